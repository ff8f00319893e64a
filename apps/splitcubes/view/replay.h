// Recorded events without a window: so many steps a frame, whatever time they take.
#pragma once

#include "camera_control.h"
#include "input.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace splitcubes::view {

class Viewer;

struct ReplaySettings {
    std::filesystem::path file;            // scene or mesh
    std::vector<ViewerInput> inputs = {};  // by increasing frame
    int frames = 0;
    int steps_per_frame = 1;  // while it plays
    ViewSize size = {};
    int threads = 0;
};

/// How a replay ended.
struct ReplayResult {
    std::int64_t step = 0;
    double time = 0;  // s
    std::size_t pieces = 0;
    std::uint64_t state_hash = 0;
    std::string notice;
};

/// Calls draw after each frame with the viewer and its state, and the name of a picture that the input asks
/// for. Throws InputError for files and events that cannot be used.
ReplayResult replay_input(const ReplaySettings& settings,
                          const std::function<void(const Viewer& viewer, const std::string& picture)>& draw);

}  // namespace splitcubes::view
