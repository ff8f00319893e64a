// A small grid with its cuts as plain data: what the laws of the surface are
// tried on, what a failing test is shrunk to, and what can be pasted into one.
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
    std::int32_t cut = 0;        // -1: of the boundary, as all crossings of the skin are
};

/// Nodes 0 .. node_count-1 an axis, those of the rim outside whatever `inside` says.
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

/// Slot of the edge, newly cut; -1 where it is outside or cut already.
inline std::int32_t apply(NodeGrid& grid, const EdgeCut& c) {
    if (!grid.has_edge(c.edge)) return -1;
    const bool lower = grid.inside(c.edge.node), upper = grid.inside(c.edge.upper());
    if (!lower && !upper) return -1;
    const bool skin = lower != upper || c.cut < 0;
    return grid.cut(c.edge, c.parameter, c.normal, skin ? Origin::boundary : Origin::cut, skin ? -1 : c.cut);
}

/// The case's nodes and skin: its crossings of the skin, and the middle of each
/// edge of the skin that it has none for.
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

/// Slots of the edges that were cut.
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

/// side^3 nodes, each inside by chance `fill`, each edge between two of them
/// crossed by chance `density`, the skin crossed anywhere. A tenth of the inner
/// crossings are of the boundary, the others of three cuts.
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
