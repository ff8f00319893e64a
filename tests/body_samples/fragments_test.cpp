// Cuts that make pieces too small to deform.
#include "laws/solids.h"
#include "laws/worlds.h"

#include <gtest/gtest.h>
#include <splitcubes/body/body.h>
#include <splitcubes/world/world.h>

#include <cmath>

namespace splitcubes::body {
namespace {

using namespace laws;

BodySettings spinning_block(const Vec3& omega) {
    BodySettings settings = soft(0.0141, 150);
    settings.angular_velocity = omega;
    settings.velocity = Vec3(0.3, -0.5, 0.2);
    return settings;
}

// Implicit steps are linear in the displacements: they cannot rotate a piece by a radian. The body itself,
// which is no fragment, stays elastic.
TEST(Fragments, FastOnesGoOnAsTheyWent) {
    Random random(37);
    for (int trial = 0; trial < 8; ++trial) {
        const bool is_fast = trial % 2 == 1;
        WorldSettings apart = free_space(1.0 / 30);
        apart.contact.pieces = false;
        World world(apart, threads(2));
        BodySettings stiff = spinning_block(Vec3::Zero());
        stiff.material.youngs_modulus = std::pow(10.0, random.uniform(5, 8));
        Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.18, 0.16)), stiff);
        const Vec3 normal = Vec3(1, 1.02, 0.98).normalized();
        const Vec3 at = Vec3(0.1, 0.09, 0.08) - random.uniform(5, 6) * 0.0141 * normal;
        body.cut_with_sheet(geometry::make_plane_sheet(at, normal, 1), 0, world.parallel());
        ASSERT_EQ(body.pieces().count(), 2U);
        ASSERT_TRUE(body.phyxels().rigid.bodies.empty());
        meshless::Phyxels& phyxels = body.phyxels();
        std::vector<meshless::Momenta> parts;
        meshless::momenta_of_pieces(phyxels, 2, parts);
        const std::int32_t fragment = parts[0].mass < parts[1].mass ? 0 : 1;
        const Vec3 omega =
            (is_fast ? random.uniform(20, 200) : random.uniform(0, 3)) * random_direction(random);
        for (std::size_t i = 0; i < phyxels.size(); ++i)
            if (phyxels.piece[i] == fragment)
                phyxels.velocity[i] +=
                    omega.cross(phyxels.position[i] - parts[static_cast<std::size_t>(fragment)].centre);
        const meshless::Momenta before = meshless::total_momenta(phyxels);
        double energy = 1e300;
        for (int step = 0; step < 20; ++step) {
            const StepReport report = world.step();
            EXPECT_LT((report.totals.momentum - before.linear).norm(), 1e-9 * before.linear.norm());
            EXPECT_LT((report.totals.angular_momentum - before.angular()).norm(),
                      1e-6 * before.angular().norm());
            const double now = report.totals.kinetic_energy + report.totals.elastic_energy;
            EXPECT_LT(now, (1 + 1e-6) * energy);
            EXPECT_LT(report.solver.energy_removed, 1e-5 * now);  // rounding
            energy = now;
        }
        EXPECT_EQ(phyxels.rigid.bodies.size(), is_fast ? 1U : 0U);
        EXPECT_EQ(body.validate(), std::vector<std::string>{});
    }
}

TEST(Fragments, CornersOfASpinningBodyGoOnAsTheyWent) {
    Random random(31);
    int fragments = 0;
    // Contact would push the corner, whose turning faces meet those of the body.
    WorldSettings apart = free_space();
    apart.contact.pieces = false;
    for (int trial = 0; trial < 12; ++trial) {
        World world(apart, threads(2));
        const Vec3 omega = 5 * random_direction(random);
        Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.18, 0.16)), spinning_block(omega));
        const meshless::Momenta before = meshless::total_momenta(body.phyxels());
        const Vec3 corner(0.1, 0.09, 0.08);
        const Vec3 normal = Vec3(1, 1.02, 0.98).normalized();
        body.cut_with_sheet(
            geometry::make_plane_sheet(corner - (1.2 + trial % 3) * 0.0141 * normal, normal, 1), 0,
            world.parallel());
        ASSERT_EQ(body.pieces().count(), 2U);
        const meshless::Momenta after = meshless::total_momenta(body.phyxels());
        EXPECT_LT((after.linear - before.linear).norm(), 1e-13 * before.linear.norm());
        EXPECT_LT((after.angular_momentum - before.angular_momentum).norm(),
                  1e-12 * before.angular_momentum.norm());
        EXPECT_LT((after.centre - before.centre).norm(), 1e-13);
        ASSERT_EQ(body.phyxels().rigid.bodies.size(), 1U);
        ++fragments;
        const meshless::RigidPiece& fragment = body.phyxels().rigid.bodies[0];
        EXPECT_LT((fragment.angular_velocity() - omega).norm(), 0.05 * omega.norm());
        const Vec3 expected = Vec3(0.3, -0.5, 0.2) + omega.cross(fragment.centre - before.centre);
        EXPECT_LT((fragment.velocity() - expected).norm(), 0.05 * expected.norm());
        const Vec3 angular_momentum = fragment.angular_momentum, velocity = fragment.velocity(),
                   centre = fragment.centre;
        for (int step = 1; step <= 60; ++step) {
            world.step();
            ASSERT_EQ(body.phyxels().rigid.bodies[0].angular_momentum, angular_momentum) << "step " << step;
            ASSERT_LT((body.phyxels().rigid.bodies[0].centre - centre - world.time() * velocity).norm(),
                      1e-12);
        }
    }
    EXPECT_EQ(fragments, 12);
}

