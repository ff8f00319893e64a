#include <splitcubes/scene/build.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/scaled_tool.h>

#include <gtest/gtest.h>

#include <string>

namespace splitcubes::scene {
namespace {

const std::string path = R"({"tools": [
  {"name": "wire", "side": 0.25,
   "blades": [{"straight": {"from": [-1, 0.5, 0], "to": [1, 0.25, 0]}},
              {"polyline": {"points": [[0, 0, 0], [1, 2, 3]]}},
              {"arc": {"center": [1, 0, 0], "radius": 2, "start_angle_degrees": 0, "end_angle_degrees": 90}}],
   "motion": {"path": {"keyframes": [{"time": 0, "position": [0, 0, 1]},
                                     {"time": 2, "position": [0, 4, -1]}]}}},
  {"name": "round", "blades": [{"straight": {"from": [0, 0, 0], "to": [0, 0, 1]}}],
   "motion": {"circular": {"center": [1, 2, 3], "radius": 0.5, "start_angle_degrees": 0, "turns": 2, "until_time": 3}}}]})";

// All lengths in the text are multiplied by eight, nothing else.
TEST(ScaledTool, ScalesEveryLengthAndNothingElse) {
    const std::string larger = R"({"tools": [
  {"name": "wire", "side": 2,
   "blades": [{"straight": {"from": [-8, 4, 0], "to": [8, 2, 0]}},
              {"polyline": {"points": [[0, 0, 0], [8, 16, 24]]}},
              {"arc": {"center": [8, 0, 0], "radius": 16, "start_angle_degrees": 0, "end_angle_degrees": 90}}],
   "motion": {"path": {"keyframes": [{"time": 0, "position": [0, 0, 8]},
                                     {"time": 2, "position": [0, 32, -8]}]}}},
  {"name": "round", "blades": [{"straight": {"from": [0, 0, 0], "to": [0, 0, 8]}}],
   "motion": {"circular": {"center": [8, 16, 24], "radius": 4, "start_angle_degrees": 0, "turns": 2, "until_time": 3}}}]})";
    const auto tools = parse_path_text(path, "path.json"), expected = parse_path_text(larger, "path.json");
    ASSERT_EQ(tools.size(), expected.size());
    for (std::size_t k = 0; k < tools.size(); ++k) {
        EXPECT_EQ(scaled(tools[k], 8), expected[k]) << k;
        EXPECT_EQ(scaled(tools[k], 1), tools[k]);
    }
}

}  // namespace
}  // namespace splitcubes::scene
