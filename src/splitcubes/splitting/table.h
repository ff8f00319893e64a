// What every set of cut edges makes of a face and of a cell: the paper's table
// of 2^12 configurations (Pietroni et al. 2007, section 6), made once by the
// procedure it stands for.
#pragma once

#include <splitcubes/splitting/cube.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::splitting {

/// The six ways in which a face's edges can be cut, up to symmetry
/// (the paper's figure 3): by number and place of the cut edges.
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
    /// Per ring corner: the lowest ring corner that it can be reached from along
    /// uncut ring edges. Names the instance of the face vertex it depends on.
    std::array<std::uint8_t, 4> instance;
    /// Per ring edge (kinds C and D): +1 or -1, the sense along the axis in which
    /// the sheet that crosses the face is left by both edges on the same side; else 0.
    std::array<std::int8_t, 4> side;
};

/// A quad (edge vertex, first face vertex, centre, second face vertex),
/// counter-clockwise seen from the far end of its edge.
struct TableQuad {
    std::uint8_t corner;  // the node whose material it bounds
    std::uint8_t edge;    // the cut edge it belongs to
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
    /// Per fan: the first quad (of the whole table entry) that belongs to it. Two
    /// configurations name the same fan the same way when this quad agrees.
    std::array<std::uint8_t, 8> fan_corner;   // a corner of the fan's component
    std::array<std::uint8_t, 8> fan_group;    // the sheet group that places its centre
    std::array<std::uint8_t, 8> fan_corners;  // bit c: corner c is of the fan's component
    std::array<std::uint8_t, 8> group_faces;  // bit f: an edge of the group lies on face f
    /// Per edge: the group of cut edges linked through fans; 255 where uncut.
    std::array<std::uint8_t, edge_count> edge_group;
    /// Per edge: sense along its axis that points to one side of its sheet; signs
    /// of a group are consistent where `group_oriented` holds.
    std::array<std::int8_t, edge_count> edge_side;
    std::array<bool, 8> group_oriented;
    /// Range of the quads of each corner: [corner_quads[c], corner_quads[c+1]).
    std::array<std::uint8_t, corner_count + 1> corner_quads;
    std::uint32_t first_quad;  // of all corners, in Table::quads
};

class Table {
  public:
    /// Made by enumeration on first use (a few milliseconds), then shared.
    static const Table& get();

    const FaceConfiguration& face(unsigned ring_mask) const { return faces_[ring_mask]; }
    const CellConfiguration& cell(CellMask mask) const { return cells_[mask]; }
    /// All quads of a cell, sorted by corner, then edge.
    std::span<const TableQuad> quads(CellMask mask) const {
        const CellConfiguration& c = cells_[mask];
        return {quads_.data() + c.first_quad, c.corner_quads[corner_count]};
    }
    /// The quads of one corner: the paper's 2^12 x 8 entries.
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
