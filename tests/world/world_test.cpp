// Laws of a world in motion: conservation, determinism, constraints.
#include <splitcubes/body/body.h>
#include <splitcubes/world/world.h>

#include "laws/solids.h"
#include "laws/worlds.h"

#include <gtest/gtest.h>
#include <splitcubes/core/error.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace splitcubes::body {
namespace {

using namespace laws;

std::string hash_of_positions(const Body& body) {
    StateHash hash;
    for (const std::vector<Vec3>* values : {&body.phyxels().position, &body.phyxels().velocity,
                                            &body.vertex_positions(), &body.vertex_normals()})
        for (const Vec3& v : *values)
            for (int k = 0; k < 3; ++k) hash.add(v[k]);
    return hash.text();
}

meshless::Momenta momenta_of(const World& world) {
    meshless::Momenta sum;
    Vec3 angular = Vec3::Zero();
    for (const auto& body : world.bodies()) {
        const meshless::Momenta one = meshless::total_momenta(body->phyxels());
        sum.mass += one.mass;
        sum.linear += one.linear;
        angular += one.angular();
    }
    sum.angular_momentum = angular;  // about the origin here
    return sum;
}

TEST(World, RestWithoutLoadStaysAtRest) {
    for (const bool cut : {false, true}) {
        World world(free_space(), threads(2));
        Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.16, 0.14)), soft(0.015, 150));
        if (cut) {
            body.cut_with_sheet(geometry::make_plane_sheet(Vec3::Zero(), Vec3(1, 0.3, 0.2), 0.5), 0,
                                world.parallel());
            body.cut_with_sheet(geometry::make_plane_sheet(Vec3(0, 0, 0.02), Vec3(0, 0.3, 1), 0.05), 1,
                                world.parallel());
        }
        const std::vector<Vec3> positions = body.phyxels().position;
        const std::string hash = hash_of_positions(body);
        for (int step = 0; step < 30; ++step) {
            const StepReport report = world.step();
            ASSERT_EQ(body.phyxels().position, positions) << "step " << step;
            ASSERT_EQ(hash_of_positions(body), hash) << "step " << step;
            ASSERT_EQ(report.totals.top_speed, 0);
            ASSERT_EQ(report.totals.elastic_energy, 0);
        }
        EXPECT_EQ(body.pieces().count(), cut ? 2U : 1U);
    }
}

TEST(World, AFreeHalfFallsWhileTheOtherIsHeld) {
    for (const double time_step : {1.0 / 60, 1.0 / 200}) {
        WorldSettings settings = free_space(time_step);
        settings.gravity = Vec3(0, 0, -9.81);
        settings.validate_each_step = false;
        World world(settings, threads(2));
        Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.16, 0.14)), soft(0.015, 200));
        body.cut_with_sheet(geometry::make_plane_sheet(Vec3::Zero(), Vec3(0.05, 0.1, 1), 0.5), 0,
                            world.parallel());
        body.add_constraint(hold_beyond({0, 0, 0.04}, Vec3::UnitZ()));
        ASSERT_EQ(body.pieces().count(), 2U);
        std::vector<meshless::Momenta> before, after;
        meshless::momenta_of_pieces(body.phyxels(), 2, before);
        const std::size_t lower = before[0].centre[2] < before[1].centre[2] ? 0 : 1;
        while (world.time() < 0.5 - 1e-9) world.step();
        EXPECT_EQ(body.validate(), std::vector<std::string>{});
        meshless::momenta_of_pieces(body.phyxels(), 2, after);
        const double drop = before[lower].centre[2] - after[lower].centre[2];
        EXPECT_NEAR(drop, 0.5 * 9.81 * 0.25, 0.01 * 0.5 * 9.81 * 0.25);
        EXPECT_NEAR(after[lower].linear[2] / after[lower].mass, -9.81 * 0.5, 0.01 * 9.81 * 0.5);
        EXPECT_LT((after[1 - lower].centre - before[1 - lower].centre).norm(), 0.01) << "the held half sags";
        // It falls without rotation or stretch.
        EXPECT_LT(std::abs(after[lower].centre[0] - before[lower].centre[0]), 1e-9);
        EXPECT_LT(after[lower].angular_momentum.norm(), 1e-9);
    }
}

