// The 48 symmetries of the cube: their action on corners, edges, faces, masks, positions and crossings of a
// cell.
#pragma once

#include "splitting/cut_case.h"

#include <vector>

namespace splitcubes::splitting::cases {

/// Maps axis a to axis `to[a]`, reversed if flip[a].
struct Symmetry {
    std::array<int, 3> to;
    std::array<bool, 3> flip;

    bool mirrors() const {
        const bool even = to == std::array{0, 1, 2} || to == std::array{1, 2, 0} || to == std::array{2, 0, 1};
        return (flip[0] != flip[1]) != flip[2] ? even : !even;
    }
    int axis(int a) const { return to[static_cast<std::size_t>(a)]; }
    bool flips(int a) const { return flip[static_cast<std::size_t>(a)]; }
    int corner(int c) const {
        int out = 0;
        for (int a = 0; a < 3; ++a) out |= (corner_bit(c, a) ^ static_cast<int>(flips(a))) << axis(a);
        return out;
    }
    int edge(int e) const { return edge_between(corner(edge_corner(e, 0)), corner(edge_corner(e, 1))); }
    int face(int f) const {
        return 2 * axis(face_axis(f)) + ((f & 1) ^ static_cast<int>(flips(face_axis(f))));
    }
    CellMask mask(CellMask m) const {
        unsigned out = 0;
        for (int e = 0; e < edge_count; ++e) out |= (m >> e & 1U) << edge(e);
        return static_cast<CellMask>(out);
    }
    /// Maps a direction.
    Vec3 direction(const Vec3& v) const {
        Vec3 out;
        for (int a = 0; a < 3; ++a) out[axis(a)] = flips(a) ? -v[a] : v[a];
        return out;
    }
    /// Maps a position in a cell whose lowest corner is at zero; unit: cells.
    Vec3 position(const Vec3& p) const {
        Vec3 out;
        for (int a = 0; a < 3; ++a) out[axis(a)] = flips(a) ? 1 - p[a] : p[a];
        return out;
    }
    /// Maps a node of a grid with `side` nodes per axis.
    Vec3i node(const Vec3i& n, int side) const {
        Vec3i out;
        for (int a = 0; a < 3; ++a) out[axis(a)] = flips(a) ? side - 1 - n[a] : n[a];
        return out;
    }
    /// Maps an edge of such a grid.
    GridEdge edge(const GridEdge& e, int side) const {
        return {node(e.node, side).cwiseMin(node(e.upper(), side)), axis(e.axis)};
    }
    /// Maps a crossing in such a grid; for a cell at (0, 0, 0): side 2.
    EdgeCut crossing(const EdgeCut& c, int side = 2) const {
        EdgeCut out = c;
        out.edge = edge(c.edge, side);
        if (flips(c.edge.axis)) out.parameter = 1 - c.parameter;
        out.normal = direction(c.normal);
        return out;
    }
};

inline std::vector<Symmetry> all_symmetries() {
    std::vector<Symmetry> out;
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
            for (int flips = 0; flips < 8 && a != b; ++flips)
                out.push_back({{a, b, 3 - a - b}, {(flips & 1) != 0, (flips & 2) != 0, (flips & 4) != 0}});
    return out;
}

}  // namespace splitcubes::splitting::cases
