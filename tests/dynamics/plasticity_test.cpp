// Plastic bodies: permanent deformation, springback, conservation.
#include "bodies.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace splitcubes::meshless {
namespace {

using fixtures::block;
using fixtures::random_vector;
using fixtures::Specimen;

struct Variant {
    MaterialModel model;
    SolverKind solver;
};
const std::vector<Variant> variants = {{MaterialModel::corotated, SolverKind::implicit_steps},
                                       {MaterialModel::corotated, SolverKind::explicit_steps},
                                       {MaterialModel::st_venant_kirchhoff, SolverKind::implicit_steps},
                                       {MaterialModel::st_venant_kirchhoff, SolverKind::explicit_steps}};

Specimen plastic_block(int nx, int ny, int nz, const Variant& variant, double yield,
                       const Parallel& parallel) {
    Material material;
    material.model = variant.model;
    material.youngs_modulus = 1e5;
    material.plasticity = Plasticity{yield, 1e300, 0.4};
    Specimen body = block(nx, ny, nz, 0.05, material, parallel);
    body.options.kind = variant.solver;
    return body;
}

double largest_plastic_strain_of(const Specimen& body) {
    double largest = 0;
    for (const Mat3& strain : body.phyxels.plastic_strain) largest = std::max(largest, strain.norm());
    return largest;
}

// Holds one end of a bar, moves the other down by `deflection` (m) within half a second,
// releases it and waits for rest. Returns the remaining deflection as a fraction.
double bend_left_over(Specimen& body, double deflection, const Parallel& parallel) {
    body.material.mass_damping = 10;
    body.material.stiffness_damping = 0.002;
    std::vector<std::uint8_t> held(body.phyxels.size());
    std::vector<Vec3> position = body.phyxels.rest_position;
    body.input.held = held;
    body.input.held_position = position;
    double end = 0, count = 0;
    for (int k = 1; k <= 180; ++k) {
        for (std::size_t i = 0; i < held.size(); ++i) {
            const Vec3& rest = body.phyxels.rest_position[i];
            const bool moved = k <= 30 && rest.x() > 0.2;
            held[i] = rest.x() < -0.2 || moved;
            position[i] = moved ? Vec3(rest - Vec3(0, 0, deflection * k / 30)) : rest;
        }
        body.step(parallel);
    }
    for (std::size_t i = 0; i < held.size(); ++i) {
        if (body.phyxels.rest_position[i].x() < 0.2) continue;
        end += body.phyxels.rest_position[i].z() - body.phyxels.position[i].z();
        ++count;
    }
    return end / count / deflection;
}

TEST(Plasticity, ABarBentPastYieldKeepsItsBendOneBentLessSpringsBack) {
    const Parallel parallel(1);
    for (const Variant& variant : variants) {
        Specimen past = plastic_block(10, 3, 3, variant, 0.02, parallel);
        EXPECT_GT(bend_left_over(past, 0.15, parallel), 0.4);
        EXPECT_GT(largest_plastic_strain_of(past), 0.01);
        Specimen below = plastic_block(10, 3, 3, variant, 0.02, parallel);
        EXPECT_LT(std::abs(bend_left_over(below, 0.005, parallel)), 0.01);
        EXPECT_EQ(largest_plastic_strain_of(below), 0);
    }
}

TEST(Plasticity, StrainStaysWithinItsBounds) {
    const Parallel parallel(1);
    for (const Variant& variant : variants) {
        Specimen body = plastic_block(10, 3, 3, variant, 0.02, parallel);
        body.material.plasticity->maximum = 0.1;
        bend_left_over(body, 0.3, parallel);
        EXPECT_NEAR(largest_plastic_strain_of(body), 0.1, 1e-3) << "it was bent as far as that";
        EXPECT_LE(largest_plastic_strain_of(body), 0.1 * (1 + 1e-12));
    }
}

TEST(Plasticity, FlowLeavesMomentumAndTakesEnergy) {
    const Parallel parallel(1);
    for (const MaterialModel model : {MaterialModel::corotated, MaterialModel::st_venant_kirchhoff}) {
        Specimen body = plastic_block(7, 4, 4, {model, SolverKind::explicit_steps}, 0.02, parallel);
        fixtures::cut_randomly(body, 8, 0.12, 5, parallel);
        body.options.restore_momentum = false;
        body.move([](const Vec3& x) -> Vec3 { return x; },
                  [](const Vec3& x) -> Vec3 {
                      return Vec3(0.2, -0.1, 200 * x.x() * x.x()) + Vec3(1, 2, 4).cross(x);
                  });
        const Momenta before = total_momenta(body.phyxels);
        double start = 0;
        for (std::size_t i = 0; i < body.phyxels.size(); ++i)
            start += 0.5 * body.phyxels.mass[i] * body.phyxels.velocity[i].squaredNorm();
        SolverReport report;
        for (int k = 0; k < 60; ++k) report = body.step(parallel);
        EXPECT_GT(largest_plastic_strain_of(body), 0.05) << "it has flowed";
        // Up to the single precision of the forces.
        EXPECT_LT((report.momentum - before.linear).norm(), 1e-6 * before.linear.norm());
        EXPECT_LT((total_momenta(body.phyxels).angular_momentum - before.angular_momentum).norm(),
                  3e-5 * before.angular_momentum.norm());
        EXPECT_LT(report.kinetic_energy + report.elastic_energy, 0.97 * start);
    }
}

TEST(Plasticity, RigidMotionDoesNotMakeItFlow) {
    const Parallel parallel(1);
    for (const Variant& variant : variants) {
        Specimen body = plastic_block(6, 4, 4, variant, 1e-3, parallel);
        // Rotated at once, then translating and rotating slowly: the centrifugal strain
        // stays below the yield.
        Random random(3);
        const Mat3 turn = fixtures::random_rotation(random);
        body.move([&](const Vec3& x) -> Vec3 { return turn * x; },
                  [](const Vec3& x) -> Vec3 { return Vec3(5, -3, 20) + Vec3(0.5, 0.4, -0.3).cross(x); });
        for (int k = 0; k < 120; ++k) body.step(parallel);
        EXPECT_EQ(largest_plastic_strain_of(body), 0);
    }
}

// A plastically deformed body under a rigid motion: strains stay the same, forces rotate
// with it.
TEST(Plasticity, DeformedBodyRotatesFreely) {
    const Parallel parallel(1);
    Random random(4);
    for (const Variant& variant : variants) {
        Specimen body = plastic_block(6, 4, 4, variant, 0.02, parallel);
        body.material.plasticity->yield = 10;
        for (Mat3& strain : body.phyxels.plastic_strain) strain = Vec3(0.1, -0.05, 0.02).asDiagonal();
        const Mat3 shape = stretch_of(body.material, body.phyxels.plastic_strain[0]);
        const Mat3 turn = fixtures::random_rotation(random);
        body.move([&](const Vec3& x) -> Vec3 { return turn * shape * x; },
                  [](const Vec3& x) -> Vec3 { return Vec3(0.3, 0.5, -0.2).cross(x); });
        update_deformation(body.phyxels, body.neighbourhoods, parallel);
        for (int k = 0; k < 60; ++k) {
            const SolverReport report = body.step(parallel);
            ASSERT_LT(report.elastic_energy, 1e-3 * report.kinetic_energy);
        }
    }
}

TEST(Plasticity, CreepFollowsItsRate) {
    const Parallel parallel(1);
    std::vector<double> left;
    for (const double creep : {0.2, 2.0, 200.0}) {
        Specimen body = plastic_block(10, 3, 3, variants[0], 0.02, parallel);
        body.material.plasticity->creep = creep;
        left.push_back(bend_left_over(body, 0.15, parallel));
    }
    EXPECT_LT(left[0], 0.5 * left[1]);
    EXPECT_LT(left[1], 0.8 * left[2]);
}

}  // namespace
}  // namespace splitcubes::meshless