// Parts of what fell get phyxels of their own, some of them at nodes that lie in the region of the hold.
TEST(World, AHoldDoesNotCatchPartsOfWhatFellFromIt) {
    Random random(31);
    int in_region = 0;
    for (int trial = 0; trial < 5; ++trial) {
        WorldSettings settings = free_space(1.0 / 120);
        if (trial % 2 == 1) settings.solver.kind = meshless::SolverKind::explicit_steps;
        settings.gravity = Vec3(0, 0, -9.81);
        settings.validate_each_step = false;
        World world(settings, threads(2));
        Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.16, 0.14)), soft(0.012, 200));
        const auto cut = [&](const Vec3& at, const Vec3& normal) {
            body.cut_with_sheet(geometry::make_plane_sheet(at, normal, 0.5), 0, world.parallel());
        };
        cut(Vec3::Zero(), Vec3(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 1));
        ASSERT_EQ(body.pieces().count(), 2U);
        // The hold begins above the lower half's phyxels, but not above all of its nodes.
        std::vector<meshless::Momenta> halves;
        meshless::momenta_of_pieces(body.phyxels(), 2, halves);
        const std::int32_t lower = halves[0].centre[2] < halves[1].centre[2] ? 0 : 1;
        double top = -1;
        for (std::size_t i = 0; i < body.phyxels().size(); ++i)
            if (body.phyxels().piece[i] == lower) top = std::max(top, body.phyxels().rest_position[i][2]);
        body.add_constraint(hold_beyond({0, 0, top + 1e-6}, Vec3::UnitZ()));
        while (world.time() < 0.1) world.step();
        for (int k = 0; k < 6; ++k) cut(0.05 * random_vector(random, 1), random_vector(random, 1));
        StepReport report;
        for (int k = 0; k < 3; ++k) report = world.step();
        // Fragments that rotate are faster than their centres.
        EXPECT_LT(report.totals.top_speed, 1.5 * 9.81 * world.time());
        for (std::size_t i = 0; i < body.phyxels().size(); ++i)
            in_region += body.phyxels().rest_position[i][2] > top &&
                         body.phyxels().position[i][2] < body.phyxels().rest_position[i][2] - 0.03;
    }
    EXPECT_GT(in_region, 0) << "no cut tested the law";
}

TEST(World, ASpinningBodyKeepsItsMomenta) {
    WorldSettings settings = free_space();
    settings.validate_each_step = false;
    World world(settings, threads(2));
    BodySettings spinning = soft(0.02, 120);
    spinning.velocity = Vec3(0.3, -0.2, 0.1);
    spinning.angular_velocity = 5 * Vec3(1, 2, 2) / 3;
    Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.16, 0.12)), spinning);
    const meshless::Momenta before = momenta_of(world);
    double previous_energy = 1e300;
    for (int step = 0; step < 600; ++step) {
        const StepReport report = world.step();
        ASSERT_LT((report.totals.momentum - before.linear).norm(), 1e-5 * before.linear.norm())
            << "step " << step;
        ASSERT_LT((report.totals.angular_momentum - before.angular_momentum).norm(),
                  1e-5 * before.angular_momentum.norm())
            << "step " << step;
        if (step % 100 == 99) {
            const double energy = report.totals.kinetic_energy + report.totals.elastic_energy;
            EXPECT_LT(energy, 1.001 * previous_energy);
            previous_energy = energy;
        }
    }
    EXPECT_EQ(body.validate(), std::vector<std::string>{});
}

// Returns the state hash of a block that falls on the ground while a blade cuts it in two.
std::string hash_of_cutting(int thread_count, StepReport& last) {
    WorldSettings settings = free_space();
    settings.gravity = Vec3(0, 0, -9.81);
    settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.4};
    World world(settings, threads(thread_count));
    BodySettings block = soft(0.014, 250);
    block.angular_velocity = Vec3(0.5, 0.3, -0.4);
    world.add_body(moved(geometry::make_box(Vec3(0.2, 0.16, 0.14)), Vec3(0, 0, 0.12)), block);
    world.add_tool(moving_blade(Vec3(0.01, -0.2, 0), Vec3(-0.01, 0.2, 0.02), Vec3(0.003, 0, 0.3),
                                Vec3(0.02, 0, -0.1), 0.02, 0.5));
    for (int step = 0; step < 45; ++step) last = world.step();
    return world.state_hash().text();
}

TEST(World, SameBitsForAnyNumberOfThreads) {
    StepReport report;
    const std::string one = hash_of_cutting(1, report);
    EXPECT_EQ(report.totals.pieces, 2U);
    EXPECT_GT(report.counts.contacts, 0U);
    EXPECT_GT(report.totals.cut_edges, 50U);
    EXPECT_EQ(hash_of_cutting(1, report), one) << "a second run";
    EXPECT_EQ(hash_of_cutting(2, report), one);
    EXPECT_EQ(hash_of_cutting(3, report), one);
}

