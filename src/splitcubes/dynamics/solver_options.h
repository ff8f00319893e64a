// Options of a time step, common to all solvers.
#pragma once

#include <cstdint>

namespace splitcubes::meshless {

enum class SolverKind : std::uint8_t {
    implicit_steps,  // ImplicitSolver
    explicit_steps,  // ExplicitSolver
};

/// Time integration of implicit steps.
enum class TimeScheme : std::uint8_t {
    bdf2,            // second order, damps what the step resolves poorly
    backward_euler,  // first order, damps strongly
    tr_bdf2,         // second order, two stages: damps little; bodies in contact take BDF2
};

/// Stage of a TR-BDF2 step: its first share is taken by the trapezoidal rule, the rest by BDF2 over both.
enum class TimeStage : std::uint8_t { none, trapezoidal, second };

struct SolverOptions {
    SolverKind kind = SolverKind::implicit_steps;
    // For ImplicitSolver; restore_momentum applies to both.
    double tolerance = 1e-3;   // residual relative to the forces of the step
    int max_iterations = 200;  // conjugate gradient iterations per solve
    TimeScheme scheme = TimeScheme::bdf2;
    TimeStage stage = TimeStage::none;  // set by TimeIntegrator
    bool warm_start = true;             // starts from the last step's acceleration
    bool restore_momentum = true;       // for pieces that are neither held nor in contact
    bool guard_energy = true;           // false disables EnergyGuard, to measure the bare solver
    int further_solves = 0;             // implicit: additional Newton iterations, each relinearised
    int refinement = 1;                 // explicit: factor on the number of substeps for stability
};

}  // namespace splitcubes::meshless
