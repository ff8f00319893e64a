// Parses scenes from JSON text.
#pragma once

#include <splitcubes/scene/description.h>

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace splitcubes::scene {

/// Limits on a scene's size, so that no text can exhaust the machine.
struct ParseLimits {
    static constexpr std::size_t bytes = std::size_t{4} << 20;
    static constexpr int nesting_depth = 32;
    static constexpr std::size_t bodies = 1000;
    static constexpr std::size_t constraints = 1000;
    static constexpr std::size_t parts = 1000;            // of an implicit shape
    static constexpr std::size_t strength_layers = 1000;  // of one body
    static constexpr std::size_t colliders = 1000;
    static constexpr std::size_t handles = 1000;
    static constexpr std::size_t tools = 1000;
    static constexpr std::size_t blades = 1000;      // of a tool
    static constexpr std::size_t points = 10000;     // of a polyline
    static constexpr std::size_t keyframes = 10000;  // of a path
    static constexpr std::size_t overrides = 1000;
    static constexpr std::size_t name_length = 200;  // bytes
};

/// Reads a scene: JSON with // and /* */ comments. Each override has the form `path.to[0].value=json` and is
/// applied before validation. A value that is not JSON is taken as a string unless it begins with [, { or ";
/// null removes the key; missing objects are created; of two keys that exclude each other (frames and
/// duration) the last override wins. Throws InputError whose place is `file:line` (for syntax errors
/// `file:line:column`), or the override's option if the value came from there: for bad syntax, unknown,
/// duplicate or missing keys, wrong types, values out of range, alternatives given together, names of unknown
/// bodies, times that do not increase, and missing files.
SceneDescription parse_scene_file(const std::filesystem::path& path,
                                  std::span<const std::string> overrides = {});

/// Reads a scene from text; `name` stands for the file in messages and, without its extension, is the scene's
/// name if the text gives none. Relative file names refer to `folder`.
SceneDescription parse_scene_text(std::string_view text, const std::string& name,
                                  const std::filesystem::path& folder,
                                  std::span<const std::string> overrides = {});

/// Reads a path file: blades on their paths without a scene, to cut a body at rest. Its `tools` (at least
/// one) have the format of a scene's but name no bodies. Coordinates are those of the mesh that is cut.
/// Limits and errors are those of scenes.
std::vector<ToolDescription> parse_path_file(const std::filesystem::path& path);

/// Reads a path file from text; `name` stands for the file in messages.
std::vector<ToolDescription> parse_path_text(std::string_view text, const std::string& name);

/// Keys of one kind of object.
struct ObjectKeys {
    std::string_view object;  // name under $defs in scenes/schema.json; "scene", "path_file": a whole file
    std::vector<std::string_view> keys;
    std::vector<DeprecatedKey> deprecated = {};
};

/// Returns all kinds of objects in scenes.
const std::vector<ObjectKeys>& scene_keys();
/// Returns the kinds that only path files have; see scenes/paths/schema.json.
const std::vector<ObjectKeys>& path_keys();
/// Returns the kinds of objects in recordings (recording.h).
const std::vector<ObjectKeys>& recording_keys();

}  // namespace splitcubes::scene
