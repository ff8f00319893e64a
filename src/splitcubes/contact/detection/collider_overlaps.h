// Overlaps of drawn surfaces with colliders at the end of a step.
#pragma once

#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/collider.h>
#include <splitcubes/contact/detection/collider_contact.h>
#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/box.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace splitcubes::body {

/// Lifts pieces out of colliders where contact forces fail: they end before they have converged, and a piece
/// can lose its strain as it comes off. Such a piece is translated until its deepest vertex is at the depth
/// that is allowed, and stopped there by inelastic impulses with Coulomb friction on its rigid motion. Pieces
/// that are held in part stay.
///
/// Contact forces act on means of phyxels. In strained material single vertices move farther, by a part of
/// the spacing, or by several spacings where a cut draws them from one inverted phyxel. Lifting the whole
/// piece for them would add energy, so elastic pieces are lifted for their phyxels only, and their vertices
/// are drawn at the depth that is allowed.
///
/// A rigid piece is lifted only for vertices that moved in the step. A cut makes vertices, so some begin the
/// step inside a collider. They may stay as deep as they began, until contact forces have pushed them out.
///
/// Kinetic energy never increases, except by moving colliders. There is no state between steps.
class ColliderOverlaps {
  public:
    struct Task {
        std::span<const BodyView> bodies;  // surfaces as at the end of the step
        std::span<const Collider> colliders;
        double time = 0;  // s, at the start of the step
        double dt = 0;    // s
    };
    /// Changes of the sums over all bodies.
    struct Outcome {
        double kinetic_energy = 0;             // J
        Vec3 momentum = Vec3::Zero();          // kg m/s
        Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s, about the origin
        std::size_t pieces = 0;                // lifted
    };
    /// Notes how deep vertices are at the start of the step. The surfaces are as they are then, with the
    /// frames that they will have at its end.
    void begin(const Task& task, const Parallel& parallel);
    /// Lifts the pieces of all bodies: moves phyxels and rigid pieces, not the surfaces.
    Outcome undo(const Task& task, const Parallel& parallel);
    /// A vertex that is drawn elsewhere than its motion takes it.
    struct Drawn {
        std::uint32_t vertex;
        Vec3 position;  // m, world
    };
    /// Returns the vertices of a body that are drawn where a collider allows it, for surfaces that have moved
    /// along with what undo lifted. Valid until the next call.
    std::span<const Drawn> drawn(const Task& task, std::size_t body, const Parallel& parallel);
    /// Returns whether the last call of undo moved pieces of a body.
    bool moved(std::size_t body) const { return moved_[body] != 0; }
    /// Returns whether it found vertices of a body that may have to be drawn elsewhere.
    bool found_deep(std::size_t body) const { return found_deep_[body] != 0; }

  private:
    /// Vertex, or phyxel of an elastic piece, near a collider.
    struct Near {
        std::int32_t piece;
        std::uint32_t vertex;   // or phyxel
        Vec3 point;             // m, world
        double depth, allowed;  // m, in the collider
        bool is_deep() const { return depth > allowed; }
    };
    /// Depth of a vertex, m, > 0.
    struct Depth {
        std::uint32_t vertex;
        double depth;
    };
    enum class Time { start, end };  // of the step
    /// Lever arm and velocities of a vertex that a collider stops.
    struct Stop {
        Vec3 arm;               // m, from the centre of mass
        Vec3 normal;            // unit, out of the collider
        Vec3 surface_velocity;  // m/s, of the collider
        Mat3 mobility;          // 1/kg, change of velocity per impulse
        double friction = 0;
        double impulse = 0;              // N s, along the normal
        Vec3 tangential = Vec3::Zero();  // N s
    };
    struct PieceMotion {
        double mass = 0;                       // kg
        Mat3 inverse_inertia = Mat3::Zero();   // 1/(kg m^2), world
        Vec3 centre = Vec3::Zero();            // m
        Vec3 velocity = Vec3::Zero();          // m/s
        Vec3 angular_velocity = Vec3::Zero();  // rad/s
    };
    void list_near(const Task& task, std::size_t body, Time time, const Parallel& parallel);
    void allow_depths(const BodyView& body, std::span<const Depth> kept);
    void take_poses(const Task& task);
    void keep_deep_pieces(const BodyView& body);
    void take_phyxels(const Task& task, const BodyView& body);
    double depth_of(const Task& task, const Vec3& point) const;
    Vec3 lift_of(const Task& task, std::span<const Near> near, double least, double most) const;
    void list_stops(const Task& task, std::span<const Near> near, const Vec3& lift,
                    const PieceMotion& motion);
    void stop(PieceMotion& motion);
    static PieceMotion translate(meshless::Phyxels& phyxels, std::int32_t piece, const Vec3& shift);
    void lift(const Task& task, const BodyView& body, std::span<const Near> near, Outcome& outcome);

    std::vector<std::uint8_t> moved_;         // per body
    std::vector<std::uint8_t> found_deep_;    // per body
    std::vector<std::vector<Depth>> depths_;  // per body: at the start of the step, by vertex
    std::vector<Drawn> drawn_;                // of a body
    std::vector<std::vector<Near>> found_;    // per range of vertices
    std::vector<Near> near_;                  // of a body, by piece
    std::vector<std::uint8_t> deep_;          // per piece of a body
    std::vector<ColliderPoses> poses_;        // per collider
    std::vector<Stop> stops_;
};

}  // namespace splitcubes::body
