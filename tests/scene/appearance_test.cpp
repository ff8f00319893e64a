// Finishes, instruments and what is displayed, as scenes say them.
#include <splitcubes/core/error.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/resolve.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

namespace splitcubes::scene {
namespace {

using testing::HasSubstr;

std::string box_body(const std::string& more) {
    return R"({"name": "a", "shape": {"box": {"size": [1, 1, 1]}})" + (more.empty() ? "" : ", " + more) + "}";
}

SceneDescription parse_looks(const std::string& text) {
    return parse_scene_text(text, "x.json", "/");
}

std::string looks_error(const std::string& text) {
    try {
        parse_looks(text);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

std::string error_of_finish(const std::string& finish) {
    return looks_error(R"({"bodies": [)" + box_body(R"("appearance": {"cut": )" + finish + "}") + "]}");
}

TEST(Appearance, AKindIsAFinishOfWhichPartsAreReplaced) {
    const SceneDescription scene =
        parse_looks(R"({"bodies": [)" +
                    box_body(R"("appearance": {"cut": {"kind": "crumb", "roughness": 0.25}})") + "]}");
    geometry::Finish expected = *finish_of_kind("crumb");
    ASSERT_FALSE(expected.speckles.empty());
    expected.roughness = 0.25;
    ASSERT_TRUE(scene.bodies[0].appearance.cut);
    EXPECT_EQ(*scene.bodies[0].appearance.cut, expected);
    EXPECT_FALSE(scene.bodies[0].appearance.surface);
}

TEST(Appearance, EveryKindIsWhatItsResolvedFormSays) {
    for (const std::string_view kind : finish_kind_names()) {
        const std::string finish = R"({"kind": ")" + std::string(kind) + "\"}";
        const SceneDescription scene =
            parse_looks(R"({"bodies": [)" + box_body(R"("appearance": {"surface": )" + finish + "}") +
                        R"(], "colliders": [
               {"name": "c", "shape": {"sphere": {"radius": 1}}, "finish": )" +
                        finish + "}]}");
        SceneDescription again = parse_looks(resolved_scene(scene).dump());
        again.folder = scene.folder;
        EXPECT_EQ(again, scene) << kind;
        EXPECT_EQ(*scene.colliders[0].finish, *finish_of_kind(kind));
    }
}

TEST(Appearance, WhatIsWrongIsSaidInOneLine) {
    EXPECT_THAT(error_of_finish(R"({"kind": "stel"})"), HasSubstr("\"stel\", which is unknown"));
    EXPECT_THAT(error_of_finish(R"({"colour": [1, 2, 0]})"), HasSubstr("colour[1] is 2"));
    EXPECT_THAT(error_of_finish(R"({"color": [1, 1, 0]})"), HasSubstr("did you mean 'colour'?"));
    EXPECT_THAT(
        error_of_finish(
            R"({"layers": [{"depth": 0.2, "colour": [1, 1, 1]}, {"depth": 0.1, "colour": [1, 1, 1]}]})"),
        HasSubstr("layers[1].depth is 0.1, not above the one before"));
    EXPECT_THAT(
        error_of_finish(
            R"({"stripes": {"bands": [{"from": 1, "colour": [1, 1, 1]}, {"from": 1, "colour": [1, 1, 1]}]}})"),
        HasSubstr("bands[1].from is 1, not above the one before"));
    EXPECT_THAT(error_of_finish(R"({"speckles": [{"size": 0, "colour": [1, 1, 1]}]})"),
                HasSubstr("size is 0"));
}

std::string tool_with(const std::string& more) {
    return R"({"bodies": [)" + box_body("") + R"(], "tools": [{"name": "t",
        "blades": [{"straight": {"from": [0, 0, 0], "to": [0, 0, 1]}}],
        "motion": {"path": {"keyframes": [{"time": 0}, {"time": 1, "position": [1, 0, 0]}]}}, )" +
           more + "}]}";
}

TEST(Appearance, InstrumentsAreOneKindEach) {
    EXPECT_EQ(looks_error(tool_with(R"("instrument": {"knife": {}})")), "");
    EXPECT_THAT(looks_error(tool_with(R"("instrument": {"knife": {}, "wire": {}})")),
                HasSubstr("exactly one of"));
    EXPECT_THAT(looks_error(tool_with(R"("instrument": {"knife": {"height": -1}})")),
                HasSubstr("height is -1"));
    EXPECT_THAT(looks_error(tool_with(R"("instrument": {"mesh": {"file": "none.obj"}})")),
                HasSubstr("there is no file"));
    EXPECT_THAT(looks_error(tool_with(R"("solid": {})")), HasSubstr("a tool without an instrument"));
}

TEST(Appearance, SolidToolsAndCollidersHaveDifferentNames) {
    std::string text = tool_with(R"("instrument": {"knife": {}}, "solid": {})");
    EXPECT_EQ(looks_error(text), "");
    text.insert(1, R"("colliders": [{"name": "t", "shape": {"sphere": {"radius": 1}}}], )");
    EXPECT_THAT(looks_error(text), HasSubstr("has the solid tool \"t\", and a collider is called so"));
}

TEST(Appearance, HandlesFollowToolsThatThereAre) {
    const auto scene = [](const std::string& name) {
        return R"({"bodies": [)" + box_body("") +
               R"(], "handles": [{"name": "h", "body": "a", "region": {"sphere":
            {"center": [0, 0, 0], "radius": 1}}, "relative_to": ")" +
               name + R"("}], "tools": [{"name": "t",
            "blades": [{"straight": {"from": [0, 0, 0], "to": [0, 0, 1]}}],
            "motion": {"path": {"keyframes": [{"time": 0}]}}}]})";
    };
    EXPECT_EQ(parse_looks(scene("t")).handles[0].relative_to->name, "t");
    EXPECT_THAT(looks_error(scene("u")),
                HasSubstr("\"u\", which names nothing that it can go along with; there are t, a"));
}

TEST(Appearance, ScalesAreOneNumberOrThree) {
    const auto scale_of = [](const std::string& scale) {
        const SceneDescription scene =
            parse_looks(R"({"bodies": [)" + box_body(R"("placement": {"scale": )" + scale + "}") + "]}");
        SceneDescription again = parse_looks(resolved_scene(scene).dump());
        again.folder = scene.folder;
        EXPECT_EQ(again, scene);
        return scene.bodies[0].placement.scale;
    };
    EXPECT_EQ(scale_of("2"), Vec3(2, 2, 2));
    EXPECT_EQ(scale_of("[1, 2, 0.5]"), Vec3(1, 2, 0.5));
    EXPECT_THAT(looks_error(R"({"bodies": [)" + box_body(R"("placement": {"scale": [1, 0, 1]})") + "]}"),
                HasSubstr("scale[1] is 0"));
}

}  // namespace
}  // namespace splitcubes::scene