TEST(World, StateHashDiffersForDifferentStates) {
    World a(free_space(), threads(1)), b(free_space(), threads(1));
    BodySettings settings = soft(0.03, 60);
    a.add_body(geometry::make_box(Vec3(0.2, 0.16, 0.12)), settings);
    settings.velocity[0] = 1e-12;
    b.add_body(geometry::make_box(Vec3(0.2, 0.16, 0.12)), settings);
    EXPECT_NE(a.state_hash().text(), b.state_hash().text());
    const std::string before = a.state_hash().text();
    a.step();
    EXPECT_NE(a.state_hash().text(), before);
}

// Returns a world with a block that spins in place, its corners at about 0.3 m/s, while twenty blades cut
// through or into it.
std::unique_ptr<World> shredder(std::uint64_t seed, bool validated) {
    Random random(seed);
    WorldSettings settings = free_space();
    settings.validate_each_step = validated;
    auto world = std::make_unique<World>(settings, threads(2));
    BodySettings spinning = soft(0.016, 200);
    spinning.angular_velocity = Vec3(1, -2, 0.5);
    world->add_body(geometry::make_box(Vec3(0.2, 0.18, 0.16)), spinning);
    for (int k = 0; k < 20; ++k) {
        const Vec3 along = random_direction(random);
        const Vec3 across = along.cross(random_direction(random)).normalized();
        const Vec3 through = random_vector(random, 0.06);
        const double half = k % 2 == 0 ? 0.3 : 0.06;
        world->add_tool(moving_blade(-half * along, half * along, through - 0.2 * across,
                                     through + 0.2 * across, 0.02 * k, 0.02 * k + random.uniform(0.05, 0.2),
                                     2));
    }
    return world;
}

TEST(World, MassAndMomentumAreConservedWhileTwentyBladesCut) {
    const std::unique_ptr<World> world = shredder(20, true);
    const meshless::Momenta before = momenta_of(*world);
    StepReport report;
    for (int step = 0; step < 50; ++step) {
        report = world->step();
        ASSERT_NEAR(report.totals.mass, before.mass, 1e-12 * before.mass) << "step " << step;
        ASSERT_LT((report.totals.momentum - before.linear).norm(), 1e-6 * before.mass * 0.3)
            << "step " << step;
    }
    EXPECT_GT(report.totals.pieces, 5U);
    EXPECT_EQ(report.totals.pieces, world->bodies()[0]->pieces().count());
}

struct Shredded {
    std::uint64_t seed;
    std::size_t strays = 0;                   // phyxels that moved to a piece that existed before the step
    double first_energy = 0, max_energy = 0;  // J, after the first step; maximum over all steps
    double max_kinetic = 0;                   // J, maximum over all steps
    int step = 0;                             // of max_energy
};

// Runs the worlds once, for the two tests that follow.
const std::vector<Shredded>& shredded() {
    static const std::vector<Shredded> all = [] {
        std::vector<Shredded> out;
        for (const std::uint64_t seed : {1, 2, 6, 7, 9, 11}) {
            const std::unique_ptr<World> world = shredder(seed, false);
            const Body& body = *world->bodies()[0];
            Shredded& one = out.emplace_back(Shredded{seed});
            for (int step = 0; step < 40; ++step) {
                const std::vector<std::int32_t> before = body.phyxels().piece;
                const auto known = static_cast<std::int32_t>(body.pieces().count());
                const StepReport report = world->step();
                for (std::size_t i = 0; i < before.size(); ++i) {
                    const std::int32_t now = body.phyxels().piece[i];
                    one.strays += now != before[i] && now < known;
                }
                const double energy = report.totals.kinetic_energy + report.totals.elastic_energy;
                if (step == 0) one.first_energy = energy;
                if (energy > one.max_energy) one.step = step;
                one.max_energy = std::max(one.max_energy, energy);
                one.max_kinetic = std::max(one.max_kinetic, report.totals.kinetic_energy);
            }
        }
        return out;
    }();
    return all;
}

TEST(World, MaterialNeverMovesToAPieceThatSeparatedEarlier) {
    // A phyxel stays in its piece or moves to a fragment that splits off in this step. Any other piece has
    // moved away.
    for (const Shredded& one : shredded()) EXPECT_EQ(one.strays, 0U) << "seed " << one.seed;
}

TEST(World, CuttingAddsNoEnergy) {
    // Relumped mass moves slightly inwards, by which a spinning body gains a little energy.
    for (const Shredded& one : shredded()) {
        EXPECT_LT(one.max_kinetic, 1.05 * one.first_energy) << "seed " << one.seed;
        EXPECT_LT(one.max_energy, 1.06 * one.first_energy) << "seed " << one.seed << ", step " << one.step;
    }
}

