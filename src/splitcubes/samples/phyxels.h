// Phyxels: the samples of the material and their state, as a structure of arrays.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/math/types.h>
#include <splitcubes/samples/rigid_pieces.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Initial state of a new phyxel.
struct PhyxelStart {
    Vec3 rest_position = Vec3::Zero();    // m, rest space
    Vec3 position = Vec3::Zero();         // m, world
    Vec3 velocity = Vec3::Zero();         // m/s, world
    Mat3 deformation = Mat3::Identity();  // d world / d rest
    Mat3 plastic_strain = Mat3::Zero();   // rest space
    std::int32_t piece = 0;
    double support_radius = 0;                             // m
    double contact_radius = 0;                             // m
    std::uint32_t ignored_holds = 0, ignored_handles = 0;  // see Phyxels
};

/// All phyxels of a body. Every array has one entry per phyxel; phyxels are only
/// ever appended, so an index stays valid for the body's life.
struct Phyxels {
    std::vector<Vec3> rest_position;            // m, rest space, never changes
    std::vector<Vec3> position;                 // m, world, written by ImplicitSolver
    std::vector<Vec3> velocity;                 // m/s, world, written by ImplicitSolver, relump_after_split
    std::vector<Vec3> previous_position;        // m, world, one step ago (BDF2 history)
    std::vector<Vec3> previous_velocity;        // m/s, world, one step ago (BDF2 history)
    std::vector<double> mass;                   // kg, written by apply(MassLumping), relump_after_split
    std::vector<double> volume;                 // m^3 at rest, written by the same
    std::vector<double> support_radius;         // m, rest space, h of the kernel
    std::vector<double> contact_radius;         // m, contact distance
    std::vector<Mat3> deformation;              // d world / d rest, completed where rank < 3
    std::vector<Mat3> rotation;                 // rotation part of `deformation`, det = +1
    std::vector<Mat3> plastic_strain;           // rest space, symmetric (Plasticity)
    std::vector<std::int32_t> piece;            // id of its piece, 0..piece_count-1
    std::vector<std::uint8_t> restart_history;  // 1: BDF2 restarts with backward Euler
    std::vector<std::uint8_t> touching;         // 1: on the ground, written by ImplicitSolver
    std::vector<std::uint8_t> held;             // 1: its position is prescribed, for Neighbourhoods
    std::vector<double> elastic_energy;         // J, at the end of the last step, with the links of that step
    std::vector<double> reserve;                // J, its share of its piece's energy budget (EnergyGuard)
    /// Number of the first holds and handles of the body that do not act on the phyxel, whatever their
    /// region: those that had let go of its material when it was sampled.
    std::vector<std::uint32_t> ignored_holds, ignored_handles;
    /// s, the step between previous_position and position; 0 before the first step.
    /// A change of step size restarts BDF2.
    double history_step = 0;
    int substeps = 0;    // of the last explicit step; 0 before the first
    int slow_steps = 0;  // implicit steps that still begin with rigid modes, since one was slow without
    /// Pieces that are too small to deform. The state of their phyxels, except mass, volume and plastic
    /// strain, follows from it (write_phyxels).
    RigidPieces rigid;

    std::size_t size() const { return rest_position.size(); }
    /// For checkpoints.
    template <class Archive>
    void serialize(Archive& archive) {
        archive(rest_position, position, velocity, previous_position, previous_velocity, mass, volume);
        archive(support_radius, contact_radius, deformation, rotation, plastic_strain, piece);
        archive(restart_history, touching, held, elastic_energy, reserve, history_step, substeps, slow_steps,
                rigid);
        archive(ignored_holds, ignored_handles);
    }
    /// Appends one phyxel with zero mass and volume; its restart_history is 1.
    void append(const PhyxelStart& start);
    /// Appends one phyxel at rest.
    void append(const Vec3& rest, double contact_radius_metres, std::int32_t piece_number = 0);
};

/// Mass, momenta and inertia of a set of phyxels.
struct Momenta {
    double mass = 0;                       // kg
    Vec3 centre = Vec3::Zero();            // m, world, centre of mass
    Vec3 linear = Vec3::Zero();            // kg m/s
    Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s, about `centre`
    Mat3 inertia = Mat3::Zero();           // kg m^2, about `centre`
    /// Returns the angular momentum about the world's origin, kg m^2/s.
    Vec3 angular() const { return angular_momentum + centre.cross(linear); }
};

/// Computes the momenta of each piece, summed in the order of phyxels; rigid pieces give those of the rigid
/// body. Phyxels with a piece outside 0..piece_count-1 are left out. `out` is resized.
void momenta_of_pieces(const Phyxels& phyxels, int piece_count, std::vector<Momenta>& out);
/// The same up to rounding, on several threads; `partial` is a buffer.
void momenta_of_pieces(const Phyxels& phyxels, int piece_count, std::vector<Momenta>& out,
                       std::vector<Momenta>& partial, const Parallel& parallel);

/// Returns the momenta of several bodies together.
Momenta together(std::span<const Momenta> parts);

/// Returns the momenta of all phyxels and rigid pieces together.
Momenta total_momenta(const Phyxels& phyxels);

/// Returns the angular velocity (rad/s) that gives a body of this inertia this angular momentum. Principal
/// axes without inertia (a point, a line) or with less than `min_inertia` (kg m^2) get none.
Vec3 angular_velocity(const Mat3& inertia, const Vec3& angular_momentum, double min_inertia = 0);

}  // namespace splitcubes::meshless
