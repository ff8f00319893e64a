// Motions that a scene composes, and copies that it repeats.
#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/motion.h>
#include <splitcubes/scene/parse.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

namespace splitcubes::scene {
namespace {

using testing::HasSubstr;

SceneDescription parse_tools(const std::string& tools, const std::string& more = "") {
    return parse_scene_text(
        R"({"bodies": [{"name": "a", "shape": {"box": {"size": [1, 1, 1]}}}], "tools": [)" + tools + "]" +
            more + "}",
        "x.json", "/");
}

std::string moving_tool(const std::string& name, const std::string& motion, const std::string& more = "") {
    return R"({"name": ")" + name +
           R"(", "blades": [{"straight": {"from": [0, 0, 0], "to": [0, 0, 1]}}], "motion": )" + motion +
           (more.empty() ? "" : ", " + more) + "}";
}

const std::string spin = R"({"circular": {"radius": 0, "turns": 3, "from_time": 0, "until_time": 2}})";
const std::string straight_path =
    R"({"path": {"keyframes": [{"time": 0, "position": [1, 0, 0]}, {"time": 2, "position": [1, 0, 2],
        "rotation": {"axis": [0, 1, 0], "angle_degrees": 120}}]}})";

double distance(const Isometry& a, const Isometry& b) {
    return (a.matrix() - b.matrix()).norm();
}

TEST(Motion, ComposedFramesAreTheProductsOfTheirParts) {
    const SceneDescription scene =
        parse_tools(moving_tool("s", spin) + "," + moving_tool("p", straight_path) + "," +
                    moving_tool("both", R"({"composed": {"parts": [)" + spin + "," + straight_path + "]}}"));
    const cutting::Blade outer = make_blade(scene.tools[0]), inner = make_blade(scene.tools[1]),
                         both = make_blade(scene.tools[2]);
    EXPECT_EQ(both.active_from(), 0);
    EXPECT_EQ(both.active_until(), 2);
    Random random(7);
    for (int k = 0; k < 200; ++k) {
        const double t = random.uniform(-0.5, 2.5);
        // Straight lines between samples of a turn of 5 degrees miss the arc by 0.1 % of the radius.
        EXPECT_LT(distance(both.frame(t), outer.frame(t) * inner.frame(t)), 0.01) << t;
    }
}

TEST(Motion, RelativeMotionsAreThoseInTheFrameOfTheOther) {
    const SceneDescription scene =
        parse_tools(moving_tool("s", spin) + "," + moving_tool("p", straight_path, R"("relative_to": "s")") +
                    "," + moving_tool("q", straight_path));
    const cutting::Blade outer = make_blade(scene.tools[0]), relative = make_blade(scene.tools[1]),
                         alone = make_blade(scene.tools[2]);
    for (const double t : {0.0, 0.3, 1.1, 2.0})
        EXPECT_LT(distance(relative.frame(t), outer.frame(t) * alone.frame(t)), 0.01) << t;
    try {
        parse_tools(moving_tool("p", straight_path, R"("relative_to": "s")") + "," + moving_tool("s", spin));
        FAIL() << "a tool that comes later was found";
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("tools and colliders must come before what goes along"));
    }
}

TEST(Motion, HelicesRiseAndChangeTheirRadius) {
    const SceneDescription scene = parse_tools(moving_tool(
        "h", R"({"helix": {"center": [1, 2, 3], "radius": 2, "end_radius": 0.5, "turns": 4, "rise": 6,
                           "from_time": 1, "until_time": 3}})"));
    const cutting::Blade blade = make_blade(scene.tools[0]);
    EXPECT_LT((blade.frame(1).translation() - Vec3(3, 2, 3)).norm(), 1e-12);
    EXPECT_LT((blade.frame(3).translation() - Vec3(1.5, 2, 9)).norm(), 1e-9);
    for (const double t : {1.3, 1.77, 2.5}) {
        const double share = (t - 1) / 2, angle = 8 * std::numbers::pi * share, radius = 2 - 1.5 * share;
        const Vec3 expected(1 + radius * std::cos(angle), 2 + radius * std::sin(angle), 3 + 6 * share);
        EXPECT_LT((blade.frame(t).translation() - expected).norm(), 0.01) << t;
    }
}

