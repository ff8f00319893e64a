// Handles, constraints, colliders, and what is left when something is removed.
#include "api/scenes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace splitcubes::api_tests {
namespace {

// m, mean of a body's vertices.
double mean_height(const Simulation& simulation, BodyId body) {
    const SurfaceView surface = simulation.surface(body);
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t v = 0; v < surface.vertex_slots(); ++v) {
        if (surface.pieces[v] < 0) continue;
        sum += surface.positions[3 * v + 2];
        ++count;
    }
    return sum / static_cast<double>(count);
}

void run_steps(Simulation& simulation, int steps) {
    for (int k = 0; k < steps; ++k) simulation.step();
}

BodySettings at(double x, double z) {
    BodySettings out = soft_block();
    out.placement.position = {x, 0, z};
    return out;
}

SimulationSettings on_earth() {
    SimulationSettings out;
    out.thread_count = 2;
    return out;
}

TEST(Things, AConstraintHoldsUntilItIsRemovedAndMovesAsItsPosesSay) {
    Simulation simulation(on_earth());
    const BodyId block = simulation.add_body(BoxMesh(0.1, 0.1, 0.1).view(), soft_block());
    const ConstraintId hold =
        simulation.add_constraint(block, {.region = BoxRegion{{-1, -1, -1}, {1, 1, 1}}});
    run_steps(simulation, 10);
    EXPECT_NEAR(mean_height(simulation, block), 0, 1e-6);
    for (int k = 1; k <= 6; ++k)
        simulation.add_constraint_pose(hold, simulation.time() + k * simulation.time_step(),
                                       {{0, 0, 0.01 * k}, {}});
    run_steps(simulation, 6);
    EXPECT_NEAR(mean_height(simulation, block), 0.06, 1e-4);
    simulation.remove_constraint(hold);
    run_steps(simulation, 20);
    EXPECT_LT(mean_height(simulation, block), 0);
}

TEST(Things, AHandlePullsAndItsForceIsReported) {
    Simulation simulation(on_earth());
    const BodyId block = simulation.add_body(BoxMesh(0.1, 0.1, 0.1).view(), soft_block());
    const HandleId other =
        simulation.add_handle(block, {.region = SphereRegion{{}, 0.03}, .stiffness = 1e-3});
    const HandleId handle = simulation.add_handle(block, {.region = BoxRegion{{-1, -1, -1}, {1, 1, 1}}});
    simulation.remove_handle(other);
    run_steps(simulation, 300);
    const StepResult result = simulation.step();
    ASSERT_EQ(result.handles.size(), 1U);
    EXPECT_EQ(result.handles[0].handle, handle);
    EXPECT_NEAR(result.handles[0].force.z, 9.81, 1) << "a kilogram hangs from it";
    simulation.remove_handle(handle);
    EXPECT_TRUE(simulation.step().handles.empty());
}

TEST(Things, ColliderBearsAndCarriesAndIsRemoved) {
    for (const ColliderShape& shape :
         {ColliderShape(HalfSpaceShape{{0, 0, 2}, 0}), ColliderShape(BoxShape{{1, 1, 0.2}, 0.01})}) {
        Simulation simulation(on_earth());
        const double top = std::holds_alternative<BoxShape>(shape) ? 0.1 : 0;
        const ColliderId under =
            simulation.add_collider({.shape = HalfSpaceShape{{0, 0, 1}, -10}, .pose = {{0, 0, 0}, {}}});
        const ColliderId table = simulation.add_collider({.shape = shape});
        const BodyId block = simulation.add_body(BoxMesh(0.1, 0.1, 0.1).view(), at(0, top + 0.052));
        run_steps(simulation, 60);
        EXPECT_NEAR(mean_height(simulation, block), top + 0.05, 0.012);
        simulation.remove_collider(under);
        run_steps(simulation, 5);
        EXPECT_NEAR(mean_height(simulation, block), top + 0.05, 0.012);
        simulation.remove_collider(table);
        run_steps(simulation, 40);
        EXPECT_LT(mean_height(simulation, block), top - 1);
    }
}

