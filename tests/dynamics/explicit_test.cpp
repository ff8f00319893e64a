// Explicit steps: conservation, and stability at any stiffness.
#include "bodies.h"

#include <gtest/gtest.h>
#include <splitcubes/core/state_hash.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace splitcubes::meshless {
namespace {

using fixtures::block;
using fixtures::Ground;
using fixtures::random_vector;
using fixtures::Specimen;

Material soft_material(MaterialModel model, double youngs_modulus = 2.5e5) {
    Material material;
    material.model = model;
    material.youngs_modulus = youngs_modulus;
    material.poisson_ratio = 0.33;
    return material;
}

constexpr MaterialModel both_models[] = {MaterialModel::corotated, MaterialModel::st_venant_kirchhoff};

Specimen explicit_block(int nx, int ny, int nz, const Material& material, const Parallel& parallel) {
    Specimen body = block(nx, ny, nz, 0.05, material, parallel);
    body.options.kind = SolverKind::explicit_steps;
    return body;
}

Vec3 held_position_at(const Vec3& rest) {
    return rest;
}

double total_energy_of(const SolverReport& report) {
    return report.kinetic_energy + report.elastic_energy;
}

TEST(Explicit, BodyAtRestStaysAtRest) {
    const Parallel parallel(1);
    for (const MaterialModel model : both_models) {
        Specimen body = explicit_block(6, 5, 4, soft_material(model), parallel);
        fixtures::cut_randomly(body, 6, 0.1, 1, parallel);
        for (int k = 0; k < 5; ++k) EXPECT_EQ(total_energy_of(body.step(parallel)), 0);
        EXPECT_EQ(body.phyxels.position, body.phyxels.rest_position);
    }
}

// Ten thousand substeps of the chosen length, a few hundred periods of a smooth vibration. The quantity that
// leapfrog conserves differs from the energy by the order of (w h)^2, so the energy oscillates with the
// vibration, but its mean stays.
TEST(Explicit, EnergyOfAFreeVibrationDoesNotDrift) {
    const Parallel parallel(1);
    for (const MaterialModel model : both_models) {
        Specimen body = explicit_block(8, 3, 3, soft_material(model), parallel);
        body.move(held_position_at, [](const Vec3& x) -> Vec3 {
            return {std::sin(std::numbers::pi * x.x() / 0.4), 0, 0};
        });
        body.options.restore_momentum = false;
        std::vector<double> energy;
        for (int substeps = 0; substeps < 10000;) {
            const SolverReport report = body.step(parallel);
            substeps += report.substeps;
            energy.push_back(total_energy_of(report));
        }
        const auto mean = [&](std::size_t from) {
            double sum = 0;
            for (std::size_t k = from; k < from + energy.size() / 4; ++k) sum += energy[k];
            return sum / static_cast<double>(energy.size() / 4);
        };
        const auto [min, max] = std::minmax_element(energy.begin(), energy.end());
        EXPECT_LT(*max - *min, 0.02 * *max);
        EXPECT_NEAR(mean(energy.size() - energy.size() / 4) / mean(0), 1, 0.002);
    }
}

// Within the single precision of the forces: they exchange some thousand times the momentum in two seconds
// and leave a rounding error.
TEST(Explicit, MomentaAreKeptWithoutRestoring) {
    const Parallel parallel(1);
    Random random(2);
    for (const MaterialModel model : both_models) {
        Specimen body = explicit_block(7, 5, 4, soft_material(model), parallel);
        fixtures::cut_randomly(body, 10, 0.12, 5, parallel);
        body.options.restore_momentum = false;
        body.move(held_position_at,
                  [](const Vec3& x) -> Vec3 { return Vec3(0.2, -0.1, 0.3) + Vec3(1, 2, 4.5).cross(x); });
        const Momenta before = total_momenta(body.phyxels);
        SolverReport report;
        for (int k = 0; k < 120; ++k) report = body.step(parallel);
        EXPECT_LT((report.momentum - before.linear).norm(), 1e-5 * before.linear.norm());
        EXPECT_LT((total_momenta(body.phyxels).angular_momentum - before.angular_momentum).norm(),
                  1e-5 * before.angular_momentum.norm());
    }
}

TEST(Explicit, FallsAndIsDampedAtTheRightRate) {
    const Parallel parallel(1);
    Specimen body = explicit_block(4, 4, 4, soft_material(MaterialModel::corotated), parallel);
    body.material.mass_damping = 2;
    body.input.gravity = Vec3(0, 0, -9.81);
    body.move(held_position_at, [](const Vec3& x) -> Vec3 { return Vec3(1, 0, 0) + Vec3(0, 0, 1).cross(x); });
    const Momenta before = total_momenta(body.phyxels);
    for (int k = 0; k < 60; ++k) body.step(parallel);
    const Momenta after = total_momenta(body.phyxels);
    EXPECT_NEAR(after.linear.x() / before.linear.x(), std::exp(-2.0), 1e-3);
    EXPECT_NEAR(after.angular_momentum.norm() / before.angular_momentum.norm(), std::exp(-2.0), 1e-3);
    EXPECT_NEAR(after.linear.z() / after.mass, -9.81 / 2 * (1 - std::exp(-2.0)), 0.01);
}

// Substeps follow the speed of sound: bodies that are held, stretched or shaken stay stable.
TEST(Explicit, SubstepsKeepAnyStiffnessStable) {
    const Parallel parallel(1);
    for (const MaterialModel model : both_models) {
        int last = 0;
        for (const double stiffness : {1e3, 1e5, 1e7}) {
            Specimen body = explicit_block(6, 3, 3, soft_material(model, stiffness), parallel);
            std::vector<std::uint8_t> held;
            for (const Vec3& rest : body.phyxels.rest_position) held.push_back(rest.x() < -0.1);
            const std::vector<Vec3> position = body.phyxels.position;
            body.input.held = held;
            body.input.held_position = position;
            body.input.gravity = Vec3(0, 0, -9.81);
            SolverReport report;
            double top = 0;
            for (int k = 0; k < 60; ++k) {
                report = body.step(parallel);
                ASSERT_EQ(report.non_finite, 0U);
                top = std::max(top, report.top_speed);
            }
            EXPECT_LT(top, 15);
            EXPECT_GT(report.substeps, 3 * last) << "ten times the speed of sound";
            last = report.substeps;
        }
    }
}

// At twice the length, St. Venant-Kirchhoff is several times as stiff, within one step.
TEST(Explicit, StretchedStVenantKirchhoffStaysStable) {
    const Parallel parallel(1);
    Specimen body = explicit_block(6, 3, 3, soft_material(MaterialModel::st_venant_kirchhoff), parallel);
    body.move([](const Vec3& x) -> Vec3 { return x.cwiseProduct(Vec3(2, 0.8, 0.8)); },
              [](const Vec3&) { return Vec3(0, 0, 0); });
    double start = 0, top = 0;
    for (int k = 0; k < 60; ++k) {
        const SolverReport report = body.step(parallel);
        if (k == 0) start = total_energy_of(report);
        top = std::max(top, total_energy_of(report));
    }
    EXPECT_LT(top, 1.15 * start);
}

TEST(Explicit, StiffnessDampingDampsAndStaysStable) {
    const Parallel parallel(1);
    for (const double damping : {1e-4, 1e-3, 1e-1}) {
        Specimen body = explicit_block(6, 3, 3, soft_material(MaterialModel::corotated), parallel);
        body.material.stiffness_damping = damping;
        body.move([](const Vec3& x) -> Vec3 { return x.cwiseProduct(Vec3(1.1, 1, 1)); },
                  [](const Vec3&) { return Vec3(0, 0, 0); });
        double last = std::numeric_limits<double>::infinity();
        for (int k = 0; k < 10; ++k) {
            const double energy = total_energy_of(body.step(parallel));
            EXPECT_LT(energy, last);
            last = energy;
        }
    }
}

TEST(Explicit, AgreesWithImplicitStepsWhereBothAreAccurate) {
    const Parallel parallel(1);
    for (const MaterialModel model : both_models) {
        Specimen a = explicit_block(6, 3, 3, soft_material(model, 2e4), parallel);
        Specimen b = explicit_block(6, 3, 3, soft_material(model, 2e4), parallel);
        b.options.kind = SolverKind::implicit_steps;
        b.options.tolerance = 1e-6;
        for (Specimen* body : {&a, &b}) {
            body->input.dt = 5e-4;
            body->move([](const Vec3& x) -> Vec3 { return x.cwiseProduct(Vec3(1.05, 1, 1)); },
                       [](const Vec3&) { return Vec3(0, 0, 0); });
        }
        double off = 0, moved = 0;
        for (int k = 0; k < 100; ++k) {
            a.step(parallel);
            b.step(parallel);
            for (std::size_t i = 0; i < a.phyxels.size(); ++i) {
                off = std::max(off, (a.phyxels.position[i] - b.phyxels.position[i]).norm());
                moved = std::max(moved, (a.phyxels.position[i] - 1.05 * a.phyxels.rest_position[i]).norm());
            }
        }
        EXPECT_LT(off, 0.05 * moved);
    }
}

TEST(Explicit, RestsAndSlidesOnTheGround) {
    const Parallel parallel(1);
    for (const double friction : {0.0, 0.1}) {
        Specimen body = explicit_block(5, 5, 3, soft_material(MaterialModel::corotated), parallel);
        body.input.gravity = Vec3(0, 0, -9.81);
        body.ground = Ground{Vec3::UnitZ(), -0.076, friction};
        body.material.stiffness_damping = 0.002;
        body.move(held_position_at, [](const Vec3&) { return Vec3(1, 0, 0); });
        SolverReport report;
        for (int k = 0; k < 30; ++k) report = body.step(parallel);
        EXPECT_GT(report.contacts, 10U);
        const Momenta after = total_momenta(body.phyxels);
        EXPECT_NEAR(after.linear.x() / after.mass, 1 - 9.81 * friction * 0.5, friction > 0 ? 0.1 : 1e-9);
        for (std::size_t i = 0; i < body.phyxels.size(); ++i)
            EXPECT_GT(body.phyxels.position[i].z(), -0.076 + 0.025 - 0.05 * 0.05)
                << "a twentieth of the spacing";
        for (int k = 0; k < 60; ++k) report = body.step(parallel);
        EXPECT_LT(std::abs(report.momentum.z()), 0.01 * after.mass);
        if (friction > 0) {
            EXPECT_LT(report.top_speed, 0.05) << "friction has stopped it";
        }
    }
}

TEST(Explicit, HeldPhyxelsFollowTheirPath) {
    const Parallel parallel(1);
    Specimen body = explicit_block(5, 3, 3, soft_material(MaterialModel::st_venant_kirchhoff), parallel);
    std::vector<std::uint8_t> held;
    for (const Vec3& rest : body.phyxels.rest_position) held.push_back(rest.x() < -0.07);
    std::vector<Vec3> position = body.phyxels.position;
    body.input.held = held;
    body.input.held_position = position;
    for (int k = 1; k <= 30; ++k) {
        for (std::size_t i = 0; i < position.size(); ++i)
            position[i] = body.phyxels.rest_position[i] + Vec3(0, 0.01 * k, 0);
        body.step(parallel);
        for (std::size_t i = 0; i < position.size(); ++i) {
            if (held[i] != 0) {
                ASSERT_EQ(body.phyxels.position[i], position[i]);
            }
        }
    }
    EXPECT_NEAR(total_momenta(body.phyxels).centre.y(), 0.3, 0.1) << "the rest is taken along";
}

TEST(Explicit, NonFinitePhyxelsAreCountedAndContained) {
    const Parallel parallel(1);
    Specimen body = explicit_block(5, 5, 5, soft_material(MaterialModel::st_venant_kirchhoff), parallel);
    body.phyxels.velocity[7] = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
    EXPECT_GT(body.step(parallel).non_finite, 0U);
    for (std::size_t i = 0; i < body.phyxels.size(); ++i) {
        EXPECT_TRUE(body.phyxels.position[i].allFinite());
        EXPECT_TRUE(body.phyxels.velocity[i].allFinite());
    }
}

// Cuts leave phyxels with few neighbours, or with little mass. None of them sets the substep of all, which
// would be down to a tenth of that of the whole block.
TEST(Explicit, CutsAndLightPhyxelsHardlyShortenTheSubsteps) {
    const Parallel parallel(1);
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        Random random(seed);
        const MaterialModel model = both_models[seed % 2];
        Specimen body = explicit_block(6, 5, 4, soft_material(model, 1e7), parallel);
        const int whole = body.step(parallel).substeps;
        fixtures::cut_randomly(body, 8, 0.1, seed, parallel);
        for (std::size_t i = 0; i < body.phyxels.size(); ++i)
            if (random.below(20) == 0) {
                const double share = std::pow(10.0, random.uniform(-3, 0));
                body.phyxels.mass[i] *= share;
                body.phyxels.volume[i] *= share;
            }
        body.neighbourhoods.rebuild(body.phyxels, body.pairs, body.material, parallel);
        for (Vec3& v : body.phyxels.velocity) v = random_vector(random, 0.1);
        const Momenta before = total_momenta(body.phyxels);
        int most = 0;
        for (int k = 0; k < 5; ++k) most = std::max(most, body.step(parallel).substeps);
        EXPECT_LE(most, 4 * whole) << seed;
        const Momenta after = total_momenta(body.phyxels);
        EXPECT_LT((after.linear - before.linear).norm(), 1e-6 * before.mass * 0.1);
        EXPECT_LT((after.angular_momentum - before.angular_momentum).norm(), 1e-6 * before.mass * 0.1 * 0.1);
    }
}

