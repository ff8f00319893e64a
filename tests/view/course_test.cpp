// Scenes whose things go along with the material and wait for each other, in the viewer.
#include "view/sessions.h"

#include <splitcubes/view/engine.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace splitcubes::view_tests {
namespace {

// A knife halves the block; then a grip lifts one half, and a second knife goes along with it.
const std::string carried = R"(, "tools": [
    {"name": "first", "blades": [{"straight": {"from": [0, -0.2, 0], "to": [0, 0.2, 0]}}],
     "motion": {"path": {"keyframes": [{"time": 0.05, "position": [0.01, 0, 0.12]}, {"time": 0.25, "position": [0.01, 0, -0.02]}]}}},
    {"name": "second", "blades": [{"straight": {"from": [0, -0.2, 0], "to": [0, 0.2, 0]}}],
     "motion": {"path": {"keyframes": [{"time": 0, "position": [0.06, 0, 0.12]}, {"time": 0.3, "position": [0.06, 0, -0.02]}]}},
     "relative_to": {"body": "block", "region": {"half_space": {"point": [0.02, 0, 0], "normal": [1, 0, 0]}}},
     "start_when": {"body": "block"}, "instrument": {"knife": {}}}],
  "handles": [{"name": "grip", "body": "block", "region": {"half_space": {"point": [0.07, 0, 0], "normal": [1, 0, 0]}},
     "keyframes": [{"time": 0}, {"time": 0.4, "position": [0.1, 0, 0.1]}], "stiffness": 3000, "start_when": {"body": "block"}}])";

struct CarriedScene : testing::Test {
    TemporaryFolder folder{"course"};
    HandSession session{write_block_scene(folder.path, carried, 12, 90)};
};

TEST_F(CarriedScene, ThingsStartWhenTheBodyIsSeveredAndGoAlongWithIt) {
    session.key("space");
    session.run(12);
    ASSERT_EQ(session.pieces(), 1U);
    EXPECT_TRUE(session.state().rods.empty());
    EXPECT_TRUE(session.state().instruments.empty()) << "it waits out of sight";
    session.run(30);
    EXPECT_EQ(session.pieces(), 3U);
    EXPECT_EQ(session.state().rods.size(), 1U);
    ASSERT_EQ(session.state().instruments.size(), 1U);
    EXPECT_GT(session.state().instruments[0].frame.translation().x(), 0.07) << "it went along";
}

TEST_F(CarriedScene, AHeldRegionGoesAlongWithACollider) {
    // The block is lifted by its left face, which a plate carries.
    const std::string lifted =
        R"(, "colliders": [{"name": "plate", "shape": {"box": {"size": [0.02, 0.02, 0.02]}},
        "placement": {"position": [-0.4, 0, 0.3]}, "keyframes": [{"time": 0}, {"time": 0.4, "position": [0, 0, 0.1]}]}],
        "constraints": [{"body": "block", "kind": "hold", "relative_to": "plate",
        "region": {"half_space": {"point": [-0.07, 0, 0], "normal": [-1, 0, 0]}}}])";
    HandSession lifting(write_block_scene(folder.path, lifted, 12, 90));
    const double before = lifting.viewer.bounds().max.z();
    lifting.key("space");
    lifting.run(24);
    EXPECT_NEAR(lifting.viewer.bounds().max.z(), before + 0.1, 0.01);
}

TEST_F(CarriedScene, RecordingsUndoAndThePastComeToTheSameBits) {
    session.key("space");
    session.run(8);
    session.key("1");
    session.drag({-0.05, -0.16, 0.1}, {-0.05, 0.16, 0.1}, 16);
    session.run(10);
    const std::int64_t stroke_end = session.state().step;
    EXPECT_GE(session.pieces(), 3U);
    session.key("z", control_key);
    EXPECT_LT(session.loop.engine()->time(), 0.26)
        << "to before the stroke, and before the block was severed";
    EXPECT_TRUE(session.state().rods.empty());
    session.key("y", control_key);
    session.run(5);
    // Undone and done again, with steps in between that know nothing of what came later.
    session.key("z", control_key);
    session.run(3);
    session.key("y", control_key);
    session.run(5);
    HandSession straight(write_block_scene(folder.path, carried, 12, 90));
    straight.key("space");
    straight.run(8);
    straight.key("1");
    straight.drag({-0.05, -0.16, 0.1}, {-0.05, 0.16, 0.1}, 16);
    straight.run(20);
    EXPECT_EQ(session.hash(), straight.hash());
    const std::int64_t steps = session.state().step;
    const std::uint64_t end = session.hash();
    EXPECT_TRUE(session.loop.engine()->look_back(stroke_end - 8, [] { return true; }));
    EXPECT_EQ(session.hash(), end) << "a look at the past changes nothing";

    const std::string file = folder.path / "session.jsonl";
    session.key("escape");
    session.act("save_recording", file);
    HandSession again(file);
    again.key("space");
    while (again.loop.engine()->step_count() < steps) again.frame();
    EXPECT_EQ(again.hash(), end);
}

}  // namespace
}  // namespace splitcubes::view_tests
