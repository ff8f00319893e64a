#include <splitcubes/fracture/crack_separation.h>
#include <splitcubes/fracture/tuning.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

namespace {

// Whether the edge has been cut, not by the boundary.
bool is_cracked(const NodeGrid& grid, const GridEdge& edge) {
    if (!grid.has_edge(edge)) return false;
    const std::int32_t slot = grid.slot(edge);
    return slot >= 0 && grid.crossing(slot).origin != splitting::Origin::boundary;
}

// Returns the distance, in cells, from a node along an axis to the first cut edge; max_distance if there is
// none before.
int distance_to_crack(const NodeGrid& grid, const Vec3i& node, int axis, int step, int max_distance) {
    GridEdge edge{node, axis};
    if (step < 0) --edge.node[axis];
    for (int distance = 0; distance < max_distance; ++distance, edge.node[axis] += step)
        if (is_cracked(grid, edge)) return distance;
    return max_distance;
}

// Whether at least two of the four parallel edges around are cut, and at least three are cut or not
// inside.
bool is_passed(const NodeGrid& grid, const GridEdge& edge) {
    int torn = 0, outside = 0;
    for (int k = 0; k < 4; ++k) {
        GridEdge other = edge;
        other.node[(edge.axis + 1 + (k & 1)) % 3] += k < 2 ? -1 : 1;
        if (!grid.has_edge(other) || !grid.inside(other.node) || !grid.inside(other.upper())) {
            ++outside;
        } else if (grid.is_cut(other)) {
            ++torn;
        }
    }
    return torn >= 2 && torn + outside >= 3;
}

// Whether the edge is the riser of a step between two sheets: one sheet ends beside its lower node, the other
// beside its upper node, on opposite sides and within max_riser.
bool is_riser(const NodeGrid& grid, const GridEdge& edge) {
    constexpr int max_riser = tuning::tearing::max_riser;
    for (int k = 1; k <= 2; ++k) {
        const int across = (edge.axis + k) % 3;
        const int low_back = distance_to_crack(grid, edge.node, across, -1, max_riser);
        const int low_ahead = distance_to_crack(grid, edge.node, across, 1, max_riser);
        if ((low_back < max_riser) == (low_ahead < max_riser)) continue;
        const int to_low = low_back < max_riser ? -1 : 1;
        if (distance_to_crack(grid, edge.upper(), across, to_low, max_riser) < max_riser) continue;
        const int high = distance_to_crack(grid, edge.upper(), across, -to_low, max_riser);
        if (std::min(low_back, low_ahead) + high < max_riser) return true;
    }
    return false;
}

// Whether is_passed and is_riser of the cell's edges may depend on this edge.
bool is_near(const GridEdge& edge, const CellKey& cell) {
    constexpr int max_distance = tuning::tearing::max_riser + 1;
    int distance = 0;
    for (int axis = 0; axis < 3; ++axis)
        distance = std::max(distance, std::abs(edge.node[axis] - cell[static_cast<std::size_t>(axis)]));
    return distance <= max_distance;
}

}  // namespace

CrackSeparation::CrackSeparation(const StrengthField& strength, const StressField& stress, CrackCells& cells,
                                 const meshless::Material& material, const NodeGrid& grid)
    : stress_(stress),
      cells_(cells),
      cell_size_(grid.rest().cell_size),
      // At least 1.5, because the frames at the edges of a rough crack are noisy.
      break_stretch_(1 + std::max(0.5, 3 * strength.settings().strength / material.youngs_modulus) +
                     (material.plasticity ? material.plasticity->maximum : 0)) {}

