// Growth of cracks.
#include <splitcubes/fracture/crack_front.h>
#include <splitcubes/fracture/tuning.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

// Returns whether the crack of a cell cuts the edge under this stress, and sets `out` to the cut.
bool CrackFront::propose(const NodeGrid& grid, const CrackCell& cell, const EdgeStress& stress,
                         double strength, const GridEdge& edge, CutProposal& out) const {
    const CrackTip& tip = cell.tip;
    const Vec3 a = grid.rest().node_position(edge.node), b = grid.rest().node_position(edge.upper());
    Vec3 principal = (stress.world_from_rest.transpose() * stress.direction).normalized();
    if (principal.dot(tip.normal) < 0) principal = -principal;
    const double crack_opening = cell.opening_stress / strength;
    double load = stress.largest / strength;
    Vec3 turned = tip.normal;
    if (load > strength_.settings().propagation_ratio &&
        principal.dot(tip.normal) > tuning::tearing::min_opening_cosine)
        turned = ((1 - tuning::tearing::principal_share) * tip.normal +
                  tuning::tearing::principal_share * principal)
                     .normalized();
    else if (load = crack_opening; !(load > 1))
        return false;
    Vec3 through = tip.centre;
    if (tip.weak_plane) {
        through -=
            0.5 * (tip.centre - tip.weak_plane->point).dot(tip.weak_plane->normal) * tip.weak_plane->normal;
        turned = (tip.normal.dot(tip.weak_plane->normal) < 0 ? -1 : 1) * tip.weak_plane->normal;
    }
    const double along = turned.dot(b - a);
    if (std::abs(along) < 0.1 * grid.rest().cell_size) return false;
    const double parameter = turned.dot(through - a) / along;
    if (parameter < -tuning::tearing::edge_slack || parameter > 1 + tuning::tearing::edge_slack) return false;
    out = {splitting::edge_id(edge), load, std::clamp(parameter, 0.0, 1.0), turned, crack_opening};
    return true;
}

// Returns the cut of an edge: the mean of those that its crack cells propose. id == CutProposal::no_edge:
// none.
CutProposal CrackFront::propose(const NodeGrid& grid, const TearContext& context,
                                const OpenEdge& open) const {
    CutProposal mean;
    const Vec3i low = open.edge.node, high = open.edge.upper();
    const Vec3 middle = 0.5 * (grid.rest().node_position(low) + grid.rest().node_position(high));
    const double strength = std::max(strength_.at(middle), 1e-300);
    const EdgeStress stress = stress_.find_stress(context, grid, open.edge, {open.lower, open.upper},
                                                  stress_.stress_at(context, grid, low, open.lower) +
                                                      stress_.stress_at(context, grid, high, open.upper),
                                                  strength_.settings().propagation_ratio * strength);
    const bool is_stressed = stress.largest > 0;
    const auto opens = [&](std::uint32_t cell) { return cells_.cells()[cell].opening_stress > strength; };
    if (!is_stressed && std::none_of(open.tips.begin(), open.tips.begin() + open.tip_count, opens))
        return mean;
    if (!stress_.is_large(context, context.pieces.piece_of(grid, low))) return mean;
    int count = 0;
    for (std::uint32_t k = 0; k < open.tip_count; ++k) {
        CutProposal one;
        if (!propose(grid, cells_.cells()[open.tips[k]], stress, strength, open.edge, one)) continue;
        if (++count == 1) {
            mean = one;
            continue;
        }
        mean.load = std::max(mean.load, one.load);
        mean.crack_opening = std::max(mean.crack_opening, one.crack_opening);
        mean.parameter += one.parameter;
        mean.normal += (one.normal.dot(mean.normal) < 0 ? -1 : 1) * one.normal;
    }
    if (count > 0) mean.parameter /= count;
    return mean;
}

// Lists the cuts that the front proposes, the most loaded first.
void CrackFront::find_proposals(const NodeGrid& grid, const TearContext& context) {
    list_front_edges(grid, context);
    stress_.find_requested_stresses(context, grid);
    proposals_.resize(front_edges_.size());
    context.parallel.for_each(front_edges_.size(), tuning::grains::front_edges, [&](std::size_t k) {
        proposals_[k] = propose(grid, context, cells_.open_edges()[front_edges_[k]]);
    });
    std::erase_if(proposals_, [](const CutProposal& p) { return p.id == CutProposal::no_edge; });
    std::sort(proposals_.begin(), proposals_.end(), [](const CutProposal& a, const CutProposal& b) {
        return a.load != b.load ? a.load > b.load : a.id < b.id;
    });
}

void CrackFront::grow_loaded(NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots) {
    find_loaded_front(grid, context);
    grow(grid, context, slots);
}

void CrackFront::grow_from(std::size_t first, NodeGrid& grid, const TearContext& context,
                           std::vector<std::int32_t>& slots) {
    front_.clear();
    for (std::size_t k = first; k < cells_.cells().size(); ++k)
        front_.push_back(static_cast<std::uint32_t>(k));
    grow(grid, context, slots);
}

void CrackFront::grow(NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots) {
    const double rings = std::clamp(crack_speed_ * context.dt / cell_size_, 1.0, 1000.0);
    for (int ring = 0; ring < static_cast<int>(rings) && !front_.empty(); ++ring) {
        // Grows the front by one ring of cells; the cells around the new cuts are the next front.
        find_proposals(grid, context);
        const std::size_t before = slots.size();
        for (const CutProposal& proposal : proposals_) cells_.cut(grid, proposal, slots);
        cells_.note_crossings(grid);
        CrackCells::list_cells_around(grid, std::span(slots).subspan(before), touched_cells_);
        front_.clear();
        for (const CellKey& cell : touched_cells_)
            front_.push_back(static_cast<std::uint32_t>(cells_.index_of(cell)));
    }
}

}  // namespace splitcubes::body
