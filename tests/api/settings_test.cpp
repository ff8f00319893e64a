// Changes of settings between steps, kept states, and the elastic samples.
#include "api/scenes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace splitcubes::api_tests {
namespace {

// A block that hangs from its top.
struct Hanging {
    Simulation simulation;
    BodyId block;

    explicit Hanging(const BodySettings& body = soft_block()) : simulation(earth()) {
        block = simulation.add_body(BoxMesh(0.1, 0.1, 0.2).view(), body);
        simulation.add_constraint(block, {.region = BoxRegion{{-1, -1, 0.08}, {1, 1, 1}}});
    }
    static SimulationSettings earth() {
        SimulationSettings out;
        out.thread_count = 2;
        return out;
    }
    void run(int steps) {
        for (int k = 0; k < steps; ++k) simulation.step();
    }
    double lowest() const {
        const SurfaceView surface = simulation.surface(block);
        double out = 1;
        for (std::size_t v = 0; v < surface.vertex_slots(); ++v)
            if (surface.pieces[v] >= 0) out = std::min<double>(out, surface.positions[3 * v + 2]);
        return out;
    }
};

BodySettings damped_block() {
    BodySettings out = soft_block();
    out.material.mass_damping = 20;
    return out;
}

TEST(Settings, SameSettingsChangeNoBit) {
    Hanging a, b;
    a.run(5);
    b.run(5);
    b.simulation.set_material(b.block, b.simulation.material(b.block));
    b.simulation.set_tearing(b.block, b.simulation.tearing(b.block));
    b.simulation.set_step_settings(b.simulation.step_settings());
    EXPECT_EQ(a.simulation.state_hash(), b.simulation.state_hash());
    a.run(5);
    b.run(5);
    EXPECT_EQ(a.simulation.state_hash(), b.simulation.state_hash());
}

TEST(Settings, StifferMaterialSagsLess) {
    Hanging h(damped_block());
    h.run(60);
    const double soft = h.lowest();
    MaterialSettings material = h.simulation.material(h.block);
    material.youngs_modulus *= 10;
    h.simulation.set_material(h.block, material);
    EXPECT_EQ(h.simulation.material(h.block).youngs_modulus, material.youngs_modulus);
    EXPECT_NEAR(h.lowest(), soft, 1e-6) << "the shape stays";
    h.run(120);
    const double sag = -0.1 - h.lowest();
    EXPECT_GT(h.lowest(), soft + 0.002);
    EXPECT_GT(sag, 0);
}

TEST(Settings, TwiceTheDensityIsTwiceTheWeight) {
    Hanging light(damped_block()), heavy(damped_block());
    MaterialSettings material = heavy.simulation.material(heavy.block);
    material.density *= 2;
    heavy.simulation.set_material(heavy.block, material);
    light.run(120);
    heavy.run(120);
    EXPECT_NEAR((-0.1 - heavy.lowest()) / (-0.1 - light.lowest()), 2, 0.25);
}

TEST(Settings, TimeGoesOnWithAnotherTimeStep) {
    Hanging h;
    h.run(7);
    const double before = h.simulation.time();
    StepSettings settings = h.simulation.step_settings();
    settings.time_step /= 4;
    settings.gravity = {0, 0, 0};
    h.simulation.set_step_settings(settings);
    EXPECT_NEAR(h.simulation.time(), before, 1e-12);
    h.run(4);
    EXPECT_NEAR(h.simulation.time(), before + 1.0 / 60, 1e-12);
    EXPECT_EQ(h.simulation.step_settings().gravity.z, 0);
}

TEST(Settings, MaterialTearsOnceItHasAStrength) {
    BodySettings body = soft_block();
    body.phyxel_count = 300;
    Hanging h(body);
    EXPECT_FALSE(h.simulation.tearing(h.block));
    h.run(30);
    EXPECT_EQ(h.simulation.piece_count(h.block), 1U);
    h.simulation.set_tearing(h.block, TearingSettings{.strength = 300});
    EXPECT_EQ(h.simulation.tearing(h.block)->strength, 300);
    h.run(60);
    EXPECT_GT(h.simulation.piece_count(h.block), 1U);
}

TEST(Settings, WrongOnesAreRefusedAndChangeNothing) {
    Hanging h;
    h.run(2);
    const std::uint64_t before = h.simulation.state_hash();
    MaterialSettings material = h.simulation.material(h.block);
    material.poisson_ratio = 0.5;
    EXPECT_EQ(kind_of_error([&] { h.simulation.set_material(h.block, material); }),
              static_cast<int>(ErrorKind::invalid_argument));
    StepSettings settings = h.simulation.step_settings();
    settings.time_step = 0;
    EXPECT_EQ(kind_of_error([&] { h.simulation.set_step_settings(settings); }),
              static_cast<int>(ErrorKind::invalid_argument));
    settings = h.simulation.step_settings();
    settings.ground_friction = 0.5;  // there is no ground
    EXPECT_EQ(kind_of_error([&] { h.simulation.set_step_settings(settings); }),
              static_cast<int>(ErrorKind::invalid_argument));
    settings = h.simulation.step_settings();
    settings.restitution = -0.1;
    EXPECT_EQ(kind_of_error([&] { h.simulation.set_step_settings(settings); }),
              static_cast<int>(ErrorKind::invalid_argument));
    EXPECT_EQ(kind_of_error([&] { h.simulation.set_tearing(h.block, TearingSettings{.strength = -1}); }),
              static_cast<int>(ErrorKind::invalid_argument));
    EXPECT_EQ(h.simulation.state_hash(), before);
}

TEST(Settings, ChangesAreUndoneWithTheState) {
    Hanging h;
    h.simulation.mark_undo_point();
    MaterialSettings material = h.simulation.material(h.block);
    const double before = material.youngs_modulus;
    material.youngs_modulus = 5e4;
    h.simulation.set_material(h.block, material);
    h.simulation.undo();
    EXPECT_EQ(h.simulation.material(h.block).youngs_modulus, before);
    h.simulation.redo();
    EXPECT_EQ(h.simulation.material(h.block).youngs_modulus, 5e4);
}

TEST(KeptState, RestoringRepeatsTheSameSteps) {
    Hanging h;
    const ToolId knife = h.simulation.add_tool({edge_along_y}, {.pose = {{0.003, 0, 0.2}, {}}});
    h.run(3);
    const KeptState kept = h.simulation.keep();
    EXPECT_TRUE(kept);
    EXPECT_GT(kept.bytes(), 1000U);
    const std::size_t undo_points = h.simulation.undo_count();
    std::uint64_t hashes[2];
    for (std::uint64_t& hash : hashes) {
        h.simulation.restore(kept);
        h.simulation.lower_tool(knife);
        cut_through(h.simulation, knife, 0.003, 6);
        hash = h.simulation.state_hash();
    }
    EXPECT_EQ(hashes[0], hashes[1]);
    EXPECT_EQ(h.simulation.undo_count(), undo_points + 2);
    h.simulation.forget_history();
    EXPECT_EQ(h.simulation.undo_count(), 0U);
    EXPECT_FALSE(h.simulation.undo());
    EXPECT_EQ(kind_of_error([&] { h.simulation.restore({}); }),
              static_cast<int>(ErrorKind::invalid_argument));
}

TEST(Samples, StressOfAHangingBlockGrowsUpwards) {
    Hanging h(damped_block());
    h.run(120);
    const SampleState samples = h.simulation.samples(h.block);
    ASSERT_GT(samples.size(), 50U);
    EXPECT_GT(samples.spacing, 0.005);
    double low = 0, high = 0;
    int low_count = 0, high_count = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        EXPECT_EQ(samples.pieces[i], 0);
        if (samples.rest_positions[i].z < -0.05) low += samples.principal_stress[i], ++low_count;
        if (samples.rest_positions[i].z > 0.02 && samples.rest_positions[i].z < 0.07)
            high += samples.principal_stress[i], ++high_count;
    }
    // Weight of what hangs below, over the section: 1000 kg/m^3 * 9.81 m/s^2 * 0.145 m.
    EXPECT_NEAR(high / high_count, 1420, 500);
    EXPECT_LT(low / low_count, 0.5 * high / high_count);
}

