// Caches between steps do not change which contacts are found.
#include "body/rubber.h"

#include <splitcubes/body/body.h>
#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/contact_finder.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/world/world.h>

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

namespace splitcubes::body {
namespace {

using fixtures::rubber;

ContactFinder::Task task_of(const World& world, std::span<const BodyView> bodies) {
    return {bodies,       world.colliders(),          world.settings().contact,
            world.time(), world.settings().time_step, world.settings().gravity};
}

bool same_side(const meshless::ContactSide& a, const meshless::ContactSide& b) {
    return a.part == b.part && a.count == b.count && a.phyxel == b.phyxel && a.weight == b.weight;
}

void expect_same(const std::vector<ContactIsland>& found, const std::vector<ContactIsland>& expected) {
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t g = 0; g < found.size(); ++g) {
        ASSERT_EQ(found[g].bodies, expected[g].bodies);
        ASSERT_EQ(found[g].contacts.size(), expected[g].contacts.size());
        for (std::size_t k = 0; k < found[g].contacts.size(); ++k) {
            const meshless::Contact &a = found[g].contacts[k], &b = expected[g].contacts[k];
            ASSERT_EQ(a.key, b.key);
            ASSERT_TRUE(k == 0 || found[g].contacts[k - 1].key < a.key);
            ASSERT_TRUE(same_side(a.upper, b.upper) && same_side(a.lower, b.lower));
            ASSERT_EQ(a.normal, b.normal);
            ASSERT_EQ(a.gap, b.gap);
            ASSERT_EQ(a.surface_displacement, b.surface_displacement);
        }
    }
}

// A blade cuts a block on the ground and a smaller one on top of it while the lower one tears.
std::unique_ptr<World> make_searched_world(const std::shared_ptr<const Parallel>& parallel) {
    WorldSettings settings;
    settings.contact.pieces = true;
    settings.validate_each_step = false;
    settings.ground = meshless::GroundPlane{Vec3::UnitZ(), -0.06, 0.6};
    auto world = std::make_unique<World>(settings, parallel);
    BodySettings lower = rubber(0.015);
    lower.material.youngs_modulus = 15 * lower.material.density * 9.81 * 0.12;
    lower.tearing = TearSettings{};
    lower.tearing->strength = 0.05 * lower.material.density * 9.81 * 0.12;
    world->add_body(geometry::make_box(Vec3::Constant(0.12)), lower);
    world->add_body(fixtures::box_at(Vec3::Constant(0.05), Vec3(0.01, 0, 0.0851)), rubber(0.015));
    const cutting::BladeShape shape = cutting::make_straight_blade({0, -0.1, 0}, {0, 0.1, 0});
    world->add_tool(cutting::Blade(
        "blade", shape,
        {{0.1, {0.003, 0, 0.12}, Quat::Identity()}, {0.7, {0.003, 0, -0.07}, Quat::Identity()}}));
    return world;
}

TEST(ContactFinder, FindsTheSameContactsAsAFreshFinder) {
    const auto parallel = std::make_shared<const Parallel>(2);
    const std::unique_ptr<World> made = make_searched_world(parallel);
    World& world = *made;
    ContactFinder kept;
    std::vector<ContactIsland> found, expected;
    std::size_t contacts = 0, torn = 0, cut = 0;
    for (int step = 0; step < 50; ++step) {
        const StepReport report = world.step();
        torn += report.counts.torn_edges;
        cut += report.counts.new_cut_edges;
        const std::vector<BodyView> bodies = views_of(world.bodies());
        kept.find(task_of(world, bodies), *parallel, found);
        ContactFinder fresh;
        fresh.find(task_of(world, bodies), Parallel(1), expected);
        expect_same(found, expected);
        if (HasFatalFailure()) return;
        for (const ContactIsland& group : found) contacts += group.contacts.size();
    }
    EXPECT_GT(contacts, 5000U);
    EXPECT_GT(cut, torn + 100);
    EXPECT_GT(torn, 0U);
}

// Soft bodies that spin, wobble, are cut and meet: steps without a search are steps without contacts.
TEST(ContactFinder, StepsWithoutASearchHaveNoContacts) {
    const auto parallel = std::make_shared<const Parallel>(1);
    int quiet_steps = 0, steps_with_contacts = 0;
    Random random(5);
    for (int k = 0; k < 4; ++k) {
        SCOPED_TRACE(k);
        WorldSettings settings;
        settings.validate_each_step = false;
        settings.gravity = Vec3(0, 0, k % 2 == 0 ? 0 : -9.81);
        settings.time_step = 1 / random.uniform(50, 240);
        World world(settings, parallel);
        const auto vector = [&](double size) {
            return Vec3(random.uniform(-size, size), random.uniform(-size, size),
                        random.uniform(-size, size));
        };
        for (const double x : {-0.12, 0.12}) {
            BodySettings body = rubber(0.0125, std::pow(10, random.uniform(3.5, 5.5)));
            body.velocity = Vec3(x > 0 ? -0.5 : 0.5, 0, 0) + vector(0.1);
            body.angular_velocity = vector(4);
            geometry::TriangleMesh mesh = x < 0 && k < 2 ? geometry::make_torus(0.06, 0.025)
                                                         : geometry::make_box(Vec3(0.05, 0.09, 0.06));
            for (Vec3& position : mesh.positions) position += Vec3(x, 0, 0);
            world.add_body(mesh, body);
        }
        if (k % 2 == 1)
            world.bodies()[0]->add_constraint({[](const Vec3& rest) { return rest.z() > 0.02; },
                                               [](double) { return Isometry::Identity(); }});
        const cutting::BladeShape shape = cutting::make_straight_blade({-0.3, 0, 0}, {0.3, 0, 0});
        world.add_tool(cutting::Blade(
            "blade", shape,
            {{0.12, {0, -0.1, 0.01}, Quat::Identity()}, {0.16, {0, 0.1, 0.01}, Quat::Identity()}}));
        ContactFinder kept;
        std::vector<ContactIsland> found, expected;
        while (world.time() < 0.4) {
            world.step();
            const std::vector<BodyView> bodies = views_of(world.bodies());
            kept.find(task_of(world, bodies), *parallel, found);
            ContactFinder fresh;
            fresh.find(task_of(world, bodies), *parallel, expected);
            expect_same(found, expected);
            if (HasFatalFailure()) return;
            quiet_steps += kept.was_quiet();
            std::size_t contacts = 0;
            for (const ContactIsland& island : found) contacts += island.contacts.size();
            steps_with_contacts += contacts > 0;
        }
    }
    EXPECT_GT(quiet_steps, 30);
    EXPECT_GT(steps_with_contacts, 50);
}

}  // namespace
}  // namespace splitcubes::body
