// Recordings of `run` as scenes.
#pragma once

#include <splitcubes/scene/recording.h>

#include <filesystem>

namespace splitcubes::view {

/// Tells whether a file of any content is a recording of `run`.
bool is_run_recording(const std::filesystem::path& file);

/// Returns the scene of a recording, in which things move as was recorded. Those whose motion, start or end
/// depends on the state stay as the scene says.
scene::SceneDescription scene_of_recording(const scene::Recording& recording);

}  // namespace splitcubes::view
