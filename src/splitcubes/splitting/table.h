// Surface topology of a face and of a cell for every set of cut edges: the paper's table of 2^12
// configurations (Pietroni et al. 2007, section 6), generated once.
#pragma once

#include <splitcubes/splitting/cube.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::splitting {

/// The six sets of cut edges of a face, up to symmetry (the paper's figure 3): by count and position.
enum class FaceKind : std::uint8_t {
    A,  // none
    B,  // one
    C,  // two neighbours: a corner is cut off
    D,  // two opposite ones: the face is cut in two
    E,  // three
    F,  // all four
};

/// One of the 16 masks of a face's ring edges.
struct FaceConfiguration {
    FaceKind kind;
    std::uint8_t cut_count;
    /// Per ring corner: the lowest ring corner connected to it over uncut ring edges. It names the instance
    /// of the face vertex that bounds the corner's material.
    std::array<std::uint8_t, 4> instance;
    /// Per ring edge (kinds C and D): +1 or -1, the direction along the axis that leaves the sheet on the
    /// same side for both cut edges; otherwise 0.
    std::array<std::int8_t, 4> side;
};

/// A quad (edge vertex, first face vertex, centre, second face vertex), counter-clockwise seen from the far
/// end of its edge.
struct TableQuad {
    std::uint8_t corner;  // the node whose material it bounds
    std::uint8_t edge;    // its cut edge
    std::uint8_t first_face;
    std::uint8_t second_face;
    std::uint8_t first_instance;  // face vertex instance (ring corner) on the first face
    std::uint8_t second_instance;
    std::uint8_t fan;  // centre vertex, 0 .. fan_count-1
};

/// One of the 2^12 masks of a cell's edges.
struct CellConfiguration {
    std::uint8_t component_count;
    std::array<std::uint8_t, corner_count>
        component;  // per corner: lowest corner reachable along uncut edges
    std::uint8_t fan_count;
    std::uint8_t group_count;
    std::array<std::uint8_t, 8> fan_corner;   // corner of the fan's first quad
    std::array<std::uint8_t, 8> fan_group;    // group of linked crossings that places its centre
    std::array<std::uint8_t, 8> fan_corners;  // bit c: corner c is of the fan's component
    std::array<std::uint8_t, 8> group_faces;  // bit f: an edge of the group lies on face f
    /// Per edge: the group of cut edges linked through fans; 255 if uncut.
    std::array<std::uint8_t, edge_count> edge_group;
    /// Per edge: the direction along its axis that points to one side of its sheet; the signs of a group are
    /// consistent if `group_oriented` is set.
    std::array<std::int8_t, edge_count> edge_side;
    std::array<bool, 8> group_oriented;
    /// Range of the quads of each corner: [corner_quads[c], corner_quads[c+1]).
    std::array<std::uint8_t, corner_count + 1> corner_quads;
    std::uint32_t first_quad;  // of all corners, in Table::quads
};

class Table {
  public:
    /// Returns the table. It is generated on first use (a few milliseconds) and then shared.
    static const Table& get();

    const FaceConfiguration& face(unsigned ring_mask) const { return faces_[ring_mask]; }
    const CellConfiguration& cell(CellMask mask) const { return cells_[mask]; }
    /// Returns all quads of a cell, sorted by corner, then edge.
    std::span<const TableQuad> quads(CellMask mask) const {
        const CellConfiguration& c = cells_[mask];
        return {quads_.data() + c.first_quad, c.corner_quads[corner_count]};
    }
    /// Returns the quads of one corner: the paper's 2^12 x 8 entries.
    std::span<const TableQuad> quads(CellMask mask, int corner) const {
        const CellConfiguration& c = cells_[mask];
        const auto k = static_cast<std::size_t>(corner);
        return {quads_.data() + c.first_quad + c.corner_quads[k],
                static_cast<std::size_t>(c.corner_quads[k + 1] - c.corner_quads[k])};
    }

  private:
    Table();
    void make_faces();
    void make_cell(CellMask mask);

    std::array<FaceConfiguration, 16> faces_;
    std::vector<CellConfiguration> cells_;
    std::vector<TableQuad> quads_;
};

}  // namespace splitcubes::splitting
