#include "bodies.h"

#include <gtest/gtest.h>

namespace splitcubes::meshless {
namespace {

using fixtures::block;
using fixtures::Ground;
using fixtures::Specimen;

constexpr double spacing = 0.05;

/// Returns a block whose lowest phyxels are `height` above contact with the plane z = 0.
Specimen above_ground(double height, double friction, double youngs_modulus, const Parallel& parallel) {
    Material material;
    material.youngs_modulus = youngs_modulus;
    material.poisson_ratio = 0.33;
    material.stiffness_damping = 0.005;
    Specimen body = block(6, 6, 4, spacing, material, parallel);
    const double offset = height + 2 * spacing;
    body.move([=](const Vec3& x) -> Vec3 { return x + Vec3(0, 0, offset); },
              [](const Vec3&) { return Vec3(0, 0, 0); });
    body.input.gravity = Vec3(0, 0, -9.81);
    body.ground = Ground{Vec3::UnitZ(), 0, friction};
    return body;
}

double energy_above_ground(const Specimen& body, const SolverReport& report) {
    double potential = 0;
    for (std::size_t i = 0; i < body.phyxels.size(); ++i)
        potential -= body.phyxels.mass[i] * body.input.gravity.dot(body.phyxels.position[i]);
    return potential + report.kinetic_energy + report.elastic_energy;
}

double lowest(const Specimen& body) {
    double low = 1e9;
    for (const Vec3& x : body.phyxels.position) low = std::min(low, x.z());
    return low;
}

TEST(Ground, DroppedBlockComesToRestWithoutCreep) {
    const Parallel parallel(1);
    Specimen body = above_ground(0.3, 0.5, 2.5e5, parallel);
    double energy = 0, height = 1e9;
    for (int k = 0; k < 300; ++k) {
        const SolverReport report = body.step(parallel);
        const double now = energy_above_ground(body, report);
        if (k == 0) energy = now;
        EXPECT_LT(now, 1.001 * energy) << "step " << k;
        height = std::min(height, lowest(body));
    }
    EXPECT_GT(height, 0.5 * spacing - 1e-4) << "nothing sinks in";
    const std::vector<Vec3> before = body.phyxels.position;
    SolverReport report;
    for (int k = 0; k < 300; ++k) report = body.step(parallel);
    EXPECT_GT(report.contacts, 20U);
    EXPECT_LT(report.top_speed, 5e-3);
    double moved = 0;
    for (std::size_t i = 0; i < before.size(); ++i)
        moved = std::max(moved, (body.phyxels.position[i] - before[i]).norm());
    EXPECT_LT(moved, 5e-4);
    EXPECT_LT(total_momenta(body.phyxels).centre.head<2>().norm(), 1e-3) << "it stands where it fell";
}

TEST(Ground, CarriesTheWeightOfAStack) {
    const Parallel parallel(1);
    for (const double stiffness : {3e4, 1e6, 1e8}) {
        Specimen body = above_ground(0, 0.5, stiffness, parallel);
        const double start = total_momenta(body.phyxels).centre.z();
        SolverReport report;
        for (int k = 0; k < 240; ++k) report = body.step(parallel);
        const double sunk = start - total_momenta(body.phyxels).centre.z();
        // A column under its own weight: mean displacement rho g H^2 / (3 E), plus a margin.
        const double column = 1000 * 9.81 * 0.2 * 0.2 / (3 * stiffness);
        // 0.1 mm is the solver's tolerance over the step.
        EXPECT_GT(sunk, 0.2 * column - 1e-4) << stiffness;
        EXPECT_LT(sunk, 3 * column + 1e-4) << stiffness;
        EXPECT_LT(report.top_speed, 1e-2);
    }
}

TEST(Ground, FrictionHoldsBelowItsAngleAndSlidesAbove) {
    const Parallel parallel(1);
    for (const bool holds : {true, false}) {
        Specimen body = above_ground(0, holds ? 0.6 : 0.2, 1e6, parallel);
        const double acceleration = 4;  // m/s^2 along x; tangent 0.41
        body.input.gravity = Vec3(acceleration, 0, -9.81);
        const int steps = 120;
        for (int k = 0; k < steps; ++k) body.step(parallel);
        const Momenta now = total_momenta(body.phyxels);
        const double speed = now.linear.x() / now.mass;
        if (holds) {
            EXPECT_LT(std::abs(speed), 0.01);
            EXPECT_LT(now.centre.x(), 0.02);
        } else {
            EXPECT_NEAR(speed, (acceleration - 0.2 * 9.81) * steps / 60.0, 0.4);
        }
    }
}

TEST(Ground, SlidesWithoutFriction) {
    const Parallel parallel(1);
    Specimen body = above_ground(0, 0, 1e6, parallel);
    body.input.gravity = Vec3(1, 0, -9.81);
    for (int k = 0; k < 60; ++k) body.step(parallel);
    const Momenta now = total_momenta(body.phyxels);
    EXPECT_NEAR(now.linear.x() / now.mass, 1, 0.02);
}

TEST(Ground, DoesNotStick) {
    const Parallel parallel(1);
    Specimen body = above_ground(0, 0.5, 1e6, parallel);
    for (int k = 0; k < 60; ++k) body.step(parallel);
    body.input.gravity = Vec3(0, 0, 5);
    SolverReport report;
    for (int k = 0; k < 60; ++k) report = body.step(parallel);
    EXPECT_EQ(report.contacts, 0U);
    const Momenta now = total_momenta(body.phyxels);
    EXPECT_NEAR(now.linear.z() / now.mass, 5, 0.1) << "the ground does not pull";
}

TEST(Ground, ResolvesInitialPenetrationGently) {
    const Parallel parallel(1);
    Specimen body = above_ground(-0.04, 0.5, 2.5e5, parallel);
    double top = 0;
    for (int k = 0; k < 240; ++k) top = std::max(top, body.step(parallel).top_speed);
    // A fortieth of a spacing is kept, since lifting takes energy.
    EXPECT_GT(lowest(body), 0.5 * spacing - spacing / 40 - 1e-3);
    EXPECT_LT(top, 1.5);
}

TEST(Ground, AnyPlane) {
    // The same fall in a rotated frame.
    const Parallel parallel(1);
    const Mat3 rotation = Eigen::AngleAxisd(0.8, Vec3(1, 2, -0.5).normalized()).toRotationMatrix();
    Specimen level = above_ground(0.05, 0.3, 2.5e5, parallel);
    Specimen tilted = above_ground(0.05, 0.3, 2.5e5, parallel);
    tilted.move([&](const Vec3& x) -> Vec3 { return rotation * (x + Vec3(0, 0, 0.05 + 2 * spacing)); },
                [](const Vec3&) { return Vec3(0, 0, 0); });
    tilted.input.gravity = rotation * tilted.input.gravity;
    tilted.ground = Ground{rotation * Vec3::UnitZ(), 0, 0.3};
    for (int k = 0; k < 60; ++k) {
        level.step(parallel);
        tilted.step(parallel);
    }
    for (std::size_t i = 0; i < level.phyxels.size(); ++i)
        EXPECT_LT((tilted.phyxels.position[i] - rotation * level.phyxels.position[i]).norm(), 2e-3);
}

}  // namespace
}  // namespace splitcubes::meshless
