// Contact of bodies with colliders, pieces and each other; handles and tools.
#include "body/rubber.h"

#include <splitcubes/body/body.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/world/world.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace splitcubes::body {
namespace {

using fixtures::box_at;
using fixtures::rubber;

std::shared_ptr<const Parallel> thread_pool(int count) {
    return std::make_shared<const Parallel>(count);
}

WorldSettings falling() {
    WorldSettings out;
    out.contact.pieces = true;
    out.validate_each_step = false;
    return out;
}

WorldSettings unsupported() {
    WorldSettings out = falling();
    out.gravity = Vec3::Zero();
    return out;
}

geometry::TriangleMesh level_sheet(double height, double half) {
    return {{{-half, -half, height}, {half, -half, height}, {half, half, height}, {-half, half, height}},
            {{0, 1, 2}, {0, 2, 3}}};
}

double lowest(const Body& body) {
    double out = 1e300;
    for (const Vec3& p : body.vertex_positions()) out = std::min(out, p.z());
    return out;
}

Vec3 centre_of_piece(const Body& body, std::int32_t piece) {
    std::vector<meshless::Momenta> sums;
    meshless::momenta_of_pieces(body.phyxels(), static_cast<int>(body.pieces().count()), sums);
    return sums[static_cast<std::size_t>(piece)].centre;
}

double height_energy(const World& world) {
    double sum = 0;
    for (const auto& body : world.bodies())
        for (std::size_t i = 0; i < body->phyxels().size(); ++i)
            sum -= body->phyxels().mass[i] * world.settings().gravity.dot(body->phyxels().position[i]);
    return sum;
}

// Drops a cube on a solid and checks that it comes to rest above it.
void expect_rest_on(std::shared_ptr<const geometry::SignedDistance> solid, const Vec3& from) {
    World world(falling(), thread_pool(1));
    Body& body = world.add_body(box_at(Vec3::Constant(0.06), from), rubber(0.015));
    world.add_collider({"solid", solid, {}, 0.8});
    double energy = 0, deepest = 0;
    for (int step = 0; step < 150; ++step) {
        const StepReport report = world.step();
        const double now = report.totals.kinetic_energy + report.totals.elastic_energy + height_energy(world);
        if (step == 0) energy = now;
        EXPECT_LT(now - energy, 1e-3 * std::abs(energy)) << "step " << step;
        for (const Vec3& p : body.vertex_positions()) deepest = std::min(deepest, solid->at(p).distance);
        if (step == 149) {
            EXPECT_LT(report.totals.top_speed, 0.01);
            EXPECT_GT(report.counts.contacts, 3U);
        }
    }
    EXPECT_GT(deepest, -0.05 * body.phyxel_spacing()) << "a twentieth of the spacing";
}

TEST(Contact, RestsOnAPlane) {
    expect_rest_on(geometry::make_plane_distance(Vec3::UnitZ(), 0), Vec3(0, 0, 0.1));
}

TEST(Contact, RestsOnABox) {
    expect_rest_on(geometry::make_box_distance(Vec3(0.2, 0.2, 0.04), 0.002), Vec3(0, 0, 0.1));
}

TEST(Contact, RestsOnTheMeshOfABox) {
    const Parallel parallel(1);
    expect_rest_on(geometry::make_mesh_distance(geometry::make_box(Vec3(0.2, 0.2, 0.04)), 40, parallel),
                   Vec3(0, 0, 0.1));
}

// Lets a block with a bottom 12 spacings wide stand for a while; returns the number of active contacts.
std::size_t contacts_below(World& world) {
    BodySettings settings = rubber(0.01, 2e5);
    settings.phyxel_spacing = 0.02;
    world.add_body(box_at({0.24, 0.24, 0.08}, {0, 0, 0.0401}), settings);
    StepReport report;
    for (int step = 0; step < 40; ++step) report = world.step();
    return report.counts.contacts;
}

TEST(Contact, AFlatFacePushesOncePerSpacingOnAPlaneAndWithAllSamplesElsewhere) {
    World plane(falling(), thread_pool(2)), box(falling(), thread_pool(2));
    plane.add_collider({"ground", geometry::make_plane_distance(Vec3::UnitZ(), 0), {}, 0.5});
    box.add_collider({"plate", geometry::make_box_distance(Vec3(1, 1, 0.1), 0),
                      [](double) { return Isometry(Eigen::Translation3d(0, 0, -0.05)); }, 0.5});
    const std::size_t on_plane = contacts_below(plane), on_box = contacts_below(box);
    EXPECT_GT(on_plane, 100U) << "one per spacing";
    EXPECT_LT(on_plane, 250U);
    EXPECT_GT(on_box, 2 * on_plane);
    EXPECT_NEAR(lowest(*plane.bodies()[0]), lowest(*box.bodies()[0]), 2e-4);
}

TEST(Contact, ACutThroughAStandingBlockKeepsItsSupportingContacts) {
    WorldSettings settings = falling();
    World world(settings, thread_pool(2));
    world.add_collider({"ground", geometry::make_plane_distance(Vec3::UnitZ(), 0), {}, 0.5});
    // The blade passes through the whole block within one step.
    const double then = 41 * settings.time_step;
    world.add_tool(cutting::Blade("blade", cutting::make_straight_blade({0, -0.2, 0}, {0, 0.2, 0}),
                                  {{then - 0.5 * settings.time_step, {0.0031, 0, 0.2}, Quat::Identity()},
                                   {then + 0.4 * settings.time_step, {0.0042, 0, -0.1}, Quat::Identity()}}));
    const std::size_t before = contacts_below(world);
    std::size_t min_contacts = before;
    for (int step = 0; step < 6; ++step) min_contacts = std::min(min_contacts, world.step().counts.contacts);
    EXPECT_EQ(world.bodies()[0]->pieces().count(), 2U);
    EXPECT_GT(min_contacts + 3, before);
}

TEST(Contact, ABlockRestsOnABall) {
    World world(falling(), thread_pool(1));
    Body& body = world.add_body(box_at(Vec3(0.08, 0.08, 0.03), Vec3(0, 0, 0.13)), rubber(0.015));
    const auto ball = geometry::make_sphere_distance(0.1);
    world.add_collider({"ball", ball, {}, 1});
    double deepest = 0;
    for (int step = 0; step < 60; ++step) {
        world.step();
        for (const Vec3& p : body.vertex_positions()) deepest = std::min(deepest, ball->at(p).distance);
    }
    EXPECT_GT(deepest, -0.05 * body.phyxel_spacing());
    EXPECT_GT(centre_of_piece(body, 0).z(), 0.1);
}

TEST(Contact, AFastBodyDoesNotGoThroughAThinPlate) {
    for (const double speed : {5.0, 20.0}) {
        World world(unsupported(), thread_pool(1));
        BodySettings thrown = rubber(0.015);
        thrown.velocity = Vec3(0, 0, -speed);
        Body& body = world.add_body(box_at(Vec3::Constant(0.05), Vec3(0, 0, 0.15)), thrown);
        world.add_collider({"plate", geometry::make_box_distance(Vec3(0.4, 0.4, 0.02), 0), {}, 0.5});
        for (int step = 0; step < 30; ++step) {
            world.step();
            EXPECT_GT(centre_of_piece(body, 0).z(), 0.01) << "step " << step;
        }
    }
}

TEST(Contact, PassesBesideAPlate) {
    World world(unsupported(), thread_pool(1));
    BodySettings thrown = rubber(0.015);
    thrown.velocity = Vec3(0, 0, -5);
    Body& body = world.add_body(box_at(Vec3::Constant(0.05), Vec3(0.04, 0, 0.15)), thrown);
    world.add_collider({"plate", geometry::make_box_distance(Vec3(0.02, 0.4, 0.02), 0), {}, 0.5});
    for (int step = 0; step < 6; ++step) EXPECT_EQ(world.step().counts.contacts, 0U);
    EXPECT_NEAR(centre_of_piece(body, 0).z(), 0.15 - 5 * 6 / 60.0, 1e-9);
}

TEST(Contact, ABodySticksOrSlidesOnASlopeByItsFriction) {
    const double slope = 0.5;  // tangent of the angle
    // Phyxels aligned with the contact samples, and not.
    for (const auto& [friction, spacing] :
         {std::pair(0.7, 0.015), {0.7, 0.0125}, {0.2, 0.015}, {0.2, 0.0125}}) {
        WorldSettings settings = falling();
        const Vec3 normal = Vec3(-slope, 0, 1).normalized();
        settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, friction};
        // In the frame of the slope: gravity is inclined.
        settings.gravity = 9.81 * Vec3(std::sqrt(1 - normal.z() * normal.z()), 0, -normal.z());
        World world(settings, thread_pool(1));
        Body& body = world.add_body(box_at(Vec3(0.09, 0.09, 0.03), Vec3(0, 0, 0.0151)), rubber(spacing, 5e5));
        StepReport report;
        for (int step = 0; step < 30; ++step) report = world.step();
        const double before = report.totals.momentum.x() / report.totals.mass;
        const Vec3 there = centre_of_piece(body, 0);
        for (int step = 0; step < 60; ++step) report = world.step();
        const double gained = report.totals.momentum.x() / report.totals.mass - before;
        const double pull = settings.gravity.x(), press = -settings.gravity.z();
        if (friction > slope) {
            EXPECT_LT((centre_of_piece(body, 0) - there).norm(), 1e-5)
                << "sticks, without creep, " << spacing;
        } else {
            EXPECT_NEAR(gained, pull - friction * press, 0.03 * pull) << "in one second, " << spacing;
        }
    }
}

