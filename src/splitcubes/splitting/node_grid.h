// The topology of a body: which grid nodes are material and which grid edges
// are cut. This alone decides what hangs together; everything else is derived.
#pragma once

#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/splitting/cube.h>
#include <splitcubes/splitting/slot_map.h>

#include <cstdint>
#include <vector>

namespace splitcubes::splitting {

using geometry::Origin;
using geometry::RestGrid;

/// A grid edge, from `node` to node + axis.
struct GridEdge {
    Vec3i node = Vec3i::Zero();
    int axis = 0;

    Vec3i upper() const {
        Vec3i n = node;
        ++n[axis];
        return n;
    }
    bool operator==(const GridEdge& other) const { return node == other.node && axis == other.axis; }
};

/// A grid edge as one number, stable for the life of a grid: 16 bits a
/// coordinate, then the axis. Sorting by it sorts by axis, z, y, x.
std::uint64_t edge_id(const GridEdge& edge);
GridEdge edge_from_id(std::uint64_t id);

/// Where a cut edge is crossed.
struct Crossing {
    GridEdge edge;
    double parameter;  // along the edge, within [min_parameter, 1 - min_parameter]
    double hit;        // the same before it was clamped, [0, 1]: where the sheet really is
    Vec3 normal;       // unit, rest space, never against the edge: normal[axis] >= 0
    Origin origin;
    std::int32_t cut;  // which cut made it; -1 for the boundary
};

/// What a cell's corners and edges are.
struct CellEdges {
    CellMask mask = 0;                           // bit e: edge e is cut
    std::uint8_t inside = 0;                     // bit c: corner c is inside
    std::array<std::int32_t, edge_count> slots;  // -1 where uncut
};

/// No crossing comes nearer to a node than this share of the edge, so that no
/// node lies on the surface.
inline constexpr double min_parameter = 0.02;

/// Nodes inside or outside, and the cut edges with one crossing each. Cuts are
/// only ever added; a slot (index into crossings()) never changes. An edge
/// between an inside and an outside node must be cut (see validate.h).
class NodeGrid {
  public:
    NodeGrid() = default;
    explicit NodeGrid(const RestGrid& rest);

    const RestGrid& rest() const { return rest_; }
    const BrickLayout& bricks() const { return layout_; }

    bool inside(const Vec3i& node) const {
        return words_[layout_.brick_of(node)].inside >> BrickLayout::local(node) & 1U;
    }
    /// Sets all nodes first <= x < last of a row. Only before the first cut.
    void set_inside_row(int y, int z, int first, int last);
    std::uint64_t inside_word(std::size_t brick) const { return words_[brick].inside; }
    std::uint64_t cut_word(std::size_t brick, int axis) const {
        return words_[brick].cut[static_cast<std::size_t>(axis)];
    }
    std::size_t inside_count() const;

    bool is_cut(const GridEdge& edge) const {
        return cut_word(layout_.brick_of(edge.node), edge.axis) >> BrickLayout::local(edge.node) & 1U;
    }
    /// Slot of a cut edge, -1 where uncut.
    std::int32_t slot(const GridEdge& edge) const {
        return is_cut(edge) ? edge_slots_.get(edge.node, edge.axis) : -1;
    }
    /// Cuts an edge. The first hit wins: returns -1, and changes nothing, where the
    /// edge is cut already, else the new slot. The parameter is clamped, the normal
    /// normalised and turned along the edge; a normal that is zero or not finite
    /// becomes the edge's direction.
    std::int32_t cut(const GridEdge& edge, double parameter, const Vec3& normal, Origin origin,
                     std::int32_t cut_number);
    /// The same for a crossing of an equal grid: of an uncut edge, with a `hit` within [0, 1] and a normal as
    /// `cut` left it. Returns the new slot.
    std::int32_t put(Crossing crossing);

    const std::vector<Crossing>& crossings() const { return crossings_; }
    const Crossing& crossing(std::int32_t slot) const { return crossings_[static_cast<std::size_t>(slot)]; }

    /// Rest position of a crossing, m.
    Vec3 crossing_position(const Crossing& crossing) const;

    bool has_edge(const GridEdge& edge) const {
        return rest_.contains(edge.node) && rest_.contains(edge.upper());
    }
    /// The cell's lowest node must leave room for the cell.
    bool has_cell(const Vec3i& cell) const {
        return (cell.array() >= 0).all() && (cell.array() + 1 < rest_.node_count.array()).all();
    }
    CellMask cell_mask(const Vec3i& cell) const { return cell_edges(cell).mask; }
    /// Bit c: corner c is inside.
    unsigned cell_inside(const Vec3i& cell) const { return cell_edges(cell).inside; }
    CellEdges cell_edges(const Vec3i& cell) const;

    /// Room for that many cut edges, so that cuts copy nothing until then.
    void reserve(std::size_t crossing_count) { crossings_.reserve(crossing_count); }
    std::size_t bytes() const;

  private:
    RestGrid rest_;
    BrickLayout layout_;
    struct BrickWords {
        std::uint64_t inside = 0;            // a bit per node
        std::array<std::uint64_t, 3> cut{};  // per axis, a bit per edge, at its lower node
    };
    std::vector<BrickWords> words_;    // per brick
    SlotMap<3> edge_slots_;            // per edge, at its lower node
    std::vector<Crossing> crossings_;  // one per cut edge, in the order they were cut
};

/// Corner c of a cell as a node.
inline Vec3i corner_node(const Vec3i& cell, int corner) {
    return {cell[0] + corner_bit(corner, 0), cell[1] + corner_bit(corner, 1),
            cell[2] + corner_bit(corner, 2)};
}
/// Edge e of a cell.
inline GridEdge cell_edge(const Vec3i& cell, int edge) {
    return {corner_node(cell, edge_corner(edge, 0)), edge_axis(edge)};
}

}  // namespace splitcubes::splitting
