// A cut adds no elastic energy, and its relaxation keeps the momenta.
#include "bodies.h"

#include <splitcubes/dynamics/cut_relaxation.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {
namespace {

using namespace fixtures;

// Writes each phyxel's energy and returns the sum.
double take_energy(Specimen& body) {
    SlicedElasticity elastic;
    elastic.take_state(body.neighbourhoods, body.material, configuration_of(body.phyxels), two_threads());
    return elastic.energy(configuration_of(body.phyxels), two_threads(), body.phyxels.elastic_energy);
}

/// Returns a bent, twisted and turned block with the energy of its uncut state.
Specimen strained_block(Random& random, MaterialModel model, double size) {
    Material material;
    material.model = model;
    material.youngs_modulus = std::pow(10, random.uniform(3, 8));
    material.poisson_ratio = random.uniform(0, 0.45);
    Specimen body = block(7, 5, 4, 0.05, material, two_threads());
    for (std::size_t i = 0; i < body.phyxels.size(); ++i) {
        body.phyxels.volume[i] *= random.uniform(0.3, 1.5);
        body.phyxels.mass[i] = material.density * body.phyxels.volume[i];
    }
    body.neighbourhoods.rebuild(body.phyxels, body.pairs, body.material, two_threads());
    const Mat3 turn = random_rotation(random);
    const Vec3 spin = random_vector(random, 5), across = random_vector(random, 10 * size),
               along = random_vector(random, 10 * size);
    body.move(
        [&](const Vec3& X) {
            const Vec3 bent =
                X + X.x() * X.x() * across + X.y() * X.z() * along + size * Vec3(X.y(), 0, X.x());
            return Vec3(turn * bent);
        },
        [&](const Vec3& x) { return Vec3(Vec3(1, 2, 3) + spin.cross(x)); });
    body.phyxels.previous_position = body.phyxels.position;
    take_energy(body);
    return body;
}

/// Cuts planes that end inside the block.
void cut_partly(Specimen& body, int count, Random& random) {
    for (int k = 0; k < count; ++k) {
        const Vec3 point = random_vector(random, 0.1), normal = random_vector(random, 1).normalized();
        const Vec3 inwards = random_vector(random, 1).cross(normal).normalized();
        const std::vector<float> before = body.pairs.visibility;
        cut_by_plane(body, point, normal);
        for (std::size_t p = 0; p < body.pairs.size(); ++p) {
            const Vec3 middle = 0.5 * (body.phyxels.rest_position[body.pairs.a[p]] +
                                       body.phyxels.rest_position[body.pairs.b[p]]);
            if (inwards.dot(middle - point) > 0.05) body.pairs.visibility[p] = before[p];
        }
    }
    body.neighbourhoods.rebuild(body.phyxels, body.pairs, body.material, two_threads());
}

CutRelaxation::Report relax(Specimen& body, std::vector<std::uint8_t> held = {},
                            const Vec3& gravity = Vec3::Zero(),
                            std::span<const std::vector<std::uint32_t>> rejoined = {}) {
    held.resize(body.phyxels.size(), 0);
    CutRelaxation relaxation;
    return relaxation.relax(body.phyxels, body.neighbourhoods, body.material, {held, rejoined, gravity, 1},
                            two_threads());
}

std::vector<std::uint8_t> hold_end(const Phyxels& phyxels) {
    std::vector<std::uint8_t> held;
    for (const Vec3& rest : phyxels.rest_position) held.push_back(rest.x() < -0.05 ? 1 : 0);
    return held;
}

TEST(CutRelaxation, RandomCutsAddNoEnergyAndKeepMomenta) {
    Random random(7);
    int gains = 0;
    for (int trial = 0; trial < 60; ++trial) {
        const auto model = trial % 2 == 0 ? MaterialModel::corotated : MaterialModel::st_venant_kirchhoff;
        Specimen body = strained_block(random, model, random.uniform(0.01, 0.3));
        double before = 0;
        for (const double energy : body.phyxels.elastic_energy) before += energy;
        const Momenta motion = total_momenta(body.phyxels);
        cut_partly(body, 1 + trial % 4, random);
        const CutRelaxation::Report report = relax(body);
        gains += report.gained > 0;
        const double noise = 1e-10 * body.material.youngs_modulus * 0.0175;
        EXPECT_LT(take_energy(body), 1.002 * before + noise) << "trial " << trial;
        const Momenta after = total_momenta(body.phyxels);
        EXPECT_LT((after.centre - motion.centre).norm(), 1e-13) << "trial " << trial;
        EXPECT_LT((after.linear - motion.linear).norm(), 1e-12 * motion.linear.norm()) << "trial " << trial;
        EXPECT_LT((after.angular_momentum - motion.angular_momentum).norm(),
                  1e-11 * motion.angular_momentum.norm())
            << "trial " << trial;
    }
    EXPECT_GT(gains, 20);
}

TEST(CutRelaxation, HeldPhyxelsStay) {
    Random random(8);
    int moved = 0;
    for (int trial = 0; trial < 20; ++trial) {
        Specimen body = strained_block(random, MaterialModel::corotated, 0.2);
        const std::vector<std::uint8_t> held = hold_end(body.phyxels);
        const std::vector<Vec3> start = body.phyxels.position;
        cut_partly(body, 3, random);
        relax(body, held);
        for (std::size_t i = 0; i < start.size(); ++i) {
            moved += start[i] != body.phyxels.position[i];
            if (held[i] != 0) EXPECT_EQ(start[i], body.phyxels.position[i]) << "trial " << trial;
        }
    }
    EXPECT_GT(moved, 0);
}

// Lifting a body that hangs takes elastic energy, too, but gravity gains as much.
TEST(CutRelaxation, BodiesThatHangAreNotLifted) {
    Random random(10);
    int gains = 0;
    for (int trial = 0; trial < 20; ++trial) {
        Material material;
        material.youngs_modulus = std::pow(10, random.uniform(3.5, 5));
        Specimen body = block(7, 5, 4, 0.05, material, two_threads());
        const std::vector<std::uint8_t> held = hold_end(body.phyxels);
        const std::vector<Vec3> target = body.phyxels.position;
        body.input.held = held;
        body.input.held_position = target;
        body.input.gravity = random_vector(random, 10);
        body.input.dt = 0.2;
        for (int step = 0; step < 30; ++step) body.step(two_threads());
        const double before = take_energy(body);
        const std::vector<Vec3> start = body.phyxels.position;
        cut_partly(body, 3, random);
        gains += relax(body, held, body.input.gravity).gained > 0.01 * before;
        double lifted = 0;
        for (std::size_t i = 0; i < start.size(); ++i)
            lifted -= body.phyxels.mass[i] * body.input.gravity.dot(body.phyxels.position[i] - start[i]);
        EXPECT_LT(take_energy(body) + lifted, 1.002 * before) << "trial " << trial;
    }
    EXPECT_GT(gains, 5);
}

/// Cuts a corner off, moves it rigidly and links it again by a few pairs. Returns its phyxels.
std::vector<std::uint32_t> move_corner(Specimen& body, Random& random) {
    std::vector<std::uint32_t> group, cut;
    std::vector<std::uint8_t> is_inside(body.phyxels.size());
    const double size = random.uniform(0.03, 0.15);
    for (std::uint32_t i = 0; i < body.phyxels.size(); ++i)
        if ((is_inside[i] = (body.phyxels.rest_position[i] - Vec3(0.15, 0.1, 0.075)).norm() < size))
            group.push_back(i);
    for (std::uint32_t p = 0; p < body.pairs.size(); ++p)
        if (is_inside[body.pairs.a[p]] != is_inside[body.pairs.b[p]]) {
            body.pairs.visibility[p] = 0;
            cut.push_back(p);
        }
    body.neighbourhoods.rebuild(body.phyxels, body.pairs, body.material, two_threads());
    const Mat3 turn = Eigen::AngleAxisd(random.uniform(0, 1), random_vector(random, 1).normalized()).matrix();
    const Vec3 shift = random_vector(random, 0.1), centre = body.phyxels.position[group.front()];
    for (const std::uint32_t i : group) {
        body.phyxels.position[i] = centre + shift + turn * (body.phyxels.position[i] - centre);
        body.phyxels.rotation[i] = turn * body.phyxels.rotation[i];
    }
    take_energy(body);
    SlicedElasticity elastic;
    elastic.take_state(body.neighbourhoods, body.material, configuration_of(body.phyxels), two_threads());
    elastic.read_deformation(body.phyxels.deformation, body.phyxels.rotation, two_threads());
    for (int k = 0; k < 6; ++k) {
        const auto at = static_cast<std::size_t>(random.uniform(0, 1) * static_cast<double>(cut.size()));
        body.pairs.visibility[cut[at]] = 1;
    }
    body.neighbourhoods.rebuild(body.phyxels, body.pairs, body.material, two_threads());
    return group;
}

// Parts that nothing linked may have moved apart by any distance before they are linked again.
TEST(CutRelaxation, PartsThatAreLinkedAgainAreNotStrained) {
    Random random(11);
    int left_otherwise = 0;
    for (int trial = 0; trial < 40; ++trial) {
        Specimen body = strained_block(random, MaterialModel::corotated, random.uniform(1e-4, 1e-3));
        const std::vector<std::vector<std::uint32_t>> rejoined = {move_corner(body, random)};
        const Momenta motion = total_momenta(body.phyxels);
        double before = 0;
        for (const double energy : body.phyxels.elastic_energy) before += energy;
        Specimen other = body;
        const double gained = relax(body, {}, Vec3::Zero(), rejoined).gained;
        const double noise = 1e-10 * body.material.youngs_modulus * 0.0175;
        const double bound = 1.002 * before + 1e-3 * gained + noise;
        EXPECT_LT(take_energy(body), bound) << "trial " << trial;
        relax(other);
        left_otherwise += take_energy(other) > bound;
        const Momenta after = total_momenta(body.phyxels);
        EXPECT_LT((after.centre - motion.centre).norm(), 1e-13) << "trial " << trial;
        EXPECT_LT((after.angular_momentum - motion.angular_momentum).norm(),
                  1e-11 * motion.angular_momentum.norm())
            << "trial " << trial;
    }
    EXPECT_GT(left_otherwise, 10);
}

TEST(CutRelaxation, NothingMovesWhereNothingIsGained) {
    // Rows reproduce a linear field with any links, so an even strain keeps its energy.
    Random random(9);
    for (int trial = 0; trial < 20; ++trial) {
        Specimen body = strained_block(random, MaterialModel::corotated, 0.2);
        Mat3 stretch = Mat3::Identity();
        stretch(0, 0) = random.uniform(0.7, 1.5);
        stretch(0, 1) = random.uniform(-0.2, 0.2);
        body.move([&](const Vec3& X) { return Vec3(stretch * X); },
                  [](const Vec3&) { return Vec3(1, 0, 0); });
        take_energy(body);
        cut_partly(body, 1, random);
        const std::vector<Vec3> start = body.phyxels.position;
        const std::vector<Vec3> velocity = body.phyxels.velocity;
        EXPECT_EQ(relax(body).iterations, 0) << "trial " << trial;
        EXPECT_EQ(start, body.phyxels.position);
        EXPECT_EQ(velocity, body.phyxels.velocity);
    }
}

}  // namespace
}  // namespace splitcubes::meshless
