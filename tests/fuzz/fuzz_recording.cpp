// Arbitrary text as a recording. A refusal has a line per problem; an accepted recording is equal after
// writing and reading it again, and its motions are rigid and finite at all times.
#include <splitcubes/core/error.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/recording.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

using namespace splitcubes;
using namespace splitcubes::scene;

namespace {

void require(bool holds, const std::string& detail) {
    if (holds) return;
    std::fprintf(stderr, "broken promise: %s\n", detail.c_str());
    std::abort();
}

std::string text_of(const Recording& recording) {
    return recording_text(recording, "/");
}

std::string seed() {
    Recording out;
    out.scene = parse_scene_text(
        R"({"frames": 3, "bodies": [{"name": "b", "shape": {"box": {"size": [1, 1, 1]}}}],
        "tools": [{"name": "k", "blades": [{"straight": {"from": [0, 0, 0], "to": [0, 1, 0]}}],
                   "motion": {"path": {"keyframes": [{"time": 0}]}}}]})",
        "s.json", "/");
    Isometry turned = Isometry::Identity();
    turned.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
    SampledMotion motion;
    motion.add(0, Isometry::Identity());
    motion.add(0.01, turned);
    for (const auto driven : {body::Driven::tool, body::Driven::constraint})
        out.tracks.push_back({driven, driven == body::Driven::tool ? "k" : "b/0", motion});
    return text_of(out);
}

void check_motion(const SampledMotion& motion) {
    for (const double time : {-1.0, 0.0, 0.005, 0.02, 1e6}) {
        const Isometry at = motion.at(time);
        require(at.matrix().allFinite(), "a motion is finite");
        require((at.linear() * at.linear().transpose() - Mat3::Identity()).norm() < 1e-5,
                "a motion is rigid");
    }
}

}  // namespace

// Seeds the corpus folder.
extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
    for (int k = 1; k < *count; ++k)
        if (const std::filesystem::path folder = (*arguments)[k]; std::filesystem::is_directory(folder)) {
            std::ofstream(folder / "recording.json", std::ios::binary) << seed();
            return 0;
        }
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    Recording recording;
    try {
        recording = parse_recording(text, "fuzz.json", "/");
    } catch (const InputError& error) {
        const std::string what = error.what();
        const auto line_ends = std::count(what.begin(), what.end(), '\n');
        require(!what.empty() && what.front() != '\n' && what.back() != '\n' &&
                    what.find("\n\n") == std::string::npos && line_ends <= 20,
                "each problem is one line: " + what);
        return 0;
    }
    for (const body::MotionTrack& track : recording.tracks) check_motion(track.motion);
    const std::string once = text_of(recording);
    try {
        require(text_of(parse_recording(once, "fuzz.json", "/")) == once, "a recording comes back");
    } catch (const InputError& error) {
        require(false, std::string("what was written can be read: ") + error.what());
    }
    return 0;
}
