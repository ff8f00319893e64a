// Paths to values inside a JSON value.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace splitcubes::scene {

/// A step from a JSON value to one inside it: into an object by key, or into an array by index.
struct PathStep {
    std::string key;  // empty with index >= 0
    int index = -1;
    bool operator==(const PathStep&) const = default;
};
using JsonPath = std::vector<PathStep>;

/// Formats a path: `bodies[0].material.density`; `the scene` for the empty path.
std::string to_string(const JsonPath& path);

/// Parses a path given as an option. Keys consist of letters, digits, `_`, `$` and `-`. Throws InputError
/// with `where` as its location.
JsonPath parse_path(std::string_view text, const std::string& where);

/// Returns whether `inner` is `outer` or inside it.
bool is_within(const JsonPath& inner, const JsonPath& outer);

/// Returns whether parse_path accepts the character in keys.
bool is_path_word(char c);

}  // namespace splitcubes::scene
