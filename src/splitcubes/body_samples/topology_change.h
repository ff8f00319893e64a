// Changes of a body's topology in one step, passed from stage to stage.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/math/types.h>
#include <splitcubes/splitting/pieces.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace splitcubes::body {

/// Parts of a piece that no pair of phyxels could connect.
struct Gap {
    Vec3i node = Vec3i::Zero();            // inside node between them, where a phyxel is needed
    std::uint32_t inside = 0, around = 0;  // a phyxel of the smaller part, and the nearest one of the rest
};

/// The stages of a step fill it in their order; each reads the fields that earlier stages wrote. After the
/// step it lists what the step changed, until the next one begins.
struct TopologyChange {
    std::vector<std::int32_t> crossings;        // cut_edges, tear: new ones of the NodeGrid, ascending slots
    std::vector<splitting::CutFront> fronts;    // cut_edges: those of earlier cuts that moved
    std::vector<std::uint32_t> cells;           // retessellate: cells of the Surface that were made again
    std::vector<geometry::Box> boxes;           // retessellate: m, rest space; contain all that changed
    std::vector<splitting::PieceSplit> splits;  // label_pieces
    std::vector<std::int32_t> fast_fragments;   // resample: pieces that become rigid, ascending
    std::size_t new_phyxels = 0;                // resample: appended last
    bool volumes_changed = false;               // resample: of phyxels
    std::vector<std::uint32_t>
        dirty_pairs;        // update_visibility, resample: their links are not up to date yet
    std::vector<Gap> gaps;  // update_visibility; resample fills them
    /// update_visibility: groups of phyxels, each ascending, that had lost all links to the rest of their
    /// piece and got new ones.
    std::vector<std::vector<std::uint32_t>> rejoined;

    bool empty() const { return crossings.empty() && fast_fragments.empty(); }
    /// Keeps the capacity of the arrays.
    void clear() {
        crossings.clear();
        fronts.clear();
        cells.clear();
        boxes.clear();
        splits.clear();
        fast_fragments.clear();
        new_phyxels = 0;
        volumes_changed = false;
        dirty_pairs.clear();
        gaps.clear();
        rejoined.clear();
    }
};

}  // namespace splitcubes::body
