// Suggestions for mistyped words.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace splitcubes {

/// Returns how many letters must be inserted, deleted, replaced or swapped with the next one to turn one word
/// into the other (optimal string alignment distance).
std::size_t typing_distance(std::string_view a, std::string_view b);

/// Returns the known word nearest to `word`, the first of equally near ones. A known word that starts with
/// `word`, of at least three letters, has distance 1. Returns an empty string if every known word needs more
/// changes than a third of the letters of the shorter word, rounded.
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

}  // namespace splitcubes
