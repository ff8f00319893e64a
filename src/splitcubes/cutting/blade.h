// Blades: cutting edges and their motion.
#pragma once

#include <splitcubes/math/sampled_motion.h>

#include <optional>
#include <string>
#include <vector>

namespace splitcubes::cutting {

/// A tool's frame at a time: world = position + rotation * own.
struct Keyframe {
    double time = 0;                   // s
    Vec3 position = Vec3::Zero();      // m, world
    Quat rotation = Quat::Identity();  // of any length above zero
};

/// The cutting edges of a tool; all polylines move as one rigid body.
struct BladeShape {
    std::vector<std::vector<Vec3>> polylines;  // blade edges in the tool's own frame, m
};

/// Returns the direction at angle zero of circles about `axis` (of any length above zero): the component of
/// the x axis perpendicular to it, or of the y axis if `axis` is within 25 degrees of x. Unit. Throws
/// InputError for an axis without direction.
Vec3 angle_zero_about(const Vec3& axis);

/// Returns a blade with one straight edge.
BladeShape make_straight_blade(const Vec3& from, const Vec3& to);

/// Returns an arc of a circle, right-handed about `axis` from one angle (rad, see angle_zero_about) to the
/// other, as `segments` chords with ends on the arc.
BladeShape make_arc_blade(const Vec3& center, double radius, const Vec3& axis, double start_angle,
                          double end_angle, int segments = 16);

/// Returns keyframes along a circle at a constant rate from time t0 to t1. Angles are in rad, see
/// angle_zero_about; negative turns run left-handed about the axis. A circle of radius 0 turns in place. With
/// turn_with_path the frame rotates about `axis` by the angle passed, starting unrotated; otherwise it keeps
/// its orientation. Between the keyframes the blade interpolates.
std::vector<Keyframe> circular_path(const Vec3& center, const Vec3& axis, double radius, double start_angle,
                                    double turns, double t0, double t1, bool turn_with_path = true,
                                    int keyframes_per_turn = 64);

enum class PathInterpolation {
    linear,  // straight lines between the positions
    smooth,  // Catmull-Rom spline through the positions: cubic Hermite, velocities by central differences in
             // time
};

struct BladeOptions {
    PathInterpolation interpolation = PathInterpolation::linear;
    std::optional<double> active_from = std::nullopt;   // s; none: the first keyframe's time
    std::optional<double> active_until = std::nullopt;  // s; none: the last keyframe's time
};

/// A tool with its path: keyframes, or samples of a motion that is known at some times only (of a hand, or
/// recorded). Between keyframes rotations follow the shorter arc at a constant rate; before the first and
/// after the last the tool is at rest.
class Blade {
  public:
    /// Throws InputError for no polyline, a polyline of fewer than two points or of no length, no keyframe,
    /// times that do not increase, an active interval that ends before it begins, and anything that is not
    /// finite.
    Blade(std::string name, BladeShape shape, std::vector<Keyframe> keyframes,
          const BladeOptions& options = {});
    /// Makes a blade that follows samples, of which there must be at least one; options.interpolation is
    /// ignored. Without options.active_until the blade stays active forever, so that move_to can extend the
    /// path. Throws InputError like the other constructor.
    Blade(std::string name, BladeShape shape, SampledMotion path, const BladeOptions& options = {});

    /// Appends a sample to the path of a blade made with samples: the tool's frame at a time (s) after the
    /// last. Throws InputError for any other blade or sample.
    void move_to(double time, const Isometry& world_from_own);

    /// Drops the samples that the path from this time (s) on does not depend on; keyframes stay.
    void forget_before(double time);
    /// When it cuts (s); until: may be infinite. Throws InputError for an interval that ends before it
    /// begins.
    void set_active(double from, double until);

    const std::string& name() const { return name_; }
    const BladeShape& shape() const { return shape_; }
    /// Returns the keyframes, with unit rotations; for a sampled path its samples.
    const std::vector<Keyframe>& keyframes() const { return keyframes_; }
    /// The path of a blade that was made with samples; else empty.
    const SampledMotion& samples() const { return samples_; }
    PathInterpolation interpolation() const { return interpolation_; }
    double active_from() const { return active_from_; }    // s
    double active_until() const { return active_until_; }  // s
    /// Returns whether the blade cuts at a time, both ends of the interval included.
    bool active(double time) const { return time >= active_from_ && time <= active_until_; }

    /// Returns the frame at a time: world from own.
    Isometry frame(double time) const;
    /// Returns the polylines at a time; m, world.
    std::vector<std::vector<Vec3>> pose(double time) const;

  private:
    Vec3 position_at(std::size_t span, double fraction) const;
    void set_activity(const BladeOptions& options, double last);

    std::string name_;
    BladeShape shape_;
    std::vector<Keyframe> keyframes_;
    std::vector<Vec3> velocities_;  // m/s, world, one per keyframe; for smooth paths
    SampledMotion samples_;         // empty for a path of keyframes
    PathInterpolation interpolation_;
    double active_from_;   // s
    double active_until_;  // s
};

}  // namespace splitcubes::cutting
