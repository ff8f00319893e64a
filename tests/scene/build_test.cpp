#include <splitcubes/core/error.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/parse.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

namespace splitcubes::scene {
namespace {

std::string build_error(const std::string& text) {
    try {
        BuildReport report;
        build_world(parse_scene_text(text, "x.json", "/"), std::make_shared<const Parallel>(1), report);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(BuildWorld, says_which_body_is_at_fault) {
    const std::string error = build_error(R"json({"bodies": [
        {"name": "good", "shape": {"box": {"size": [1, 1, 1]}}, "cell_size": 0.2},
        {"name": "thin", "shape": {"box": {"size": [1, 1, 0.001]}}, "cell_size": 0.2}]})json");
    EXPECT_THAT(error, testing::StartsWith("body 'thin': "));
    EXPECT_THAT(error, testing::HasSubstr("thinner than a cell"));
    EXPECT_EQ(error.find('\n'), std::string::npos);
}

TEST(BuildWorld, says_which_constraint_holds_nothing) {
    const std::string error = build_error(R"json({
        "bodies": [{"name": "good", "shape": {"box": {"size": [1, 1, 1]}}, "cell_size": 0.2}],
        "constraints": [{"body": "good", "kind": "hold",
                         "region": {"box": {"min": [5, 5, 5], "max": [6, 6, 6]}}}]})json");
    EXPECT_THAT(error, testing::StartsWith("constraints[0]: its region holds no phyxel of body 'good'"));
}

TEST(BuildWorld, notes_that_blade_sides_need_contact) {
    for (const bool pieces : {false, true}) {
        const std::string text = R"json({
            "bodies": [{"name": "good", "shape": {"box": {"size": [1, 1, 1]}}, "cell_size": 0.2}],
            "contact": {"pieces": )json" +
                                 std::string(pieces ? "true" : "false") + R"json(},
            "tools": [{"name": "knife", "side": 0.1, "friction": 0.3,
                       "blades": [{"polyline": {"points": [[0, -1, 0], [0, 1, 0]]}}],
                       "motion": {"path": {"keyframes": [{"time": 0, "position": [0, 0, 1]},
                                                         {"time": 1, "position": [0, 0, -1]}]}}}]})json";
        BuildReport report;
        build_world(parse_scene_text(text, "x.json", "/"), std::make_shared<const Parallel>(1), report);
        EXPECT_EQ(report.notes.size(), pieces ? 0U : 1U);
        for (const auto& [name, note] : report.notes) EXPECT_EQ(name, "knife");
    }
}

}  // namespace
}  // namespace splitcubes::scene
