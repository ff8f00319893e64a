// Recordings of `run` in the viewer: things move as was recorded, not as the scene says.
#include "view/sessions.h"

#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/recording.h>

#include <gtest/gtest.h>

namespace splitcubes::view_tests {
namespace {

using body::Driven;

Isometry shift(const Vec3& by) {
    Isometry out = Isometry::Identity();
    out.translation() = by;
    return out;
}

SampledMotion line(const Vec3& from, const Vec3& to, double until) {
    SampledMotion out;
    constexpr int count = 10;
    for (int k = 0; k <= count; ++k) out.add(until * k / count, shift(from + (to - from) * k / count));
    return out;
}

// A knife that stands beside the block, a plate at rest, and a hold.
const std::string still = R"(, "tools": [{"name": "knife", "active_until": 9,
    "blades": [{"straight": {"from": [0, -0.2, 0], "to": [0, 0.2, 0]}}],
    "motion": {"path": {"keyframes": [{"time": 0, "position": [0.5, 0, 0]}]}}}],
  "colliders": [{"name": "plate", "shape": {"box": {"size": [0.02, 0.02, 0.02]}}, "placement": {"position": [0, 0, 0.5]}}],
  "constraints": [{"body": "block", "kind": "hold", "region": {"half_space": {"point": [-0.07, 0, 0], "normal": [-1, 0, 0]}}}])";

struct RecordedScene : testing::Test {
    TemporaryFolder folder{"recorded"};

    std::filesystem::path recorded(std::vector<body::MotionTrack> tracks, const std::string& more = still) {
        const std::filesystem::path file = folder.path / "motions.json";
        scene::SceneDescription scene = scene::parse_scene_file(write_block_scene(folder.path, more, 12, 90));
        scene.frames = 60;
        std::ofstream(file) << scene::recording_text({std::move(scene), "x", std::move(tracks), "", ""},
                                                     folder.path);
        return file;
    }
};

TEST_F(RecordedScene, ThingsMoveAsWasRecorded) {
    HandSession without(recorded({}));
    without.key("space");
    without.run(30);
    EXPECT_EQ(without.pieces(), 1U);
    HandSession session(recorded({{Driven::tool, "knife", line({0.01, 0, 0.12}, {0.01, 0, -0.02}, 0.4)},
                                  {Driven::collider, "plate", line({0, 0, 0.5}, {0, 0.3, 0.5}, 0.4)},
                                  {Driven::constraint, "block/0", line({0, 0, 0}, {-0.1, 0, 0}, 0.4)},
                                  {Driven::tool, "another", line({0, 0, 0}, {1, 0, 0}, 0.4)}}));
    const double left = session.viewer.bounds().min.x();
    session.key("space");
    session.run(30);
    EXPECT_EQ(session.pieces(), 2U);
    EXPECT_NEAR(session.state().colliders[0].frame.translation().y(), 0.3, 1e-9);
    EXPECT_NEAR(session.viewer.bounds().min.x(), left - 0.1, 0.01);
    // Strokes come on top of it, and the session itself can be recorded.
    session.key("1");
    session.drag({0.06, -0.16, 0.1}, {0.06, 0.16, 0.1}, 16);
    session.run(5);
    EXPECT_GE(session.pieces(), 3U);
    const std::int64_t steps = session.state().step;
    session.act("save_recording", folder.path / "session.jsonl");
    const std::uint64_t end = session.hash();
    HandSession again(folder.path / "session.jsonl");
    again.key("space");
    while (again.state().step < steps) again.frame();
    EXPECT_EQ(again.hash(), end);
}

TEST_F(RecordedScene, WhatTheStateDecidesStaysAsTheSceneSays) {
    std::string waiting = still;
    waiting.replace(waiting.find(R"("active_until": 9)"), 17, R"("start_when": {"time": 99})");
    HandSession session(
        recorded({{Driven::tool, "knife", line({0.01, 0, 0.12}, {0.01, 0, -0.02}, 0.4)}}, waiting));
    session.key("space");
    session.run(30);
    EXPECT_EQ(session.pieces(), 1U);
}

}  // namespace
}  // namespace splitcubes::view_tests
