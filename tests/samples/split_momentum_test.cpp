// Momenta stay and kinetic energy does not rise when resampling changes masses, places and velocities.
#include "dynamics/bodies.h"

#include <gtest/gtest.h>
#include <splitcubes/samples/split_momentum.h>

#include <algorithm>

namespace splitcubes::meshless {
namespace {

using fixtures::random_vector;

constexpr int piece_count = 4;
const std::vector<std::int32_t> family = {0, 0, 1, -1};  // per piece

Phyxels random_pieces(Random& random) {
    Phyxels phyxels;
    for (int i = 0; i < 120; ++i) {
        phyxels.append(random_vector(random, 0.2), 0.02, i % piece_count);
        phyxels.mass.back() = random.uniform(0.1, 1);
        phyxels.position.back() = phyxels.rest_position.back() + Vec3(2, -1, 3);
        phyxels.velocity.back() = random_vector(random, 1) + Vec3(0, 0, 2);
    }
    return phyxels;
}

// Moves, weighs and accelerates the phyxels at random; each family keeps its mass.
void disturb(Random& random, double velocity, Phyxels& phyxels) {
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        phyxels.position[i] += random_vector(random, 0.01);
        phyxels.velocity[i] += random_vector(random, velocity);
    }
    for (std::size_t i = 0; i + piece_count < phyxels.size(); i += piece_count)
        for (std::size_t k = i; k < i + piece_count; ++k) {
            const double moved = random.uniform(0, 0.5) * phyxels.mass[k];
            phyxels.mass[k] -= moved;
            phyxels.mass[k + piece_count] += moved;
        }
}

std::vector<Momenta> momenta_of_families(const Phyxels& phyxels) {
    std::vector<Momenta> pieces;
    momenta_of_pieces(phyxels, piece_count, pieces);
    return {together(std::span{pieces}.subspan(0, 2)), pieces[2], pieces[3]};
}

std::vector<double> energy_of_families(const Phyxels& phyxels) {
    std::vector<double> out(3, 0);
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const std::int32_t of = family[static_cast<std::size_t>(phyxels.piece[i])];
        out[of < 0 ? 2 : static_cast<std::size_t>(of)] +=
            0.5 * phyxels.mass[i] * phyxels.velocity[i].squaredNorm();
    }
    return out;
}

TEST(SplitMomentum, KeepsMomentaAndAddsNoEnergy) {
    Random random(5);
    int gained = 0;
    for (int trial = 0; trial < 40; ++trial) {
        Phyxels phyxels = random_pieces(random);
        const SplitMomentum split(phyxels, family);
        const std::vector<Momenta> before = momenta_of_families(phyxels);
        const std::vector<double> energy = energy_of_families(phyxels);
        disturb(random, random.uniform(0, 0.5), phyxels);
        const std::vector<Momenta> other = momenta_of_families(phyxels);
        const std::vector<double> disturbed = energy_of_families(phyxels);
        split.settle(phyxels);
        const std::vector<Momenta> after = momenta_of_families(phyxels);
        const std::vector<double> settled = energy_of_families(phyxels);
        for (std::size_t k = 0; k < 2; ++k) {
            EXPECT_LT((after[k].centre - before[k].centre).norm(), 1e-12);
            EXPECT_LT((after[k].linear - before[k].linear).norm(), 1e-12 * before[k].linear.norm());
            EXPECT_LT((after[k].angular() - before[k].angular()).norm(), 1e-12 * before[k].angular().norm());
            EXPECT_LT(settled[k], energy[k] * (1 + 1e-12));
            gained += disturbed[k] > energy[k];
        }
        EXPECT_EQ(after[2].angular(), other[2].angular());
        EXPECT_EQ(settled[2], disturbed[2]);
    }
    EXPECT_GT(gained, 20);
}

// A family that has lost energy keeps its deviations from the rigid motion.
TEST(SplitMomentum, LeavesVelocitiesThatAddNone) {
    Random random(6);
    Phyxels phyxels = random_pieces(random);
    const SplitMomentum split(phyxels, family);
    const std::vector<Momenta> before = momenta_of_families(phyxels);
    for (std::size_t i = 0; i < phyxels.size(); ++i) phyxels.velocity[i] *= 0.5;
    const std::vector<Vec3> velocity = phyxels.velocity;
    split.settle(phyxels);
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const std::int32_t of = family[static_cast<std::size_t>(phyxels.piece[i])];
        if (of < 0) continue;
        const Momenta& half = before[static_cast<std::size_t>(of)];
        const Vec3 rigid =
            half.linear / half.mass +
            angular_velocity(half.inertia, half.angular_momentum).cross(phyxels.position[i] - half.centre);
        EXPECT_LT((phyxels.velocity[i] - velocity[i] - 0.5 * rigid).norm(), 1e-12);
    }
}

}  // namespace
}  // namespace splitcubes::meshless