TEST(Contact, SlidingBodiesObeyCoulombsLaw) {
    const double friction = 0.2, time = 0.25;
    // Phyxels aligned with the contact samples, and not.
    for (const double spacing : {0.015, 0.0125}) {
        WorldSettings settings = falling();
        settings.contact.friction = friction;
        settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0};
        World world(settings, thread_pool(2));
        world.add_body(box_at(Vec3(0.45, 0.12, 0.03), Vec3(0, 0, 0.0151)), rubber(0.015, 5e5));
        BodySettings thrown = rubber(spacing, 5e5);
        thrown.velocity = Vec3(1.2, 0, 0);
        Body& upper = world.add_body(box_at(Vec3(0.09, 0.09, 0.03), Vec3(-0.15, 0, 0.0452)), thrown);
        StepReport report;
        for (int step = 0; step < 6; ++step) report = world.step();
        const meshless::Momenta before = meshless::total_momenta(upper.phyxels());
        const double both = report.totals.momentum.x();
        const int steps = static_cast<int>(std::lround(time * 60));
        int iterations = 0;
        for (int step = 0; step < steps; ++step) {
            report = world.step();
            iterations = std::max(iterations, report.solver.iterations);
        }
        const double lost = before.linear.x() - meshless::total_momenta(upper.phyxels()).linear.x();
        const double wanted = friction * 9.81 * before.mass * steps / 60;
        EXPECT_NEAR(lost, wanted, 0.05 * wanted) << "spacing " << spacing;
        EXPECT_NEAR(report.totals.momentum.x(), both, 1e-3 * both) << "the other body takes it";
        EXPECT_LT(iterations, 300);
    }
}

