// Growth of cracks, and rupture of the ligaments that they leave.
#include <splitcubes/body/tearing.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

using splitting::GridEdge;
using splitting::NodeGrid;

namespace {

// Open edges per parallel task: a quarter of those in break_ligaments; those in find_proposals.
constexpr std::size_t face_grain = 64, edge_grain = 16;
// Share of the principal direction in the normal of a crack's continuation. The phyxels' stress is noisy
// around a tip, so a larger share makes cracks rough; a smaller one makes them turn late.
constexpr double turning_share = 0.25;
}  // namespace

// Returns whether the crack of a cell cuts the edge under this stress, and sets `out` to the cut.
bool Tearing::propose(const NodeGrid& grid, const CrackCell& cell, const Stress& stress, double strength,
                      const GridEdge& edge, Proposal& out) const {
    const Tip& tip = cell.tip;
    const Vec3 a = grid.rest().node_position(edge.node), b = grid.rest().node_position(edge.upper());
    Vec3 principal = (stress.world_from_rest.transpose() * stress.direction).normalized();
    if (principal.dot(tip.normal) < 0) principal = -principal;
    const double crack_opening = cell.opening_stress / strength;
    double load = stress.largest / strength;
    Vec3 turned = tip.normal;
    if (load > settings_.propagation_ratio && principal.dot(tip.normal) > min_opening_cosine)
        turned = ((1 - turning_share) * tip.normal + turning_share * principal).normalized();
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
    if (parameter < -edge_slack || parameter > 1 + edge_slack) return false;
    out = {splitting::edge_id(edge), load, std::clamp(parameter, 0.0, 1.0), turned, crack_opening};
    return true;
}

// Returns the cut of an edge: the mean of those that its crack cells propose. id == no_edge: none.
Tearing::Proposal Tearing::propose(const NodeGrid& grid, const TearContext& context,
                                   const OpenEdge& open) const {
    Proposal mean;
    const Vec3i low = open.edge.node, high = open.edge.upper();
    const Vec3 middle = 0.5 * (grid.rest().node_position(low) + grid.rest().node_position(high));
    const double strength = std::max(strength_at(middle), 1e-300);
    const Stress stress =
        find_stress(context, grid, open.edge, {open.lower, open.upper},
                    stress_at(context, grid, low, open.lower) + stress_at(context, grid, high, open.upper),
                    settings_.propagation_ratio * strength);
    const bool is_stressed = stress.largest > 0;
    const auto opens = [&](std::uint32_t cell) { return crack_cells_[cell].opening_stress > strength; };
    if (!is_stressed && std::none_of(open.tips.begin(), open.tips.begin() + open.tip_count, opens))
        return mean;
    if (!is_large(context, context.pieces.piece_of(grid, low))) return mean;
    int count = 0;
    for (std::uint32_t k = 0; k < open.tip_count; ++k) {
        Proposal one;
        if (!propose(grid, crack_cells_[open.tips[k]], stress, strength, open.edge, one)) continue;
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
void Tearing::find_proposals(const NodeGrid& grid, const TearContext& context) {
    list_front_edges(grid, context);
    find_requested_stresses(context, grid);
    proposals_.resize(front_edges_.size());
    context.parallel.for_each(front_edges_.size(), edge_grain, [&](std::size_t k) {
        proposals_[k] = propose(grid, context, open_edges_[front_edges_[k]]);
    });
    std::erase_if(proposals_, [](const Proposal& p) { return p.id == no_edge; });
    std::sort(proposals_.begin(), proposals_.end(), [](const Proposal& a, const Proposal& b) {
        return a.load != b.load ? a.load > b.load : a.id < b.id;
    });
}

// Lists the cells around the given cuts, each once, ascending.
void Tearing::cells_of(const NodeGrid& grid, std::span<const std::int32_t> slots, std::vector<Key>& out) {
    out.clear();
    for (const std::int32_t slot : slots)
        for_cells_around(grid, grid.crossing(slot).edge, [&](const Key& cell) { out.push_back(cell); });
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
}

void Tearing::grow(NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots) {
    const double rings = std::clamp(crack_speed_ * context.dt / cell_size_, 1.0, 1000.0);
    for (int ring = 0; ring < static_cast<int>(rings) && !front_.empty(); ++ring) {
        // Grows the front by one ring of cells; the cells around the new cuts are the next front.
        find_proposals(grid, context);
        const std::size_t before = slots.size();
        for (const Proposal& proposal : proposals_) cut(grid, proposal, slots);
        note_crossings(grid);
        cells_of(grid, std::span(slots).subspan(before), touched_cells_);
        front_.clear();
        for (const Key& cell : touched_cells_)
            front_.push_back(
                static_cast<std::uint32_t>(crack_cell_index_.get({cell[0], cell[1], cell[2]}, 0)));
    }
}

// Cuts the open edges that are stretched above break_stretch_; of those that share a node, only the most
// stretched.
void Tearing::break_ligaments(NodeGrid& grid, const TearContext& context, std::vector<std::int32_t>& slots) {
    context.parallel.for_each(open_edges_.size(), 4 * face_grain, [&](std::size_t k) {
        OpenEdge& open = open_edges_[k];
        if (open.stretch < 0) return;
        open.stretch = -1;
        if (grid.is_cut(open.edge)) return;
        const geometry::Frame* a = frame_of(context, open.edge.node, open.lower);
        const geometry::Frame* b = frame_of(context, open.edge.upper(), open.upper);
        open.stretch = a && b ? (b->position - a->position).norm() / cell_size_ : 0;
    });
    proposals_.clear();
    std::size_t cut = 0;
    for (const OpenEdge& open : open_edges_) {
        cut += open.stretch < 0;
        if (open.stretch > break_stretch_)
            proposals_.push_back(
                {splitting::edge_id(open.edge), open.stretch, 0.5, Vec3::Unit(open.edge.axis)});
    }
    if (2 * cut > open_edges_.size()) forget_cut_edges();
    std::sort(proposals_.begin(), proposals_.end(), [](const Proposal& x, const Proposal& y) {
        return x.load != y.load ? x.load > y.load : x.id < y.id;
    });
    separated_nodes_.clear();
    for (const Proposal& proposal : proposals_) {
        const GridEdge edge = splitting::edge_from_id(proposal.id);
        const Vec3i low = edge.node, high = edge.upper();
        const Key a{low[0], low[1], low[2]}, b{high[0], high[1], high[2]};
        const auto has_separated = [&](const Key& node) {
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

}  // namespace splitcubes::body
