// Hits rebound by the coefficient of restitution, whatever the stiffness, the step and the solver.
#include "body/rubber.h"

#include <splitcubes/body/body.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/world/checkpoint.h>
#include <splitcubes/world/world.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace splitcubes::body {
namespace {

using fixtures::at;
using fixtures::rubber;

std::shared_ptr<const Parallel> with_threads(int count = 1) {
    return std::make_shared<const Parallel>(count);
}

WorldSettings settings_with(double restitution, double time_step = 1.0 / 60) {
    WorldSettings out;
    out.validate_each_step = false;
    out.time_step = time_step;
    out.contact.restitution = restitution;
    return out;
}

using meshless::SolverKind;

constexpr double gravity = 9.81;  // m/s^2
constexpr std::array kinds = {SolverKind::implicit_steps, SolverKind::explicit_steps};

std::string name_of(SolverKind kind) {
    return kind == SolverKind::explicit_steps ? "explicit" : "implicit";
}

// A ball that is thrown at a solid of which the top is z = 0.
struct Throw {
    double restitution = 0, radius = 0;  // radius: m
    double youngs_modulus = 0;           // Pa
    double damping = 0;                  // s
    double time_step = 0;                // s
    double speed = 0, sideways = 0;      // m/s, downwards and along x
    double friction = 0;
    std::uint32_t solid = 0;
    SolverKind kind = SolverKind::implicit_steps;

