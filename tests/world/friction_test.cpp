// Coulomb's law for bodies on slopes, in both solvers.
#include "body/rubber.h"

#include <splitcubes/body/body.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/world/world.h>

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

namespace splitcubes::body {
namespace {

using meshless::SolverKind;

struct Slope {
    double tangent = 0, friction = 0;
    double youngs_modulus = 0;  // Pa
    double time_step = 0;       // s
    double direction = 0;       // rad, of the slope in the body's frame
    Vec3 size = Vec3::Zero();   // m
    SolverKind kind = SolverKind::implicit_steps;

    std::string text() const {
        std::ostringstream out;
        out << (kind == SolverKind::explicit_steps ? "explicit" : "implicit") << ", slope " << tangent
            << ", friction " << friction << ", " << youngs_modulus << " Pa, step " << time_step << " s, size "
            << size.transpose() << ", direction " << direction;
        return out.str();
    }
};

// Friction differs from the slope by 3 % at least.
Slope draw_slope(Random& random, SolverKind kind) {
    Slope out;
    out.kind = kind;
    out.tangent = random.uniform(0.1, 0.6);
    out.friction =
        out.tangent * (random.uniform(0, 1) < 0.5 ? random.uniform(0.2, 0.97) : random.uniform(1.03, 1.5));
    out.youngs_modulus = std::pow(10, random.uniform(4, 7));
    out.time_step = 1 / random.uniform(30, 240);
    out.direction = random.uniform(0, 6.28);
    // Low, so that none topples.
    out.size = Vec3(random.uniform(0.06, 0.1), random.uniform(0.06, 0.1), random.uniform(0.02, 0.03));
    return out;
}

struct Slid {
    double distance = 0, late_distance = 0;  // m, down the slope: in all, and in the last half of the time
    double speed = 0;                        // m/s, gained in the last half of the time
    double removed = 0;                      // J, by the energy guard
    double mass = 0;                         // kg
};

// A slope is a level ground under an inclined gravity.
Slid slide(const Slope& slope, double seconds) {
    const Vec3 down(std::cos(slope.direction), std::sin(slope.direction), 0);
    const double cosine = 1 / std::sqrt(1 + slope.tangent * slope.tangent);
    WorldSettings settings;
    settings.validate_each_step = false;
    settings.time_step = slope.time_step;
    settings.solver.kind = slope.kind;
    settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, slope.friction};
    settings.gravity = 9.81 * cosine * (slope.tangent * down - Vec3::UnitZ());
    World world(settings, std::make_shared<const Parallel>(1));
    Body& body = world.add_body(fixtures::box_at(slope.size, Vec3(0, 0, 0.5 * slope.size.z())),
                                fixtures::rubber(0.015, slope.youngs_modulus));
    const auto along = [&](const Vec3& v) { return v.dot(down); };
    Slid out;
    const int steps = static_cast<int>(std::lround(seconds / slope.time_step));
    const double start = along(meshless::total_momenta(body.phyxels()).centre);
    double middle = 0, middle_speed = 0;
    for (int step = 0; step < steps; ++step) {
        out.removed += world.step().solver.energy_removed;
        const meshless::Momenta now = meshless::total_momenta(body.phyxels());
        out.mass = now.mass;
        out.distance = along(now.centre) - start;
        out.speed = along(now.linear) / now.mass - middle_speed;
        out.late_distance = out.distance - middle;
        if (step + 1 != steps / 2) continue;
        middle = out.distance;
        middle_speed = along(now.linear) / now.mass;
    }
    out.speed /= (steps - steps / 2) * slope.time_step;
    return out;
}

void expect_coulomb(SolverKind kind, std::uint64_t seed, int count) {
    Random random(seed);
    for (int k = 0; k < count; ++k) {
        const Slope slope = draw_slope(random, kind);
        SCOPED_TRACE(slope.text());
        const double seconds = 0.8;
        const Slid slid = slide(slope, seconds);
        const double cosine = 1 / std::sqrt(1 + slope.tangent * slope.tangent);
        const double pull = 9.81 * cosine * slope.tangent;
        if (slope.friction > slope.tangent) {
            EXPECT_LT(std::abs(slid.late_distance), 1e-4 * 0.5 * pull * seconds * seconds) << "sticks";
            EXPECT_LT(std::abs(slid.distance), 0.01 * 0.5 * pull * seconds * seconds) << "sticks soon";
        } else {
            const double wanted = pull - 9.81 * cosine * slope.friction;
            EXPECT_NEAR(slid.speed, wanted, 0.02 * wanted);
        }
        // J, of the work of gravity on a body that slides freely.
        EXPECT_LT(slid.removed, 1e-4 * slid.mass * pull * pull * seconds * seconds);
    }
}

TEST(Friction, ImplicitStepsObeyCoulombsLaw) {
    expect_coulomb(SolverKind::implicit_steps, 1, 20);
}

TEST(Friction, ExplicitStepsObeyCoulombsLaw) {
    expect_coulomb(SolverKind::explicit_steps, 2, 6);
}

}  // namespace
}  // namespace splitcubes::body
