#include <splitcubes/dynamics/implicit/block_jacobi.h>

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

// A block of random stiffness, cut, turned and strained, some phyxels held.
LinearSystem random_system(std::uint64_t seed, const std::array<int, 3>& counts, int cuts,
                           const Parallel& parallel) {
    Random random(seed);
    Material material;
    material.model = seed % 2 == 0 ? MaterialModel::corotated : MaterialModel::st_venant_kirchhoff;
    material.youngs_modulus = std::pow(10, random.uniform(4, 8));
    material.poisson_ratio = random.uniform(0, 0.45);
    Specimen body = block(counts[0], counts[1], counts[2], 0.05, material, parallel);
    fixtures::cut_randomly(body, cuts, 0.2, seed, parallel);
    const Mat3 turn = fixtures::random_rotation(random);
    Mat3 stretch = Mat3::Identity();
    for (int k = 0; k < 9; ++k) stretch(k / 3, k % 3) += random.uniform(-0.02, 0.02);
    body.move([&](const Vec3& x) -> Vec3 { return turn * stretch * x + Vec3(1, 2, 3); },
              [](const Vec3& x) -> Vec3 { return 0 * x; });
    LinearSystem system(std::move(body), 1.0 / 60);
    if (seed % 3 == 0) system.hold([](const Vec3& x) { return x.x() < -0.03; });
    return system;
}

// Springs between random phyxels, and of a handle to some.
ContactProducts random_springs(const LinearSystem& system, Random& random) {
    const auto n = static_cast<std::uint32_t>(system.size());
    const std::array<std::size_t, 1> counts = {n};
    ContactProducts springs;
    springs.clear(counts);
    for (int s = 0; s < 6; ++s) {
        Contact contact;
        contact.normal = random_vector(random, 1).normalized();
        for (ContactSide* const side : {&contact.upper, &contact.lower}) {
            side->count = 2;
            side->phyxel[0] = static_cast<std::uint32_t>(random.below(n / 2));
            side->phyxel[1] = n / 2 + static_cast<std::uint32_t>(random.below(n / 2));
            side->weight[0] = random.uniform(0, 1);
            side->weight[1] = 1 - side->weight[0];
        }
        const double along = std::pow(10, random.uniform(2, 6));
        springs.add(contact, along, random.uniform(0, 1) * along);
        HandleSpring handle;
        handle.phyxel = static_cast<std::uint32_t>(random.below(n));
        springs.add(handle, std::pow(10, random.uniform(1, 4)));
    }
    springs.finish();
    return springs;
}

// Returns A u of the system with springs, zero where phyxels are held.
std::vector<Vec3> force_of(LinearSystem& system, ContactProducts* springs, const std::vector<Vec3>& u,
                           const Parallel& parallel) {
    std::vector<Vec3> out(system.size());
    system.elastic.apply_stiffness(1, system.inertia, u, out, parallel);
    if (springs != nullptr) {
        const std::size_t n = system.elastic.stride();
        FloatArray in(3 * n, 0), sum(3 * n, 0);
        for (std::size_t i = 0; i < u.size(); ++i)
            for (std::size_t k = 0; k < 3; ++k) in[k * n + i] = static_cast<float>(u[i][static_cast<int>(k)]);
        const std::array<ContactProducts::RowPart, 1> rows = {
            ContactProducts::RowPart{n, in.data(), sum.data()}};
        springs->apply(rows, parallel);
        for (std::size_t i = 0; i < u.size(); ++i)
            for (std::size_t k = 0; k < 3; ++k)
                out[i][static_cast<int>(k)] += static_cast<double>(sum[k * n + i]);
    }
    for (std::size_t i = 0; i < u.size(); ++i)
        if (system.held[i] != 0) out[i].setZero();
    return out;
}

