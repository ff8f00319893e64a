// Blades: edges that cut, and how they move.
#pragma once

#include <splitcubes/math/sampled_motion.h>

#include <optional>
#include <string>
#include <vector>

namespace splitcubes::cutting {

/// Where a tool's frame is at a time: world = position + rotation * own.
struct Keyframe {
    double time = 0;                   // s
    Vec3 position = Vec3::Zero();      // m, world
    Quat rotation = Quat::Identity();  // of any length above zero
};

/// The edges of a tool that cut; all polylines move as one rigid thing.
struct BladeShape {
    std::vector<std::vector<Vec3>> polylines;  // blade edges in the tool's own frame, m
};

/// The direction at angle zero of circles about `axis` (of any length above
/// zero): the part of the x axis perpendicular to it; of the y axis where `axis`
/// lies within 25 degrees of x. Unit. InputError for an axis without direction.
Vec3 angle_zero_about(const Vec3& axis);

/// One straight edge.
BladeShape make_straight_blade(const Vec3& from, const Vec3& to);

/// An arc of a circle, right-handed about `axis` from one angle (rad, see
/// angle_zero_about) to the other, as `segments` straight pieces with ends on the arc.
BladeShape make_arc_blade(const Vec3& center, double radius, const Vec3& axis, double start_angle,
                          double end_angle, int segments = 16);

/// Keyframes along a circle at a constant rate from time t0 to t1. Angles in rad,
/// see angle_zero_about; negative turns run left-handed about the axis. With
/// turn_with_path the frame turns about `axis` along with the angle passed,
/// starting from no rotation; otherwise it keeps its directions. Between the
/// keyframes the path is as the blade interpolates it.
std::vector<Keyframe> circular_path(const Vec3& center, const Vec3& axis, double radius, double start_angle,
                                    double turns, double t0, double t1, bool turn_with_path = true,
                                    int keyframes_per_turn = 64);

enum class PathInterpolation {
    linear,  // straight lines between the positions
    smooth,  // Catmull-Rom through the positions: cubic Hermite, velocities by central differences in time
};

struct BladeOptions {
    PathInterpolation interpolation = PathInterpolation::linear;
    std::optional<double> active_from = std::nullopt;   // s; none: the first keyframe's time
    std::optional<double> active_until = std::nullopt;  // s; none: the last keyframe's time
};

/// A tool with its path: keyframes, or samples of a motion that is known at some
/// times only (a hand's, a recorded one). Between keyframes rotations take the short way round at
/// a constant rate; before the first and after the last the tool stands still.
class Blade {
  public:
    /// Throws InputError for no polyline, a polyline of fewer than two points or of
    /// no length, no keyframe, times that do not increase, an active interval that
    /// ends before it begins, and anything that is not finite.
    Blade(std::string name, BladeShape shape, std::vector<Keyframe> keyframes,
          const BladeOptions& options = {});
    /// Along samples, of which there must be at least one; options.interpolation is
    /// not read. Without options.active_until the blade is active for ever, so
    /// that move_to can go on. Throws InputError as the other.
    Blade(std::string name, BladeShape shape, SampledMotion path, const BladeOptions& options = {});

    /// Appends a sample to the path of a blade that was made with one: where the tool is
    /// at a time (s) after the last. Throws InputError for anything else.
    void move_to(double time, const Isometry& world_from_own);

    const std::string& name() const { return name_; }
    const BladeShape& shape() const { return shape_; }
    /// Rotations of unit length; of a sampled path: its samples.
    const std::vector<Keyframe>& keyframes() const { return keyframes_; }
    PathInterpolation interpolation() const { return interpolation_; }
    double active_from() const { return active_from_; }    // s
    double active_until() const { return active_until_; }  // s
    /// Whether the blade cuts at a time; both ends of the interval belong to it.
    bool active(double time) const { return time >= active_from_ && time <= active_until_; }

    /// world from own.
    Isometry frame(double time) const;
    /// The polylines at a time; m, world.
    std::vector<std::vector<Vec3>> pose(double time) const;

  private:
    Vec3 position_at(std::size_t span, double fraction) const;
    void set_activity(const BladeOptions& options, double last);

    std::string name_;
    BladeShape shape_;
    std::vector<Keyframe> keyframes_;
    std::vector<Vec3> velocities_;  // m/s, world, one per keyframe; for smooth paths
    SampledMotion samples_;         // empty for keyframes
    PathInterpolation interpolation_;
    double active_from_;   // s
    double active_until_;  // s
};

}  // namespace splitcubes::cutting