// Light and stiff plates under blocks of up to a thousand times their density, of random size and place.
// Springs begin as stiff as the weight of the plate needs.
TEST(Contact, LightStiffPlatesUnderHeavyBlocksDoNotSinkIn) {
    Random random(11);
    for (int trial = 0; trial < 6; ++trial) {
        SCOPED_TRACE(testing::Message() << "trial " << trial);
        WorldSettings settings = falling();
        settings.time_step = 1 / random.uniform(50, 120);
        settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.5};
        World world(settings, thread_pool(2));
        const double thickness = random.uniform(0.03, 0.04), side = random.uniform(0.05, 0.07);
        BodySettings light = rubber(0.017, 1e8), heavy = rubber(0.017, std::pow(10, random.uniform(7, 8)));
        light.material.density = 100;
        heavy.material.density = std::pow(10, random.uniform(3, 5));
        const Vec3 shift(random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01), 0);
        const Body& plate =
            world.add_body(box_at(Vec3(0.1, 0.1, thickness), Vec3(0, 0, 0.5 * thickness + 1e-4)), light);
        const Body& block = world.add_body(
            box_at(Vec3::Constant(side), Vec3(0, 0, thickness + 0.5 * side + 2e-4) + shift), heavy);
        for (int step = 0; step < 40; ++step) world.step();
        double top = 0;
        for (const Vec3& p : plate.vertex_positions()) top = std::max(top, p.z());
        const double tenth_cell = 0.1 * 0.5 * plate.phyxel_spacing();
        EXPECT_GT(lowest(plate), -tenth_cell);
        EXPECT_GT(lowest(block), top - tenth_cell);
    }
}