TEST(Events, ABarThatIsPulledApartTears) {
    Simulation simulation(in_free_space());
    BodySettings bar = soft_block();
    bar.tearing = TearingSettings{.strength = 4e3};
    const BodyId body = simulation.add_body(BoxMesh(0.3, 0.06, 0.06).view(), bar);
    simulation.add_constraint(body, {.region = BoxRegion{{-1, -1, -1}, {-0.12, 1, 1}}});
    const ConstraintId pulled =
        simulation.add_constraint(body, {.region = BoxRegion{{0.12, -1, -1}, {1, 1, 1}}});
    simulation.add_constraint_pose(pulled, 1, {{0.3, 0, 0}, {}});
    std::size_t torn = 0, separated = 0, edges = 0;
    for (int k = 0; k < 60 && separated == 0; ++k) {
        const StepResult result = simulation.step();
        for (const Torn& event : result.torn) {
            EXPECT_EQ(event.body, body);
            torn += event.edges;
        }
        edges += result.new_cut_edges;
        separated += result.pieces_separated.size();
        EXPECT_TRUE(result.cuts_began.empty());
    }
    EXPECT_GT(torn, 5U);
    EXPECT_EQ(torn, edges);
    EXPECT_GE(separated, 1U);
}

TEST(Events, APieceThatIsTooSmallToDeformBecomesRigid) {
    Simulation simulation(in_free_space());
    const BodyId block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    simulation.cut_with_sheet(block, SheetMesh(0.3, 0.064).view());
    const std::array<Vector3, 2> edge{Vector3{-0.3, 0, 0}, Vector3{0.3, 0, 0}};
    const std::array<TimedPose, 2> path{TimedPose{0, {{0, 0.064, 0.3}, {}}},
                                        TimedPose{1, {{0, 0.064, -0.3}, {}}}};
    simulation.cut_with_blade(block, {edge}, path);
    const ToolId knife = simulation.add_tool({edge_along_y}, {.pose = {{0.2, 0, 0.064}, {}}});
    simulation.lower_tool(knife);
    std::vector<std::int32_t> separated, rigid;
    for (int k = 1; k <= 10; ++k) {
        simulation.add_tool_pose(knife, simulation.time() + simulation.time_step(),
                                 {{0.2 - 0.04 * k, 0, 0.064}, {}});
        const StepResult result = simulation.step();
        for (const PieceSeparated& event : result.pieces_separated) separated.push_back(event.piece);
        for (const FragmentMadeRigid& event : result.made_rigid) rigid.push_back(event.piece);
    }
    ASSERT_GE(rigid.size(), 1U);
    EXPECT_LT(rigid.size(), separated.size()) << "the others still deform";
    for (const std::int32_t piece : rigid) EXPECT_THAT(separated, testing::Contains(piece));
}

TEST(Removal, OfABodyLeavesTheOthersAsTheyWere) {
    // Beside each other, so that they do not meet: what is left goes on as if it had been alone.
    const auto position_after = [](bool with_others) {
        Simulation simulation(on_earth());
        BodyId first, last;
        simulation.add_collider({.shape = HalfSpaceShape{{0, 0, 1}, -0.052}});
        if (with_others) first = simulation.add_body(BoxMesh(0.1, 0.1, 0.1).view(), at(1, 0));
        const BodyId block = simulation.add_body(BoxMesh(0.1, 0.1, 0.1).view(), soft_block());
        if (with_others) last = simulation.add_body(BoxMesh(0.1, 0.1, 0.1).view(), at(2, 0));
        simulation.add_tool({edge_along_y}, {.pose = {{0, 0, 0.2}, {}}, .bodies = {block}});
        run_steps(simulation, 10);
        if (with_others) simulation.remove_body(first);
        run_steps(simulation, 10);
        if (with_others) simulation.remove_body(last);
        run_steps(simulation, 10);
        EXPECT_EQ(simulation.bodies(), std::vector{block});
        const auto positions = simulation.surface(block).positions;
        return std::vector<float>(positions.begin(), positions.end());
    };
    EXPECT_EQ(position_after(true), position_after(false));
}