    std::string text() const {
        std::ostringstream out;
        out << name_of(kind) << ", coefficient " << restitution << ", radius " << radius << ", "
            << youngs_modulus << " Pa, damping " << damping << ", step " << time_step << " s, " << speed
            << " m/s, sideways " << sideways << ", friction " << friction << ", solid " << solid;
        return out.str();
    }
};

Throw draw_throw(Random& random, SolverKind kind) {
    Throw out;
    out.kind = kind;
    out.restitution = random.uniform(0.3, 0.9);
    out.radius = random.uniform(0.05, 0.2);
    out.youngs_modulus = std::pow(10, random.uniform(5, 8));
    out.damping = random.uniform(0, 1) < 0.5 ? 0 : random.uniform(0, 0.003);
    out.time_step = std::pow(10, random.uniform(-3, std::log10(1.0 / 60)));
    // The rebound is faster than what gravity does in four steps.
    out.speed = std::max(random.uniform(0.5, 5), 4 * gravity * out.time_step / out.restitution);
    out.solid = random.below(4);
    return out;
}

std::shared_ptr<const geometry::SignedDistance> solid_of(std::uint32_t kind) {
    if (kind == 0) return geometry::make_plane_distance(Vec3::UnitZ(), 0);
    if (kind == 1) return geometry::make_box_distance(Vec3(3, 3, 0.1), 0.002);
    if (kind == 2) return geometry::make_mesh_distance(geometry::make_box(Vec3(3, 3, 0.5)), 40, Parallel(1));
    return geometry::make_sphere_distance(2);
}

double top_of(std::uint32_t kind) {
    return std::array{0.0, 0.05, 0.25, 2.0}[kind];
}

struct Rebound {
    double ratio = 0;    // of the speeds at which the ball's centre left and met the solid
    double gained = 0;   // share of the energy of the hit, above what the ball had
    double slowed = 0;   // m/s, along x
    double touched = 0;  // s, for which contacts pushed
    bool has_left = false;
};

double energy_of(const World& world, const StepReport& report) {
    double sum = report.totals.kinetic_energy + report.totals.elastic_energy + report.totals.contact_energy;
    for (const auto& body : world.bodies()) {
        const meshless::Momenta all = meshless::total_momenta(body->phyxels());
        sum -= all.mass * world.settings().gravity.dot(all.centre);
    }
    return sum;
}

Rebound throw_ball(const Throw& given) {
    WorldSettings settings = settings_with(given.restitution, given.time_step);
    settings.solver.kind = given.kind;
    World world(settings, with_threads());
    world.add_collider({"solid", solid_of(given.solid), {}, given.friction});
    BodySettings ball = rubber(0.4 * given.radius, given.youngs_modulus, given.damping);
    ball.velocity = Vec3(given.sideways, 0, -given.speed);
    const double height = std::max(0.02 * given.radius, 5e-4) + 0.37 * given.speed * given.time_step;
    Body& body = world.add_body(
        at(geometry::make_sphere(given.radius, 3), Vec3(0, 0, top_of(given.solid) + given.radius + height)),
        ball);
    const meshless::Momenta start = meshless::total_momenta(body.phyxels());
    const double met = std::sqrt(given.speed * given.speed + 2 * gravity * height);
    const double before =
        0.5 * start.linear.squaredNorm() / start.mass + start.mass * gravity * start.centre.z();
    Rebound out;
    bool has_hit = false;
    for (int step = 0; step < 2000 && !out.has_left; ++step) {
        const StepReport report = world.step();
        const meshless::Momenta now = meshless::total_momenta(body.phyxels());
        const Vec3 velocity = now.linear / now.mass;
        // What contact springs hold they have from the ball.
        const double energy = energy_of(world, report) - report.totals.contact_energy;
        out.gained = std::max(out.gained, (energy - before) / (0.5 * start.mass * met * met));
        has_hit = has_hit || report.counts.contacts > 0;
        out.has_left = has_hit && report.counts.contacts == 0 && velocity.z() > 0;
        const double risen = now.centre.z() - start.centre.z() + height;
        out.ratio = std::sqrt(std::max(0.0, velocity.z() * velocity.z() + 2 * gravity * risen)) / met;
        out.slowed = given.sideways - velocity.x();
        if (report.counts.contacts > 0) out.touched += given.time_step;
    }
    return out;
}

void expect_rebounds(std::uint64_t seed, SolverKind kind, std::size_t count) {
    Random random(seed);
    for (std::size_t draw = 0; draw < count; ++draw) {
        const Throw given = draw_throw(random, kind);
        SCOPED_TRACE(given.text());
        const Rebound rebound = throw_ball(given);
        EXPECT_TRUE(rebound.has_left);
        EXPECT_NEAR(rebound.ratio, given.restitution, 0.1 * given.restitution);
        EXPECT_LT(rebound.gained, 0.02);
    }
}

TEST(Restitution, ImplicitBallsReboundByTheCoefficient) {
    expect_rebounds(101, SolverKind::implicit_steps, 60);
}

TEST(Restitution, ExplicitBallsReboundByTheCoefficient) {
    expect_rebounds(102, SolverKind::explicit_steps, 40);
}

TEST(Restitution, ElasticHitsGiveBackNearlyAll) {
    Random random(103);
    for (std::size_t draw = 0; draw < 30; ++draw) {
        Throw given = draw_throw(random, kinds[draw % 2]);
        given.restitution = 1;
        given.youngs_modulus = std::pow(10, random.uniform(5, 7));
        SCOPED_TRACE(given.text());
        const Rebound rebound = throw_ball(given);
        EXPECT_GT(rebound.ratio, 0.9);
        EXPECT_LT(rebound.ratio, 1.02);
        EXPECT_LT(rebound.gained, 0.02);
    }
}

TEST(Restitution, InelasticHitsLeaveTheBallWhereItFell) {
    Random random(104);
    for (std::size_t draw = 0; draw < 12; ++draw) {
        Throw given = draw_throw(random, kinds[draw % 2]);
        given.restitution = 0;
        given.solid = 0;
        SCOPED_TRACE(given.text());
        WorldSettings settings = settings_with(0, given.time_step);
        settings.solver.kind = given.kind;
        settings.ground = meshless::GroundPlane{};
        World world(settings, with_threads());
        BodySettings ball = rubber(0.4 * given.radius, given.youngs_modulus, given.damping);
        ball.velocity = Vec3(0, 0, -given.speed);
        Body& body =
            world.add_body(at(geometry::make_sphere(given.radius, 3), Vec3(0, 0, 1.05 * given.radius)), ball);
        const double start = meshless::total_momenta(body.phyxels()).centre.z();
        for (int step = 0; step < std::lround(0.3 / given.time_step); ++step) {
            world.step();
            // A step's motion, or what the ball is longer when it parts.
            EXPECT_LT(meshless::total_momenta(body.phyxels()).centre.z() - start,
                      given.speed * given.time_step + 0.05 * given.radius);
        }
    }
}

// The friction of a hit is at most its coefficient times the impulse along the normal, which is that of an
// elastic hit and of gravity at most. Hits of stiffer bodies in implicit steps stick.
TEST(Restitution, ObliqueHitsObeyCoulombsLaw) {
    Random random(105);
    for (std::size_t draw = 0; draw < 30; ++draw) {
        Throw given = draw_throw(random, kinds[draw % 2]);
        given.youngs_modulus = std::pow(10, random.uniform(5, 6));
        given.solid = random.below(2);
        given.friction = random.uniform(0.1, 0.4);
        given.sideways = random.uniform(2, 5) * given.friction * (1 + given.restitution) * given.speed;
        SCOPED_TRACE(given.text());
        const Rebound rebound = throw_ball(given);
        EXPECT_NEAR(rebound.ratio, given.restitution, 0.1 * given.restitution);
        EXPECT_LT(rebound.slowed, 1.1 * given.friction * (2 * given.speed + gravity * rebound.touched));
        EXPECT_GT(rebound.slowed, 0.4 * given.friction * (1 + given.restitution) * given.speed);
    }
}

// Two balls that meet off their centres, without gravity.
TEST(Restitution, PiecesPartByTheCoefficientAndKeepTheirMomenta) {
    Random random(106);
    for (std::size_t draw = 0; draw < 16; ++draw) {
        const double coefficient = random.uniform(0.3, 0.9), speed = random.uniform(0.5, 3);
        const double radius = random.uniform(0.03, 0.06), other_radius = random.uniform(0.03, 0.06);
        const double offset = random.uniform(0, 0.5) * std::min(radius, other_radius);
        WorldSettings settings = settings_with(coefficient, 1 / random.uniform(60, 480));
        settings.gravity = Vec3::Zero();
        settings.contact.friction = 0;
        settings.solver.kind = kinds[draw % 2];
        World world(settings, with_threads());
        BodySettings thrown = rubber(0.4 * radius, std::pow(10, random.uniform(5, 7)), 0);
        const BodySettings still = rubber(0.4 * other_radius, std::pow(10, random.uniform(5, 7)), 0);
        thrown.velocity = Vec3(0, 0, -speed);
        SCOPED_TRACE(testing::Message()
                     << "draw " << draw << ", coefficient " << coefficient << ", " << speed << " m/s, "
                     << thrown.material.youngs_modulus << " and " << still.material.youngs_modulus
                     << " Pa, offset " << offset << ", step " << settings.time_step);
        world.add_body(at(geometry::make_sphere(radius, 3), Vec3(offset, 0, radius + other_radius + 0.002)),
                       thrown);
        world.add_body(geometry::make_sphere(other_radius, 3), still);
        const auto all = [&](std::size_t b) { return meshless::total_momenta(world.bodies()[b]->phyxels()); };
        const meshless::Momenta start = meshless::together(std::array{all(0), all(1)});
        const double before = 0.5 * all(0).linear.squaredNorm() / all(0).mass;
        // Along the line between the centres when the balls meet.
        const Vec3 normal =
            Vec3(offset, 0, std::sqrt(std::pow(radius + other_radius, 2) - offset * offset)).normalized();
        StepReport report;
        for (int step = 0; step < 0.3 / settings.time_step; ++step) {
            report = world.step();
            const meshless::Momenta now = meshless::together(std::array{all(0), all(1)});
            // Explicit steps sum forces in single precision, and push the two points of a contact, which are
            // apart: only the impulses of restitution keep the angular momentum there.
            const bool is_explicit = settings.solver.kind == SolverKind::explicit_steps;
            ASSERT_LT((now.linear - start.linear).norm(), (is_explicit ? 3e-7 : 1e-9) * start.linear.norm());
            if (!is_explicit)
                ASSERT_LT((now.angular() - start.angular()).norm(), 1e-5 * start.linear.norm() * radius);
            ASSERT_LT(energy_of(world, report), 1.01 * before);
        }
        const double parted = normal.dot(all(0).linear / all(0).mass - all(1).linear / all(1).mass);
        const double met = speed * normal.z();
        EXPECT_NEAR(parted / met, coefficient, 0.1 * coefficient);
    }
}

// Heights fall with the square of the coefficient, and the bounces end.
TEST(Restitution, BouncesEnd) {
    for (const SolverKind kind : kinds)
        for (const double coefficient : {0.5, 0.8}) {
            SCOPED_TRACE(testing::Message() << coefficient << " " << name_of(kind));
            WorldSettings settings = settings_with(coefficient, 1.0 / 240);
            settings.solver.kind = kind;
            settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.5};
            World world(settings, with_threads());
            // Coarse balls roll away; a fine one takes an explicit step many substeps.
            const double spacing = kind == SolverKind::explicit_steps ? 0.02 : 0.0125;
            Body& body =
                world.add_body(at(geometry::make_sphere(0.05, 3), Vec3(0, 0, 0.25)), rubber(spacing, 1e6));
            const auto height = [&] { return meshless::total_momenta(body.phyxels()).centre.z() - 0.05; };
            std::vector<double> tops = {0.2};
            bool rises = false;
            StepReport report;
            for (int step = 0; step < 600; ++step) {
                const double last = height();
                report = world.step();
                if (rises && height() < last && last > 0.01) tops.push_back(last);
                rises = height() > last;
            }
            ASSERT_GE(tops.size(), 3U);
            for (std::size_t k = 1; k < std::min<std::size_t>(tops.size(), 4); ++k)
                EXPECT_NEAR(tops[k] / tops[k - 1], coefficient * coefficient, 0.1 * coefficient * coefficient)
                    << "bounce " << k;
            // A ball that has bounced may roll.
            EXPECT_LT(std::abs(meshless::total_momenta(body.phyxels()).linear.z()),
                      5e-3 * report.totals.mass);
            EXPECT_GT(report.counts.contacts, 0U);
        }
}