TEST(Contact, AMovingColliderPushes) {
    World world(unsupported(), thread_pool(1));
    Body& body = world.add_body(geometry::make_box(Vec3::Constant(0.05)), rubber(0.0125));
    world.add_collider({"pusher", geometry::make_box_distance(Vec3(0.02, 0.2, 0.2), 0.001),
                        [](double time) {
                            Isometry out = Isometry::Identity();
                            out.translation() = Vec3(-0.05 + 0.2 * time, 0, 0);
                            return out;
                        },
                        0.5});
    StepReport report;
    for (int step = 0; step < 60; ++step) report = world.step();
    EXPECT_NEAR(report.totals.momentum.x() / report.totals.mass, 0.2, 0.02);
    double left = 1;
    for (const Vec3& p : body.vertex_positions()) left = std::min(left, p.x());
    EXPECT_GT(left, -0.05 + 0.2 + 0.01 - 0.05 * body.phyxel_spacing());
}

// One piece of a body is thrown against the other, off centre.
TEST(Contact, CollidingPiecesKeepTheirMomentaAndGainNoEnergy) {
    World world(unsupported(), thread_pool(2));
    Body& body = world.add_body(geometry::make_box(Vec3(0.06, 0.06, 0.12)), rubber(0.015));
    body.cut_with_sheet(level_sheet(0.001, 0.2), 0, world.parallel());
    ASSERT_EQ(body.pieces().count(), 2U);
    const std::int32_t upper = centre_of_piece(body, 0).z() > centre_of_piece(body, 1).z() ? 0 : 1;
    meshless::Phyxels& phyxels = body.phyxels();
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (phyxels.piece[i] == upper) phyxels.velocity[i] = Vec3(0.1, 0.05, -0.8);
    const meshless::Momenta before = meshless::total_momenta(phyxels);
    double energy = 0;
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        energy += 0.5 * phyxels.mass[i] * phyxels.velocity[i].squaredNorm();
    std::size_t contacts = 0;
    for (int step = 0; step < 60; ++step) {
        const StepReport report = world.step();
        contacts = std::max(contacts, report.counts.contacts);
        const meshless::Momenta now = meshless::total_momenta(phyxels);
        ASSERT_LT((now.linear - before.linear).norm(), 1e-9 * before.linear.norm()) << "step " << step;
        ASSERT_LT((now.angular() - before.angular()).norm(), 1e-5 * before.linear.norm() * 0.06);
        const double after = report.totals.kinetic_energy + report.totals.elastic_energy;
        ASSERT_LT(after, (1 + 1e-3) * energy) << "step " << step;
        energy = std::min(energy, after);
    }
    EXPECT_GT(contacts, 10U);
    std::vector<meshless::Momenta> sums;
    meshless::momenta_of_pieces(phyxels, 2, sums);
    EXPECT_LT(sums[static_cast<std::size_t>(1 - upper)].linear.z(), 0) << "the lower one was pushed";
}

TEST(Contact, CollidingBodiesShareTheirMomentum) {
    World world(unsupported(), thread_pool(1));
    BodySettings thrown = rubber(0.015), still = rubber(0.0125, 3e5);
    thrown.velocity = Vec3(0, 0, -1);
    world.add_body(box_at(Vec3::Constant(0.06), Vec3(0, 0, 0.08)), thrown);
    Body& target = world.add_body(geometry::make_box(Vec3::Constant(0.06)), still);
    StepReport report = world.step();
    const Vec3 momentum = report.totals.momentum, angular_momentum = report.totals.angular_momentum;
    double energy = report.totals.kinetic_energy;
    for (int step = 0; step < 40; ++step) {
        report = world.step();
        EXPECT_LT((report.totals.momentum - momentum).norm(), 1e-9 * momentum.norm());
        EXPECT_LT((report.totals.angular_momentum - angular_momentum).norm(), 1e-5 * 0.06 * momentum.norm());
        const double now = report.totals.kinetic_energy + report.totals.elastic_energy;
        EXPECT_LT(now, (1 + 1e-3) * energy);
        energy = std::min(energy, now);
    }
    EXPECT_LT(meshless::total_momenta(target.phyxels()).linear.z(), 0.3 * momentum.z());
}

