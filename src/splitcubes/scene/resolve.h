// A scene description back to JSON.
#pragma once

#include <splitcubes/scene/description.h>

#include <nlohmann/json_fwd.hpp>

namespace splitcubes::scene {

/// The complete scene with every default filled in, in the order of the scene
/// format; parse_scene_text of its text gives an equal description, in any folder
/// (file names are absolute).
nlohmann::ordered_json resolved_scene(const SceneDescription& scene);

}  // namespace splitcubes::scene