// What lies stays: no jitter, and nothing creeps up.
TEST(Restitution, BodiesThatRestStayAtRest) {
    for (const SolverKind kind : kinds)
        for (const double rate : {60.0, 500.0}) {
            SCOPED_TRACE(testing::Message() << rate << " " << name_of(kind));
            std::vector<double> tops;
            for (const std::optional<double> coefficient : {std::optional<double>(), std::optional(0.9)}) {
                WorldSettings settings = settings_with(0, 1 / rate);
                settings.contact.restitution = coefficient;
                settings.solver.kind = kind;
                settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.5};
                World world(settings, with_threads());
                world.add_body(fixtures::box_at(Vec3(0.1, 0.1, 0.06), Vec3(0, 0, 0.03)), rubber(0.02, 2e5));
                world.add_body(fixtures::box_at(Vec3(0.06, 0.06, 0.06), Vec3(0, 0, 0.09)), rubber(0.02, 2e5));
                StepReport report;
                for (int step = 0; step < rate; ++step) report = world.step();
                EXPECT_LT(report.totals.top_speed, 5e-3);
                tops.push_back(meshless::total_momenta(world.bodies()[1]->phyxels()).centre.z());
            }
            EXPECT_NEAR(tops[0], tops[1], 1e-4);
        }
}

