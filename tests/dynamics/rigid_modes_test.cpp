#include <splitcubes/dynamics/implicit/rigid_modes.h>

#include "linear_system.h"

#include <gtest/gtest.h>

#include <cmath>

namespace splitcubes::meshless {
namespace {

using fixtures::block;
using fixtures::dot;
using fixtures::LinearSystem;
using fixtures::Preconditioner;
using fixtures::random_vector;
using fixtures::Specimen;

// A cut block, rotated as a whole, one end held.
LinearSystem rotated_system(std::uint64_t seed, double youngs_modulus, int cuts, const Parallel& parallel) {
    Material material;
    material.youngs_modulus = youngs_modulus;
    Specimen body = block(12, 10, 9, 0.05, material, parallel);
    fixtures::cut_randomly(body, cuts, 0.2, seed, parallel);
    Random random(seed);
    const Mat3 turn = fixtures::random_rotation(random);
    body.move([&](const Vec3& x) -> Vec3 { return turn * x + Vec3(1, 2, 3); },
              [](const Vec3& x) -> Vec3 { return 0 * x; });
    LinearSystem system(std::move(body), 1.0 / 60);
    system.hold([](const Vec3& x) { return x.x() < -0.27; });
    system.update(parallel);
    return system;
}

std::vector<Vec3> random_rigid_motions(const LinearSystem& system, Random& random) {
    std::vector<Vec3> shift(system.aggregates.count()), rotation(shift.size()), out(system.size());
    for (std::size_t c = 0; c < shift.size(); ++c) {
        shift[c] = random_vector(random, 1);
        rotation[c] = random_vector(random, 10);
    }
    for (std::size_t i = 0; i < out.size(); ++i) {
        out[i].setZero();
        if (system.held[i] != 0) continue;
        const auto c = static_cast<std::size_t>(system.aggregates.index()[i]);
        out[i] = shift[c] + rotation[c].cross(system.body.phyxels.position[i]);
    }
    return out;
}

// The coarse correction is the projection, in the energy of the system, onto rigid motions of aggregates: of
// the residual of such a motion it finds the motion.
TEST(RigidModes, FindTheRigidMotionsOfAggregates) {
    const Parallel parallel(2);
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        LinearSystem system = rotated_system(seed, seed % 2 == 0 ? 1e5 : 1e7, 5, parallel);
        ASSERT_TRUE(system.modes->is_built());
        Random random(seed);
        const std::vector<Vec3> motion = random_rigid_motions(system, random);
        std::vector<Vec3> force(system.size());
        system.elastic.apply_stiffness(1, system.inertia, motion, force, parallel);
        for (std::size_t i = 0; i < force.size(); ++i)
            if (system.held[i] != 0) force[i].setZero();
        double product = 0;
        const std::vector<Vec3> found = system.correct_by_modes(force, parallel, product);
        double error = 0, size = 0;
        for (std::size_t i = 0; i < force.size(); ++i) {
            error = std::max(error, (found[i] - motion[i]).norm());
            size = std::max(size, motion[i].norm());
        }
        EXPECT_LT(error, 2e-3 * size) << seed;
        EXPECT_NEAR(product, dot(force, motion), 1e-3 * product) << seed;
    }
}

TEST(RigidModes, CorrectionIsSymmetricPositiveAndEqualForAllThreadCounts) {
    const Parallel one(1), three(3);
    LinearSystem system = rotated_system(7, 1e6, 6, one);
    Random random(5);
    for (int k = 0; k < 4; ++k) {
        const std::vector<Vec3> a = system.random_residual(random), b = system.random_residual(random);
        double of_a = 0, of_b = 0, again = 0;
        const std::vector<Vec3> Ma = system.correct_by_modes(a, one, of_a);
        const std::vector<Vec3> Mb = system.correct_by_modes(b, one, of_b);
        EXPECT_GT(of_a, 0);
        EXPECT_NEAR(dot(b, Ma), dot(a, Mb), 1e-5 * (of_a + of_b));
        EXPECT_EQ(system.correct_by_modes(a, three, again), Ma);
        EXPECT_EQ(again, of_a);
        for (std::size_t i = 0; i < Ma.size(); ++i) EXPECT_TRUE(system.held[i] == 0 || Ma[i].isZero(0));
    }
}

// Neither cuts nor stiffness make a solve expensive.
TEST(RigidModes, KeepTheIterationsOfCutStiffBodiesNearThoseOfWholeOnes) {
    const Parallel parallel(2);
    for (const double youngs_modulus : {1e5, 1e6, 1e7, 1e8})
        for (const int cuts : {3, 12}) {
            int whole = 0;
            for (const int k : {0, cuts}) {
                LinearSystem system = rotated_system(11, youngs_modulus, k, parallel);
                Random random(3);
                std::vector<Vec3> rhs = system.random_residual(random);
                for (std::size_t i = 0; i < rhs.size(); ++i)
                    rhs[i] = system.held[i] != 0 ? Vec3(Vec3::Zero()) : Vec3(0.1 * rhs[i] - Vec3(0, 0, 1));
                const int count = system.iterations(rhs, Preconditioner::rigid_modes, parallel);
                if (k == 0) {
                    whole = count;
                    continue;
                }
                EXPECT_LE(count, 6 * whole) << youngs_modulus << " Pa, " << cuts << " cuts";
                if (youngs_modulus > 1e5)
                    EXPECT_LT(2 * count, system.iterations(rhs, Preconditioner::aggregates, parallel));
            }
        }
}

}  // namespace
}  // namespace splitcubes::meshless
