// Finite rotations within displacements, and bodies that rotate fast.
#include "bodies.h"

#include <splitcubes/dynamics/finite_rotations.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace splitcubes::meshless {
namespace {

using fixtures::block;
using fixtures::random_vector;
using fixtures::Specimen;

Specimen stiff_block(const Parallel& parallel) {
    Material material;
    material.youngs_modulus = 1e7;
    material.poisson_ratio = 0.3;
    return block(6, 5, 4, 0.02, material, parallel);
}

// Gives a body at rest an angular velocity, rad/s. Returns its kinetic energy, J.
double spin(Specimen& body, const Vec3& rate) {
    body.move([](const Vec3& at) -> Vec3 { return at; },
              [&](const Vec3& at) -> Vec3 { return rate.cross(at); });
    double energy = 0;
    for (std::size_t i = 0; i < body.phyxels.size(); ++i)
        energy += 0.5 * body.phyxels.mass[i] * body.phyxels.velocity[i].squaredNorm();
    return energy;
}

// Displacements along straight lines that rotate and shift a block, at random: afterwards all distances are
// those before.
TEST(FiniteRotations, KeepDistances) {
    const Parallel parallel(2);
    Random random(5);
    FiniteRotations rotations;
    for (int trial = 0; trial < 20; ++trial) {
        Specimen body = stiff_block(parallel);
        const std::vector<Vec3>& x = body.phyxels.position;
        const Vec3 rotation = random_vector(random, 1);
        const Vec3 shift = random_vector(random, 0.1);
        std::vector<Vec3> u;
        for (const Vec3& at : x) u.push_back(shift + rotation.cross(at));
        const std::vector<std::uint8_t> held(x.size(), 0);
        rotations.apply(body.phyxels, body.material, 1, held, x, u, parallel);
        EXPECT_GT(rotations.stretch_energy(), 0);
        for (std::size_t i = 1; i < x.size(); ++i)
            EXPECT_NEAR((x[i] + u[i] - x[0] - u[0]).norm(), (x[i] - x[0]).norm(), 1e-12);
    }
}

// Displacements without rotation stay, and so do those of a piece that is held.
TEST(FiniteRotations, LeaveStrainsAndHeldPieces) {
    const Parallel parallel(1);
    Specimen body = stiff_block(parallel);
    const std::vector<Vec3>& x = body.phyxels.position;
    std::vector<std::uint8_t> held(x.size(), 0);
    const Mat3 strain = Vec3(0.1, -0.2, 0.05).asDiagonal();
    FiniteRotations rotations;
    std::vector<Vec3> u;
    for (const Vec3& at : x) u.emplace_back(strain * at);
    const std::vector<Vec3> before = u;
    rotations.apply(body.phyxels, body.material, 1, held, x, u, parallel);
    for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LT((u[i] - before[i]).norm(), 1e-12);
    for (std::size_t i = 0; i < x.size(); ++i) u[i] = Vec3(0, 0, 1).cross(x[i]);
    const std::vector<Vec3> turned = u;
    held[3] = 1;
    rotations.apply(body.phyxels, body.material, 1, held, x, u, parallel);
    for (std::size_t i = 0; i < x.size(); ++i) EXPECT_EQ((u[i] - turned[i]).norm(), 0);
}

// Stiff blocks of random proportions that tumble by 0.05 to 1 radian a step keep their energy, and the energy
// guard has next to nothing to take: implicit steps do not stretch what rotates.
TEST(FiniteRotations, TumblingBodiesKeepTheirEnergy) {
    const Parallel parallel(2);
    Random random(8);
    for (int trial = 0; trial < 24; ++trial) {
        Material material;
        material.youngs_modulus = std::pow(10, random.uniform(5.5, 7.5));
        material.poisson_ratio = random.uniform(0, 0.45);
        Specimen body = block(3 + trial % 4, 4, 3, 0.03, material, parallel);
        body.input.dt = 1.0 / 60;
        const double angle = random.uniform(0.05, 1);  // rad a step
        const double first = spin(body, angle / body.input.dt * random_vector(random, 1).normalized());
        double highest = 0, removed = 0;
        for (int step = 0; step < 60; ++step) {
            const SolverReport report = body.step(parallel);
            highest = std::max(highest, report.kinetic_energy + report.elastic_energy);
            removed += report.energy_removed;
        }
        EXPECT_LT(highest, 1.01 * first) << "trial " << trial << ", " << angle << " rad a step";
        EXPECT_LT(removed, 0.005 * first) << "trial " << trial << ", " << angle << " rad a step";
    }
}

// Small stiff blocks that a handle keeps at their place by springs at some phyxels turn by up to 2.5 radians
// a step: what they store is at most what they had. The extrapolation of such a rotation along chords would
// be a strain of a hundred per cent.
TEST(FiniteRotations, FastBodiesOnHandlesGainNoEnergy) {
    const Parallel parallel(1);
    Random random(4);
    for (int trial = 0; trial < 30; ++trial) {
        Material material;
        material.model = trial % 2 == 0 ? MaterialModel::corotated : MaterialModel::st_venant_kirchhoff;
        material.youngs_modulus = std::pow(10, random.uniform(5, 8));
        material.poisson_ratio = random.uniform(0, 0.45);
        Specimen body = block(2 + trial % 3, 3, 2, 0.01, material, parallel);
        body.input.dt = 1.0 / 120;
        const double angle = random.uniform(0.3, 2.5);  // rad a step
        const double first = spin(body, angle / body.input.dt * random_vector(random, 1).normalized());
        std::vector<HandleSpring> springs;
        const std::vector<double> limits = {1e9};
        for (std::uint32_t i = 0; i < body.phyxels.size(); i += 3) {
            HandleSpring spring;
            spring.phyxel = i;
            spring.target = body.phyxels.position[i];
            spring.stiffness = body.phyxels.mass[i] * std::pow(random.uniform(0, 100), 2);
            springs.push_back(spring);
        }
        std::vector<CachedContact> cached;
        body.input.contacts.handle_springs = springs;
        body.input.contacts.handle_force_limits = limits;
        body.input.contacts.cached = &cached;
        double highest = 0;
        for (int step = 0; step < 40; ++step) {
            const SolverReport report = body.step(parallel);
            highest = std::max(highest, report.kinetic_energy + report.elastic_energy);
        }
        EXPECT_LT(highest, 1.01 * first)
            << "trial " << trial << ", " << angle << " rad a step, " << material.youngs_modulus << " Pa";
    }
}

}  // namespace
}  // namespace splitcubes::meshless
