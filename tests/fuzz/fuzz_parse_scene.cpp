// Arbitrary text as a scene and as a path file. A refusal has a line per problem, at most 21; an accepted
// scene is equal after writing and reading it again.
#include <splitcubes/core/error.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/resolve.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

using namespace splitcubes;
using namespace splitcubes::scene;

namespace {

void require(bool holds, const char* what, const std::string& detail) {
    if (holds) return;
    std::fprintf(stderr, "broken promise: %s: %s\n", what, detail.c_str());
    std::abort();
}

void read_scene_text(std::string_view text) {
    const SceneDescription scene = parse_scene_text(text, "fuzz.json", "/");
    const std::string once = resolved_scene(scene).dump();
    try {
        const std::string twice = resolved_scene(parse_scene_text(once, "fuzz.json", "/")).dump();
        require(once == twice, "a scene comes back equal", once + "\n" + twice);
    } catch (const InputError& error) {
        require(false, "what was written can be read", error.what());
    }
}

template <class Read>
void try_to(const Read& read, std::string_view text) {
    try {
        read(text);
    } catch (const InputError& error) {
        const std::string what = error.what();
        const auto line_ends = std::count(what.begin(), what.end(), '\n');
        require(!what.empty() && what.front() != '\n' && what.back() != '\n' &&
                    what.find("\n\n") == std::string::npos && line_ends <= 20,
                "each problem is one line", what);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    try_to(read_scene_text, text);
    try_to([](std::string_view t) { parse_path_text(t, "fuzz.json"); }, text);
    return 0;
}
