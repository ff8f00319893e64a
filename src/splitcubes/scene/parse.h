// Scenes from JSON text.
#pragma once

#include <splitcubes/scene/description.h>

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace splitcubes::scene {

/// Bounds on what a scene may hold, so that no text can exhaust the machine.
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
    static constexpr std::size_t blades = 1000;           // of a tool
    static constexpr std::size_t points = 10000;          // of a polyline
    static constexpr std::size_t keyframes = 10000;       // of a path
    static constexpr std::size_t motion_parts = 16;       // of a composed motion
    static constexpr std::size_t repeated_items = 20000;  // of all copies of a thing
    static constexpr std::size_t overrides = 1000;
    static constexpr std::size_t name_length = 200;  // bytes
};

/// Reads a scene: JSON in which // and /* */ comments may stand. Each override is
/// `path.to[0].value=json` and is applied before anything is checked; what is no JSON
/// is taken as a text, unless it begins with [, { or ", null takes the key out, objects on the way are made;
/// of two keys that exclude each other (frames and duration) the last override holds. Throws InputError whose
/// location is `file:line` (of bad syntax `file:line:column`), or the override's option where the value came
/// from there: on bad syntax, unknown, duplicate or missing keys, wrong types, values out of range,
/// alternatives given together, names of bodies that are not there, times that do not increase, and files
/// that are not there.
SceneDescription parse_scene_file(const std::filesystem::path& path,
                                  std::span<const std::string> overrides = {});

/// The same from text; `name` stands for the file in messages and, without its
/// extension, is the scene's name when the text gives none. Relative file names
/// refer to `folder`.
SceneDescription parse_scene_text(std::string_view text, const std::string& name,
                                  const std::filesystem::path& folder,
                                  std::span<const std::string> overrides = {});

/// Reads a path file: blades on their paths without a scene around them, to cut
/// a body at rest. Its `tools` are written as those of a scene, but name no
/// bodies; at least one. Coordinates are those of the mesh that is cut. Limits
/// and errors are those of scenes.
std::vector<ToolDescription> parse_path_file(const std::filesystem::path& path);

/// The same from text; `name` stands for the file in messages. Files are relative to `folder`, or to the
/// current one.
std::vector<ToolDescription> parse_path_text(std::string_view text, const std::string& name);
std::vector<ToolDescription> parse_path_text(std::string_view text, const std::string& name,
                                             const std::filesystem::path& folder);

/// An old name of a key. It is read with a note until the version `removed_in`.
struct DeprecatedKey {
    std::string_view old_name, name, removed_in;
};

/// The keys that one kind of object may have.
struct ObjectKeys {
    std::string_view object;  // name under $defs in scenes/schema.json; "scene", "path_file": a whole file
    std::vector<std::string_view> keys;
    std::vector<DeprecatedKey> deprecated = {};
};

/// All kinds of objects that scenes have.
const std::vector<ObjectKeys>& scene_keys();
/// Those that only path files have; see scenes/paths/schema.json.
const std::vector<ObjectKeys>& path_keys();
/// Those of recordings (recording.h).
const std::vector<ObjectKeys>& recording_keys();

}  // namespace splitcubes::scene