TEST(Contact, AFreshCutPushesNothing) {
    World world(unsupported(), thread_pool(1));
    Body& body = world.add_body(geometry::make_box(Vec3(0.08, 0.06, 0.06)), rubber(0.015));
    body.cut_with_sheet(level_sheet(0.004, 0.2), 0, world.parallel());
    StepReport report;
    for (int step = 0; step < 30; ++step) {
        report = world.step();
        EXPECT_LT(report.totals.top_speed, 1e-3) << "step " << step;
    }
}

TEST(Contact, ASlitThatEndsInsideDoesNotCloseThroughItself) {
    // A bar with a slit from one side is bent so that the cut faces close.
    std::array<double, 2> through = {0, 0};
    for (const bool pieces : {false, true}) {
        WorldSettings settings = falling();
        settings.gravity = Vec3(0, 0, 9.81);
        settings.contact.pieces = pieces;
        World world(settings, thread_pool(1));
        BodySettings bar = rubber(0.0125, 3e4);
        bar.material.mass_damping = 4;
        Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.05, 0.05)), bar);
        geometry::TriangleMesh slit;
        for (const Vec2& p : {Vec2(-0.1, 0.1), Vec2(0.1, 0.1), Vec2(0.1, -0.002), Vec2(-0.1, -0.002)})
            slit.positions.push_back(Vec3(0.0007, p.x(), -p.y()));
        slit.triangles = {{0, 1, 2}, {0, 2, 3}};
        body.cut_with_sheet(slit, 0, world.parallel());
        ASSERT_EQ(body.pieces().count(), 1U);
        HoldConstraint ends;
        ends.region = [](const Vec3& rest) { return std::abs(rest.x()) > 0.088; };
        ends.motion = [](double) { return Isometry::Identity(); };
        body.add_constraint(ends);
        for (int step = 0; step < 60; ++step) world.step();
        // Maximum overlap of phyxels on both sides of the slit, below its middle.
        double& max_overlap = through[pieces ? 1 : 0];
        const meshless::Phyxels& p = body.phyxels();
        for (std::size_t i = 0; i < p.size(); ++i)
            for (std::size_t j = 0; j < p.size(); ++j)
                if (p.rest_position[i].x() < 0 && p.rest_position[j].x() > 0 &&
                    p.rest_position[j].x() - p.rest_position[i].x() < 0.02 &&
                    std::abs(p.rest_position[i].y() - p.rest_position[j].y()) < 1e-6 &&
                    std::abs(p.rest_position[i].z() - p.rest_position[j].z()) < 1e-6)
                    max_overlap = std::max(max_overlap, p.rest_position[j].x() - p.rest_position[i].x() -
                                                            (p.position[j].x() - p.position[i].x()));
    }
    EXPECT_GT(through[0], 0.003) << "without contact the cut faces overlap";
    EXPECT_LT(through[1], 0.3 * through[0]);
}

TEST(Contact, AStackOfThreeSlicesRests) {
    WorldSettings settings = falling();
    settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.6};
    World world(settings, thread_pool(2));
    Body& body = world.add_body(box_at(Vec3(0.09, 0.09, 0.09), Vec3(0, 0, 0.0451)), rubber(0.018));
    body.cut_with_sheet(level_sheet(0.031, 0.2), 0, world.parallel());
    body.cut_with_sheet(level_sheet(0.061, 0.2), 1, world.parallel());
    ASSERT_EQ(body.pieces().count(), 3U);
    for (int step = 0; step < 120; ++step) world.step();
    std::vector<Vec3> start;
    for (int k = 0; k < 3; ++k) start.push_back(centre_of_piece(body, k));
    double kinetic = 0, first = 0, max_energy = -1e300;
    for (int step = 0; step < 600; ++step) {
        const StepReport report = world.step();
        const double energy =
            report.totals.kinetic_energy + report.totals.elastic_energy + height_energy(world);
        if (step == 0) first = energy;
        max_energy = std::max(max_energy, energy);
        kinetic = std::max(kinetic, report.totals.kinetic_energy);
    }
    for (int k = 0; k < 3; ++k)
        EXPECT_LT((centre_of_piece(body, k) - start[static_cast<std::size_t>(k)]).norm(), 1e-4 * 0.09)
            << k << ": creep in ten seconds";
    EXPECT_LT(kinetic, 1e-9) << "J: 0.05 mm/s of a body of 0.7 kg";
    EXPECT_LT(max_energy - first, 1e-5 * first) << "energy does not increase";
    EXPECT_GT(lowest(body), -0.05 * body.phyxel_spacing());
}

