// The public interface as a program uses it: add, cut, read.
#include "api/scenes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace splitcubes::api_tests {
namespace {

TEST(Simulation, ABladeCutsABlockInTwoAndFeelsIt) {
    Simulation simulation(in_free_space());
    const BodyId block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    const ToolId knife =
        simulation.add_tool({edge_along_y}, {.name = "knife", .pose = {{0.003, 0, 0.2}, {}}});
    simulation.lower_tool(knife);
    std::size_t began = 0, separated = 0;
    double work = 0, lift = 0;
    cut_through(simulation, knife, 0.003, 20, [&](const StepResult& result) {
        for (const CutBegan& event : result.cuts_began) {
            EXPECT_EQ(event.tool, knife);
            EXPECT_EQ(event.body, block);
            ++began;
        }
        for (const PieceSeparated& event : result.pieces_separated) {
            EXPECT_EQ(event.body, block);
            EXPECT_EQ(event.parent, 0);
            ++separated;
        }
        ASSERT_EQ(result.tools.size(), 1U);
        work += result.tools[0].cut_work;
        lift = std::max(lift, result.tools[0].force.z);
    });
    EXPECT_EQ(began, 1U);
    EXPECT_EQ(separated, simulation.piece_count(block) - 1);
    EXPECT_GE(simulation.piece_count(block), 2U);
    EXPECT_NEAR(work, 20 * 0.2 * 0.2, 0.3 * 20 * 0.2 * 0.2);
    EXPECT_GT(lift, 0) << "a knife that goes down is pushed up";
}

TEST(Simulation, ARaisedToolMovesWithoutCutting) {
    Simulation simulation(in_free_space());
    const BodyId block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    const ToolId knife = simulation.add_tool({edge_along_y}, {.pose = {{0.003, 0, 0.2}, {}}});
    EXPECT_FALSE(simulation.is_lowered(knife));
    cut_through(simulation, knife, 0.003, 10);
    EXPECT_EQ(simulation.piece_count(block), 1U);
    simulation.add_tool_pose(knife, simulation.time() + simulation.time_step(), {{0.003, 0, 0.2}, {}});
    simulation.step();
    simulation.lower_tool(knife);
    EXPECT_TRUE(simulation.is_lowered(knife));
    cut_through(simulation, knife, 0.003, 10);
    EXPECT_GE(simulation.piece_count(block), 2U);
}

TEST(Simulation, OneThatIsRaisedHalfWayLeavesHalfACut) {
    Simulation simulation(in_free_space());
    const BodyId block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    const ToolId knife = simulation.add_tool({edge_along_y}, {.pose = {{0.003, 0, 0.2}, {}}});
    simulation.lower_tool(knife);
    int step = 0;
    double area = 0;
    cut_through(simulation, knife, 0.003, 20, [&](const StepResult& result) {
        if (++step == 10) simulation.raise_tool(knife);
        for (const ToolResult& tool : result.tools) area += tool.cut_area;
    });
    EXPECT_EQ(simulation.piece_count(block), 1U);
    EXPECT_NEAR(area, 0.02, 0.006);
}

TEST(Simulation, PosesBetweenStepsAreTheStrokeNotItsEnds) {
    // Round the block's corner within one step: the straight path between the ends would cut it.
    Simulation simulation(in_free_space());
    const BodyId block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    const ToolId knife = simulation.add_tool({edge_along_y}, {.pose = {{-0.2, 0, 0}, {}}});
    simulation.lower_tool(knife);
    const double dt = simulation.time_step();
    int sample = 0;
    for (const Vector3& at :
         {Vector3{-0.2, 0, 0.2}, Vector3{0, 0, 0.3}, Vector3{0.2, 0, 0.2}, Vector3{0.2, 0, 0}})
        simulation.add_tool_pose(knife, ++sample * dt / 4, {at, {}});
    simulation.step();
    const StepResult result = simulation.step();
    EXPECT_EQ(result.new_cut_edges, 0U);
    EXPECT_EQ(simulation.piece_count(block), 1U);
}

TEST(Simulation, AToolThatWasNotMovedStoodStill) {
    // A pose after a pause must not make a slow stroke of the pause.
    Simulation simulation(in_free_space());
    simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    const ToolId knife = simulation.add_tool({edge_along_y}, {.pose = {{0.003, 0, 0.2}, {}}});
    simulation.lower_tool(knife);
    for (int k = 0; k < 5; ++k) simulation.step();
    simulation.add_tool_pose(knife, simulation.time() + 0.5 * simulation.time_step(), {{0.003, 0, -0.2}, {}});
    EXPECT_EQ(simulation.step().new_cut_edges, 0U) << "what is swept in this step is cut in the next";
    EXPECT_GT(simulation.step().new_cut_edges, 50U);
}

TEST(Simulation, CutsAtRestBySheetsAndBlades) {
    Simulation simulation(in_free_space());
    const BodyId block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    EXPECT_GT(simulation.cut_with_sheet(block, SheetMesh(0.3, 0.004).view()), 50U);
    EXPECT_EQ(simulation.piece_count(block), 2U);
    const std::array<Vector3, 2> edge{Vector3{-0.3, 0, 0}, Vector3{0.3, 0, 0}};
    const std::array<TimedPose, 2> path{TimedPose{0, {{0, 0.003, 0.3}, {}}},
                                        TimedPose{1, {{0, 0.003, -0.3}, {}}}};
    EXPECT_GT(simulation.cut_with_blade(block, {edge}, path), 50U);
    EXPECT_EQ(simulation.piece_count(block), 4U);
    EXPECT_EQ(simulation.time(), 0);
    simulation.step();
}

TEST(Simulation, SurfaceIsClosedAndItsPiecesAreThoseOfTheBody) {
    Simulation simulation(in_free_space());
    const BodyId block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    simulation.cut_with_sheet(block, SheetMesh(0.3, 0.004).view());
    simulation.step();
    const SurfaceView surface = simulation.surface(block);
    std::set<std::int32_t> pieces;
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    double volume = 0;
    for (std::size_t t = 0; t < surface.triangle_slots(); ++t) {
        const std::uint32_t* v = &surface.triangles[3 * t];
        if (v[0] == v[1]) continue;
        pieces.insert(surface.pieces[v[0]]);
        const auto at = [&](int k, int axis) {
            return double{surface.positions[3 * v[k] + static_cast<unsigned>(axis)]};
        };
        for (int k = 0; k < 3; ++k) {
            EXPECT_TRUE(edges.insert({v[k], v[(k + 1) % 3]}).second);
            const int l = (k + 1) % 3, m = (k + 2) % 3;
            volume += at(0, k) * (at(1, l) * at(2, m) - at(1, m) * at(2, l)) / 6;
        }
    }
    for (const auto& [a, b] : edges) EXPECT_TRUE(edges.contains({b, a}));
    EXPECT_EQ(pieces, (std::set<std::int32_t>{0, 1}));
    EXPECT_NEAR(volume, 0.008, 2e-4);
}

TEST(Simulation, ForAnyNumberOfThreadsTheSame) {
    std::set<std::uint64_t> hashes;
    for (const int threads : {1, 3}) {
        SimulationSettings settings = in_free_space();
        settings.thread_count = threads;
        settings.contact.pieces = true;
        Simulation simulation(settings);
        simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
        const ToolId knife = simulation.add_tool({edge_along_y}, {.pose = {{0.003, 0, 0.2}, {}}});
        simulation.lower_tool(knife);
        cut_through(simulation, knife, 0.003, 8);
        hashes.insert(simulation.state_hash());
    }
    EXPECT_EQ(hashes.size(), 1U);
}

}  // namespace
}  // namespace splitcubes::api_tests