TEST(Fragments, ACutThroughARigidPieceConservesMassMomentaAndEnergy) {
    World world(free_space(), threads(2));
    Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.18, 0.16)), spinning_block(Vec3(3, -2, 4)));
    const Vec3 corner(0.1, 0.09, 0.08);
    const Vec3 normal = Vec3(1, 1.02, 0.98).normalized();
    const Vec3 foot = corner - 3.4 * 0.0141 * normal;
    body.cut_with_sheet(geometry::make_plane_sheet(foot, normal, 1), 0, world.parallel());
    ASSERT_EQ(body.phyxels().rigid.bodies.size(), 1U);
    for (int step = 0; step < 20; ++step) world.step();
    const meshless::RigidPiece before = body.phyxels().rigid.bodies[0];
    body.cut_with_sheet(geometry::make_plane_sheet(foot, Vec3(1, -1, 0.02), 0.2), 1, world.parallel());
    const auto& parts = body.phyxels().rigid.bodies;
    ASSERT_GE(parts.size(), 2U);
    double mass = 0, energy = 0;
    Vec3 linear = Vec3::Zero(), angular_momentum = Vec3::Zero();
    for (const meshless::RigidPiece& part : parts) {
        mass += part.mass;
        linear += part.momentum;
        angular_momentum +=
            part.angular_momentum +
            (part.centre - before.centre).cross(part.momentum - part.mass * before.velocity());
        energy += part.kinetic_energy();
        EXPECT_LT((part.angular_velocity() - before.angular_velocity()).norm(), 1e-10);
        EXPECT_LT((part.rotation - before.rotation).norm(), 1e-14);
    }
    EXPECT_NEAR(mass, before.mass, 1e-13 * before.mass);
    EXPECT_LT((linear - before.momentum).norm(), 1e-12 * before.momentum.norm());
    EXPECT_LT((angular_momentum - before.angular_momentum).norm(), 1e-11 * before.angular_momentum.norm());
    EXPECT_NEAR(energy, before.kinetic_energy(), 1e-11 * before.kinetic_energy());
    EXPECT_EQ(body.validate(), std::vector<std::string>{});
}

// A slab cut out between two layers of phyxels has none of its own at first.
TEST(Fragments, ASlabThinnerThanThePhyxelSpacingKeepsItsMassAndMomentum) {
    for (const double low : {0.0, 0.02}) {
        World world(free_space(), threads(2));
        BodySettings settings = soft(0.005, 0);
        settings.phyxel_spacing = 0.03;
        settings.velocity = Vec3(0.3, -0.5, 0.2);
        Body& body = world.add_body(geometry::make_box(Vec3(0.3, 0.1, 0.1)), settings);
        const meshless::Momenta before = meshless::total_momenta(body.phyxels());
        for (const int k : {0, 1})
            body.cut_with_sheet(geometry::make_plane_sheet(Vec3(0, 0, low + 0.0126 * k), Vec3::UnitZ(), 1), k,
                                world.parallel());
        ASSERT_EQ(body.pieces().count(), 3U);
        std::vector<double> mass(3, 0);
        for (std::size_t i = 0; i < body.phyxels().size(); ++i)
            mass[static_cast<std::size_t>(body.phyxels().piece[i])] += body.phyxels().mass[i];
        for (const double m : mass) EXPECT_GT(m, 0.2 * before.mass / 3);
        const meshless::Momenta after = meshless::total_momenta(body.phyxels());
        EXPECT_NEAR(after.mass, before.mass, 1e-13 * before.mass);
        EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * before.linear.norm());
        for (int step = 0; step < 2; ++step) world.step();
        EXPECT_LT((meshless::total_momenta(body.phyxels()).linear - before.linear).norm(),
                  1e-7 * before.linear.norm());
    }
}

TEST(Fragments, ARigidPieceInAHoldFollowsIt) {
    WorldSettings settings = free_space();
    settings.gravity = Vec3(0, 0, -9.81);
    World world(settings, threads(2));
    Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.18, 0.16)), soft(0.0141, 150));
    const Vec3 normal = Vec3(1, 1.02, 0.98).normalized();
    body.cut_with_sheet(geometry::make_plane_sheet(Vec3(0.1, 0.09, 0.08) - 2.4 * 0.0141 * normal, normal, 1),
                        0, world.parallel());
    ASSERT_EQ(body.phyxels().rigid.bodies.size(), 1U);
    const Vec3 start = body.phyxels().rigid.bodies[0].centre;
    HoldConstraint hold = hold_beyond(Vec3(0.05, 0.05, 0.05), Vec3(1, 1, 1));
    hold.motion = [](double time) {
        Isometry motion = Isometry::Identity();
        motion.translation() = Vec3(0.1 * time, 0, 0);
        return motion;
    };
    body.add_constraint(hold);
    for (int step = 0; step < 30; ++step) world.step();
    EXPECT_LT((body.phyxels().rigid.bodies[0].centre - start - Vec3(0.05, 0, 0)).norm(), 1e-12);
}

}  // namespace
}  // namespace splitcubes::body