// A body that needs more than 1000 substeps moves as with implicit steps, and goes back to explicit ones.
TEST(Explicit, ABodyThatNeedsTooManySubstepsIsSteppedImplicitly) {
    const Parallel parallel(1);
    for (const double youngs_modulus : {1e5, 2e10}) {
        const Material material = soft_material(MaterialModel::corotated, youngs_modulus);
        Specimen body = explicit_block(3, 3, 3, material, parallel),
                 other = block(3, 3, 3, 0.05, material, parallel);
        for (Specimen* one : {&body, &other}) {
            one->input.gravity = Vec3(0, 0, -9.81);
            one->ground = Ground{Vec3::UnitZ(), -0.1, 0.3};
        }
        for (int k = 0; k < 30; ++k) {
            const SolverReport report = body.step(parallel);
            other.step(parallel);
            EXPECT_EQ(report.took_implicit, youngs_modulus > 1e6);
            EXPECT_LE(report.substeps, 1000);
        }
        if (youngs_modulus > 1e6) {
            EXPECT_EQ(body.phyxels.position, other.phyxels.position);
        }
    }
}

// Whatever an earlier step has saved, a step that cannot be taken changes nothing before the implicit one.
TEST(Explicit, AStepThatIsNotTakenLeavesTheStateAlone) {
    const Parallel parallel(1);
    Specimen body =
        explicit_block(3, 3, 3, soft_material(MaterialModel::st_venant_kirchhoff, 2e10), parallel);
    body.input.dt = 1e-5;
    ASSERT_FALSE(body.step(parallel).took_implicit);
    const Mat3 strain = Vec3(1e-3, -1e-3, 2e-3).asDiagonal();
    for (Mat3& plastic : body.phyxels.plastic_strain) plastic = strain;
    body.input.dt = 1.0 / 60;
    ASSERT_TRUE(body.step(parallel).took_implicit);
    for (const Mat3& plastic : body.phyxels.plastic_strain) EXPECT_EQ(plastic, strain);
}

