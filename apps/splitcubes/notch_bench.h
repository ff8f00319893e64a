// A notch that deepens from layer to layer, under each visibility criterion.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/occlusion/criterion.h>

#include <array>
#include <memory>
#include <vector>

namespace splitcubes::app {

/// A bar that is cut from above.
struct NotchDepth {
    int across = 0;       // phyxels across the bar; a phyxel is two cells
    double cells = 0;     // depth of the cut; nodes lie at every half
    double expected = 0;  // m, sag that the cut adds (theory::notch_sag)
    /// m, measured, in the order of occlusion::criterion_names.
    std::array<double, occlusion::criterion_names.size()> sag{};
};

/// Depths measured in each cell of depth.
inline constexpr int notch_depths_per_cell = 4;

/// Cuts bars of 4 and 6 phyxels across up to three quarters of their height. The first depth is half a part
/// of a cell, so no cut ends at a row of phyxels or nodes.
std::vector<NotchDepth> measure_notches(const std::shared_ptr<const Parallel>& parallel);

}  // namespace splitcubes::app
