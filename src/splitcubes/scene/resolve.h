// A scene description back to JSON.
#pragma once

#include <splitcubes/scene/description.h>

#include <nlohmann/json_fwd.hpp>

namespace splitcubes::scene {

/// The complete scene with every default filled in, in the order of the scene
/// format; parse_scene_text of its text gives an equal description, in any folder
/// (file names are absolute).
nlohmann::ordered_json resolved_scene(const SceneDescription& scene);

/// The same for a file in `folder`: names of files are relative to that.
nlohmann::ordered_json resolved_scene(SceneDescription scene, const std::filesystem::path& folder);

}  // namespace splitcubes::scene
