// A blade that passes all the way through a body leaves no ligament, however both move.
#include "laws/solids.h"
#include "laws/worlds.h"

#include <gtest/gtest.h>
#include <splitcubes/body/body.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/world/world.h>

#include <algorithm>
#include <string>
#include <vector>

namespace splitcubes::body {
namespace {

using namespace laws;

struct Passage {
    double time_step = 1.0 / 60;
    double duration = 0.2;  // s, of the blade's passage
    int subdivisions = 1;   // of edge and path
    bool falls = false;
    Vec3 turning = Vec3::Zero();  // rad/s
};

std::string text_of(const Passage& p) {
    return "step " + std::to_string(p.time_step) + " s, through in " + std::to_string(p.duration) + " s, " +
           std::to_string(p.subdivisions) + " parts" + (p.falls ? ", falling" : "") + ", turning at " +
           std::to_string(p.turning.norm()) + " rad/s";
}

// The blade moves along with the fall, so that it comes out on the other side.
void expect_two_pieces(const Passage& p) {
    SCOPED_TRACE(text_of(p));
    WorldSettings settings = free_space(p.time_step);
    if (p.falls) settings.gravity = Vec3(0, 0, -9.81);
    settings.validate_each_step = false;
    World world(settings, threads(2));
    BodySettings block = soft(0.014, 180);
    block.angular_velocity = p.turning;
    Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.16, 0.14)), block);
    const double start = 0.04;
    const double middle = start + 0.5 * p.duration;
    const double fallen = p.falls ? 0.5 * 9.81 * middle * middle : 0;
    world.add_tool(moving_blade(Vec3(0, 0, -1), Vec3(0.02, 0, 1), Vec3(0.006, -0.3, -fallen),
                                Vec3(-0.013, 0.3, -fallen), start, start + p.duration, p.subdivisions));
    while (world.time() < start + p.duration + 3 * p.time_step) world.step();
    EXPECT_EQ(body.pieces().count(), 2U);
    for (const double share : piece_shares(body.pieces())) EXPECT_GT(share, 0.2);
    ASSERT_EQ(body.validate(), std::vector<std::string>{});
    const geometry::SurfaceMesh mesh = body.surface_mesh();
    for (std::size_t piece = 0; piece < body.pieces().count(); ++piece)
        EXPECT_TRUE(
            geometry::check_mesh(splitting::extract_piece(mesh, static_cast<std::int32_t>(piece)).mesh)
                .valid());
    for (const Vec3& position : mesh.mesh.positions) ASSERT_TRUE(position.allFinite());
}

TEST(Severing, SeparatesAtAnySpeedAndTimeStep) {
    for (const double time_step : {1.0 / 30, 1.0 / 60, 1.0 / 240})
        for (const double duration : {0.02, 0.1, 0.5})
            expect_two_pieces({.time_step = time_step, .duration = duration});
}

TEST(Severing, SeparatesForAnySubdivisionOfTheBlade) {
    for (const int subdivisions : {1, 2, 3, 7, 16, 50}) {
        expect_two_pieces({.subdivisions = subdivisions});
        expect_two_pieces({.duration = 0.08, .subdivisions = subdivisions, .falls = true});
    }
}

TEST(Severing, SeparatesAFallingBody) {
    for (const double time_step : {1.0 / 30, 1.0 / 60, 1.0 / 240})
        for (const double duration : {0.03, 0.1, 0.4})
            expect_two_pieces({.time_step = time_step, .duration = duration, .falls = true});
}

TEST(Severing, SeparatesARotatingBody) {
    for (const double time_step : {1.0 / 60, 1.0 / 240})
        for (const double duration : {0.03, 0.1, 0.25})
            for (const Vec3& turning : {Vec3(3, 0, 0), Vec3(0, 3, 0), Vec3(0, 0, 3), Vec3(2, -2, 2)})
                expect_two_pieces({.time_step = time_step,
                                   .duration = duration,
                                   .subdivisions = 2,
                                   .falls = true,
                                   .turning = turning});
}

TEST(Severing, SeparatesAlongACircularPath) {
    // A wire on a closed circle cuts out a core.
    for (const double time_step : {1.0 / 60, 1.0 / 240})
        for (const int keyframes : {16, 64}) {
            WorldSettings settings = free_space(time_step);
            settings.validate_each_step = false;
            World world(settings, threads(2));
            Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.2, 0.1)), soft(0.0125, 250));
            world.add_tool(cutting::Blade("wire", cutting::make_straight_blade({0, 0, -0.2}, {0, 0, 0.2}),
                                          cutting::circular_path(Vec3::Zero(), Vec3::UnitZ(), 0.06, 0, 1.03,
                                                                 0.02, 0.5, true, keyframes)));
            while (world.time() < 0.55) world.step();
            ASSERT_EQ(body.validate(), std::vector<std::string>{});
            ASSERT_EQ(body.pieces().count(), 2U) << time_step << ", " << keyframes;
            const std::vector<double> shares = piece_shares(body.pieces());
            EXPECT_NEAR(*std::min_element(shares.begin(), shares.end()), 3.14159 * 0.06 * 0.06 / 0.04, 0.03);
        }
}

TEST(Severing, SeparatesByTwoBladesAtOnce) {
    WorldSettings settings = free_space();
    World world(settings, threads(2));
    BodySettings block = soft(0.014, 200);
    block.angular_velocity = Vec3(0.4, 0.6, -0.5);
    Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.16, 0.14)), block);
    world.add_tool(
        moving_blade(Vec3(0, 0, -1), Vec3(0, 0, 1), Vec3(0.03, -0.3, 0), Vec3(0.03, 0.3, 0), 0.02, 0.2));
    world.add_tool(
        moving_blade(Vec3(0, 0, -1), Vec3(0, 0, 1), Vec3(-0.03, 0.3, 0), Vec3(-0.03, -0.3, 0), 0.02, 0.25));
    for (int step = 0; step < 18; ++step) world.step();
    EXPECT_EQ(body.pieces().count(), 3U);
    for (const double share : piece_shares(body.pieces())) EXPECT_GT(share, 0.2);
}

TEST(Severing, ABladeThatStopsHalfwayLeavesALigament) {
    World world(free_space(), threads(2));
    Body& body = world.add_body(geometry::make_box(Vec3(0.2, 0.16, 0.14)), soft(0.014, 200));
    world.add_tool(moving_blade(Vec3(0, 0, -1), Vec3(0, 0, 1), Vec3(0, -0.3, 0), Vec3::Zero(), 0.02, 0.2));
    for (int step = 0; step < 20; ++step) world.step();
    EXPECT_EQ(body.pieces().count(), 1U);
    EXPECT_GT(body.cut_edge_count(), 30U);
    // Half of a grid plane of 14 by 11 by 10 nodes.
    EXPECT_LT(body.cut_edge_count(), 80U);
}

}  // namespace
}  // namespace splitcubes::body