TEST(Explicit, EmptyAndSinglePhyxels) {
    const Parallel parallel(1);
    Specimen none;
    none.options.kind = SolverKind::explicit_steps;
    none.neighbourhoods.rebuild(none.phyxels, none.pairs, none.material, parallel);
    EXPECT_EQ(none.step(parallel).substeps, 1);
    Specimen one = explicit_block(1, 1, 1, soft_material(MaterialModel::corotated), parallel);
    one.input.gravity = Vec3(0, 0, -10);
    for (int k = 0; k < 60; ++k) one.step(parallel);
    EXPECT_NEAR(one.phyxels.velocity[0].z(), -10, 1e-9);
}

TEST(Explicit, SameBitsForAnyThreadCountAndAnyHistory) {
    std::vector<std::uint64_t> hashes;
    for (const int threads : {1, 2, 3}) {
        const Parallel parallel(threads);
        Material material = soft_material(MaterialModel::st_venant_kirchhoff);
        material.stiffness_damping = 1e-4;
        material.plasticity = Plasticity{};
        Specimen body = explicit_block(6, 6, 5, material, parallel);
        fixtures::cut_randomly(body, 4, 0.1, 3, parallel);
        body.input.gravity = Vec3(0, 0.5, -9.81);
        body.ground = Ground{Vec3::UnitZ(), -0.2, 0.3};
        for (int k = 0; k < 20; ++k) {
            // All state is in the phyxels: a new solver continues like the old one.
            if (threads == 2 && k == 10) body.solver = TimeIntegrator{};
            body.step(parallel);
        }
        StateHash hash;
        for (std::size_t i = 0; i < body.phyxels.size(); ++i) {
            hash.add(std::span<const double>(body.phyxels.position[i].data(), 3));
            hash.add(std::span<const double>(body.phyxels.velocity[i].data(), 3));
            hash.add(std::span<const double>(body.phyxels.plastic_strain[i].data(), 9));
        }
        hashes.push_back(hash.value());
    }
    EXPECT_EQ(hashes[0], hashes[1]);
    EXPECT_EQ(hashes[0], hashes[2]);
}

}  // namespace
}  // namespace splitcubes::meshless
