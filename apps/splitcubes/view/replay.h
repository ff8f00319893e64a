// Recorded events without a window: so many steps a frame, whatever time they take.
#pragma once

#include "camera_control.h"
#include "input.h"
#include "viewer.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::view {

class Timeline;

struct ReplaySettings {
    std::filesystem::path file;            // scene, mesh or run; empty: none
    std::vector<ViewerInput> inputs = {};  // by increasing frame
    int frames = 0;
    int steps_per_frame = 1;  // while it plays
    ViewSize size = {};
    int threads = 0;
};

/// End of a replay.
struct ReplayResult {
    std::int64_t step = 0;
    double time = 0;  // s
    std::size_t pieces = 0;
    std::uint64_t state_hash = 0;  // 0: of a run
    std::string notice;
};

/// A frame of a replay, to be drawn.
struct ReplayFrame {
    int number = 0;
    Viewer& viewer;
    const Timeline& timeline;
    std::vector<std::pair<WindowAct, std::string>> acts;  // that the input asks for
};

/// Calls draw after each frame. Throws InputError for files and events that cannot be used.
ReplayResult replay_input(const ReplaySettings& settings,
                          const std::function<void(const ReplayFrame& frame)>& draw);

}  // namespace splitcubes::view