void CrackSeparation::break_ligaments(NodeGrid& grid, const TearContext& context,
                                      std::vector<std::int32_t>& slots) {
    context.parallel.for_each(cells_.open_edges().size(), tuning::grains::crack_faces, [&](std::size_t k) {
        OpenEdge& open = cells_.open_edges()[k];
        if (open.stretch < 0) return;
        open.stretch = -1;
        if (grid.is_cut(open.edge)) return;
        const geometry::Frame* a = context.frame_of(open.edge.node, open.lower);
        const geometry::Frame* b = context.frame_of(open.edge.upper(), open.upper);
        open.stretch = a && b ? (b->position - a->position).norm() / cell_size_ : 0;
    });
    proposals_.clear();
    std::size_t cut = 0;
    for (const OpenEdge& open : cells_.open_edges()) {
        cut += open.stretch < 0;
        if (open.stretch > break_stretch_)
            proposals_.push_back(
                {splitting::edge_id(open.edge), open.stretch, 0.5, Vec3::Unit(open.edge.axis)});
    }
    if (2 * cut > cells_.open_edges().size()) cells_.forget_cut_edges();
    std::sort(proposals_.begin(), proposals_.end(), [](const CutProposal& x, const CutProposal& y) {
        return x.load != y.load ? x.load > y.load : x.id < y.id;
    });
    separated_nodes_.clear();
    for (const CutProposal& proposal : proposals_) {
        const GridEdge edge = splitting::edge_from_id(proposal.id);
        const Vec3i low = edge.node, high = edge.upper();
        const CellKey a{low[0], low[1], low[2]}, b{high[0], high[1], high[2]};
        const auto has_separated = [&](const CellKey& node) {
            return std::find(separated_nodes_.begin(), separated_nodes_.end(), node) !=
                   separated_nodes_.end();
        };
        if (has_separated(a) || has_separated(b)) continue;
        separated_nodes_.push_back(a);
        separated_nodes_.push_back(b);
        const std::int32_t slot =
            grid.cut(edge, proposal.parameter, proposal.normal, splitting::Origin::cut, tear_cut_number);
        if (slot >= 0) slots.push_back(slot);
    }
}

// Whether this cell is the first of the touched cells that share the edge.
bool CrackSeparation::is_first_around(const NodeGrid& grid, const GridEdge& edge, const CellKey& key) const {
    bool is_first = true;
    CrackCells::for_cells_around(grid, edge, [&](const CellKey& cell) {
        const std::int32_t known = cell < key ? cells_.index_of(cell) : -1;
        is_first = is_first &&
                   (known < 0 || cells_.cells()[static_cast<std::size_t>(known)].touched_epoch != epoch_);
    });
    return is_first;
}

// Returns the edges of a cell that cracks have passed, one bit per edge, without those that an earlier
// touched cell reports.
std::uint32_t CrackSeparation::passed_edges_in(const NodeGrid& grid, const TearContext& context,
                                               const CellKey& key) const {
    std::uint32_t out = 0;
    for (int e = 0; e < splitting::edge_count; ++e) {
        const GridEdge edge = splitting::cell_edge({key[0], key[1], key[2]}, e);
        if (CrackCells::is_uncut(grid, edge) && is_first_around(grid, edge, key) &&
            (is_passed(grid, edge) || is_riser(grid, edge)) &&
            stress_.is_large(context, context.pieces.piece_of(grid, edge.node)))
            out |= std::uint32_t{1} << e;
    }
    return out;
}

void CrackSeparation::cut_passed_edges(NodeGrid& grid, const TearContext& context,
                                       std::vector<std::int32_t>& slots) {
    std::size_t before = 0;
    cells_.note_crossings(grid);
    for (int pass = 0; pass < tuning::tearing::max_passed_edge_passes; ++pass) {
        CrackCells::list_cells_around(grid, slots, touched_cells_);
        // Only cells near the last pass's cuts can have changed.
        if (pass > 0)
            std::erase_if(touched_cells_, [&](const CellKey& cell) {
                return std::none_of(
                    slots.begin() + static_cast<std::ptrdiff_t>(before), slots.end(),
                    [&](std::int32_t slot) { return is_near(grid.crossing(slot).edge, cell); });
            });
        ++epoch_;
        for (const CellKey& cell : touched_cells_)
            cells_.cells()[static_cast<std::size_t>(cells_.index_of(cell))].touched_epoch = epoch_;
        passed_edges_.resize(touched_cells_.size());
        context.parallel.for_each(touched_cells_.size(), tuning::grains::passed_cells, [&](std::size_t k) {
            passed_edges_[k] = passed_edges_in(grid, context, touched_cells_[k]);
        });
        before = slots.size();
        for (std::size_t k = 0; k < touched_cells_.size(); ++k)
            for (std::uint32_t edges = passed_edges_[k]; edges != 0; edges &= edges - 1) {
                const Vec3i cell(touched_cells_[k][0], touched_cells_[k][1], touched_cells_[k][2]);
                const GridEdge edge = splitting::cell_edge(cell, std::countr_zero(edges));
                cells_.cut(grid, {splitting::edge_id(edge), 0, 0.5, Vec3::Unit(edge.axis)}, slots);
            }
        if (slots.size() == before) return;
        cells_.note_crossings(grid);
    }
}

}  // namespace splitcubes::body
