// Topology of a body: which grid nodes are inside and which grid edges are cut. Connectivity is decided here
// alone; everything else is derived.
#pragma once

#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/splitting/cube.h>
#include <splitcubes/splitting/slot_map.h>

#include <array>
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

/// A grid face, from `node` along the two other axes.
struct GridFace {
    Vec3i node = Vec3i::Zero();
    int axis = 0;  // normal to it

    bool operator==(const GridFace& other) const { return node == other.node && axis == other.axis; }
};

/// Returns a face beside an edge. side: 2 k + s, 0 to 3; the face spans the edge's axis a and (a + 1 + k) %
/// 3, towards lower (s = 0) or higher (s = 1) nodes.
GridFace face_beside(const GridEdge& edge, int side);
/// Returns the edge of that face which is parallel to the given one.
GridEdge opposite_edge(const GridEdge& edge, int side);

/// Returns a grid edge as one number, stable for the life of a grid: 16 bits per coordinate, then the axis.
/// Its order is by axis, z, y, x.
std::uint64_t edge_id(const GridEdge& edge);
GridEdge edge_from_id(std::uint64_t id);

/// Steps in which the front of a sheet passes a face.
inline constexpr int front_steps = 16;

/// Crossing of a cut edge.
struct Crossing {
    GridEdge edge;
    double parameter;  // along the edge, within [min_parameter, 1 - min_parameter]
    double hit;        // the parameter before clamping, in [0, 1]: the true position of the sheet
    Vec3 normal;       // unit, rest space, never against the edge: normal[axis] >= 0
    Origin origin;
    std::int32_t cut;  // index of the cut; -1 for the boundary
    /// Per face_beside, used while that face has no other cut edge: how far the sheet's front has come on its
    /// way through the face (see front_ray), in 1 / front_steps; 0: it is not known, half way.
    std::array<std::uint8_t, 4> front = {};
};

/// A face in which a sheet ends: its only cut edge is that of `slot`, and it lies on that side of it.
struct CutFront {
    std::int32_t slot;
    std::uint8_t side;
};

/// State of a cell's corners and edges.
struct CellEdges {
    CellMask mask = 0;                           // bit e: edge e is cut
    std::uint8_t inside = 0;                     // bit c: corner c is inside
    std::array<std::int32_t, edge_count> slots;  // -1 where uncut
};

/// Minimum distance of a crossing from the nodes, as a share of the edge, so that no node lies on the
/// surface.
inline constexpr double min_parameter = 0.02;

/// Inside and outside nodes, and the cut edges with one crossing each. Cuts are only ever added; a slot
/// (index into crossings()) never changes. An edge between an inside and an outside node must be cut (see
/// validate.h).
class NodeGrid {
  public:
    NodeGrid() = default;
    explicit NodeGrid(const RestGrid& rest);

    const RestGrid& rest() const { return rest_; }
    const BrickLayout& bricks() const { return layout_; }

    bool inside(const Vec3i& node) const {
        return words_[layout_.brick_of(node)].inside >> BrickLayout::local(node) & 1U;
    }
    /// Sets the nodes first <= x < last of a row to inside. Only before the first cut.
    void set_inside_row(int y, int z, int first, int last);
    std::uint64_t inside_word(std::size_t brick) const { return words_[brick].inside; }
    std::uint64_t cut_word(std::size_t brick, int axis) const {
        return words_[brick].cut[static_cast<std::size_t>(axis)];
    }
    std::size_t inside_count() const;

    bool is_cut(const GridEdge& edge) const {
        return cut_word(layout_.brick_of(edge.node), edge.axis) >> BrickLayout::local(edge.node) & 1U;
    }
    /// Returns the slot of a cut edge, -1 if uncut.
    std::int32_t slot(const GridEdge& edge) const {
        return is_cut(edge) ? edge_slots_.get(edge.node, edge.axis) : -1;
    }
    /// Cuts an edge and returns its new slot. The first hit wins: if the edge is already cut, returns -1 and
    /// changes nothing. The parameter is clamped; the normal is normalised and oriented along the edge; a
    /// normal that is zero or not finite is replaced by the edge's direction.
    std::int32_t cut(const GridEdge& edge, double parameter, const Vec3& normal, Origin origin,
                     std::int32_t cut_number);
    /// Adds a crossing of an equal grid to an uncut edge and returns its new slot. `hit` must be in [0, 1]
    /// and the normal as `cut` leaves it.
    std::int32_t put(Crossing crossing);

    /// Returns whether the sheet of a cut between inside nodes ends in this face.
    bool ends_in(const CutFront& front) const;
    /// Moves the front of a sheet in a face to a step, 1 to front_steps - 1.
    void move_front(const CutFront& front, int step);

    const std::vector<Crossing>& crossings() const { return crossings_; }
    const Crossing& crossing(std::int32_t slot) const { return crossings_[static_cast<std::size_t>(slot)]; }

    /// Returns the rest position of a crossing, m.
    Vec3 crossing_position(const Crossing& crossing) const;

    bool has_edge(const GridEdge& edge) const {
        return rest_.contains(edge.node) && rest_.contains(edge.upper());
    }
    /// Returns whether all corners of the cell with this lowest node are in the grid.
    bool has_cell(const Vec3i& cell) const {
        return (cell.array() >= 0).all() && (cell.array() + 1 < rest_.node_count.array()).all();
    }
    CellMask cell_mask(const Vec3i& cell) const { return cell_edges(cell).mask; }
    /// Returns the corner bits; bit c: corner c is inside.
    unsigned cell_inside(const Vec3i& cell) const { return cell_edges(cell).inside; }
    CellEdges cell_edges(const Vec3i& cell) const;

    /// Reserves memory for that many cut edges, so that cuts reallocate nothing until then.
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
    std::vector<Crossing> crossings_;  // one per cut edge, in the order of cutting
};

/// Returns corner c of a cell as a node.
inline Vec3i corner_node(const Vec3i& cell, int corner) {
    return {cell[0] + corner_bit(corner, 0), cell[1] + corner_bit(corner, 1),
            cell[2] + corner_bit(corner, 2)};
}
/// Returns edge e of a cell.
inline GridEdge cell_edge(const Vec3i& cell, int edge) {
    return {corner_node(cell, edge_corner(edge, 0)), edge_axis(edge)};
}

}  // namespace splitcubes::splitting
