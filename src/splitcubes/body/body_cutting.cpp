// The first stages of a step: which grid edges the blades crossed.
#include <splitcubes/body/body.h>
#include <splitcubes/splitting/sheet_cut.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace splitcubes::body {

using splitting::GridEdge;

// Bricks of grid nodes that the blades may have reached.
std::vector<std::uint32_t> Body::candidate_bricks(std::span<const cutting::SweptBlade> blades,
                                                  const Parallel& parallel) {
    geometry::Box blade;
    for (const cutting::SweptBlade& swept : blades) blade.add(swept.bounds);
    if (blade.empty()) return {};
    if (deformation_) return bricks_of_nodes_in(blade);
    double reach = 0;
    for (const double h : phyxels_.support_radius) reach = std::max(reach, h);
    // A node without a kernel of its own follows a neighbour: one more cell of reach.
    return moving_bricks_.meeting({grid_, phyxels_, previous_deformation_, reach + grid_.rest().cell_size},
                                  blade, parallel);
}

// The uncut edges between inside nodes of the bricks, each with its motion over
// the last interval.
std::vector<cutting::CandidateEdge> Body::candidate_edges(std::span<const std::uint32_t> bricks,
                                                          const StepContext& context) {
    std::vector<GridEdge> edges;
    for (const std::uint32_t brick : bricks) {
        const Vec3i base = grid_.bricks().base(brick);
        for (unsigned local = 0; local < splitting::brick_places; ++local) {
            if (!(grid_.inside_word(brick) >> local & 1U)) continue;
            const Vec3i node = base + splitting::BrickLayout::local_place(local);
            for (int axis = 0; axis < 3; ++axis) {
                const GridEdge edge{node, axis};
                if (!grid_.has_edge(edge) || grid_.is_cut(edge)) continue;
                edges.push_back(edge);
                tracker_.track(grid_, edge.node);
                tracker_.track(grid_, edge.upper());
            }
        }
    }
    const TrackerContext tracker = tracker_context(context.parallel);
    const std::size_t known = frames_.size();
    tracker_.refresh(tracker);
    if (tracker_.size() != known) evaluate_frames_now(tracker);
    cut_position_.resize(tracker_.size());
    cut_step_.resize(tracker_.size(), -2);
    // Where a node was at the start of the interval: as the last step saw it, so
    // that intervals join without a gap; from the last state of the phyxels where
    // it was not looked at.
    std::vector<geometry::Frame>& before = frames_before_;
    evaluate_frames_before(tracker, before);
    std::vector<cutting::CandidateEdge> out;
    out.reserve(edges.size());
    const auto start_of = [&](std::uint32_t node) {
        return cut_step_[node] == step_ - 1 ? cut_position_[node] : before[node].position;
    };
    for (const GridEdge& edge : edges) {
        const auto a = static_cast<std::uint32_t>(tracker_.find(edge.node));
        const auto b = static_cast<std::uint32_t>(tracker_.find(edge.upper()));
        cutting::CandidateEdge candidate;
        candidate.id = splitting::edge_id(edge);
        candidate.motion = {start_of(a), start_of(b), frames_[a].position, frames_[b].position};
        candidate.world_from_rest = 0.5 * (frames_[a].jacobian + frames_[b].jacobian);
        out.push_back(candidate);
    }
    for (const GridEdge& edge : edges)
        for (const Vec3i& node : {edge.node, edge.upper()}) {
            const auto index = static_cast<std::size_t>(tracker_.find(node));
            cut_position_[index] = frames_[index].position;
            cut_step_[index] = step_;
        }
    return out;
}

void Body::cut_edges(std::span<const cutting::SweptBlade> blades, std::int32_t cut_number, Vec3& last_normal,
                     const StepContext& context, StepReport& report, const Isometry& tool_before,
                     const Isometry& tool_now, ToolForce& felt) {
    const std::vector<std::uint32_t> bricks = candidate_bricks(blades, context.parallel);
    if (bricks.empty()) return;
    const std::vector<cutting::CandidateEdge> candidates = candidate_edges(bricks, context);
    const std::vector<cutting::EdgeCut> cuts =
        cutting::cut_edges(blades, candidates, last_normal, context.parallel);
    for (const cutting::EdgeCut& cut : cuts) {
        const std::int32_t slot = grid_.cut(splitting::edge_from_id(cut.id), cut.parameter, cut.rest_normal,
                                            splitting::Origin::cut, cut_number);
        if (slot < 0) continue;
        new_slots_.push_back(slot);
        feel_cut(slot, context.dt, tool_before, tool_now, felt);
    }
    report.new_cut_edges += cuts.size();
}

std::size_t Body::cut_with_sheet(const geometry::TriangleMesh& sheet, std::int32_t cut_number,
                                 const Parallel& parallel) {
    StepReport report;
    new_slots_ = splitting::cut_with_sheet(grid_, sheet, cut_number);
    const std::size_t count = new_slots_.size();
    settle_topology(parallel, report);
    return count;
}

void Body::settle_topology(const Parallel& parallel, StepReport& report) {
    const StepContext context{0, 0, Vec3::Zero(), {}, {}, {}, parallel};
    retessellate(report);
    label_pieces(report);
    update_visibility(context, report);
    resample(context, report);
    rebuild_neighbourhoods(context);
    update_node_frames(context, report);
    update_surface(context, report);
}

}  // namespace splitcubes::body
