// A block that is cut by hundreds of random blades under different loads, and the invariants that must hold.
#pragma once

#include <splitcubes/dynamics/solver_options.h>
#include <splitcubes/samples/material.h>

#include <cstddef>
#include <cstdint>
#include <string>

namespace splitcubes::laws {

enum class Load {
    shaken,    // held at its upper end by a support that oscillates; gravity
    spinning,  // free, no gravity: fragments stay within reach of the blades
    standing,  // on the ground; gravity
};

struct Torture {
    Load load = Load::shaken;
    double time_step = 1.0 / 60;
    double youngs_modulus = 1e5;  // Pa
    meshless::SolverKind solver = meshless::SolverKind::implicit_steps;
    meshless::MaterialModel model = meshless::MaterialModel::corotated;
    double volume_stiffness = 0;  // relative to Young's modulus
    std::uint64_t seed = 1;
    int blades = 300;
    double seconds = 1;
    double cell_size = 0.02;
    int phyxels = 120;
};

/// Results of a run; the worst values over all steps.
struct TortureResult {
    std::string violated;    // first violated invariant; empty: none
    std::size_t pieces = 0;  // at the end
    std::size_t rigid = 0;   // of them
    std::size_t new_phyxels = 0;
    std::size_t cut_edges = 0;
    double energy_put_in = 0;             // J, first energy, all work and what height could release
    double max_gain = -1e300;             // J, maximum of energy minus energy put in
    double max_motion_gain = -1e300;      // J, the same without the elastic energy
    double top_speed = 0;                 // m/s
    double top_piece_speed = 0;           // m/s, of a centre of mass
    double worst_flight = 0;              // m, deviation of a free centre of mass from its parabola in a step
    double worst_speed = 0;               // m/s, the same for its velocity
    double worst_momentum = 0;            // kg m/s, spinning: change of the total in a step
    double worst_angular_momentum = 0;    // kg m^2/s, spinning: change of the total in a step
    double initial_angular_momentum = 0;  // kg m^2/s
    double mass = 0;                      // kg
    double lowest = 0;                    // m, lowest centre of a rigid piece (negative: below the ground)
    double seconds = 0;                   // wall clock
};

/// Cuts the block as `torture` says and watches the invariants in each step.
TortureResult run(const Torture& torture);

}  // namespace splitcubes::laws
