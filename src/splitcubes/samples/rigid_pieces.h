// Rigid pieces: pieces too small to deform. Their phyxels only follow their motion.
#pragma once

#include <splitcubes/math/types.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

struct Momenta;
struct Phyxels;

/// One rigid body. The origin of its own frame is the centre of mass; a rest point X is at centre + rotation
/// * shape * (X - rest_centre).
struct RigidPiece {
    std::int32_t piece = -1;               // index of the piece
    double mass = 0;                       // kg, > 0
    Vec3 rest_centre = Vec3::Zero();       // m, rest space
    Mat3 shape = Mat3::Identity();         // own frame from rest, symmetric: frozen stretch
    Mat3 inertia = Mat3::Identity();       // kg m^2, about the centre, own frame, positive definite
    Vec3 centre = Vec3::Zero();            // m, world, centre of mass
    Mat3 rotation = Mat3::Identity();      // world from own frame, det = +1
    Vec3 momentum = Vec3::Zero();          // kg m/s, world
    Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s, world, about the centre
    std::uint8_t touching = 0;             // 1: in contact at the end of the last step
    std::uint32_t first_point = 0;         // start of its contact points in RigidPieces::points
    std::uint32_t point_count = 0;

    Vec3 velocity() const { return momentum / mass; }
    /// Returns the angular velocity, rad/s, world.
    Vec3 angular_velocity() const { return inverse_inertia() * angular_momentum; }
    /// Returns the inertia about the centre, kg m^2, world.
    Mat3 world_inertia() const { return rotation * inertia * rotation.transpose(); }
    /// Returns its inverse, 1/(kg m^2), world.
    Mat3 inverse_inertia() const;
    /// Returns the world position of a point of its own frame, m.
    Vec3 world_point(const Vec3& own) const { return centre + rotation * own; }
    /// Returns the world position of a rest point, m.
    Vec3 world_point_of_rest(const Vec3& rest) const { return world_point(shape * (rest - rest_centre)); }
    /// Returns the velocity of its material at a point (m, world), m/s.
    Vec3 velocity_at(const Vec3& point) const {
        return velocity() + angular_velocity().cross(point - centre);
    }
    /// Applies an impulse (N s, world) at a point (m, world).
    void push(const Vec3& point, const Vec3& impulse) {
        momentum += impulse;
        angular_momentum += (point - centre).cross(impulse);
    }
    double kinetic_energy() const;  // J
    /// For checkpoints.
    template <class Archive>
    void serialize(Archive& archive) {
        archive(piece, mass, rest_centre, shape, inertia, centre, rotation, momentum, angular_momentum,
                touching);
        archive(first_point, point_count);
    }
};

/// Complete state of the rigid pieces of a body, indexed by piece.
struct RigidPieces {
    std::vector<RigidPiece> bodies;
    std::vector<Vec3> points;            // m, own frames: contact points
    std::vector<std::int32_t> of_piece;  // per piece: index into `bodies`, -1 for elastic pieces

    bool empty() const { return bodies.empty(); }
    /// Returns the index of the body of a piece, or -1.
    std::int32_t index(std::int32_t piece) const {
        return piece >= 0 && static_cast<std::size_t>(piece) < of_piece.size()
                   ? of_piece[static_cast<std::size_t>(piece)]
                   : -1;
    }
    std::span<const Vec3> points_of(const RigidPiece& body) const {
        return {points.data() + body.first_point, body.point_count};
    }
    /// Adds a body, or replaces the body of the same piece, whose points it overwrites if they are not fewer.
    void put(RigidPiece body, std::span<const Vec3> own_points);
    /// For checkpoints.
    template <class Archive>
    void serialize(Archive& archive) {
        archive(bodies, points, of_piece);
    }
};

/// A kinematic rigid piece and its prescribed motion in a step.
struct RigidKinematicTarget {
    std::size_t body = 0;                    // index into RigidPieces::bodies
    Isometry motion = Isometry::Identity();  // world at the end of the step from world at its start
};

/// The grid cubes that make up a body, one per node.
struct RigidCubes {
    std::span<const Vec3> rest_position;  // m, rest space
    std::span<const double> mass;         // kg
    double edge = 0;                      // m, > 0
};

/// Sets mass, rest_centre and inertia of a body with the given `shape`. Each cube has the second moments of a
/// homogeneous cube of its mass, so a body of one cube has a positive definite inertia.
void weigh(const RigidCubes& cubes, RigidPiece& body);

/// Rotates a rigid body without torque for dt seconds. Angular momentum stays constant; the rotation is
/// integrated by the implicit midpoint rule for Euler's equations in the body frame with Cayley's map. This
/// conserves angular momentum and kinetic energy, both quadratic in the body-frame angular momentum, to
/// rounding at any dt (Austin, Krishnaprasad and Wang 1993; Simo and Wong 1991); substeps of a fifth of a
/// radian make it accurate. If more than max_substeps were needed, the body instead rotates about its angular
/// momentum at its current rate about that axis: both invariants still hold and the cost is bounded, but
/// nutation, far faster than a step, is omitted.
void turn_freely(RigidPiece& body, double dt, int max_substeps = 4096);

/// Returns the momenta of a rigid piece.
Momenta momenta_of(const RigidPiece& body);

/// Writes position, velocity, deformation and rotation of all phyxels of rigid pieces.
void write_phyxels(Phyxels& phyxels);

}  // namespace splitcubes::meshless
