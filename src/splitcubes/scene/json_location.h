// Where things stand in a JSON text, which the JSON library does not say: a strict
// check of the syntax with line numbers, and the line of the value at a path.
#pragma once

#include <splitcubes/scene/json_path.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace splitcubes::scene {

/// Objects may have this many keys; finding one takes time proportional to them.
inline constexpr std::size_t max_object_keys = 1000;
/// And keys so many bytes: problems keep the paths of what they are about.
inline constexpr std::size_t max_key_length = 1000;

/// A number that no double holds.
struct UnheldNumber {
    std::size_t begin, size;  // bytes of the text
    JsonPath path;            // of the first ones; empty: of one of many
};
/// So many have their path told.
inline constexpr std::size_t most_unheld_paths = 1000;

/// Checks that the text is one JSON value, with comments allowed: syntax, UTF-8,
/// numbers within what a double holds, at most max_object_keys keys in an object and none twice
/// or longer than max_key_length, nesting at
/// most max_depth (the recursion is as deep). Throws InputError at `name:line:column` (characters, from 1),
/// or at `name` when the text is no file's (with_place false). unheld: gets the numbers that no double holds,
/// in place of an error.
void check_json(std::string_view text, const std::string& name, int max_depth, bool with_place = true,
                std::vector<UnheldNumber>* unheld = nullptr);
/// The same of a long text, whose values take at most about max_memory bytes once they are parsed: an array
/// of two characters takes fifty.
void check_json_within(std::string_view text, const std::string& name, int max_depth, std::size_t max_memory);

/// The line, from 1, on which the member (its key) or element at `path` starts;
/// where there is none, that of the innermost enclosing value that is there. The
/// text must have passed check_json.
int line_of(std::string_view text, const JsonPath& path);

}  // namespace splitcubes::scene