TEST(Restitution, ABoxThatFallsOnAFaceRebounds) {
    for (const SolverKind kind : kinds) {
        SCOPED_TRACE(name_of(kind));
        WorldSettings settings = settings_with(0.6, 1.0 / 120);
        settings.solver.kind = kind;
        settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.5};
        World world(settings, with_threads());
        Body& body =
            world.add_body(fixtures::box_at(Vec3(0.12, 0.12, 0.08), Vec3(0, 0, 0.24)), rubber(0.02, 1e6));
        double top = 0, last = 0;
        bool has_hit = false;
        StepReport report;
        for (int step = 0; step < 72; ++step) {
            report = world.step();
            has_hit = has_hit || report.counts.contacts > 0;
            last = meshless::total_momenta(body.phyxels()).centre.z() - 0.04;
            if (has_hit && report.counts.contacts == 0) top = std::max(top, last);
        }
        EXPECT_NEAR(std::sqrt(top / 0.2), 0.6, 0.06);
    }
}

// Two halves fall side by side. Energy never exceeds what they had.
TEST(Restitution, HalvesThatFallTogetherComeToRest) {
    for (const SolverKind kind : kinds) {
        SCOPED_TRACE(name_of(kind));
        WorldSettings settings = settings_with(0.5, 1.0 / 120);
        settings.solver.kind = kind;
        settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.5};
        World world(settings, with_threads());
        Body& body =
            world.add_body(fixtures::box_at(Vec3(0.12, 0.08, 0.08), Vec3(0, 0, 0.14)), rubber(0.016, 5e5));
        body.cut_with_sheet(geometry::make_plane_sheet(Vec3(0.01, 0, 0.14), Vec3(1, 0.2, 0.4), 0.2), 0,
                            world.parallel());
        const meshless::Momenta start = meshless::total_momenta(body.phyxels());
        const double fallen = start.mass * gravity * 0.1;
        StepReport report;
        for (int step = 0; step < 480; ++step) {
            report = world.step();
            ASSERT_LT(energy_of(world, report) - start.mass * gravity * start.centre.z(), 0.01 * fallen);
        }
        EXPECT_EQ(report.totals.pieces, 2U);
        EXPECT_LT(report.totals.top_speed, 1e-3);
    }
}