TEST(World, SmallPiecesOfASpinningBodyAreHardlyFasterThanIt) {
    // Corners of one or few nodes, with few phyxels. Angular momentum that such a piece cannot take up must
    // not become linear speed.
    Random random(21);
    for (int trial = 0; trial < 24; ++trial) {
        const double depth = 1.2 + trial % 4;
        World world(free_space(), threads(2));
        BodySettings spinning = soft(0.0141, 150);
        spinning.angular_velocity = 5 * random_direction(random);
        const Vec3 center = random_vector(random, 0.1);
        Body& body = world.add_body(moved(geometry::make_box(Vec3(0.2, 0.18, 0.16)), center), spinning);
        const Vec3 corner = Vec3(0.1, 0.09, 0.08);
        const Vec3 normal = Vec3(1, 1.02, 0.98).normalized();
        const double top = spinning.angular_velocity.norm() * corner.norm();
        body.cut_with_sheet(geometry::make_plane_sheet(center + corner - depth * 0.0141 * normal, normal, 1),
                            0, world.parallel());
        ASSERT_EQ(body.pieces().count(), 2U) << "depth " << depth;
        const std::size_t nodes = body.pieces().node_counts()[1];
        for (const Vec3& v : body.phyxels().velocity)
            ASSERT_LT(v.norm(), 3 * top) << "trial " << trial << ", a piece of " << nodes << " nodes";
        for (int step = 0; step < 10; ++step)
            ASSERT_LT(world.step().totals.top_speed, 3 * top)
                << "trial " << trial << ", a piece of " << nodes << " nodes, step " << step;
    }
}

TEST(World, MomentumIsConservedWhenPiecesSeparateInFreeFlight) {
    WorldSettings settings = free_space();
    World world(settings, threads(2));
    BodySettings flying = soft(0.014, 250);
    flying.velocity = Vec3(0.4, 0.1, -0.2);
    flying.angular_velocity = Vec3(2, -1, 3);
    Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.16, 0.14)), flying);
    world.add_tool(moving_blade(Vec3(0, -0.3, 0), Vec3(0, 0.3, 0.05), Vec3(0.03, 0, 0.3), Vec3(0.06, 0, -0.3),
                                0.05, 0.4, 3));
    const meshless::Momenta before = momenta_of(world);
    const Vec3 angular_momentum_before = meshless::total_momenta(body.phyxels()).angular_momentum;
    std::size_t max_pieces = 1;
    for (int step = 0; step < 60; ++step) {
        const StepReport report = world.step();
        max_pieces = std::max(max_pieces, report.totals.pieces);
        ASSERT_LT((report.totals.momentum - before.linear).norm(), 1e-6 * before.linear.norm())
            << "step " << step;
        // About the centre of mass, which itself moves slightly when mass is relumped.
        const Vec3 angular_momentum = meshless::total_momenta(body.phyxels()).angular_momentum;
        ASSERT_LT((angular_momentum - angular_momentum_before).norm(), 1e-5 * angular_momentum_before.norm())
            << "step " << step;
    }
    EXPECT_GE(max_pieces, 2U);
    // The pieces separate, because they continue along the tangents of their rotation.
    std::vector<meshless::Momenta> pieces;
    meshless::momenta_of_pieces(body.phyxels(), static_cast<int>(body.pieces().count()), pieces);
    EXPECT_GT((pieces[0].linear / pieces[0].mass - pieces[1].linear / pieces[1].mass).norm(), 0.05);
}

TEST(World, MomentumGrowsByGravityOnly) {
    WorldSettings settings = free_space();
    settings.gravity = Vec3(0, 0, -9.81);
    World world(settings, threads(2));
    BodySettings block = soft(0.016, 150);
    block.velocity = Vec3(0.5, 0, 2);
    world.add_body(geometry::make_sphere(0.1, 3), block);
    world.add_tool(moving_blade(Vec3(0, -0.3, 0), Vec3(0, 0.3, 0), Vec3(-0.3, 0, 0.02), Vec3(0.4, 0, 0.1),
                                0.02, 0.15, 1));
    const meshless::Momenta before = momenta_of(world);
    StepReport report;
    for (int step = 0; step < 30; ++step) {
        report = world.step();
        const Vec3 expected = before.linear + before.mass * world.time() * settings.gravity;
        ASSERT_LT((report.totals.momentum - expected).norm(), 1e-6 * before.mass * 5) << "step " << step;
    }
    EXPECT_EQ(report.totals.pieces, 2U);
}

