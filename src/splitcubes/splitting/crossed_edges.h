// Counts of the grid edges that a cutter crosses, to explain why a cut had no effect.
#pragma once

#include <splitcubes/splitting/node_grid.h>

#include <cstddef>

namespace splitcubes::splitting {

struct CrossedEdges {
    std::size_t uncut = 0;     // between inside nodes, not cut: would be cut
    std::size_t cut = 0;       // between inside nodes, already cut
    std::size_t boundary = 0;  // one end is outside, or the edge crosses a gap of the input

    void add(const NodeGrid& grid, const GridEdge& edge) {
        const bool lower = grid.inside(edge.node), upper = grid.inside(edge.upper());
        if (!lower && !upper) return;
        const std::int32_t slot = grid.slot(edge);
        if (slot < 0)
            ++uncut;
        else if (grid.crossing(slot).origin == Origin::cut)
            ++cut;
        else
            ++boundary;
    }
    void add(const CrossedEdges& other) {
        uncut += other.uncut;
        cut += other.cut;
        boundary += other.boundary;
    }
};

}  // namespace splitcubes::splitting