TEST(Motion, CopiesAreDisplacedTurnedAndDelayed) {
    const SceneDescription scene = parse_tools(
        moving_tool("t", straight_path, R"("repeat": {"count": 4, "position": [0, 0.5, 0], "time": 0.25,
             "rotation": {"angle_degrees": 90}, "pivot": [0, 0, 0]})") +
        "," + moving_tool("c", spin, R"("repeat": {"count": 2, "position": [0, 0, 3]})"));
    ASSERT_EQ(scene.tools.size(), 6u);
    EXPECT_EQ(scene.tools[2].name, "t-3");
    EXPECT_EQ(scene.tools[5].name, "c-2");
    const cutting::Blade first = make_blade(scene.tools[0]);
    for (int k = 0; k < 4; ++k) {
        const cutting::Blade copy = make_blade(scene.tools[static_cast<std::size_t>(k)]);
        EXPECT_EQ(copy.active_from(), 0.25 * k);
        Isometry step = Isometry::Identity();
        step.linear() = Eigen::AngleAxisd(k * std::numbers::pi / 2, Vec3::UnitZ()).toRotationMatrix();
        step.translation() = Vec3(0, 0.5 * k, 0);
        for (const double t : {0.0, 0.4, 1.3, 2.0})
            EXPECT_LT(distance(copy.frame(t + 0.25 * k), step * first.frame(t)), 1e-9) << k << " " << t;
    }
    EXPECT_LT(distance(make_blade(scene.tools[5]).frame(0.7),
                       Isometry(Eigen::Translation3d(0, 0, 3) * make_blade(scene.tools[4]).frame(0.7))),
              1e-3);
}

TEST(Motion, TooManyCopiesAndTakenNamesAreRefused) {
    const auto error_of = [](const std::string& tools) -> std::string {
        try {
            parse_tools(tools);
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_THAT(error_of(moving_tool("t", spin, R"("repeat": {"count": 600})") + "," +
                         moving_tool("u", spin, R"("repeat": {"count": 600})")),
                HasSubstr("makes more than 1000"));
    EXPECT_THAT(
        error_of(moving_tool("t", straight_path, R"("repeat": {"count": 9, "position": [9e6, 0, 0]})")),
        HasSubstr("makes copy 3 too far away"));
    EXPECT_THAT(error_of(moving_tool("t", spin, R"("repeat": {"count": 900, "time": 9999})")),
                HasSubstr("too late"));
    EXPECT_THAT(error_of(moving_tool(std::string(198, 't'), spin, R"("repeat": {"count": 10})")),
                HasSubstr("makes copy 10"));
    std::string long_path;
    for (int k = 0; k < 100; ++k)
        long_path += (k > 0 ? "," : "") + std::string(R"({"time": )") + std::to_string(k) + "}";
    EXPECT_THAT(error_of(moving_tool("t", R"({"path": {"keyframes": [)" + long_path + "]}}",
                                     R"("repeat": {"count": 300})")),
                HasSubstr("points, keyframes and parts in all its copies"));
    EXPECT_THAT(
        error_of(moving_tool("t-1", spin) + "," + moving_tool("t", spin, R"("repeat": {"count": 2})")),
        HasSubstr("a name given before"));
    EXPECT_THAT(error_of(moving_tool("t", R"({"composed": {"parts": [{"composed": {"parts": []}}]}})")),
                HasSubstr("stands inside of another composed motion"));
}

TEST(Motion, CopiesOfABodyStandWhereTheirStepPutsThem) {
    const SceneDescription scene = parse_scene_text(
        R"({"bodies": [{"name": "b", "shape": {"box": {"size": [1, 2, 3]}}, "placement": {"position": [2, 0, 0]},
            "velocity": [1, 0, 0], "repeat": {"count": 3, "rotation": {"angle_degrees": 90}}}]})",
        "x.json", "/");
    ASSERT_EQ(scene.bodies.size(), 3u);
    EXPECT_EQ(scene.bodies[1].name, "b-2");
    EXPECT_LT((scene.bodies[1].placement.position - Vec3(0, 2, 0)).norm(), 1e-12);
    EXPECT_LT((scene.bodies[1].velocity - Vec3(0, 1, 0)).norm(), 1e-12);
    EXPECT_LT((scene.bodies[2].placement.position - Vec3(-2, 0, 0)).norm(), 1e-12);
}

TEST(Motion, AHandleGoesAlongWithItsTool) {
    const SceneDescription scene =
        parse_tools(moving_tool("t", straight_path),
                    R"(, "handles": [{"name": "h", "body": "a", "from_time": 0.5, "relative_to": "t",
            "region": {"sphere": {"center": [0, 0, 0], "radius": 1}}}])");
    const auto motion = handle_motion(scene.handles[0], scene);
    const cutting::Blade blade = make_blade(scene.tools[0]);
    EXPECT_LT(distance(motion(0.5), Isometry::Identity()), 1e-12);
    EXPECT_LT(distance(motion(1.5) * blade.frame(0.5), blade.frame(1.5)), 1e-12);
}

}  // namespace
}  // namespace splitcubes::scene
