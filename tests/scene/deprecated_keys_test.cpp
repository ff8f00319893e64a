// Old names of keys are read until the version that removes them.
#include <splitcubes/core/error.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/resolve.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace splitcubes::scene {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string torn_sphere(const std::string& tearing) {
    return R"({"bodies": [{"name": "ball", "shape": {"sphere": {"radius": 0.05}}, "material": {"tearing": {"strength": 1e4)" +
           tearing + "}}}]}";
}

TEST(DeprecatedKeys, AreReadWithOneNote) {
    const SceneDescription now =
        parse_scene_text(torn_sphere(R"(, "propagation_ratio": 0.3)"), "now.json", "");
    EXPECT_THAT(now.deprecations, IsEmpty());
    SceneDescription old = parse_scene_text(torn_sphere(R"(, "toughness": 0.3)"), "now.json", "");
    EXPECT_THAT(old.deprecations,
                ElementsAre(HasSubstr("bodies[0].material.tearing.toughness is now called "
                                      "'propagation_ratio'; the old name works until version ")));
    old.deprecations.clear();
    EXPECT_EQ(old, now);
}

TEST(DeprecatedKeys, AreReadFromOptions) {
    const std::vector<std::string> option{"bodies[0].material.tearing.toughness=0.4"};
    const SceneDescription scene = parse_scene_text(torn_sphere(""), "s.json", "", option);
    EXPECT_EQ(scene.bodies[0].material.tearing->propagation_ratio, 0.4);
    EXPECT_EQ(scene.deprecations.size(), 1U);
}

TEST(DeprecatedKeys, AreRefusedBesideTheNewName) {
    try {
        parse_scene_text(torn_sphere(R"(, "toughness": 0.3, "propagation_ratio": 0.4)"), "s.json", "");
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(),
                    HasSubstr("toughness is the old name of 'propagation_ratio', which is given too"));
    }
}

TEST(DeprecatedKeys, ErrorsNameTheKeyThatIsThere) {
    try {
        parse_scene_text(torn_sphere(R"(, "toughness": 3)"), "s.json", "");
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("tearing.toughness is 3"));
    }
}

TEST(DeprecatedKeys, AreWrittenUnderTheNewName) {
    const SceneDescription old = parse_scene_text(torn_sphere(R"(, "toughness": 0.3)"), "s.json", "");
    const std::string written = resolved_scene(old).dump();
    EXPECT_THAT(written, HasSubstr("propagation_ratio"));
    EXPECT_THAT(written, testing::Not(HasSubstr("toughness")));
}

}  // namespace
}  // namespace splitcubes::scene
