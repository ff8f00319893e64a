// Mass, momentum and energy of a block that three hundred blades cut.
#include "torture.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace splitcubes::laws {
namespace {

using meshless::SolverKind;

// Relative energy gain allowed, elastic energy included. At rest: transient gains of single steps. Spinning:
// moments of inertia that a few phyxels cannot reproduce when mass is lumped again.
constexpr double tolerance_at_rest = 0.02, spinning_tolerance = 0.04;

void expect_sound(const Torture& torture, const std::string& name) {
    const TortureResult seen = run(torture);
    const double g = torture.load == Load::spinning ? 0 : 9.81;
    EXPECT_EQ(seen.violated, "") << name;
    EXPECT_GT(seen.pieces, static_cast<std::size_t>(torture.blades) / 2) << name;
    EXPECT_GT(seen.rigid, seen.pieces / 2) << name << ": most are rigid fragments";
    const double tolerance = torture.load == Load::spinning ? spinning_tolerance : tolerance_at_rest;
    EXPECT_LT(seen.max_motion_gain, tolerance * seen.energy_put_in) << name;
    EXPECT_LT(seen.max_gain, tolerance * seen.energy_put_in) << name;
    EXPECT_LT(seen.worst_flight, 1e-12) << name << ": off its parabola, m";
    EXPECT_LT(seen.worst_speed, 1e-12) << name << ": off its parabola, m/s";
    if (torture.load == Load::spinning) {
        EXPECT_LT(seen.worst_momentum, 1e-12 * seen.mass) << name;
        EXPECT_LT(seen.worst_angular_momentum, 1e-12 * seen.initial_angular_momentum) << name;
    }
    // Speed bound: free fall, the support's upward throw, or the speed of the corners.
    const double max_throw_speed = torture.load == Load::shaken     ? 1.5
                                   : torture.load == Load::spinning ? 0.9
                                                                    : 1.5;
    EXPECT_LT(seen.top_piece_speed,
              max_throw_speed + (torture.load == Load::shaken ? g * torture.seconds : 1))
        << name;
}

TEST(Torture, ShakenSlowly) {
    for (const double modulus : {1e5, 1e8})
        expect_sound({.time_step = 1.0 / 30, .youngs_modulus = modulus}, "shaken, 1/30 s");
}

TEST(Torture, Shaken) {
    for (const double modulus : {1e3, 1e5, 1e8})
        expect_sound({.youngs_modulus = modulus, .seed = 2}, "shaken, 1/60 s");
}

TEST(Torture, ShakenQuickly) {
    expect_sound({.time_step = 1.0 / 240, .youngs_modulus = 1e8, .seed = 3, .seconds = 0.5},
                 "shaken, 1/240 s");
}

TEST(Torture, ShakenByExplicitSteps) {
    for (const double modulus : {1e3, 1e5})
        expect_sound({.youngs_modulus = modulus, .solver = SolverKind::explicit_steps, .seed = 4},
                     "shaken, explicit");
}

TEST(Torture, Spinning) {
    expect_sound({.load = Load::spinning, .seed = 5}, "spinning");
    expect_sound(
        {.load = Load::spinning, .youngs_modulus = 1e3, .solver = SolverKind::explicit_steps, .seed = 6},
        "spinning, explicit");
}

TEST(Torture, Standing) {
    expect_sound({.load = Load::standing, .seed = 7}, "standing");
    expect_sound({.load = Load::standing, .solver = SolverKind::explicit_steps, .seed = 8},
                 "standing, explicit");
}

// The paper's material; without the volume term it collapses under compression.
TEST(Torture, StVenantKirchhoff) {
    for (const double volume : {0.0, 1.0})
        for (const SolverKind solver : {SolverKind::implicit_steps, SolverKind::explicit_steps})
            for (const Load load : {Load::shaken, Load::spinning})
                expect_sound({.load = load,
                              .solver = solver,
                              .model = meshless::MaterialModel::st_venant_kirchhoff,
                              .volume_stiffness = volume,
                              .seed = 10,
                              .blades = 60,
                              .seconds = 0.5},
                             "St. Venant-Kirchhoff, volume " + std::to_string(volume) + ", solver " +
                                 std::to_string(static_cast<int>(solver)) + ", torment " +
                                 std::to_string(static_cast<int>(load)));
}

TEST(Torture, ShortRun) {
    for (const Load load : {Load::shaken, Load::spinning, Load::standing})
        expect_sound({.load = load, .seed = 9, .blades = 12, .seconds = 0.3}, "shortly");
}

}  // namespace
}  // namespace splitcubes::laws
