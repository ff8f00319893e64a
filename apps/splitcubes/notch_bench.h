// A notch that deepens from layer to layer, under each visibility criterion.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/occlusion/criterion.h>

#include <array>
#include <memory>
#include <vector>

namespace splitcubes::app {

/// A bar that is cut from above, between two layers of nodes.
struct NotchDepth {
    int across = 0;       // phyxels across the bar; a phyxel is two cells
    int layers = 0;       // of nodes that are cut
    double expected = 0;  // m, sag that the cut adds (theory::notch_sag)
    /// m, measured, in the order of occlusion::criterion_names.
    std::array<double, occlusion::criterion_names.size()> sag{};
};

/// Cuts bars of 4 and 6 phyxels across layer by layer up to three quarters of their height.
std::vector<NotchDepth> measure_notches(const std::shared_ptr<const Parallel>& parallel);

}  // namespace splitcubes::app
