// Selection of pieces by size.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::splitting {

struct PieceChoice {
    double min_volume = 0;    // m^3; smaller pieces are dropped; 0: none
    std::size_t largest = 0;  // only this many of the largest are kept; 0: all

    bool all() const { return min_volume <= 0 && largest == 0; }
};

/// Returns flags of the pieces to drop, by index. Pieces whose flag in `left_out` is not zero (none if it is
/// empty) are neither dropped nor counted. Of pieces with equal volumes the one with the lower index counts
/// as larger.
std::vector<std::uint8_t> pieces_to_drop(std::span<const double> volumes,
                                         std::span<const std::uint8_t> left_out, const PieceChoice& choice);

}  // namespace splitcubes::splitting
