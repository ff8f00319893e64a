#include <splitcubes/core/error.h>
#include <splitcubes/scene/json_location.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/recording.h>

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace splitcubes::scene {
namespace {

Recording example() {
    Recording out;
    out.scene = parse_scene_text(
        R"({"frames": 3, "bodies": [{"name": "block", "shape": {"box": {"size": [1, 1, 1]}}}],
        "tools": [{"name": "knife", "blades": [{"straight": {"from": [0, 0, 0], "to": [0, 1, 0]}}],
                   "motion": {"path": {"keyframes": [{"time": 0}]}}}]})",
        "s.json", ".");
    out.program = "1.2";
    out.first_state = "0123456789abcdef";
    out.last_state = "fedcba9876543210";
    using enum body::Driven;
    for (const auto driven : {tool, constraint, handle, collider}) {
        SampledMotion motion;
        for (int k = 0; k < 4; ++k) {
            Isometry pose = Isometry::Identity();
            pose.linear() = Eigen::AngleAxisd(0.7 * k, Vec3(1, 2, 3).normalized()).toRotationMatrix();
            pose.translation() = Vec3(std::sin(k), 1e-17 * k, 1e5 / (k + 3));
            motion.add(k / 60.0, pose);
        }
        out.tracks.push_back({driven, driven == tool ? "knife" : "block/0", motion});
    }
    return out;
}

TEST(Recording, RoundTripsExactly) {
    const Recording before = example();
    const Recording after =
        parse_recording(recording_text(before, before.scene.folder), "r.json", before.scene.folder);
    EXPECT_EQ(after.scene, before.scene);
    EXPECT_EQ(after.program, before.program);
    EXPECT_EQ(after.first_state, before.first_state);
    EXPECT_EQ(after.last_state, before.last_state);
    ASSERT_EQ(after.tracks.size(), before.tracks.size());
    for (std::size_t t = 0; t < before.tracks.size(); ++t) {
        const auto &a = before.tracks[t], &b = after.tracks[t];
        EXPECT_EQ(a.driven, b.driven);
        EXPECT_EQ(a.name, b.name);
        EXPECT_EQ(a.motion.times(), b.motion.times());
        for (std::size_t k = 0; k < a.motion.frames().size(); ++k)
            EXPECT_EQ(a.motion.frames()[k].matrix(), b.motion.frames()[k].matrix());
    }
}

TEST(Recording, RoundTripsWithoutTracks) {
    Recording before = example();
    before.tracks.clear();
    EXPECT_TRUE(parse_recording(recording_text(before, "/"), "r.json", "/").tracks.empty());
}

// Returns the error of parse_recording for the example with a part of its text replaced.
std::string refusal(const std::string& part, const std::string& by) {
    std::string text = recording_text(example(), "/");
    const std::size_t at = text.find(part);
    EXPECT_NE(at, std::string::npos) << part;
    if (at != std::string::npos) text.replace(at, part.size(), by);
    try {
        parse_recording(text, "r.json", "/");
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

void expect_refused(const std::string& part, const std::string& by, const std::string& said) {
    EXPECT_NE(refusal(part, by).find(said), std::string::npos) << by << ": " << refusal(part, by);
}

TEST(Recording, ErrorsNameTheLine) {
    expect_refused("splitcubes recording 2", "somebody's recording 2", "is not a recording");
    expect_refused("splitcubes recording 2", "splitcubes recording 1", "which another version wrote");
    expect_refused("\"times\": [0.0,", "\"times\": [0.04,", "tracks[0].times[1]");
    expect_refused("\"times\": [0.0,", "\"times\": [", "has 4 elements, times has 3");
    expect_refused("[1.0,0.0,0.0,0.0,", "[1.5,0.0,0.0,0.0,", "is not a rigid motion");
    expect_refused("[1.0,0.0,0.0,0.0,", "[1.0,0.0,0.0,", "places[0]");
    expect_refused("[1.0,0.0,0.0,0.0,", "[1.0,0.0,0.0,\"x\",", "places[0][3]");
    expect_refused("\"tool\": \"knife\"", "\"tol\": \"knife\"", "tol");
    expect_refused("\"frames\": 3", "\"frames\": 0", "frames");
    expect_refused("\"frames\": 3", "\"frames\": 2", "tracks[0].times[3] comes after the end");
    expect_refused("\"tool\": \"knife\"", "\"tool\": \"\"", "tracks[0].tool has 0 bytes");
    expect_refused("\"tool\": \"knife\"", "\"tool\": \"" + std::string(301, 'x') + "\"", "has 301 bytes");
    expect_refused("\"handle\": \"block/0\"", "\"constraint\": \"block/0\"",
                   "drives 'block/0', which one before");
    expect_refused("\"youngs_modulus\"", "\"young\"", "young");
    expect_refused("\"tracks\"", "\"trucks\"", "trucks");
    EXPECT_THROW(parse_recording("", "r.json", "/"), InputError);
    EXPECT_THROW(parse_recording("[]", "r.json", "/"), InputError);
    EXPECT_THROW(read_recording("/nowhere/r.json"), InputError);
}

// An array of two characters takes more than fifty bytes.
TEST(Recording, TooManyValuesAreRefusedBeforeAllocation) {
    std::string text = "[[]";
    for (int k = 0; k < 10000; ++k) text += ",[]";
    text += "]";
    check_json_within(text, "r.json", 4, 10001 * 64 + 64);
    EXPECT_THROW(check_json_within(text, "r.json", 4, 10001 * 64), InputError);
    EXPECT_THROW(check_json_within("[\"" + std::string(1000, 'x') + "\"]", "r.json", 4, 1000), InputError);
    EXPECT_THROW(check_json_within(R"({"a": {"b": {}}})", "r.json", 4, 280), InputError);
}

TEST(Recording, PartialTextIsRefused) {
    const std::string whole = recording_text(example(), "/");
    for (std::size_t length = 0; length + 3 < whole.size(); length += 97)
        EXPECT_THROW(parse_recording(whole.substr(0, length), "r.json", "/"), InputError) << length;
}

}  // namespace
}  // namespace splitcubes::scene
