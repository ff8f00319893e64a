// Writes a scene description as JSON.
#pragma once

#include <splitcubes/scene/description.h>

#include <nlohmann/json_fwd.hpp>

namespace splitcubes::scene {

/// Returns the complete scene with all defaults filled in, in the order of the scene format. parse_scene_text
/// of its text gives an equal description in any folder (file names are absolute).
nlohmann::ordered_json resolved_scene(const SceneDescription& scene);

/// Returns the scene for a file in `folder`: file names are relative to it.
nlohmann::ordered_json resolved_scene(SceneDescription scene, const std::filesystem::path& folder);

}  // namespace splitcubes::scene
