#include <splitcubes/dynamics/implicit/aggregates.h>

#include "linear_system.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::meshless {
namespace {

using fixtures::block;
using fixtures::dot;
using fixtures::Preconditioner;
using fixtures::random_vector;
using fixtures::Specimen;
using System = fixtures::LinearSystem;

System cut_system(const Parallel& parallel) {
    Specimen body = block(13, 11, 10, 0.05, Material{}, parallel);
    fixtures::cut_randomly(body, 6, 0.2, 3, parallel);
    System system(std::move(body), 1.0 / 90);
    system.hold([](const Vec3& x) { return x.x() < -0.28; });
    system.update(parallel);
    return system;
}

TEST(Aggregates, CorrectionIsSymmetricAndPositive) {
    const Parallel parallel(2);
    System system = cut_system(parallel);
    ASSERT_GE(system.aggregates.level_count(), 2U);
    Random random(5);
    for (int k = 0; k < 5; ++k) {
        const std::vector<Vec3> a = system.random_residual(random), b = system.random_residual(random);
        double of_a = 0;
        const std::vector<Vec3> Ma = system.correct(a, parallel, of_a), Mb = system.correct(b, parallel);
        EXPECT_GT(of_a, 0);
        EXPECT_NEAR(dot(a, Ma), of_a, 1e-5 * of_a);
        EXPECT_NEAR(dot(b, Ma), dot(a, Mb), 1e-5 * of_a);
    }
}

// A rotated residual has the rotated correction.
TEST(Aggregates, RotateWithTheBody) {
    const Parallel parallel(1);
    System system = cut_system(parallel);
    Random random(6);
    const Mat3 Q = fixtures::random_rotation(random);
    const std::vector<Vec3> r = system.random_residual(random);
    std::vector<Vec3> turned = r;
    for (Vec3& force : turned) force = Q * force;
    const std::vector<Vec3> z = system.correct(r, parallel), z_turned = system.correct(turned, parallel);
    const double size = std::sqrt(dot(z, z) / static_cast<double>(z.size()));
    for (std::size_t i = 0; i < z.size(); ++i) EXPECT_LT((z_turned[i] - Q * z[i]).norm(), 1e-5 * size);
}

TEST(Aggregates, HeldPhyxelsAreNotCorrected) {
    const Parallel parallel(1);
    System system = cut_system(parallel);
    Random random(7);
    const std::vector<Vec3> z = system.correct(system.random_residual(random), parallel);
    for (std::size_t i = 0; i < z.size(); ++i) EXPECT_TRUE(system.held[i] == 0 || z[i].isZero(0)) << i;
}

// Separated sides of a cut do not influence each other.
TEST(Aggregates, DoNotReachAcrossACut) {
    const Parallel parallel(1);
    Specimen body = block(12, 12, 12, 0.05, Material{}, parallel);
    const auto left = [](const Vec3& x) { return x.dot(Vec3(1, 0.3, 0.2)) < 0.04; };
    for (std::size_t p = 0; p < body.pairs.size(); ++p)
        if (left(body.phyxels.rest_position[body.pairs.a[p]]) !=
            left(body.phyxels.rest_position[body.pairs.b[p]]))
            body.pairs.visibility[p] = 0;
    body.neighbourhoods.rebuild(body.phyxels, body.pairs, body.material, parallel);
    System system(std::move(body), 1.0 / 90);
    system.update(parallel);
    Random random(8);
    std::vector<Vec3> r = system.random_residual(random);
    for (std::size_t i = 0; i < r.size(); ++i)
        r[i] = left(system.body.phyxels.rest_position[i]) ? Vec3(r[i] + Vec3(1, 1, 1)) : Vec3(Vec3::Zero());
    const std::vector<Vec3> z = system.correct(r, parallel);
    for (std::size_t i = 0; i < z.size(); ++i)
        EXPECT_EQ(z[i].isZero(0), !left(system.body.phyxels.rest_position[i])) << i;
}

void expect_equal_products(Aggregates& a, Aggregates& b, const System& system, const Parallel& parallel) {
    ASSERT_EQ(a.count(), b.count());
    ASSERT_EQ(a.level_count(), b.level_count());
    const std::size_t n = system.body.neighbourhoods.slices().stride();
    Random random(9);
    FloatArray r(3 * n, 0);
    for (float& force : r) force = static_cast<float>(random.uniform(-1, 1));
    EXPECT_EQ(a.correct(r.data(), parallel), b.correct(r.data(), parallel));
    for (std::size_t i = 0; i < n; ++i) ASSERT_EQ(a.index()[i], b.index()[i]) << i;
    for (std::size_t k = 0; k < 3 * (a.count() + 1); ++k) ASSERT_EQ(a.correction()[k], b.correction()[k]);
}

TEST(Aggregates, UpdateEqualsRebuild) {
    const Parallel one(1), three(3);
    System system = cut_system(one);
    Random random(10);
    for (int cut = 0; cut < 12; ++cut) {
        const std::vector<std::uint32_t> changed =
            fixtures::cut_by_plane(system.body, random_vector(random, 0.2), random_vector(random, 1));
        system.body.neighbourhoods.update(system.body.phyxels, system.body.pairs, changed,
                                          system.body.material, one);
        if (cut == 5) system.hold([](const Vec3& x) { return x.y() > 0.22; });
        if (cut == 8)
            for (std::size_t i = 0; i < system.size(); ++i)
                system.body.phyxels.piece[i] = system.body.phyxels.rest_position[i].z() > 0.1;
        system.update(one);
        Aggregates fresh;
        fresh.update(system.body.phyxels, system.body.neighbourhoods, system.held, three);
        fresh.compute_weights(system.body.neighbourhoods, 1, system.inertia, system.added, three);
        expect_equal_products(system.aggregates, fresh, system, cut % 2 == 0 ? one : three);
    }
}

// Compares the couplings across a plane with the energy of translating one side, averaged over directions.
TEST(Aggregates, CouplingsAreTheStiffnessAgainstATranslation) {
    const Parallel parallel(1);
    System system(block(16, 16, 16, 0.05, Material{}, parallel), 1.0 / 60);
    system.update(parallel);
    const Specimen& body = system.body;
    const Neighbourhoods& links = body.neighbourhoods;
    const auto moves = [&](std::size_t i) { return body.phyxels.rest_position[i].x() > 0; };
    double coupled = 0, energy = 0;
    for (std::size_t i = 0; i < system.size(); ++i)
        for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l)
            if (moves(i) && !moves(links.neighbour()[l])) coupled += links.link_coupling(l, i);
    const std::vector<double> zeros(system.size(), 0);
    std::vector<Vec3> shift(system.size()), force(system.size());
    for (int axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < system.size(); ++i)
            shift[i] = moves(i) ? Vec3(Vec3::Unit(axis)) : Vec3(Vec3::Zero());
        energy += system.elastic.apply_stiffness(1, zeros, shift, force, parallel) / 3;
    }
    EXPECT_NEAR(coupled, energy, 0.1 * energy);
}

