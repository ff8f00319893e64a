// Which pieces are worth keeping.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::splitting {

struct PieceChoice {
    double min_volume = 0;    // m^3; pieces below it are dropped; 0: none
    std::size_t largest = 0;  // only so many of the largest are kept; 0: all

    bool all() const { return min_volume <= 0 && largest == 0; }
};

/// Flags of the pieces to drop, by number. Pieces whose flag in `left_out` is not zero (none where it is
/// empty) are neither dropped nor counted. Of pieces of equal volume those of lower number are larger.
std::vector<std::uint8_t> pieces_to_drop(std::span<const double> volumes,
                                         std::span<const std::uint8_t> left_out, const PieceChoice& choice);

}  // namespace splitcubes::splitting
