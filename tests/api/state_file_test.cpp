// Laws of save and load: what was saved goes on as if nothing had been; what is no state is refused.
#include "api/scenes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

namespace splitcubes::api_tests {
namespace {

std::string bytes_of(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

void write_bytes(const std::string& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
}

/// A bit of everything, half way through a stroke.
struct Everything {
    Simulation simulation;
    BodyId block, bar;
    ToolId knife;
    HandleId handle;
    ColliderId box;

    Everything() : simulation(settings()) {
        const BodyId gone = simulation.add_body(BoxMesh(0.05, 0.05, 0.05).view(), soft_block());
        block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
        BodySettings long_bar = soft_block();
        long_bar.name = "bar";
        long_bar.placement.position = {0, 0, 0.4};
        long_bar.tearing = TearingSettings{.strength = 5e4};
        bar = simulation.add_body(BoxMesh(0.3, 0.06, 0.06).view(), long_bar);
        simulation.add_constraint(bar, {.region = BoxRegion{{-1, -1, 0.3}, {-0.1, 1, 0.5}}});
        handle = simulation.add_handle(
            bar, {.name = "pull", .region = SphereRegion{{0.15, 0, 0.4}, 0.05}, .pose = {{0.02, 0, 0}, {}}});
        box = simulation.add_collider({.shape = BoxMesh(0.1, 0.1, 0.1).view(), .pose = {{0.2, 0, 0.1}, {}}});
        simulation.add_collider({.shape = HalfSpaceShape{{0, 0, 1}, -0.11}});
        knife = simulation.add_tool({edge_along_y}, {.pose = {{0.003, 0, 0.2}, {}}, .bodies = {gone, block}});
        simulation.remove_body(gone);
        simulation.lower_tool(knife);
        cut_through(simulation, knife, 0.003, 6);
        simulation.add_collider_pose(box, simulation.time() + 0.1, {{0.1, 0, 0.1}, {}});
        simulation.add_tool_pose(knife, simulation.time() + 0.05, {{0.03, 0, 0.2}, {}});
    }
    static SimulationSettings settings() {
        SimulationSettings out = in_free_space();
        out.gravity = {0, 0, -9.81};
        out.contact.pieces = true;
        out.ground = Ground{.offset = -0.12};
        return out;
    }
};

void go_on(Simulation& s, const Everything& as) {
    for (int k = 0; k < 5; ++k) s.step();
    s.add_handle_pose(as.handle, s.time() + 0.02, {{0.05, 0, 0}, {}});
    cut_through(s, as.knife, 0.05, 5);
    s.raise_tool(as.knife);
    s.remove_collider(as.box);
    s.step();
}

TEST(StateFile, WhatIsLoadedGoesOnAsIfNothingHadBeen) {
    Everything e;
    const std::string file = testing::TempDir() + "api_state.bin";
    e.simulation.save(file);
    Simulation other;
    other.load(file);
    EXPECT_EQ(other.state_hash(), e.simulation.state_hash());
    EXPECT_EQ(other.time(), e.simulation.time());
    EXPECT_EQ(other.bodies(), e.simulation.bodies());
    EXPECT_EQ(other.tools(), std::vector{e.knife});
    EXPECT_EQ(other.handles(), e.simulation.handles());
    EXPECT_FALSE(other.handles().empty());
    EXPECT_EQ(other.constraints(), e.simulation.constraints());
    EXPECT_EQ(other.colliders(), e.simulation.colliders());
    EXPECT_TRUE(other.is_lowered(e.knife));
    EXPECT_TRUE(
        std::ranges::equal(other.surface(e.block).triangles, e.simulation.surface(e.block).triangles));
    EXPECT_TRUE(
        std::ranges::equal(other.surface(e.block).positions, e.simulation.surface(e.block).positions));
    const std::string again = testing::TempDir() + "api_state2.bin";
    other.save(again);
    EXPECT_TRUE(bytes_of(file) == bytes_of(again));
    go_on(e.simulation, e);
    go_on(other, e);
    EXPECT_EQ(other.state_hash(), e.simulation.state_hash());
}

TEST(StateFile, ARegionByAFunctionIsNotWritten) {
    Everything e;
    e.simulation.add_constraint(e.block, {.region = RegionTest([](const Vector3& p) { return p.z < 0; })});
    const std::string file = testing::TempDir() + "api_no_state.bin";
    EXPECT_EQ(kind_of_error([&] { e.simulation.save(file); }), static_cast<int>(ErrorKind::invalid_argument));
    EXPECT_FALSE(std::ifstream(file).good());
    EXPECT_EQ(kind_of_error([&] { e.simulation.save("/no/such/folder/x"); }),
              static_cast<int>(ErrorKind::invalid_argument));
}

// The checksum again, so that what is behind it is read.
std::string with_checksum(std::string bytes) {
    constexpr std::size_t head = 24;  // of the first line
    std::uint64_t hash = 0xcbf29ce484222325ULL;
    const auto add = [&](std::uint64_t word) {
        hash = (hash ^ word) * 0x100000001b3ULL;
        hash ^= hash >> 29;
    };
    std::size_t at = head + 16;
    for (; at + 8 <= bytes.size(); at += 8) {
        std::uint64_t word = 0;
        std::copy_n(bytes.data() + at, 8, reinterpret_cast<char*>(&word));
        add(word);
    }
    for (; at < bytes.size(); ++at) add(static_cast<unsigned char>(bytes[at]));
    std::copy_n(reinterpret_cast<const char*>(&hash), 8, bytes.data() + head + 8);
    return bytes;
}

TEST(StateFile, WhatIsNoStateIsRefusedAndChangesNothing) {
    Simulation made(in_free_space());
    BodySettings small = soft_block();
    small.cell_size = 0.05;
    small.phyxel_count = 30;
    made.add_body(BoxMesh(0.2, 0.2, 0.2).view(), small);
    made.add_tool({edge_along_y});
    const std::string file = testing::TempDir() + "api_damaged.bin";
    made.save(file);
    const std::string good = bytes_of(file);
    ASSERT_EQ(good.substr(0, 24), "Splitcubes simulation 9\n");
    ASSERT_TRUE(with_checksum(good) == good);
    Simulation simulation(in_free_space());
    const std::uint64_t hash = simulation.state_hash();
    const auto expect_refused = [&](const std::string& bytes) {
        write_bytes(file, bytes);
        EXPECT_EQ(kind_of_error([&] { simulation.load(file); }), static_cast<int>(ErrorKind::bad_file));
        EXPECT_EQ(simulation.state_hash(), hash);
    };
    expect_refused("");
    expect_refused("Splitcubes simulation 0\n");
    expect_refused("solid of no simulation");
    for (std::size_t length = 1; length < good.size(); length += good.size() / 20)
        expect_refused(good.substr(0, length));
    std::string changed = good;
    changed[good.size() / 2] = static_cast<char>(changed[good.size() / 2] ^ 4);
    expect_refused(changed);
    EXPECT_EQ(kind_of_error([&] { simulation.load("/no/such/file"); }),
              static_cast<int>(ErrorKind::bad_file));
    // Behind a checksum that fits anything may stand: refused or loaded, but nothing else.
    std::size_t refused = 0, tried = 0;
    for (std::size_t at = 40; at < good.size(); at += 1 + good.size() / 150, ++tried) {
        std::string damaged = good;
        for (std::size_t k = 0; k < 4 && at + k < good.size(); ++k)
            damaged[at + k] = static_cast<char>(damaged[at + k] ^ (0x55 + static_cast<int>(tried)));
        write_bytes(file, with_checksum(damaged));
        const int kind = kind_of_error([&] { Simulation().load(file); });
        EXPECT_TRUE(kind == -1 || kind == static_cast<int>(ErrorKind::bad_file)) << "byte " << at;
        refused += kind != -1;
    }
    EXPECT_GT(refused, 0U);
}

}  // namespace
}  // namespace splitcubes::api_tests
