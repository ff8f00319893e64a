// A step leaves no more energy than was put in, and the energy guard does not change steps within their
// budget.
#include "bodies.h"

#include <splitcubes/dynamics/tuning.h>

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

namespace splitcubes::meshless {
namespace {

using namespace fixtures;

Material rubber(MaterialModel model = MaterialModel::corotated) {
    Material material;
    material.model = model;
    material.youngs_modulus = 1e5;
    return material;
}

/// Returns a rotating, slightly stretched block after a few steps.
Specimen spinning_block(const Material& material) {
    Specimen body = block(5, 4, 3, 0.05, material, two_threads());
    body.move([](const Vec3& rest) { return Vec3(1.02 * rest.x(), rest.y(), rest.z()); },
              [](const Vec3& x) { return Vec3(Vec3(1, 2, -1) + Vec3(1, -2, 3).cross(x)); });
    for (int k = 0; k < 3; ++k) body.step(two_threads());
    return body;
}

double elastic_energy(Specimen& body) {
    SlicedElasticity elastic;
    elastic.take_state(body.neighbourhoods, body.material, configuration_of(body.phyxels), two_threads());
    return elastic.energy(configuration_of(body.phyxels), two_threads());
}

double kinetic_energy(const Phyxels& phyxels) {
    double sum = 0;
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        sum += 0.5 * phyxels.mass[i] * phyxels.velocity[i].squaredNorm();
    return sum;
}

/// Replaces the solver's step by a function and lets the guard correct the result.
SolverReport guard_step(Specimen& body, const std::function<void(Phyxels&)>& step, double work = 0,
                        const tuning::energy::Tolerance& tolerance = tuning::energy::implicit_tolerance) {
    EnergyGuard guard;
    guard.begin(body.phyxels, body.neighbourhoods, body.material, body.input, two_threads());
    step(body.phyxels);
    SlicedElasticity elastic;
    StateDescriber describe;
    SolverReport report;
    deform_and_flow(body.phyxels, body.neighbourhoods, body.material, body.input.dt, elastic, two_threads());
    describe(body.phyxels, body.neighbourhoods, elastic, report, two_threads());
    if (work != 0) guard.add_work(0, work);
    guard.evaluate(body.phyxels, body.neighbourhoods, body.material, body.input, tolerance, {},
                   two_threads());
    guard.enforce(body.phyxels, body.neighbourhoods, body.material, body.input, report, two_threads());
    return report;
}

void restore(Phyxels& phyxels, const Momenta& before) {
    const Momenta after = total_momenta(phyxels);
    const Vec3 rotation_rate =
        angular_velocity(after.inertia, before.angular_momentum - after.angular_momentum);
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        phyxels.velocity[i] += (before.linear - after.linear) / after.mass +
                               rotation_rate.cross(phyxels.position[i] - after.centre);
}

void shake_velocities(Phyxels& phyxels, double size) {
    Random random(3);
    const Momenta before = total_momenta(phyxels);
    for (Vec3& v : phyxels.velocity) v += random_vector(random, size);
    restore(phyxels, before);
}

void crumple(Phyxels& phyxels, double size) {
    Random random(4);
    const Momenta before = total_momenta(phyxels);
    Vec3 sum = Vec3::Zero();
    double mass = 0;
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const Vec3 displacement = random_vector(random, size);
        phyxels.position[i] += displacement;
        sum += phyxels.mass[i] * displacement;
        mass += phyxels.mass[i];
    }
    for (Vec3& x : phyxels.position) x -= sum / mass;
    restore(phyxels, before);
}

/// Scales the motion about the rigid motion of all phyxels.
void scale_inner_motion(Phyxels& phyxels, double factor) {
    const Momenta all = total_momenta(phyxels);
    const Vec3 rotation_rate = angular_velocity(all.inertia, all.angular_momentum);
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const Vec3 rigid = all.linear / all.mass + rotation_rate.cross(phyxels.position[i] - all.centre);
        phyxels.velocity[i] = rigid + factor * (phyxels.velocity[i] - rigid);
    }
}

void expect_same_momenta(const Momenta& a, const Momenta& b) {
    EXPECT_LT((a.linear - b.linear).norm(), 1e-12 * a.linear.norm());
    EXPECT_LT((a.angular_momentum - b.angular_momentum).norm(), 1e-12 * a.angular_momentum.norm());
}