std::string hash_of_heap(int thread_count) {
    WorldSettings settings = falling();
    settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.4};
    World world(settings, thread_pool(thread_count));
    BodySettings turning = rubber(0.015);
    turning.angular_velocity = Vec3(1, 2, 0.5);
    Body& body = world.add_body(box_at(Vec3(0.08, 0.07, 0.06), Vec3(0, 0, 0.06)), turning);
    world.add_body(box_at(Vec3::Constant(0.04), Vec3(0.01, 0, 0.14)), rubber(0.012));
    body.cut_with_sheet(level_sheet(0.065, 0.2), 0, world.parallel());
    for (int step = 0; step < 40; ++step) world.step();
    return world.state_hash().text();
}

TEST(Contact, ThreadsDoNotMatter) {
    const std::string one = hash_of_heap(1);
    EXPECT_EQ(hash_of_heap(2), one);
    EXPECT_EQ(hash_of_heap(3), one);
}

TEST(Contact, AHandlePullsUpToItsLimit) {
    for (const double limit : {1e300, 0.1}) {
        World world(unsupported(), thread_pool(1));
        Body& body = world.add_body(geometry::make_box(Vec3(0.1, 0.05, 0.05)), rubber(0.0125));
        Handle handle;
        handle.region = [](const Vec3& rest) { return rest.x() > 0.03; };
        handle.motion = [](double) {
            Isometry out = Isometry::Identity();
            out.translation() = Vec3(0.2, 0, 0);
            return out;
        };
        handle.stiffness = 5;
        handle.limit = limit;
        body.add_handle(handle);
        StepReport report;
        Vec3 impulse = Vec3::Zero();
        for (int step = 0; step < 5; ++step) {
            report = world.step();
            ASSERT_EQ(report.handle_forces.size(), 1U);
            impulse += report.handle_forces[0] / 60;
            EXPECT_LE(report.handle_forces[0].norm(), 1.05 * limit);
        }
        EXPECT_NEAR(report.totals.momentum.x(), impulse.x(), 0.05 * impulse.x());
        if (limit < 1) {
            EXPECT_NEAR(report.totals.momentum.x(), limit * 5 / 60, 0.05 * limit * 5 / 60);
        }
    }
}

TEST(Contact, TheToolForceEqualsTheCuttingResistance) {
    for (const double resistance : {0.0, 200.0}) {
        World world(unsupported(), thread_pool(1));
        BodySettings block = rubber(0.0125);
        block.material.cutting_resistance = resistance;
        world.add_body(geometry::make_box(Vec3(0.1, 0.06, 0.05)), block);
        const double speed = 0.12;
        world.add_tool(cutting::Blade(
            "knife", cutting::make_straight_blade({0.001, -0.1, 0}, {0.001, 0.1, 0}),
            {{0, Vec3(0, 0, 0.06), Quat::Identity()}, {1, Vec3(0, 0, 0.06 - speed), Quat::Identity()}}));
        double work = 0, area = 0, max_torque = 0;
        for (int step = 0; step < 61; ++step) {
            const StepReport report = world.step();
            work -= report.tools[0].force.z() * -speed / 60;
            area += report.tools[0].area;
            max_torque = std::max(max_torque, report.tools[0].torque.norm());
        }
        EXPECT_NEAR(area, 0.06 * 0.05, 0.2 * 0.06 * 0.05) << "the block's section";
        EXPECT_NEAR(work, resistance * area, 1e-3 * resistance * area);
        EXPECT_LT(max_torque, 0.02 * 200 * 0.06) << "the blade passes in its middle";
    }
}

}  // namespace
}  // namespace splitcubes::body