TEST(World, ToolsCutOnlyTheirBodies) {
    World world(free_space(), threads(2));
    world.add_body(geometry::make_box(Vec3::Constant(0.1)), soft(0.015, 60));
    world.add_body(moved(geometry::make_box(Vec3::Constant(0.1)), Vec3(0.2, 0, 0)), soft(0.015, 60));
    world.add_tool(
        moving_blade(Vec3(-0.1, -0.1, 0), Vec3(0.3, 0.1, 0), Vec3(0, 0, 0.1), Vec3(0, 0, -0.1), 0.01, 0.1),
        {1});
    for (int step = 0; step < 10; ++step) world.step();
    EXPECT_EQ(world.bodies()[0]->cut_edge_count(), 0U);
    EXPECT_EQ(world.bodies()[0]->pieces().count(), 1U);
    EXPECT_EQ(world.bodies()[1]->pieces().count(), 2U);
    const geometry::SurfaceMesh all = world.surface_mesh();
    EXPECT_EQ(*std::max_element(all.vertex_piece.begin(), all.vertex_piece.end()), 2);
}

TEST(World, AStandingBladeCutsABodyThatFallsOnIt) {
    WorldSettings settings = free_space();
    settings.gravity = Vec3(0, 0, -9.81);
    World world(settings, threads(2));
    Body& body = world.add_body(geometry::make_box(Vec3::Constant(0.1)), soft(0.012, 120));
    cutting::BladeOptions always;
    always.active_from = 0;
    always.active_until = 10;
    world.add_tool(cutting::Blade("wire",
                                  cutting::make_straight_blade({0.004, -0.2, -0.2}, {0.004, 0.2, -0.2}),
                                  {{0, Vec3::Zero(), Quat::Identity()}}, always));
    for (int step = 0; step < 24; ++step) world.step();
    ASSERT_EQ(body.pieces().count(), 2U);
    for (const double share : piece_shares(body.pieces())) EXPECT_GT(share, 0.4);
}

TEST(World, ABodyRestsOnTheGround) {
    WorldSettings settings = free_space();
    settings.gravity = Vec3(0, 0, -9.81);
    settings.ground = meshless::GroundPlane{Vec3::UnitZ(), -0.2, 0.5};
    World world(settings, threads(2));
    BodySettings block = soft(0.015, 150);
    block.material.mass_damping = 5;
    Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.16, 0.14)), block);
    StepReport report;
    for (int step = 0; step < 240; ++step) report = world.step();
    EXPECT_LT(report.totals.top_speed, 0.01);
    EXPECT_GT(report.counts.contacts, 4U);
    double lowest = 1e300;
    for (const Vec3& p : body.surface_mesh().mesh.positions) lowest = std::min(lowest, p[2]);
    EXPECT_NEAR(lowest, -0.2, 0.2 * body.phyxel_spacing());
}

TEST(World, HeldMaterialFollowsItsPath) {
    World world(free_space(), threads(2));
    Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.1, 0.1)), soft(0.012, 150));
    HoldConstraint turning = hold_beyond({0.05, 0, 0}, Vec3::UnitX());
    turning.motion = [](double time) {
        Isometry out(Eigen::AngleAxisd(2 * time, Vec3::UnitX()));
        out.pretranslate(Vec3(0.1 * time, 0, 0));
        return out;
    };
    turning.until = 0.3;
    body.add_constraint(hold_beyond({-0.05, 0, 0}, -Vec3::UnitX()));
    body.add_constraint(turning);
    while (world.time() < 0.29) world.step();
    const Isometry where = turning.motion(world.time());
    for (std::size_t i = 0; i < body.phyxels().size(); ++i) {
        const Vec3& rest = body.phyxels().rest_position[i];
        if (std::abs(rest[0]) < 0.05) continue;
        const Vec3 expected = rest[0] > 0 ? Vec3(where * rest) : rest;
        ASSERT_LT((body.phyxels().position[i] - expected).norm(), 1e-12);
    }
    // It springs back after the release.
    const auto mean_x = [&] {
        double sum = 0;
        for (const Vec3& p : body.phyxels().position)
            sum += p[0] / static_cast<double>(body.phyxels().size());
        return sum;
    };
    const double stretched = mean_x();
    for (int step = 0; step < 6; ++step) world.step();
    EXPECT_LT(mean_x(), stretched - 1e-3);
}

TEST(World, RefusesATimeStepThatIsNotPositive) {
    for (const double dt : {0.0, -0.1, std::numeric_limits<double>::quiet_NaN()})
        EXPECT_THROW(World(free_space(dt), threads(1)), InputError);
}

}  // namespace
}  // namespace splitcubes::body