// A bar bends under its weight: the pressure is a third of the stress along it, whatever Poisson's ratio.
TEST(Samples, PressureOfABentBarFollowsTheLoadUpToTheIncompressibleLimit) {
    for (const double ratio : {0.3, 0.49, 0.499}) {
        SimulationSettings settings;
        settings.gravity = {0, 0, -0.5};
        settings.thread_count = 2;
        Simulation simulation(settings);
        BodySettings bar = soft_block();
        bar.cell_size = 0.05 / 12;
        bar.phyxel_spacing = 0.05 / 6;
        bar.material = {.youngs_modulus = 1e6, .poisson_ratio = ratio, .mass_damping = 20};
        const BodyId body = simulation.add_body(BoxMesh(0.25, 0.05, 0.05).view(), bar);
        simulation.add_constraint(body, {.region = BoxRegion{{-1, -1, -1}, {-0.1, 1, 1}}});
        for (int step = 0; step < 100; ++step) simulation.step();
        const SampleState samples = simulation.samples(body);
        double off = 0, all = 0;
        for (std::size_t i = 0; i < samples.size(); ++i) {
            const Vector3 rest = samples.rest_positions[i];
            if (rest.x < -0.07 || rest.x > 0.1) continue;
            const double arm = 0.125 - rest.x, side = 0.05;
            const double moment = 0.5 * 1000 * 0.5 * side * side * arm * arm;
            const double expected = -moment * rest.z / (std::pow(side, 4) / 12) / 3;
            off += (samples.pressure[i] - expected) * (samples.pressure[i] - expected);
            all += expected * expected;
        }
        // A sample's own pressure is off by half of it at 0.499.
        EXPECT_LT(std::sqrt(off / all), 0.2) << ratio;
    }
}

TEST(Samples, SpacingIsThatOfTheSettings) {
    BodySettings body = soft_block();
    body.phyxel_spacing = 0.025;
    const Hanging h(body);
    EXPECT_NEAR(h.simulation.samples(h.block).spacing, 0.025, 1e-9);
    EXPECT_NEAR(h.simulation.cell_size(h.block), 0.02, 1e-12);
}

TEST(Settings, PlasticMaterialKeepsAShareOfItsStrain) {
    BodySettings body = damped_block();
    body.material.plasticity = PlasticitySettings{.yield = 0.005};
    Hanging plastic(body), elastic(damped_block());
    for (Hanging* h : {&plastic, &elastic}) {
        h->run(60);
        StepSettings settings = h->simulation.step_settings();
        settings.gravity = {};
        h->simulation.set_step_settings(settings);
        h->run(120);
    }
    EXPECT_LT(plastic.lowest(), elastic.lowest() - 0.001);
}

}  // namespace
}  // namespace splitcubes::api_tests
