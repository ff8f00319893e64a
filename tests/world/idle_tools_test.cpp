// Diagnosis of idle tools in simple worlds.
#include <splitcubes/body/body.h>
#include <splitcubes/node_motion/rest_cut.h>
#include <splitcubes/world/idle_tools.h>

#include "laws/worlds.h"

#include <gtest/gtest.h>
#include <splitcubes/splitting/sheet_cut.h>

namespace splitcubes::body {
namespace {

using namespace laws;

// Block of 0.2 x 0.16 x 0.14 m around the origin, with cells of about 14 mm.
struct Scene {
    World world{free_space(), threads(2)};

    explicit Scene(const Vec3& velocity = Vec3::Zero()) {
        BodySettings settings = soft(0.2 / 14, 200);
        settings.velocity = velocity;
        world.add_body(geometry::make_box(Vec3(0.2, 0.16, 0.14)), settings);
    }
    // Blade edge along y that moves from above to below within a tenth of a second.
    void add(double x, double t0 = 0, const Vec3& up = Vec3(0, 0, 0.2)) {
        world.add_tool(moving_blade(Vec3(x, -0.3, 0), Vec3(x, 0.3, 0), up, -up, t0, t0 + 0.1));
    }
    std::vector<IdleTool> after(int steps) {
        IdleTools tools(world);
        for (int k = 0; k < steps; ++k) {
            const StepReport report = world.step();
            tools.observe(world, report);
        }
        return tools.idle(world);
    }
};

TEST(IdleTools, AToolThatCutsIsNotIdle) {
    Scene scene;
    scene.add(0.01);
    EXPECT_TRUE(scene.after(12).empty());
    EXPECT_TRUE(IdleTools(scene.world).idle(scene.world).empty()) << "by its marks alone";
}

TEST(IdleTools, AToolThatMissesReportsBothBoxes) {
    Scene scene;
    scene.add(0.3);
    const std::vector<IdleTool> idle = scene.after(12);
    ASSERT_EQ(idle.size(), 1U);
    EXPECT_EQ(idle[0].before.cut + idle[0].before.boundary + idle[0].before.uncut, 0U);
    EXPECT_NEAR(idle[0].sweep.min[0], 0.3, 1e-12);
    EXPECT_NEAR(idle[0].sweep.max[2], 0.2, 1e-12);
    EXPECT_NEAR(idle[0].sweep.min[2], -0.2, 1e-12);
    EXPECT_NEAR(idle[0].bounds.max[0], 0.1, 2e-3);
}

TEST(IdleTools, AToolInAnExistingCutReportsCutEdges) {
    Scene scene;
    scene.add(0.01);
    scene.add(0.012, 0.2);
    const std::vector<IdleTool> idle = scene.after(24);
    ASSERT_EQ(idle.size(), 1U);
    EXPECT_EQ(idle[0].tool, 1U);
    EXPECT_EQ(idle[0].before.uncut, 0U);
    EXPECT_GT(idle[0].before.cut, 50U);
}

TEST(IdleTools, AToolWithinACellOfTheSurfaceReportsBoundaryEdges) {
    Scene scene;
    scene.add(0.0985);
    const std::vector<IdleTool> idle = scene.after(12);
    ASSERT_EQ(idle.size(), 1U);
    EXPECT_EQ(idle[0].before.uncut + idle[0].before.cut, 0U);
    EXPECT_GT(idle[0].before.boundary, 50U);
}

TEST(IdleTools, AnInactiveToolSweepsNothing) {
    Scene scene;
    scene.add(0.01, 5);
    const std::vector<IdleTool> idle = scene.after(12);
    ASSERT_EQ(idle.size(), 1U);
    EXPECT_TRUE(idle[0].sweep.empty());
}

TEST(IdleTools, AToolThatArrivesInTheLastStepIsStillIdle) {
    for (int steps = 1; steps < 12; ++steps) {
        Scene scene;
        scene.add(0.01);
        const std::vector<IdleTool> idle = scene.after(steps);
        if (idle.empty()) {
            EXPECT_GT(steps, 1);
            return;
        }
        EXPECT_EQ(idle[0].before.uncut, 0U) << steps;
        Scene one_more;
        one_more.add(0.01);
        EXPECT_EQ(one_more.after(steps + 1).empty(), idle[0].last.uncut > 0) << steps;
    }
    FAIL() << "it never cuts";
}

TEST(IdleTools, FollowsAMovingBody) {
    // The same cut twice, while the body moves along; and a blade from which it moves away.
    Scene scene(Vec3(1, 0, 0));
    for (const double t0 : {0.0, 0.2}) {
        const Vec3 begin(t0, 0, 0.2), end(t0 + 0.1, 0, -0.2);
        scene.world.add_tool(moving_blade(Vec3(0.01, -0.3, 0), Vec3(0.01, 0.3, 0), begin, end, t0, t0 + 0.1));
    }
    scene.add(-0.15, 0.3);
    const std::vector<IdleTool> idle = scene.after(30);
    ASSERT_EQ(idle.size(), 2U);
    EXPECT_EQ(idle[0].tool, 1U);
    EXPECT_EQ(idle[0].before.uncut, 0U);
    EXPECT_GT(idle[0].before.cut, 50U);
    EXPECT_EQ(idle[1].before.cut + idle[1].before.boundary + idle[1].before.uncut, 0U);
    EXPECT_GT(idle[1].bounds.max[0], 0.4) << "where it was meanwhile";
}

TEST(IdleTools, ObservingDoesNotChangeTheWorld) {
    Scene watched, alone;
    for (Scene* scene : {&watched, &alone}) {
        scene->add(0.01, 0.05);
        scene->add(0.3);
    }
    watched.after(12);
    for (int k = 0; k < 12; ++k) alone.world.step();
    EXPECT_EQ(watched.world.state_hash().text(), alone.world.state_hash().text());
}

TEST(CrossedEdges, AreEqualForASheetAndTheBladeThatSweepsIt) {
    Body body(geometry::make_box(Vec3(0.2, 0.16, 0.14)), soft(0.2 / 14, 50), *threads(2));
    splitting::NodeGrid grid = body.grid();
    const geometry::TriangleMesh half{
        {{0.013, -0.3, 0.3}, {0.013, 0.3, 0.3}, {0.013, -0.3, 0.01}, {0.013, 0.3, 0.01}},
        {{0, 1, 2}, {1, 3, 2}}};
    const geometry::TriangleMesh whole{
        {{0.013, -0.3, 0.3}, {0.013, 0.3, 0.3}, {0.013, -0.3, -0.3}, {0.013, 0.3, -0.3}},
        {{0, 1, 2}, {1, 3, 2}}};
    const std::size_t cut = splitting::cut_with_sheet(grid, half, 0).size();
    const cutting::Blade blade =
        moving_blade(Vec3(0.013, -0.3, 0), Vec3(0.013, 0.3, 0), Vec3(0, 0, 0.3), Vec3(0, 0, -0.3), 0, 1);
    for (const splitting::CrossedEdges& crossed :
         {splitting::edges_crossed_by_sheet(grid, whole), edges_crossed_by_blade(grid, blade, *threads(2))}) {
        EXPECT_EQ(crossed.cut, cut);
        EXPECT_GT(crossed.uncut, cut / 2);
        EXPECT_EQ(crossed.boundary, 0U) << "the plane lies along edges of neither side";
    }
    EXPECT_EQ(splitting::edges_crossed_by_sheet(grid, half).cut, cut);
    EXPECT_EQ(splitting::edges_crossed_by_sheet(grid, half).uncut, 0U);
}

}  // namespace
}  // namespace splitcubes::body