// A body of one block is solved exactly: of the force of any displacement the block finds it. The error is
// measured in the energy of the system.
TEST(BlockJacobi, SolvesSmallBodiesExactly) {
    const Parallel parallel(1);
    int solved = 0;
    for (std::uint64_t seed = 1; seed <= 24; ++seed) {
        SCOPED_TRACE(seed);
        LinearSystem system = random_system(seed, {3, 3, 3}, static_cast<int>(seed % 3), parallel);
        ASSERT_LE(system.size(), BlockJacobi::max_size);
        Random random(seed);
        ContactProducts springs = random_springs(system, random);
        ContactProducts* const used = seed % 4 == 0 ? nullptr : &springs;
        system.update(parallel, used);
        if (system.aggregates.count() > 1) continue;
        ++solved;
        std::vector<Vec3> u = system.random_residual(random);
        for (Vec3& displacement : u) displacement *= 1e-3;
        const std::vector<Vec3> force = force_of(system, used, u, parallel);
        double product = 0;
        std::vector<Vec3> error = system.correct_by_blocks(force, parallel, product);
        for (std::size_t i = 0; i < u.size(); ++i) error[i] -= u[i];
        const double energy = dot(u, force);
        EXPECT_LT(dot(error, force_of(system, used, error, parallel)), 1e-4 * energy);
        EXPECT_NEAR(product, energy, 1e-2 * energy);
    }
    EXPECT_GT(solved, 12);
}

TEST(BlockJacobi, IsSymmetricPositiveAndEqualForAllThreadCounts) {
    const Parallel one(1), three(3);
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        LinearSystem system = random_system(seed, {12, 10, 9}, 6, one);
        Random random(seed);
        const ContactProducts springs = random_springs(system, random);
        system.update(one, &springs);
        const std::vector<Vec3> a = system.random_residual(random), b = system.random_residual(random);
        double of_a = 0, of_b = 0, again = 0;
        const std::vector<Vec3> Ma = system.correct_by_blocks(a, one, of_a);
        const std::vector<Vec3> Mb = system.correct_by_blocks(b, one, of_b);
        EXPECT_GT(of_a, 0);
        EXPECT_NEAR(dot(a, Ma), of_a, 1e-4 * of_a);
        EXPECT_NEAR(dot(b, Ma), dot(a, Mb), 1e-3 * (of_a + of_b));
        system.update(three, &springs);
        EXPECT_EQ(system.correct_by_blocks(a, three, again), Ma);
        EXPECT_EQ(again, of_a);
        for (std::size_t i = 0; i < Ma.size(); ++i) EXPECT_TRUE(system.held[i] == 0 || Ma[i].isZero(0));
    }
}

// Rebuilding after springs changed equals building anew, where they changed by more than the factors ignore.
TEST(BlockJacobi, FollowsSprings) {
    const Parallel parallel(1);
    LinearSystem system = random_system(2, {9, 8, 7}, 4, parallel);
    Random random(9);
    const ContactProducts first = random_springs(system, random), second = random_springs(system, random);
    const std::vector<Vec3> r = system.random_residual(random);
    system.update(parallel, &second);
    double product = 0;
    const std::vector<Vec3> anew = system.correct_by_blocks(r, parallel, product);
    system.update(parallel, &first);
    EXPECT_NE(system.correct_by_blocks(r, parallel, product), anew);
    const std::array<RigidModes::Part, 1> parts = {
        RigidModes::Part{system.body.neighbourhoods, system.aggregates, system.elastic,
                         system.body.phyxels.rest_position, system.body.phyxels.position, system.inertia, 1}};
    system.blocks->clear_springs();
    EXPECT_FALSE(system.blocks->is_built());
    system.blocks->build(parts, &second, parallel);
    EXPECT_EQ(system.correct_by_blocks(r, parallel, product), anew);
}

// Neither cuts nor stiffness make a solve expensive.
TEST(BlockJacobi, KeepsTheIterationsOfCutStiffBodiesNearThoseOfWholeOnes) {
    const Parallel parallel(2);
    for (const std::uint64_t seed : {3, 6, 9, 12}) {
        SCOPED_TRACE(seed);
        int whole = 0;
        for (const int cuts : {0, 12}) {
            LinearSystem system = random_system(seed, {12, 10, 9}, cuts, parallel);
            system.update(parallel);
            Random random(3);
            const std::vector<Vec3> rhs = system.random_residual(random);
            const int count = system.iterations(rhs, Preconditioner::blocks, parallel);
            if (cuts == 0)
                whole = count;
            else
                EXPECT_LE(count, 3 * whole);
            EXPECT_LE(count, system.iterations(rhs, Preconditioner::rigid_modes, parallel));
        }
    }
}

}  // namespace
}  // namespace splitcubes::meshless