struct Case {
    double youngs_modulus;
    int cuts;
    bool held;
};

TEST(Aggregates, SaveIterationsAlsoForCutBodies) {
    const Parallel parallel(2);
    for (const Case& c : {Case{250e3, 0, true}, Case{250e3, 8, true}, Case{1e8, 0, true}, Case{1e8, 8, true},
                          Case{1e8, 0, false}, Case{1e3, 0, true}}) {
        Material material;
        material.youngs_modulus = c.youngs_modulus;
        Specimen body = block(15, 15, 15, 0.05, material, parallel);
        if (c.cuts > 0) fixtures::cut_randomly(body, c.cuts, 0.3, 4, parallel);
        System system(std::move(body), 1.0 / 90);
        if (c.held) system.hold([](const Vec3& x) { return x.x() < -0.33; });
        system.update(parallel);
        // A body that begins to fall, plus noise.
        Random random(11);
        std::vector<Vec3> rhs = system.random_residual(random);
        for (std::size_t i = 0; i < rhs.size(); ++i)
            rhs[i] = system.held[i] != 0 ? Vec3(Vec3::Zero()) : Vec3(0.01 * rhs[i] - Vec3(0, 0, 1));
        const int jacobi = system.iterations(rhs, Preconditioner::diagonal, parallel);
        const int multilevel = system.iterations(rhs, Preconditioner::aggregates, parallel);
        // Translations do not correct the rotations of fragments, which decide where material is stiff.
        EXPECT_LE(multilevel, (c.youngs_modulus > 1e7 && c.cuts > 0 ? 1.1 : 1) * jacobi)
            << c.youngs_modulus << " Pa, " << c.cuts << " cuts";
        // A free body falls by one translation of all phyxels.
        EXPECT_TRUE(c.held || 2 * multilevel < jacobi) << multilevel;
    }
}

}  // namespace
}  // namespace splitcubes::meshless
