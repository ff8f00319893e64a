// Input and report of a time step, common to all solvers.
#pragma once

#include <splitcubes/contact/response/contact.h>
#include <splitcubes/contact/response/obstacle.h>
#include <splitcubes/core/parallel.h>
#include <splitcubes/dynamics/solver_options.h>
#include <splitcubes/elasticity/elasticity.h>
#include <splitcubes/samples/material.h>
#include <splitcubes/samples/neighbourhoods.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/samples/rigid_pieces.h>

#include <cstdint>
#include <span>

namespace splitcubes::meshless {

struct StepInput {
    double dt = 1.0 / 60;                 // s, > 0
    Vec3 gravity = Vec3::Zero();          // m/s^2, world
    std::span<const std::uint8_t> held;   // per phyxel, 1 = position is prescribed; or empty
    std::span<const Vec3> held_position;  // per phyxel, m, world, at the end of the step; or empty
    ContactInput contacts;                // of part 0 only; its sides refer to this body
    int piece_count = 1;
    std::span<const Obstacle> obstacles;                           // colliders for rigid pieces
    std::span<const RigidKinematicTarget> kinematic_rigid_pieces;  // at most one per rigid piece
};

/// Work done on a body from outside in a step, J.
struct ExternalWork {
    double holds = 0;    // on what moves with them, and by that on the rest
    double handles = 0;  // by their springs
};

struct SolverReport {
    int iterations = 0;              // conjugate gradient iterations over all solves of the step
    int solves = 0;                  // 1, 2 with TR-BDF2, more if contacts changed; 0 if explicit
    int substeps = 1;                // substeps of an explicit step
    bool took_implicit = false;      // an explicit step that needed too many substeps
    double residual = 0;             // relative to the forces of the step, after the last solve
    std::size_t inverted = 0;        // phyxels with det F <= 0 after the step
    std::size_t rank_deficient = 0;  // phyxels whose neighbourhood has rank below 3
    std::size_t non_finite = 0;      // phyxels that became non-finite and moved on without elastic force
    std::size_t contacts = 0;        // active contacts
    std::size_t energy_excess_pieces = 0;  // pieces with an energy excess (EnergyGuard)
    int retries = 0;                       // repetitions of the step with finer substeps
    double energy_removed = 0;             // J, removed by EnergyGuard
    double kinetic_energy = 0;             // J
    double elastic_energy = 0;             // J
    double contact_energy = 0;             // J, stored in contact springs
    ExternalWork work;                     // in the step
    Vec3 momentum = Vec3::Zero();          // kg m/s
    Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s, about the origin
    double top_speed = 0;                  // m/s
};

}  // namespace splitcubes::meshless
