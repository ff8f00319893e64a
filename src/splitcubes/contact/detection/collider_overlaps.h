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

/// Lifts pieces out of colliders. Contact forces act on means of phyxels, end before they have converged, and
/// a piece can lose its strain as it comes off, so vertices may end up deeper in a collider than these forces
/// allow. Such a piece is translated until its deepest vertex is at that depth, and stopped there by
/// inelastic impulses with Coulomb friction on its rigid motion. Pieces that are held in part stay.
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
    /// Lifts the pieces of all bodies: moves phyxels and rigid pieces, not the surfaces.
    Outcome undo(const Task& task, const Parallel& parallel);
    /// Returns whether the last call of undo moved pieces of a body.
    bool moved(std::size_t body) const { return moved_[body] != 0; }

  private:
    /// Vertex near a collider.
    struct Near {
        std::int32_t piece;
        Vec3 point;  // m, world
        bool deep;
    };
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
    void list_near(const Task& task, const BodyView& body, const Parallel& parallel);
    Vec3 lift_of(const Task& task, std::span<const Near> near, double spacing) const;
    void list_stops(const Task& task, std::span<const Near> near, const Vec3& lift,
                    const PieceMotion& motion);
    void stop(PieceMotion& motion);
    static PieceMotion translate(meshless::Phyxels& phyxels, std::int32_t piece, const Vec3& shift);
    void lift(const Task& task, const BodyView& body, std::span<const Near> near, Outcome& outcome);

    std::vector<std::uint8_t> moved_;       // per body
    std::vector<std::vector<Near>> found_;  // per range of vertices
    std::vector<Near> near_;                // of a body, by piece
    std::vector<std::uint8_t> deep_;        // per piece of a body
    std::vector<ColliderPoses> poses_;      // per collider
    std::vector<Stop> stops_;
};

}  // namespace splitcubes::body
