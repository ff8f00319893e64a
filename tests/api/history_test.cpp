// Laws of undo and redo: the state after going back and forward is the state that was.
#include "api/scenes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <set>
#include <vector>

namespace splitcubes::api_tests {
namespace {

struct Bench {
    Simulation simulation;
    BodyId block;
    ToolId knife;

    explicit Bench(const HistorySettings& history = {}) : simulation(settings_with(history)) {
        block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
        simulation.add_constraint(block, {.region = BoxRegion{{-1, -1, -1}, {1, 1, -0.08}}});
        simulation.add_handle(block,
                              {.region = SphereRegion{{0.1, 0, 0.1}, 0.05}, .pose = {{0.01, 0, 0}, {}}});
        simulation.add_collider({.shape = SphereShape{0.1}, .pose = {{0, 0, 0.25}, {}}});
        knife = simulation.add_tool({edge_along_y}, {.pose = {{0.003, 0, 0.2}, {}}});
    }
    static SimulationSettings settings_with(const HistorySettings& history) {
        SimulationSettings out = in_free_space();
        out.ground = Ground{.offset = -0.12};
        out.contact.pieces = true;
        out.history = history;
        return out;
    }
    void stroke(double x) {
        simulation.add_tool_pose(knife, simulation.time() + simulation.time_step(), {{x, 0, 0.2}, {}});
        simulation.step();
        simulation.lower_tool(knife);
        cut_through(simulation, knife, x, 6);
        simulation.raise_tool(knife);
    }
};

TEST(History, UndoGoesBackToBeforeTheCutAndRedoForward) {
    Bench b;
    std::vector<std::uint64_t> before, after;
    for (const double x : {0.003, -0.047, 0.053}) {
        before.push_back(b.simulation.state_hash());
        b.stroke(x);
        after.push_back(b.simulation.state_hash());
    }
    EXPECT_EQ(b.simulation.undo_count(), 3U);
    const std::size_t pieces = b.simulation.piece_count(b.block);
    EXPECT_GE(pieces, 4U);
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(b.simulation.undo());
    EXPECT_FALSE(b.simulation.undo());
    EXPECT_EQ(b.simulation.piece_count(b.block), 1U);
    EXPECT_EQ(b.simulation.redo_count(), 3U);
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(b.simulation.redo());
    EXPECT_FALSE(b.simulation.redo());
    EXPECT_EQ(b.simulation.state_hash(), after.back());
    EXPECT_EQ(b.simulation.piece_count(b.block), pieces);
}

TEST(History, WhatFollowsFromAnUndoneStateIsWhatFollowedFromIt) {
    Bench b;
    b.stroke(0.053);
    b.simulation.mark_undo_point();
    const std::uint64_t at_mark = b.simulation.state_hash();
    b.stroke(0.003);
    const std::uint64_t after = b.simulation.state_hash();
    ASSERT_TRUE(b.simulation.undo());  // the stroke
    ASSERT_TRUE(b.simulation.undo());  // to the mark
    EXPECT_EQ(b.simulation.state_hash(), at_mark);
    b.stroke(0.003);
    EXPECT_EQ(b.simulation.state_hash(), after);
    EXPECT_EQ(b.simulation.redo_count(), 0U) << "another future";
}

TEST(History, CutsAtRestAreUndoneToo) {
    Bench b;
    const std::uint64_t before = b.simulation.state_hash();
    b.simulation.cut_with_sheet(b.block, SheetMesh(0.3, 0.004).view());
    EXPECT_EQ(b.simulation.piece_count(b.block), 2U);
    ASSERT_TRUE(b.simulation.undo());
    EXPECT_EQ(b.simulation.state_hash(), before);
    EXPECT_EQ(b.simulation.piece_count(b.block), 1U);
    HistorySettings none;
    none.automatic = false;
    Bench other(none);
    other.simulation.cut_with_sheet(other.block, SheetMesh(0.3, 0.004).view());
    other.stroke(0.053);
    EXPECT_FALSE(other.simulation.undo());
}

TEST(History, IdsNameTheSameThingsAgain) {
    Bench b;
    b.simulation.mark_undo_point();
    const BodyId late = b.simulation.add_body(BoxMesh(0.05, 0.05, 0.05).view(), soft_block());
    b.simulation.remove_body(b.block);
    ASSERT_TRUE(b.simulation.undo());
    EXPECT_EQ(b.simulation.piece_count(b.block), 1U);
    EXPECT_EQ(kind_of_error([&] { b.simulation.piece_count(late); }),
              static_cast<int>(ErrorKind::unknown_id));
    const BodyId other = b.simulation.add_body(BoxMesh(0.05, 0.05, 0.05).view(), soft_block());
    EXPECT_NE(other, late);
}

TEST(History, SurfaceOfAnUndoneBodyIsCopiedAsAWhole) {
    Bench b;
    const std::vector<float> rest(b.simulation.surface(b.block).rest_positions.begin(),
                                  b.simulation.surface(b.block).rest_positions.end());
    b.stroke(0.003);
    const std::uint64_t revision = b.simulation.surface(b.block).revision;
    ASSERT_TRUE(b.simulation.undo());
    const SurfaceView surface = b.simulation.surface(b.block);
    EXPECT_GT(surface.revision, revision + 1);
    EXPECT_TRUE(std::ranges::equal(surface.rest_positions, rest));
    ASSERT_EQ(surface.changed_vertices.size(), 1U);
    EXPECT_EQ(surface.changed_vertices[0].count, surface.vertex_slots());
}

// Copies triangle slots within the change ranges alone.
bool patch_equals_whole(const SurfaceView& surface, std::vector<std::uint32_t>& copy) {
    copy.resize(surface.triangles.size());
    for (const Range& r : surface.changed_triangles)
        std::copy_n(surface.triangles.begin() + 3 * std::ptrdiff_t{r.first}, 3 * r.count,
                    copy.begin() + 3 * std::ptrdiff_t{r.first});
    return std::ranges::equal(copy, surface.triangles);
}

TEST(History, ChangeRangesKeepACopyEqualOverUndoAndRedo) {
    Bench b;
    std::vector<std::uint32_t> copy;
    const auto follows = [&] { return patch_equals_whole(b.simulation.surface(b.block), copy); };
    EXPECT_TRUE(follows());
    b.simulation.cut_with_sheet(b.block, SheetMesh(0.3, 0.004).view());
    EXPECT_TRUE(follows());
    b.simulation.cut_with_sheet(b.block, SheetMesh(0.3, 0.044).view());
    EXPECT_TRUE(follows());
    ASSERT_TRUE(b.simulation.undo());
    EXPECT_TRUE(follows());
    ASSERT_TRUE(b.simulation.undo());
    EXPECT_TRUE(follows());
    ASSERT_TRUE(b.simulation.redo());
    EXPECT_TRUE(follows());
    ASSERT_TRUE(b.simulation.redo());
    EXPECT_TRUE(follows());
}

TEST(History, NoRevisionIsGivenTwice) {
    std::set<std::uint64_t> seen;
    for (int round = 0; round < 2; ++round) {
        Bench b;
        EXPECT_TRUE(seen.insert(b.simulation.surface(b.block).revision).second);
        b.simulation.mark_undo_point();
        b.simulation.cut_with_sheet(b.block, SheetMesh(0.3, 0.004).view());
        EXPECT_TRUE(seen.insert(b.simulation.surface(b.block).revision).second);
        b.simulation.remove_body(b.block);
        ASSERT_TRUE(b.simulation.undo());
        EXPECT_TRUE(seen.insert(b.simulation.surface(b.block).revision).second);
    }
    EXPECT_FALSE(seen.contains(0));
}

TEST(History, StaysWithinItsBudgets) {
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "api_history";
    std::filesystem::create_directories(folder);
    {
        Bench probe;
        probe.simulation.mark_undo_point();
        const std::size_t one = probe.simulation.memory_use().history_memory;
        HistorySettings settings;
        settings.memory_budget = 2 * one + one / 2;
        {
            Bench b(settings);
            for (int k = 0; k < 5; ++k) b.simulation.mark_undo_point();
            EXPECT_EQ(b.simulation.undo_count(), 2U);
            EXPECT_LE(b.simulation.memory_use().history_memory, settings.memory_budget);
        }
        settings.disk_folder = folder.string();
        settings.disk_budget = 2 * one + one / 2;
        Bench b(settings);
        const std::uint64_t hash = b.simulation.state_hash();
        b.simulation.mark_undo_point();
        for (int k = 0; k < 3; ++k) {
            b.simulation.step();
            b.simulation.mark_undo_point();
        }
        EXPECT_EQ(b.simulation.undo_count(), 4U);
        EXPECT_FALSE(std::filesystem::is_empty(folder));
        EXPECT_LE(b.simulation.memory_use().history_disk, settings.disk_budget);
        for (int k = 0; k < 4; ++k) ASSERT_TRUE(b.simulation.undo());
        EXPECT_EQ(b.simulation.state_hash(), hash);
        for (int k = 0; k < 9; ++k) b.simulation.mark_undo_point();
        EXPECT_EQ(b.simulation.undo_count(), 4U);
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder)) << "files of the history go with it";
}

}  // namespace
}  // namespace splitcubes::api_tests