// Balls in hits with the ground, a moving collider and each other.
std::unique_ptr<World> juggled(SolverKind kind, int thread_count) {
    WorldSettings settings = settings_with(0.7, 1.0 / 100);
    settings.solver.kind = kind;
    settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.5};
    auto world = std::make_unique<World>(settings, with_threads(thread_count));
    Collider paddle;
    paddle.solid = geometry::make_box_distance(Vec3(0.2, 0.2, 0.02), 0.002);
    paddle.motion = [](double time) {
        return Isometry(Eigen::Translation3d(0.2, 0, 0.05 + 0.02 * std::sin(20 * time)));
    };
    world->add_collider(paddle);
    for (const double x : {0.0, 0.2})
        for (const double z : {0.1, 0.22})
            world->add_body(at(geometry::make_sphere(0.04, 3), Vec3(x + 0.1 * z, 0, z)), rubber(0.02, 3e5));
    return world;
}

TEST(Restitution, IsTheSameForAnyNumberOfThreadsAndAfterACheckpoint) {
    for (const SolverKind kind : kinds) {
        const auto one = juggled(kind, 1), two = juggled(kind, 2);
        std::string middle;
        bool has_hit = false;
        for (int step = 0; step < 80; ++step) {
            // In the middle of a hit.
            if (middle.empty() && step > 10 && has_hit) middle = encode_checkpoint(*one, "juggled");
            has_hit = one->step().totals.contact_energy > 0.01;
            two->step();
        }
        ASSERT_FALSE(middle.empty());
        EXPECT_EQ(one->state_hash().text(), two->state_hash().text());
        const auto resumed = juggled(kind, 1);
        restore_checkpoint(*resumed, middle, "juggled", "middle");
        while (resumed->step_count() < one->step_count()) resumed->step();
        EXPECT_EQ(one->state_hash().text(), resumed->state_hash().text());
    }
}

// Removing a body and a collider leaves the hits of the others as they are.
TEST(Restitution, RemovedThingsLeaveTheOtherHits) {
    const auto world = juggled(SolverKind::implicit_steps, 1);
    while (!(world->step().totals.contact_energy > 0.01)) continue;
    world->remove_body(0);
    world->remove_collider(1);
    for (int step = 0; step < 20; ++step) EXPECT_TRUE(std::isfinite(world->step().totals.kinetic_energy));
}

}  // namespace
}  // namespace splitcubes::body