TEST(EnergyGuard, ExcessMotionIsRemovedAndMomentaAreKept) {
    Specimen body = spinning_block(rubber());
    const double before = elastic_energy(body) + kinetic_energy(body.phyxels);
    const Momenta momenta = total_momenta(body.phyxels);
    const SolverReport report = guard_step(body, [](Phyxels& phyxels) { shake_velocities(phyxels, 5); });
    EXPECT_EQ(report.energy_excess_pieces, 1U);
    EXPECT_GT(report.energy_removed, before);
    const double after = elastic_energy(body) + kinetic_energy(body.phyxels);
    EXPECT_LT(after, 1.02 * before);
    EXPECT_NEAR(report.kinetic_energy + report.elastic_energy, after, 1e-9 * after);
    expect_same_momenta(momenta, total_momenta(body.phyxels));
}

TEST(EnergyGuard, ExcessStrainIsRemovedAndMomentaAreKept) {
    for (const MaterialModel model : {MaterialModel::corotated, MaterialModel::st_venant_kirchhoff}) {
        Specimen body = spinning_block(rubber(model));
        const double before = elastic_energy(body) + kinetic_energy(body.phyxels);
        const Momenta momenta = total_momenta(body.phyxels);
        const SolverReport report = guard_step(body, [](Phyxels& phyxels) { crumple(phyxels, 0.2); });
        EXPECT_EQ(report.energy_excess_pieces, 1U);
        EXPECT_LT(elastic_energy(body) + kinetic_energy(body.phyxels), 1.1 * before);
        const Momenta after = total_momenta(body.phyxels);
        expect_same_momenta(momenta, after);
        EXPECT_LT((after.centre - momenta.centre).norm(), 1e-12);
        for (const Vec3& x : body.phyxels.position) EXPECT_TRUE(x.allFinite());
    }
}

// A hold that turns strains the phyxels that stay behind.
TEST(EnergyGuard, CorrectionsNeverAddStrain) {
    Random random(11);
    std::size_t corrected = 0;
    for (int trial = 0; trial < 20; ++trial) {
        Specimen body = block(5, 4, 3, 0.05, rubber(), two_threads());
        body.step(two_threads());
        const Mat3 turn =
            Eigen::AngleAxisd(random.uniform(0.01, 0.5), random_vector(random, 1).normalized()).matrix();
        std::vector<std::uint8_t> held;
        std::vector<Vec3> target;
        for (const Vec3& x : body.phyxels.position) {
            held.push_back(x.x() < 0 ? 1 : 0);
            target.emplace_back(turn * x);
        }
        body.input.held = held;
        body.input.held_position = target;
        double solved = 0;
        const SolverReport report = guard_step(body, [&](Phyxels& phyxels) {
            for (std::size_t i = 0; i < phyxels.size(); ++i)
                phyxels.position[i] =
                    target[i] +
                    (held[i] != 0 ? Vec3(Vec3::Zero()) : random_vector(random, random.uniform(1e-4, 1e-2)));
            solved = elastic_energy(body);
        });
        corrected += report.energy_excess_pieces;
        EXPECT_LT(elastic_energy(body), (1 + 1e-9) * solved) << "trial " << trial;
    }
    EXPECT_GT(corrected, 5U);
}

// The error of a leapfrog reverses within a few steps. Implicit schemes damp: what they lost is gone.
TEST(EnergyGuard, WhatAnImplicitStepLostDoesNotComeBack) {
    const auto regain = [](const tuning::energy::Tolerance& tolerance, double& lost) {
        Specimen body = spinning_block(rubber());
        guard_step(
            body, [](Phyxels& phyxels) { shake_velocities(phyxels, 1); },
            std::numeric_limits<double>::infinity(), tolerance);
        const double before = kinetic_energy(body.phyxels);
        guard_step(
            body, [](Phyxels& phyxels) { scale_inner_motion(phyxels, 0.5); }, 0, tolerance);
        lost = before - kinetic_energy(body.phyxels);
        const double low = kinetic_energy(body.phyxels);
        guard_step(
            body, [](Phyxels& phyxels) { scale_inner_motion(phyxels, 1.8); }, 0, tolerance);
        return kinetic_energy(body.phyxels) - low;
    };
    double lost = 0;
    const double implicit = regain(tuning::energy::implicit_tolerance, lost);
    EXPECT_GT(lost, 0);
    EXPECT_LT(implicit, 0.05 * lost);
    const double with_reserve = regain(tuning::energy::explicit_tolerance, lost);
    EXPECT_GT(with_reserve, 0.5 * lost);
}

TEST(EnergyGuard, EnergyFromWorkIsKept) {
    Specimen body = spinning_block(rubber());
    const SolverReport report = guard_step(
        body, [](Phyxels& phyxels) { shake_velocities(phyxels, 5); },
        std::numeric_limits<double>::infinity());
    EXPECT_EQ(report.energy_excess_pieces, 0U);
    EXPECT_EQ(report.energy_removed, 0);
}