TEST(Removal, ToolsOfARemovedBodyCutNoOther) {
    Simulation simulation(in_free_space());
    const BodyId gone = simulation.add_body(BoxMesh(0.1, 0.1, 0.1).view(), at(5, 0));
    const BodyId block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    const ToolId of_gone =
        simulation.add_tool({edge_along_y}, {.pose = {{0.003, 0, 0.2}, {}}, .bodies = {gone}});
    const ToolId of_block =
        simulation.add_tool({edge_along_y}, {.pose = {{0.003, 0, 0.2}, {}}, .bodies = {block}});
    simulation.remove_body(gone);
    simulation.lower_tool(of_gone);
    cut_through(simulation, of_gone, 0.003, 6);
    EXPECT_EQ(simulation.piece_count(block), 1U);
    simulation.lower_tool(of_block);
    cut_through(simulation, of_block, 0.003, 6);
    EXPECT_GE(simulation.piece_count(block), 2U);
    simulation.remove_tool(of_gone);
    const StepResult result = simulation.step();
    ASSERT_EQ(result.tools.size(), 1U);
    EXPECT_EQ(result.tools[0].tool, of_block);
}

TEST(Removal, OfOneOfBodiesThatTouch) {
    SimulationSettings settings = on_earth();
    settings.contact.pieces = true;
    settings.ground = Ground{.offset = -0.05};
    Simulation simulation(settings);
    std::vector<BodyId> pile;
    for (int k = 0; k < 3; ++k)
        pile.push_back(simulation.add_body(BoxMesh(0.1, 0.1, 0.1).view(), at(0, 0.101 * k)));
    run_steps(simulation, 20);
    simulation.remove_body(pile[1]);
    run_steps(simulation, 60);
    EXPECT_NEAR(mean_height(simulation, pile[2]) - mean_height(simulation, pile[0]), 0.1, 0.03);
    simulation.remove_body(pile[0]);
    run_steps(simulation, 60);
    EXPECT_NEAR(mean_height(simulation, pile[2]), 0, 0.02);
}

TEST(Memory, DoesNotGrowWithTime) {
    HistorySettings history;
    history.memory_budget = 1 << 20;
    SimulationSettings settings = on_earth();
    settings.ground = Ground{.offset = -0.05};
    settings.history = history;
    Simulation simulation(settings);
    const BodyId block = simulation.add_body(BoxMesh(0.1, 0.1, 0.1).view(), soft_block());
    const ToolId knife = simulation.add_tool({edge_along_y}, {.pose = {{0.5, 0, 0.2}, {}}});
    const HandleId handle = simulation.add_handle(block, {.region = BoxRegion{{-1, -1, 0}, {1, 1, 1}}});
    std::size_t early = 0;
    for (int k = 0; k < 400; ++k) {
        const double now = simulation.time(), dt = simulation.time_step();
        for (int sample = 1; sample <= 16; ++sample) {  // a hand at 1 kHz
            const double time = now + sample * dt / 16;
            simulation.add_tool_pose(knife, time, {{0.5 + 0.01 * std::sin(time), 0, 0.2}, {}});
            simulation.add_handle_pose(handle, time, {{0.01 * std::sin(5 * time), 0, 0}, {}});
        }
        if (k % 40 == 0) simulation.lower_tool(knife);
        if (k % 40 == 20) simulation.raise_tool(knife);
        simulation.step();
        const MemoryUse use = simulation.memory_use();
        EXPECT_LE(use.history_memory, history.memory_budget);
        if (k == 20) early = use.motion_samples + use.surfaces;
        if (k > 20) {
            EXPECT_LE(use.motion_samples + use.surfaces, early) << "step " << k;
        }
    }
}

}  // namespace
}  // namespace splitcubes::api_tests
