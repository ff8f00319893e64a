#include <splitcubes/fracture/crack_cells.h>
#include <splitcubes/fracture/tuning.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

CrackCells::CrackCells(const NodeGrid& grid) : cell_index_(grid.bricks()), open_edge_index_(grid.bricks()) {}

void CrackCells::note_crossings(const NodeGrid& grid) {
    const auto& crossings = grid.crossings();
    for (; known_crossings_ < crossings.size(); ++known_crossings_) {
        const splitting::Crossing& c = crossings[known_crossings_];
        if (c.origin == splitting::Origin::boundary) continue;
        // The crossing shields edges up to two away on its grid line.
        for (int along = -2; along <= 2; ++along) {
            GridEdge edge = c.edge;
            edge.node[edge.axis] += along;
            for_cells_around(grid, edge,
                             [&](const CellKey& cell) { note_crossing_beside(grid, cell, along == 0); });
        }
    }
}

// Invalidates the tip of a cell near a new cut. is_own: an edge of the cell itself is cut, so that the cell
// is registered as a crack cell.
void CrackCells::note_crossing_beside(const NodeGrid& grid, const CellKey& cell, bool is_own) {
    const std::int32_t known = cell_index_.get({cell[0], cell[1], cell[2]}, 0);
    if (known >= 0) {
        cells_[static_cast<std::size_t>(known)].is_stale = true;
    } else if (is_own) {
        cell_index_.set({cell[0], cell[1], cell[2]}, 0, static_cast<std::int32_t>(cells_.size()));
        cells_.emplace_back().cell = cell;
        note_open_edges(grid, cell);
    }
}

// Registers the uncut edges of a new crack cell that are not yet registered.
void CrackCells::note_open_edges(const NodeGrid& grid, const CellKey& key) {
    for (int e = 0; e < splitting::edge_count; ++e) {
        const GridEdge edge = splitting::cell_edge({key[0], key[1], key[2]}, e);
        if (!is_uncut(grid, edge) || open_edge_index_.get(edge.node, edge.axis) >= 0) continue;
        open_edge_index_.set(edge.node, edge.axis, static_cast<std::int32_t>(open_edges_.size()));
        open_edges_.emplace_back().edge = edge;
    }
}

void CrackCells::forget_cut_edges() {
    for (CrackCell& cell : cells_) cell.is_stale = true;
    std::size_t kept = 0;
    for (const OpenEdge& open : open_edges_) {
        const bool is_cut = open.stretch < 0;
        open_edge_index_.set(open.edge.node, open.edge.axis, is_cut ? -1 : static_cast<std::int32_t>(kept));
        if (!is_cut) open_edges_[kept++] = open;
    }
    open_edges_.resize(kept);
}

bool CrackCells::cut(NodeGrid& grid, const CutProposal& proposal, std::vector<std::int32_t>& slots) {
    const GridEdge edge = splitting::edge_from_id(proposal.id);
    if (!(proposal.crack_opening > tuning::tearing::slab_opening) && is_shielded(grid, edge, proposal.normal))
        return false;
    const std::int32_t slot =
        grid.cut(edge, proposal.parameter, proposal.normal, splitting::Origin::cut, tear_cut_number);
    if (slot < 0) return false;
    slots.push_back(slot);
    torn_points_.push_back(grid.crossing_position(grid.crossing(slot)));
    return true;
}

bool CrackCells::is_uncut(const NodeGrid& grid, const GridEdge& edge) {
    return grid.has_edge(edge) && grid.inside(edge.node) && grid.inside(edge.upper()) && !grid.is_cut(edge);
}

bool CrackCells::is_shielded(const NodeGrid& grid, const GridEdge& edge, const Vec3& normal) {
    for (const int step : {-1, 1})
        for (int k = 1; k <= 2; ++k) {
            GridEdge other = edge;
            other.node[edge.axis] += step * k;
            if (!grid.has_edge(other)) break;
            const std::int32_t slot = grid.slot(other);
            if (slot < 0) continue;
            const splitting::Crossing& c = grid.crossing(slot);
            if (c.origin == splitting::Origin::boundary) break;
            if (std::abs(c.normal.dot(normal)) > tuning::tearing::min_opening_cosine) return true;
        }
    return false;
}

void CrackCells::list_cells_around(const NodeGrid& grid, std::span<const std::int32_t> slots,
                                   std::vector<CellKey>& out) {
    out.clear();
    for (const std::int32_t slot : slots)
        for_cells_around(grid, grid.crossing(slot).edge, [&](const CellKey& cell) { out.push_back(cell); });
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
}

}  // namespace splitcubes::body
