// Laws of taut bodies: they stay straight, converge, and still turn.
#include "bodies.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace splitcubes::meshless {
namespace {

using fixtures::block;
using fixtures::random_rotation;
using fixtures::Specimen;

// A bar or a membrane, held at one end, that is pulled along x by `strain` in `steps` steps.
struct Pull {
    Vec3i count;  // phyxels
    double spacing = 0.01, strain = 0;
    int steps = 30;
    Mat3 rotation = Mat3::Identity();

    double length() const { return (count.x() - 1) * spacing; }
};

// Returns the largest mean displacement of a cross-section to the side, m.
double sideways(const Specimen& body, const Pull& pull) {
    std::vector<Vec3> sum(static_cast<std::size_t>(pull.count.x()), Vec3::Zero());
    const double left = body.phyxels.rest_position[0].x();
    for (std::size_t i = 0; i < body.phyxels.size(); ++i) {
        const Vec3& rest = body.phyxels.rest_position[i];
        const Vec3 moved = pull.rotation.transpose() * body.phyxels.position[i] - rest;
        sum[static_cast<std::size_t>(std::lround((rest.x() - left) / pull.spacing))] +=
            Vec3(0, moved.y(), moved.z());
    }
    double largest = 0;
    for (const Vec3& all : sum) largest = std::max(largest, all.norm() / (pull.count.y() * pull.count.z()));
    return largest;
}

void expect_straight(Specimen& body, const Pull& pull, const Parallel& parallel) {
    const double left = body.phyxels.rest_position[0].x(), right = left + pull.length();
    std::vector<std::uint8_t> held;
    for (const Vec3& rest : body.phyxels.rest_position)
        held.push_back(rest.x() < left + 0.5 * pull.spacing || rest.x() > right - 0.5 * pull.spacing);
    std::vector<Vec3> position(body.phyxels.size());
    body.input.held = held;
    body.input.held_position = position;
    body.move([&](const Vec3& x) -> Vec3 { return pull.rotation * x; },
              [](const Vec3&) -> Vec3 { return Vec3::Zero(); });
    // The prescribed ends move on for a third of the steps without a further pull.
    for (int k = 1; k <= pull.steps + pull.steps / 3; ++k) {
        const double moved = pull.strain * pull.length() * std::min(1.0, static_cast<double>(k) / pull.steps);
        for (std::size_t i = 0; i < position.size(); ++i) {
            const Vec3& rest = body.phyxels.rest_position[i];
            position[i] =
                pull.rotation * (rest + (rest.x() > 0.5 * (left + right) ? moved : 0) * Vec3::UnitX());
        }
        const SolverReport report = body.step(parallel);
        ASSERT_LE(report.residual, body.options.tolerance) << "step " << k;
        ASSERT_EQ(report.inverted, 0U) << "step " << k;
        ASSERT_EQ(report.energy_excess_pieces, 0U) << "step " << k;
        ASSERT_LT(sideways(body, pull), 1e-3 * pull.length()) << "step " << k;
    }
}

TEST(Tension, TautBodiesStayStraight) {
    const Parallel parallel(2);
    Random random(1);
    for (int trial = 0; trial < 24; ++trial) {
        Material material;
        material.youngs_modulus = std::pow(10.0, random.uniform(4, 8));
        material.poisson_ratio = random.uniform(0, 0.45);
        Pull pull;
        const auto across = [&] { return 2 + static_cast<int>(random.below(3)); };
        const bool is_membrane = trial % 3 == 0;
        pull.count = Vec3i(12 + static_cast<int>(random.below(24)), across(), across());
        if (is_membrane) pull.count.y() = pull.count.x() / 2;
        pull.strain = random.uniform(0.1, 1);
        pull.steps = 20 + static_cast<int>(random.below(40));
        pull.rotation = random_rotation(random);
        Specimen body =
            block(pull.count.x(), pull.count.y(), pull.count.z(), pull.spacing, material, parallel);
        body.input.dt = 1.0 / 60;
        SCOPED_TRACE(testing::Message()
                     << "trial " << trial << ", " << pull.count.transpose() << " phyxels, E "
                     << material.youngs_modulus << ", nu " << material.poisson_ratio << ", strain "
                     << pull.strain << " in " << pull.steps);
        expect_straight(body, pull, parallel);
    }
}

// The weight of the bar is its tension; the linearised motion must not hold it up.
TEST(Tension, AHungBarSwingsAsARigidPendulum) {
    const Parallel parallel(1);
    for (const double youngs_modulus : {1e6, 1e8}) {
        Material material;
        material.youngs_modulus = youngs_modulus;
        Specimen body = block(3, 3, 15, 0.02, material, parallel);
        double top = -1;
        for (const Vec3& rest : body.phyxels.rest_position) top = std::max(top, rest.z());
        std::vector<std::uint8_t> held;
        for (const Vec3& rest : body.phyxels.rest_position)
            held.push_back(rest.z() > top - 1e-9 && std::abs(rest.x()) < 0.01);
        const std::vector<Vec3> position = body.phyxels.rest_position;
        body.input.held = held;
        body.input.held_position = position;
        body.input.gravity = Vec3(0, 0, -9.81);
        body.input.dt = 1.0 / 120;
        const Mat3 tilt = Eigen::AngleAxisd(0.2, Vec3::UnitY()).toRotationMatrix();
        const Vec3 pivot(0, 0, top);
        body.move([&](const Vec3& x) -> Vec3 { return pivot + tilt * (x - pivot); },
                  [](const Vec3&) -> Vec3 { return Vec3::Zero(); });
        // Period of a bar of length L about its end, from the moments of the phyxels.
        double inertia = 0, moment = 0;
        for (std::size_t i = 0; i < body.phyxels.size(); ++i) {
            const Vec3 arm = body.phyxels.rest_position[i] - pivot;
            inertia += body.phyxels.mass[i] * (arm.x() * arm.x() + arm.z() * arm.z());
            moment -= body.phyxels.mass[i] * arm.z();
        }
        const double quarter = 0.5 * std::numbers::pi * std::sqrt(inertia / (9.81 * moment));
        double time = 0, crossing = 0, last = (total_momenta(body.phyxels).centre - pivot).x();
        for (int k = 0; k < 120 && crossing == 0; ++k) {
            body.step(parallel);
            time += body.input.dt;
            const double centre = (total_momenta(body.phyxels).centre - pivot).x();
            if (last * centre < 0) crossing = time - body.input.dt * centre / (centre - last);
            last = centre;
        }
        EXPECT_NEAR(crossing, quarter, 0.04 * quarter) << "E " << youngs_modulus;
    }
}

// Damping in proportion to stiffness knows no tension: it only takes energy, at any stretch.
TEST(Tension, DampsATautBarInExplicitStepsToo) {
    const Parallel parallel(2);
    Material material;
    material.youngs_modulus = 1e5;
    material.volume_stiffness = 1e5;
    material.stiffness_damping = 1e-3;
    Specimen body = block(12, 3, 3, 0.02, material, parallel);
    body.options.kind = SolverKind::explicit_steps;
    std::vector<std::uint8_t> held;
    std::vector<Vec3> position;
    for (const Vec3& x : body.phyxels.rest_position) {
        held.push_back(std::abs(x.x()) > 0.1);
        position.push_back(x + 0.2 * x.x() * Vec3::UnitX());
    }
    body.input.held = held;
    body.input.held_position = position;
    body.move(
        [](const Vec3& x) -> Vec3 { return x + 0.2 * x.x() * Vec3::UnitX(); },
        [](const Vec3& x) -> Vec3 { return Vec3(0, 0.1 * std::cos(std::numbers::pi / 0.26 * x.x()), 0); });
    SolverReport report;
    for (int k = 0; k < 60; ++k) report = body.step(parallel);
    EXPECT_LT(report.top_speed, 0.02);
    EXPECT_EQ(report.energy_excess_pieces, 0U);
    EXPECT_EQ(report.non_finite, 0U);
}

}  // namespace
}  // namespace splitcubes::meshless
