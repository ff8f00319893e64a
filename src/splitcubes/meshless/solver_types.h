// What a time step is given and what it reports, whoever takes it.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/signed_distance.h>
#include <splitcubes/meshless/contact.h>
#include <splitcubes/meshless/elasticity.h>
#include <splitcubes/meshless/material.h>
#include <splitcubes/meshless/neighbourhoods.h>
#include <splitcubes/meshless/phyxels.h>

#include <cstdint>
#include <span>

namespace splitcubes::meshless {

/// A rigid piece that is held: what it makes of its place in a step.
struct RigidHold {
    std::size_t body = 0;                    // index into RigidPieces::bodies
    Isometry motion = Isometry::Identity();  // world at the end of the step from world at its start
};

/// A collider as rigid pieces see it in a step.
struct Obstacle {
    const geometry::SignedDistance* solid = nullptr;  // in its own frame
    Isometry before = Isometry::Identity();           // world from own, at the start of the step
    Isometry after = Isometry::Identity();            // the same at its end
    double friction = 0;                              // Coulomb coefficient, >= 0
};

struct StepInput {
    double dt = 1.0 / 60;                 // s, > 0
    Vec3 gravity = Vec3::Zero();          // m/s^2, world
    std::span<const std::uint8_t> held;   // per phyxel, 1 = position is prescribed; or empty
    std::span<const Vec3> held_position;  // per phyxel, m, world, at the end of the step; or empty
    ContactInput contacts;                // of part 0 only
    int piece_count = 1;
    std::span<const Obstacle> obstacles;     // that rigid pieces meet
    std::span<const RigidHold> rigid_holds;  // at most one a rigid piece
};

enum class SolverKind : std::uint8_t {
    implicit_steps,  // ImplicitSolver
    explicit_steps,  // ExplicitSolver
};

struct SolverOptions {
    SolverKind kind = SolverKind::implicit_steps;
    // Of ImplicitSolver; restore_momentum of both.
    double tolerance = 1e-3;       // of the residual, relative to the forces of the step
    int max_iterations = 200;      // of conjugate gradients, per solve
    bool bdf2 = true;              // false: backward Euler throughout
    bool warm_start = true;        // from the last step's acceleration
    bool restore_momentum = true;  // of pieces that nothing holds or touches
    bool guard_energy = true;      // EnergyGuard; false: for measuring what the solver alone does
    int further_solves = 0;        // of the implicit one: from where the first ended, linearised there
    int refinement = 1;            // of the explicit one: times the substeps that stability asks for
};

struct SolverReport {
    int iterations = 0;                    // of conjugate gradients, all solves of the step
    int solves = 0;                        // 1, more where contacts changed; 0 of explicit steps
    int substeps = 1;                      // of an explicit step
    double residual = 0;                   // relative to the forces of the step, after the last solve
    std::size_t inverted = 0;              // phyxels with det F <= 0 after the step
    std::size_t rank_deficient = 0;        // phyxels with fewer than 3 directions
    std::size_t non_finite = 0;            // phyxels that went on without elastic force
    std::size_t contacts = 0;              // points that something pushes
    std::size_t has_energy_excess = 0;     // pieces that had more energy than was put in (EnergyGuard)
    int retries = 0;                       // times the step was taken again, in finer parts
    double energy_taken = 0;               // J, by EnergyGuard
    double kinetic_energy = 0;             // J
    double elastic_energy = 0;             // J
    double contact_energy = 0;             // J, in the springs of contacts (implicit steps)
    Vec3 momentum = Vec3::Zero();          // kg m/s
    Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s, about the origin
    double top_speed = 0;                  // m/s
};

}  // namespace splitcubes::meshless
