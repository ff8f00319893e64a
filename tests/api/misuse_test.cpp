// Misuse is an Error that says what is wrong, and changes nothing.
#include "api/scenes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <limits>
#include <string>
#include <thread>

namespace splitcubes::api_tests {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// A block with a knife over it.
struct Table {
    Simulation simulation{in_free_space()};
    BoxMesh box{0.2, 0.2, 0.2};
    BodyId block = simulation.add_body(box.view(), soft_block());
    ToolId knife = simulation.add_tool({edge_along_y}, {.pose = {{0.003, 0, 0.2}, {}}});
};

// The call fails so, and nothing has changed.
template <class Call>
void expect_error(Simulation& simulation, ErrorKind kind, const Call& call) {
    const std::uint64_t hash = simulation.state_hash();
    const std::size_t bodies = simulation.bodies().size();
    EXPECT_EQ(kind_of_error(call), static_cast<int>(kind));
    EXPECT_EQ(simulation.state_hash(), hash);
    EXPECT_EQ(simulation.bodies().size(), bodies);
}

std::string message_of(const std::function<void()>& call) {
    try {
        call();
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

TEST(Misuse, MessagesNameTheBodyOrTheFile) {
    Table t;
    BodySettings settings = soft_block();
    settings.name = "liver";
    const BoxMesh flat(0.2, 0.2, 0);
    BoxMesh broken = t.box;
    broken.positions[4] = nan;
    for (const BoxMesh& mesh : {flat, broken})
        EXPECT_THAT(message_of([&] { t.simulation.add_body(mesh.view(), settings); }),
                    testing::StartsWith("body 'liver'"));
    EXPECT_THAT(message_of([&] { t.simulation.add_body("", settings); }),
                testing::HasSubstr("name is empty"));
    EXPECT_THAT(message_of([&] { t.simulation.save(""); }), testing::HasSubstr("name is empty"));
    EXPECT_THAT(message_of([&] { t.simulation.load(""); }), testing::HasSubstr("name is empty"));
}

TEST(Misuse, Meshes) {
    Table t;
    const auto add = [&](const MeshView& mesh) {
        expect_error(t.simulation, ErrorKind::invalid_argument,
                     [&] { t.simulation.add_body(mesh, soft_block()); });
        expect_error(t.simulation, ErrorKind::invalid_argument,
                     [&] { t.simulation.cut_with_sheet(t.block, mesh); });
    };
    add({});
    add({std::span<const double>(static_cast<const double*>(nullptr), 24), t.box.triangles});
    add({t.box.positions, std::span<const std::uint32_t>(static_cast<const std::uint32_t*>(nullptr), 36)});
    add({std::span(t.box.positions).first(23), t.box.triangles});
    add({t.box.positions, std::span(t.box.triangles).first(35)});
    BoxMesh wrong = t.box;
    wrong.triangles[7] = 8;
    add(wrong.view());
    wrong = t.box;
    wrong.positions[4] = nan;
    add(wrong.view());
    const std::vector<float> uv(11, 0);
    expect_error(t.simulation, ErrorKind::invalid_argument, [&] {
        t.simulation.add_body({t.box.positions, t.box.triangles, uv}, soft_block());
    });
    const std::vector<std::int32_t> material(12, -2);
    expect_error(t.simulation, ErrorKind::invalid_argument, [&] {
        t.simulation.add_body({t.box.positions, t.box.triangles, {}, material}, soft_block());
    });
    expect_error(t.simulation, ErrorKind::bad_file,
                 [&] { t.simulation.add_body("no/such/file.obj", soft_block()); });
}

TEST(Misuse, BodySettings) {
    Table t;
    const auto add = [&](const std::function<void(BodySettings&)>& change) {
        BodySettings settings = soft_block();
        change(settings);
        expect_error(t.simulation, ErrorKind::invalid_argument,
                     [&] { t.simulation.add_body(t.box.view(), settings); });
    };
    add([](BodySettings& s) { s.cell_size = -1; });
    add([](BodySettings& s) { s.cell_size = nan; });
    add([](BodySettings& s) { s.cell_size = 1e-9; });
    add([](BodySettings& s) { s.cell_size = 0, s.cells = 0; });
    add([](BodySettings& s) { s.cell_size = 0, s.cells = 100000; });
    add([](BodySettings& s) { s.phyxel_count = 0; });
    add([](BodySettings& s) { s.scale = 0; });
    add([](BodySettings& s) { s.placement.position.x = nan; });
    add([](BodySettings& s) { s.placement.rotation = {0, 0, 0, 0}; });
    add([](BodySettings& s) { s.velocity.y = std::numeric_limits<double>::infinity(); });
    add([](BodySettings& s) { s.material.density = 0; });
    add([](BodySettings& s) { s.material.poisson_ratio = 0.5; });
    add([](BodySettings& s) { s.material.cutting_resistance = -1; });
    add([](BodySettings& s) { s.tearing = TearingSettings{.strength = -1}; });
}

TEST(Misuse, SimulationSettings) {
    const auto make = [](const std::function<void(SimulationSettings&)>& change) {
        SimulationSettings settings;
        change(settings);
        EXPECT_EQ(kind_of_error([&] { Simulation(settings).time(); }),
                  static_cast<int>(ErrorKind::invalid_argument));
    };
    make([](SimulationSettings& s) { s.time_step = 0; });
    make([](SimulationSettings& s) { s.time_step = nan; });
    make([](SimulationSettings& s) { s.gravity.z = nan; });
    make([](SimulationSettings& s) { s.ground = Ground{.normal = {0, 0, 0}}; });
    make([](SimulationSettings& s) { s.ground = Ground{.friction = -1}; });
    make([](SimulationSettings& s) { s.contact.restitution = 1.01; });
    make([](SimulationSettings& s) { s.contact.restitution = nan; });
    make([](SimulationSettings& s) { s.thread_count = -1; });
    make([](SimulationSettings& s) { s.solver.max_iterations = 0; });
    make([](SimulationSettings& s) { s.history.disk_folder = "/no/such/folder"; });
}

TEST(Misuse, IdsOfNothing) {
    Table t;
    Simulation& s = t.simulation;
    const BodyId gone = s.add_body(t.box.view(), soft_block());
    s.remove_body(gone);
    const BodyId next = s.add_body(t.box.view(), soft_block());
    EXPECT_NE(next, gone) << "an id is never given twice";
    EXPECT_EQ(next.index, gone.index);
    const ToolId broken_knife = s.add_tool({edge_along_y});
    s.remove_tool(broken_knife);
    for (const BodyId id : {BodyId{}, gone, BodyId{7, 7}}) {
        const auto refused = [&](const auto& call) { expect_error(s, ErrorKind::unknown_id, call); };
        refused([&] { s.remove_body(id); });
        refused([&] { s.surface(id); });
        refused([&] { s.piece_count(id); });
        refused([&] { s.cut_with_sheet(id, SheetMesh(1).view()); });
        refused([&] { s.cut_with_blade(id, {edge_along_y}, {}); });
        refused([&] { s.add_tool({edge_along_y}, {.bodies = {t.block, id}}); });
        refused([&] { s.add_handle(id, {.region = SphereRegion{{}, 1}}); });
        refused([&] { s.add_constraint(id, {.region = SphereRegion{{}, 1}}); });
    }
    for (const ToolId id : {ToolId{}, broken_knife}) {
        expect_error(s, ErrorKind::unknown_id, [&] { s.lower_tool(id); });
        expect_error(s, ErrorKind::unknown_id, [&] { s.raise_tool(id); });
        expect_error(s, ErrorKind::unknown_id, [&] { s.add_tool_pose(id, 1, {}); });
        expect_error(s, ErrorKind::unknown_id, [&] { s.remove_tool(id); });
    }
    expect_error(s, ErrorKind::unknown_id, [&] { s.remove_handle({}); });
    expect_error(s, ErrorKind::unknown_id, [&] { s.remove_constraint({}); });
    expect_error(s, ErrorKind::unknown_id, [&] { s.remove_collider({}); });
}

TEST(Misuse, Poses) {
    Table t;
    Simulation& s = t.simulation;
    const auto refused = [&](ErrorKind kind, double time, const Pose& pose) {
        expect_error(s, kind, [&] { s.add_tool_pose(t.knife, time, pose); });
    };
    refused(ErrorKind::pose_not_later, 0, {});
    refused(ErrorKind::pose_not_later, -1, {});
    refused(ErrorKind::pose_not_later, nan, {});
    refused(ErrorKind::invalid_argument, std::numeric_limits<double>::infinity(), {});
    refused(ErrorKind::invalid_argument, 1, {{nan, 0, 0}, {}});
    refused(ErrorKind::invalid_argument, 1, {{}, {0, 0, 0, 0}});
    refused(ErrorKind::invalid_argument, 1, {{}, {nan, 0, 0, 0}});
    s.add_tool_pose(t.knife, 0.01, {});
    refused(ErrorKind::pose_not_later, 0.01, {});
    s.step();
    refused(ErrorKind::pose_not_later, 0.012, {});
    s.add_tool_pose(t.knife, s.time() + 1e-3, {});
    expect_error(s, ErrorKind::pose_not_later, [&] {
        const std::array<TimedPose, 2> path{TimedPose{1, {}}, TimedPose{1, {}}};
        s.cut_with_blade(t.block, {edge_along_y}, path);
    });
}

TEST(Misuse, BladesRegionsAndShapes) {
    Table t;
    Simulation& s = t.simulation;
    const auto refused = [&](const auto& call) { expect_error(s, ErrorKind::invalid_argument, call); };
    refused([&] { s.add_tool({}); });
    refused([&] { s.add_tool({std::span(edge_along_y).first(1)}); });
    refused([&] { s.add_tool({std::span<const Vector3>(static_cast<const Vector3*>(nullptr), 2)}); });
    const std::array<Vector3, 2> nowhere{Vector3{nan, 0, 0}, Vector3{}}, point{};
    refused([&] { s.add_tool({nowhere}); });
    refused([&] { s.add_tool({point}); });
    refused([&] { s.add_tool({edge_along_y}, {.side_reach = -1}); });
    refused([&] { s.cut_with_blade(t.block, {edge_along_y}, {}); });
    refused([&] { s.add_constraint(t.block, {.region = SphereRegion{{9, 9, 9}, 1}}); });
    refused([&] { s.add_constraint(t.block, {.region = SphereRegion{{}, -1}}); });
    refused([&] { s.add_constraint(t.block, {.region = RegionTest{}}); });
    refused([&] { s.add_handle(t.block, {.region = SphereRegion{{}, 1}, .stiffness = 0}); });
    refused([&] { s.add_handle(t.block, {.region = BoxRegion{{nan, 0, 0}, {}}}); });
    refused([&] { s.add_collider({.shape = SphereShape{}}); });
    refused([&] { s.add_collider({.shape = BoxShape{{1, 0, 1}, 0}}); });
    refused([&] { s.add_collider({.shape = HalfSpaceShape{{0, 0, 0}, 0}}); });
    refused([&] { s.add_collider({.shape = MeshView{}}); });
    refused([&] { s.add_collider({.shape = SheetMesh(1).view(), .friction = nan}); });
    s.step();
}

TEST(Misuse, CallsFromACallbackOrBesideAnotherAreRefused) {
    Table t;
    Simulation& s = t.simulation;
    int kind = -1;
    s.add_constraint(t.block, {.region = RegionTest([&](const Vector3& p) {
                                   kind = kind_of_error([&] { s.step(); });
                                   return p.z > 0.05;
                               })});
    EXPECT_EQ(kind, static_cast<int>(ErrorKind::busy));
    std::atomic<bool> ends = false;
    std::atomic<int> refused = 0, done = 0;
    std::thread reader([&] {
        while (!ends) (kind_of_error([&] { s.piece_count(t.block); }) < 0 ? done : refused)++;
    });
    for (int k = 0; k < 200 || done + refused == 0; ++k) kind_of_error([&] { s.step(); });
    ends = true;
    reader.join();
    EXPECT_GT(done + refused, 0);
}

TEST(Misuse, AStepThatFailedHalfWayLeavesUndoAndLoad) {
    Table t;
    Simulation& s = t.simulation;
    s.mark_undo_point();
    const std::uint64_t hash = s.state_hash();
    bool throws = false;
    s.add_constraint(t.block, {.region = RegionTest([&](const Vector3& p) {
                                   if (throws) throw 1;
                                   return p.z > 0.05;
                               })});
    throws = true;
    EXPECT_EQ(kind_of_error([&] { s.step(); }), static_cast<int>(ErrorKind::failed));
    EXPECT_EQ(kind_of_error([&] { s.step(); }), static_cast<int>(ErrorKind::broken));
    EXPECT_EQ(kind_of_error([&] { s.surface(t.block); }), static_cast<int>(ErrorKind::broken));
    ASSERT_TRUE(s.undo());
    EXPECT_EQ(s.state_hash(), hash);
    s.step();
}

TEST(Misuse, OfOneThatWasMovedFrom) {
    Table t;
    Simulation other = std::move(t.simulation);
    EXPECT_EQ(kind_of_error([&] { t.simulation.step(); }), static_cast<int>(ErrorKind::invalid_argument));
    EXPECT_EQ(kind_of_error([&] { t.simulation.undo(); }), static_cast<int>(ErrorKind::invalid_argument));
    other.step();
    t.simulation = std::move(other);
    EXPECT_EQ(t.simulation.piece_count(t.block), 1U);
}

TEST(Misuse, MessagesAreOneLineThatSaysWhere) {
    Table t;
    try {
        BoxMesh wrong = t.box;
        wrong.triangles[7] = 8;
        t.simulation.add_body(wrong.view(), soft_block());
        FAIL();
    } catch (const Error& error) {
        EXPECT_STREQ(error.what(), "body 'block', triangle 2: uses vertex 8 of 8");
    }
    try {
        t.simulation.add_tool_pose(t.knife, 0, {});
        FAIL();
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("not later than"));
        EXPECT_THAT(error.what(), testing::Not(testing::HasSubstr("\n")));
    }
}

}  // namespace
}  // namespace splitcubes::api_tests
