// Pieces that are too small to deform: they move as rigid bodies, and their phyxels
// only show where they are.
#pragma once

#include <splitcubes/math/types.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

struct Momenta;
struct Phyxels;

/// One rigid body. Its own frame has its origin in the centre of mass; a rest point X is
/// at centre + rotation * shape * (X - rest_centre).
struct RigidPiece {
    std::int32_t piece = -1;               // number of the piece
    double mass = 0;                       // kg, > 0
    Vec3 rest_centre = Vec3::Zero();       // m, rest space
    Mat3 shape = Mat3::Identity();         // own frame from rest, symmetric: the stretch that it has kept
    Mat3 inertia = Mat3::Identity();       // kg m^2, about the centre, own frame, positive definite
    Vec3 centre = Vec3::Zero();            // m, world, of mass
    Mat3 rotation = Mat3::Identity();      // world from own frame, det = +1
    Vec3 momentum = Vec3::Zero();          // kg m/s, world
    Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s, world, angular momentum about the centre
    std::uint8_t touching = 0;             // 1: on the ground at the end of the last step
    std::uint32_t first_point = 0;         // its contact points: a run of RigidPieces::points
    std::uint32_t point_count = 0;

    Vec3 velocity() const { return momentum / mass; }
    /// rad/s, world.
    Vec3 angular_velocity() const { return inverse_inertia() * angular_momentum; }
    /// 1/(kg m^2), world.
    Mat3 inverse_inertia() const;
    /// World from its own frame, m.
    Vec3 world_point(const Vec3& own) const { return centre + rotation * own; }
    /// World from rest, m.
    Vec3 world_point_of_rest(const Vec3& rest) const { return world_point(shape * (rest - rest_centre)); }
    /// m/s, of its material at a place (m, world).
    Vec3 velocity_at(const Vec3& point) const {
        return velocity() + angular_velocity().cross(point - centre);
    }
    /// Changes the momenta by an impulse (N s, world) at a place (m, world).
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

/// The rigid pieces of a body, by the numbers of their pieces. All their state.
struct RigidPieces {
    std::vector<RigidPiece> bodies;
    std::vector<Vec3> points;            // m, own frames: where they touch other things
    std::vector<std::int32_t> of_piece;  // per piece: index into `bodies`, -1 of elastic ones

    bool empty() const { return bodies.empty(); }
    /// Index of the body that a piece is, or -1.
    std::int32_t index(std::int32_t piece) const {
        return piece >= 0 && static_cast<std::size_t>(piece) < of_piece.size()
                   ? of_piece[static_cast<std::size_t>(piece)]
                   : -1;
    }
    std::span<const Vec3> points_of(const RigidPiece& body) const {
        return {points.data() + body.first_point, body.point_count};
    }
    /// Takes a body in, in place of the one that its piece was before.
    void put(RigidPiece body, std::span<const Vec3> own_points);
    /// For checkpoints.
    template <class Archive>
    void serialize(Archive& archive) {
        archive(bodies, points, of_piece);
    }
};

/// A body of cubes: what nodes of the grid own of it.
struct RigidCubes {
    std::span<const Vec3> rest_position;  // m, rest space
    std::span<const double> mass;         // kg
    double edge = 0;                      // m, > 0
};

/// Sets mass, rest_centre and inertia of a body of its `shape`. Each cube has the second
/// moments of a full one of its mass, so a body of one cube can hold spin.
void weigh(const RigidCubes& cubes, RigidPiece& body);

/// The world's motion of a rigid body without torque over dt seconds: `spin` stays, the
/// rotation goes on by the implicit midpoint rule for Euler's equations in its own frame
/// with Cayley's map. That keeps spin and kinetic energy, both quadratic in the body's
/// own angular momentum, to rounding at any dt (Austin, Krishnaprasad and Wang 1993;
/// Simo and Wong 1991); substeps of a fifth of a radian make it accurate. What would take more than
/// most_substeps of them turns about the axis of its spin at the rate that it has about it: both are kept,
/// and what it costs is bounded; its nutation, far faster than a step, is left out.
void turn_freely(RigidPiece& body, double dt, int most_substeps = 4096);

/// What total_momenta says of phyxels, of a rigid piece.
Momenta momenta_of(const RigidPiece& body);

/// Position, velocity, deformation and rotation of all phyxels of rigid pieces.
void write_phyxels(Phyxels& phyxels);

}  // namespace splitcubes::meshless
