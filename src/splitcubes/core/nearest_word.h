// The known word that a mistyped one was meant to be.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace splitcubes {

/// Letters to insert, leave out, replace or swap with the next one to make one word of the other
/// (optimal string alignment distance).
std::size_t typing_distance(std::string_view a, std::string_view b);

/// Of the known words the nearest to `word`, the first of several; one that `word` begins, with three letters
/// or more, counts as near. Empty where none is near enough to be meant: it takes more changes than a third
/// of the letters of the shorter of the two, rounded.
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

}  // namespace splitcubes
