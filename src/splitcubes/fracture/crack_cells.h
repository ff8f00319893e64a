// The grid cells that cracks pass through, and the uncut edges of these cells.
#pragma once

#include <splitcubes/fracture/strength_field.h>
#include <splitcubes/math/types.h>
#include <splitcubes/splitting/node_grid.h>
#include <splitcubes/splitting/slot_map.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace splitcubes::body {

/// A grid cell, by its lowest node.
using CellKey = std::array<int, 3>;

/// Edge that tearing may cut.
struct CutProposal {
    static constexpr std::uint64_t no_edge = ~std::uint64_t{0};

    std::uint64_t id = no_edge;  // splitting::edge_id
    double load = 0;             // stress over strength
    double parameter = 0;        // of the crossing
    Vec3 normal = Vec3::Zero();
    double crack_opening = 0;  // stress that the opening implies ahead of the tip, over the strength
};

/// An edge of a crack cell that was uncut when the cell was registered.
struct OpenEdge {
    splitting::GridEdge edge;
    double stretch = 0;                   // as of the last step; negative: cut
    std::int32_t lower = -1, upper = -1;  // tracker indices of its nodes; -1: not known
    std::uint64_t queried_epoch = 0;      // epoch of CrackFront in which it was queried last
    // In that query: the crack cells that may cut it, in their order.
    std::uint32_t tip_count = 0;
    std::array<std::uint32_t, 4> tips{};
    std::uint8_t shielding = 0;  // bits of CrackTip::shielding that are set for all of them
};

/// A crack in a cell and its possible continuation.
struct CrackTip {
    Vec3 centre = Vec3::Zero(), normal = Vec3::Zero();  // mean of the cell's cuts; m, unit; rest space
    std::optional<WeakPlane> weak_plane;
    std::uint32_t edges = 0;  // bit e: edge e is uncut and within reach of the crack's plane
    // Per edge: the crossings on its grid line that shield it from being cut (bits of along_line),
    // whatever plane this tip proposes, unless the crack is wide open.
    std::array<std::uint8_t, splitting::edge_count> shielding{};
    std::array<std::int32_t, splitting::edge_count> open{};  // per edge of `edges`: index of its open edge
};

/// The two crack faces on a cut edge.
struct CrackFaces {
    std::int32_t lower = -1, upper = -1;  // tracker indices of its nodes; -1: not known
    std::int32_t edge = 0;                // of the cell
    double parameter = 0;                 // along the edge
};

/// A cell with an edge that has been cut (not by the boundary).
struct CrackCell {
    CellKey cell{};
    bool is_stale = true;  // an edge of it, or one that shields, was cut since the tip was computed
    std::uint64_t touched_epoch = 0;  // epoch of CrackSeparation in which the cell was touched last
    double opening_stress = 0;        // Pa, stress ahead of the tip that the crack opening implies
    CrackTip tip;
    std::uint32_t crack_face_count = 0;
    std::array<CrackFaces, splitting::edge_count> crack_faces{};
};

/// Registry of the crack cells of one body, in the order of their crossings, and of their uncut edges. The
/// parts of Tearing keep their per-cell and per-edge state in it.
class CrackCells {
  public:
    explicit CrackCells(const splitting::NodeGrid& grid);

    /// Registers the cuts made since the last call, by blades, sheets and tearing.
    void note_crossings(const splitting::NodeGrid& grid);
    /// Cuts the proposed edge unless it is shielded, and appends the slot of its crossing to `slots`.
    /// Returns whether it was cut. The cut is not registered before the next note_crossings.
    bool cut(splitting::NodeGrid& grid, const CutProposal& proposal, std::vector<std::int32_t>& slots);
    /// Forgets torn_points().
    void begin_step() { torn_points_.clear(); }
    /// Removes cut edges from the open ones, which changes their indices.
    void forget_cut_edges();

    std::vector<CrackCell>& cells() { return cells_; }
    const std::vector<CrackCell>& cells() const { return cells_; }
    /// Returns the index of a crack cell, or -1 if it is not registered.
    std::int32_t index_of(const CellKey& cell) const {
        return cell_index_.get({cell[0], cell[1], cell[2]}, 0);
    }
    /// Open edges of the crack cells, each once; some may have been cut since they were registered.
    std::vector<OpenEdge>& open_edges() { return open_edges_; }
    const std::vector<OpenEdge>& open_edges() const { return open_edges_; }
    /// Returns the index of an open edge, or -1.
    std::int32_t open_index_of(const splitting::GridEdge& edge) const {
        return open_edge_index_.get(edge.node, edge.axis);
    }
    /// Number of the grid's crossings that are registered.
    std::size_t known_crossings() const { return known_crossings_; }
    /// Positions of the crossings that `cut` made since begin_step; m, rest.
    const std::vector<Vec3>& torn_points() const { return torn_points_; }

    /// Returns whether both ends of the edge are inside and it is uncut.
    static bool is_uncut(const splitting::NodeGrid& grid, const splitting::GridEdge& edge);
    /// Returns whether one of the next two edges on the same grid line, to either side, is cut by a nearly
    /// parallel plane: a cut would split off a slab of one or two nodes.
    static bool is_shielded(const splitting::NodeGrid& grid, const splitting::GridEdge& edge,
                            const Vec3& normal);
    /// Lists the cells around the given cuts, each once, ascending.
    static void list_cells_around(const splitting::NodeGrid& grid, std::span<const std::int32_t> slots,
                                  std::vector<CellKey>& out);
    /// Calls use(cell) for the cells that share an edge.
    template <class Use>
    static void for_cells_around(const splitting::NodeGrid& grid, const splitting::GridEdge& edge,
                                 const Use& use) {
        for (int k = 0; k < 4; ++k) {
            Vec3i cell = edge.node;
            cell[(edge.axis + 1) % 3] -= k & 1;
            cell[(edge.axis + 2) % 3] -= k >> 1;
            if (grid.has_cell(cell)) use(CellKey{cell[0], cell[1], cell[2]});
        }
    }

  private:
    void note_crossing_beside(const splitting::NodeGrid& grid, const CellKey& cell, bool is_own);
    void note_open_edges(const splitting::NodeGrid& grid, const CellKey& cell);

    std::size_t known_crossings_ = 0;  // crossings of the grid that are registered
    std::vector<CrackCell> cells_;     // in order of registration
    splitting::SlotMap<1> cell_index_;
    std::vector<OpenEdge> open_edges_;
    splitting::SlotMap<3> open_edge_index_;
    std::vector<Vec3> torn_points_;  // m, rest
};

}  // namespace splitcubes::body
