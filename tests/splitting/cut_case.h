// A small grid with its cuts as plain data: the input of property tests of the surface, the result of
// shrinking a failing case, and code that can be pasted into a test.
#pragma once

#include <splitcubes/core/random.h>
#include <splitcubes/splitting/surface.h>

#include <span>
#include <vector>

namespace splitcubes::splitting::cases {

struct EdgeCut {
    GridEdge edge;
    double parameter = 0.5;
    Vec3 normal = Vec3::Zero();  // zero: along the edge
    std::int32_t cut = 0;        // -1: of the boundary, as all crossings of the surface are
};

/// Nodes 0 .. node_count-1 per axis; the nodes of the rim are outside whatever `inside` contains.
struct CutCase {
    Vec3i node_count = Vec3i::Zero();
    std::vector<Vec3i> inside;
    std::vector<EdgeCut> cuts;
};

template <class Visit>
void for_each_edge(const NodeGrid& grid, const Visit& visit) {
    const Vec3i n = grid.rest().node_count;
    for (int z = 0; z < n[2]; ++z)
        for (int y = 0; y < n[1]; ++y)
            for (int x = 0; x < n[0]; ++x)
                for (int axis = 0; axis < 3; ++axis)
                    if (const GridEdge edge{{x, y, z}, axis}; grid.has_edge(edge)) visit(edge);
}

/// Cuts an edge and returns its new slot; -1 if it is outside or already cut.
inline std::int32_t apply(NodeGrid& grid, const EdgeCut& c) {
    if (!grid.has_edge(c.edge)) return -1;
    const bool lower = grid.inside(c.edge.node), upper = grid.inside(c.edge.upper());
    if (!lower && !upper) return -1;
    const bool is_boundary = lower != upper || c.cut < 0;
    return grid.cut(c.edge, c.parameter, c.normal, is_boundary ? Origin::boundary : Origin::cut,
                    is_boundary ? -1 : c.cut);
}

/// Returns the case's nodes with their boundary crossings; a boundary edge without one is crossed at its
/// middle.
inline NodeGrid uncut_grid(const CutCase& c) {
    RestGrid rest;
    rest.cell_size = 0.125;
    rest.origin = Vec3(-0.5, 0.25, 0.75);
    rest.node_count = c.node_count;
    NodeGrid grid(rest);
    for (const Vec3i& n : c.inside)
        if ((n.array() >= 1).all() && (n.array() + 1 < c.node_count.array()).all())
            grid.set_inside_row(n[1], n[2], n[0], n[0] + 1);
    for (const EdgeCut& cut : c.cuts)
        if (grid.has_edge(cut.edge) && grid.inside(cut.edge.node) != grid.inside(cut.edge.upper()))
            apply(grid, cut);
    for_each_edge(grid, [&](const GridEdge& edge) {
        if (grid.inside(edge.node) != grid.inside(edge.upper())) apply(grid, {edge, 0.5, Vec3::Zero(), -1});
    });
    return grid;
}

/// Cuts the edges and returns the slots of those that were not cut before.
inline std::vector<std::int32_t> apply_all(NodeGrid& grid, std::span<const EdgeCut> cuts) {
    std::vector<std::int32_t> slots;
    for (const EdgeCut& c : cuts)
        if (const std::int32_t slot = apply(grid, c); slot >= 0) slots.push_back(slot);
    return slots;
}

inline NodeGrid grid_of(const CutCase& c) {
    NodeGrid grid = uncut_grid(c);
    apply_all(grid, c.cuts);
    return grid;
}

inline Vec3 random_normal(Random& random) {
    const double x = random.uniform(-1, 1), y = random.uniform(-1, 1);
    return {x, y, random.uniform(-1, 1)};
}

/// Returns a case of side^3 nodes: each is inside with probability `fill`, each edge between two inside nodes
/// is crossed with probability `density`, boundary edges are crossed anywhere. A tenth of the inner crossings
/// belong to the boundary, the others to three cuts.
inline CutCase random_case(Random& random, int side, double fill, double density) {
    CutCase out;
    out.node_count = Vec3i::Constant(side + 2);
    for (int z = 1; z <= side; ++z)
        for (int y = 1; y <= side; ++y)
            for (int x = 1; x <= side; ++x)
                if (random.unit() < fill) out.inside.emplace_back(x, y, z);
    const NodeGrid grid = uncut_grid(out);
    for_each_edge(grid, [&](const GridEdge& edge) {
        const bool lower = grid.inside(edge.node), upper = grid.inside(edge.upper());
        if (lower != upper || (lower && random.unit() < density)) {
            EdgeCut c{edge, random.unit(), random_normal(random), -1};
            if (lower == upper && random.below(10) > 0) c.cut = static_cast<std::int32_t>(random.below(3));
            out.cuts.push_back(c);
        }
    });
    return out;
}

template <class Item>
void shuffle(std::vector<Item>& items, Random& random) {
    for (std::size_t i = items.size(); i > 1; --i)
        std::swap(items[i - 1], items[random.below(static_cast<std::uint32_t>(i))]);
}

}  // namespace splitcubes::splitting::cases
