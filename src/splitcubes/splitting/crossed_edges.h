// What something that should cut crosses in a grid: asked of what cut nothing, to say why.
#pragma once

#include <splitcubes/splitting/node_grid.h>

#include <cstddef>

namespace splitcubes::splitting {

struct CrossedEdges {
    std::size_t uncut = 0;  // between inside nodes: would be cut
    std::size_t cut = 0;    // between inside nodes, cut before
    std::size_t skin = 0;   // with one end outside, or across a gap of the input

    void add(const NodeGrid& grid, const GridEdge& edge) {
        const bool lower = grid.inside(edge.node), upper = grid.inside(edge.upper());
        if (!lower && !upper) return;
        const std::int32_t slot = grid.slot(edge);
        if (slot < 0)
            ++uncut;
        else if (grid.crossing(slot).origin == Origin::cut)
            ++cut;
        else
            ++skin;
    }
    void add(const CrossedEdges& other) {
        uncut += other.uncut;
        cut += other.cut;
        skin += other.skin;
    }
};

}  // namespace splitcubes::splitting
