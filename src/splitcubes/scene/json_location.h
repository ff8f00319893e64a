// Positions in a JSON text, which the JSON library does not report: a strict syntax check with line numbers,
// and the line of the value at a path.
#pragma once

#include <splitcubes/scene/json_path.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace splitcubes::scene {

/// Keys that an object may have at most: finding one takes linear time.
inline constexpr std::size_t max_object_keys = 1000;
/// Bytes that a key may have at most: problems keep the paths of their values.
inline constexpr std::size_t max_key_length = 1000;

/// A number outside the range of double.
struct UnrepresentableNumber {
    std::size_t begin, size;  // bytes of the text
    JsonPath path;            // for the first max_unrepresentable_paths numbers only, else empty
};
/// Unrepresentable numbers whose path is recorded.
inline constexpr std::size_t max_unrepresentable_paths = 1000;

/// Checks that the text is one JSON value, with comments allowed: syntax, UTF-8, numbers in the range of
/// double, at most max_object_keys keys per object, no key twice or longer than max_key_length, nesting of at
/// most max_depth (the recursion depth). Throws InputError at `name:line:column` (characters, from 1), or at
/// `name` if the text is not from a file (with_location false). unheld: receives numbers outside the range of
/// double, which are errors otherwise.
void check_json(std::string_view text, const std::string& name, int max_depth, bool with_location = true,
                std::vector<UnrepresentableNumber>* unheld = nullptr);
/// Checks a long text in the same way and limits the memory of its parsed values to about max_memory bytes:
/// an array of two characters takes fifty.
void check_json_within(std::string_view text, const std::string& name, int max_depth, std::size_t max_memory);

/// Returns the line, from 1, on which the member (its key) or element at `path` starts, or that of the
/// innermost existing value around it. The text must have passed check_json.
int line_of(std::string_view text, const JsonPath& path);

}  // namespace splitcubes::scene