// A deficit that the piece cannot pay would leave it without motion for good.
TEST(EnergyGuard, APieceOwesAtMostItsElasticEnergy) {
    Specimen body = spinning_block(rubber());
    const double kinetic = kinetic_energy(body.phyxels);
    guard_step(
        body, [](Phyxels&) {}, -100);
    double owed = 0;
    for (const double share : body.phyxels.reserve) owed -= share;
    EXPECT_GE(owed, 0);
    // The tolerance is 2 % of the elastic and 0.1 % of the kinetic energy.
    EXPECT_LE(owed, 1.03 * elastic_energy(body) + 2e-3 * kinetic);
    SolverReport report;
    for (int k = 0; k < 5; ++k) report = body.step(two_threads());
    EXPECT_EQ(report.energy_excess_pieces, 0U);
}

TEST(EnergyGuard, SmallExcessesDoNotAddUp) {
    Specimen body = spinning_block(rubber());
    const double before = elastic_energy(body) + kinetic_energy(body.phyxels);
    double max_energy = 0;
    for (int step = 0; step < 200; ++step) {
        guard_step(body, [](Phyxels& phyxels) { shake_velocities(phyxels, 0.02); });
        max_energy = std::max(max_energy, elastic_energy(body) + kinetic_energy(body.phyxels));
    }
    EXPECT_LT(max_energy, 1.02 * before);
}

// Steps that the guard must not change by one bit: free vibration, a pendulum, a pulled body, a landing.
struct GuardCase {
    const char* name;
    bool held, pulled, ground, shaken = false;
};

class StepsWithinTheBudget : public testing::TestWithParam<GuardCase> {};

std::vector<Vec3> run(const GuardCase& guard_case, SolverKind kind, bool guard,
                      std::size_t& energy_excess_pieces) {
    Specimen body = block(8, 3, 3, 0.05, rubber(), two_threads());
    body.options.kind = kind;
    body.options.guard_energy = guard;
    body.input.gravity = guard_case.held || guard_case.ground ? Vec3(0, 0, -9.81) : Vec3(0, 0, 0);
    if (guard_case.ground) body.ground = fixtures::Ground{Vec3::UnitZ(), -0.2, 0.3};
    body.move([](const Vec3& x) { return Vec3(1.05 * x.x(), x.y(), x.z() + 0.1 * x.x() * x.x()); },
              [](const Vec3& x) { return Vec3(Vec3(0.5, 1, 0.2).cross(x)); });
    std::vector<std::uint8_t> held(body.phyxels.size(), 0);
    std::vector<Vec3> held_position(body.phyxels.size(), Vec3::Zero());
    for (std::size_t i = 0; i < held.size() && (guard_case.held || guard_case.pulled); ++i) {
        held[i] = body.phyxels.rest_position[i].x() < -0.15;
        held_position[i] = body.phyxels.position[i];
        if (guard_case.pulled && body.phyxels.rest_position[i].x() > 0.15) held[i] = 2;
    }
    for (int step = 0; step < 60; ++step) {
        std::vector<Vec3> now = held_position;
        for (std::size_t i = 0; i < held.size(); ++i)
            if (guard_case.shaken) now[i].z() += 0.03 * std::sin(0.3 * (step + 1));
        for (std::size_t i = 0; i < held.size(); ++i)
            if (held[i] == 2) now[i].x() += 0.05 * std::sin(0.2 * (step + 1));
        if (guard_case.held || guard_case.pulled) {
            body.input.held = held;
            body.input.held_position = now;
        }
        energy_excess_pieces += body.step(two_threads()).energy_excess_pieces;
    }
    return body.phyxels.position;
}

TEST_P(StepsWithinTheBudget, AreUnchanged) {
    for (const SolverKind kind : {SolverKind::implicit_steps, SolverKind::explicit_steps}) {
        std::size_t energy_excess_pieces = 0;
        const std::vector<Vec3> guarded = run(GetParam(), kind, true, energy_excess_pieces);
        EXPECT_EQ(energy_excess_pieces, 0U) << (kind == SolverKind::explicit_steps ? "explicit" : "implicit");
        EXPECT_EQ(guarded, run(GetParam(), kind, false, energy_excess_pieces));
    }
}

INSTANTIATE_TEST_SUITE_P(EnergyGuard, StepsWithinTheBudget,
                         testing::Values(GuardCase{"vibrating", false, false, false},
                                         GuardCase{"swinging", true, false, false},
                                         GuardCase{"pulled", true, true, false},
                                         GuardCase{"shaken", true, false, false, true},
                                         GuardCase{"landing", false, false, true}),
                         [](const auto& guard_case) { return std::string(guard_case.param.name); });

}  // namespace
}  // namespace splitcubes::meshless
