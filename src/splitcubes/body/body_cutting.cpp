// The first stages of a step: which grid edges the blades crossed.
#include <splitcubes/body/body.h>
#include <splitcubes/body/node_ties.h>
#include <splitcubes/splitting/sheet_cut.h>

#include <algorithm>

namespace splitcubes::body {

using splitting::GridEdge;

namespace {

void make_unique(std::vector<std::uint32_t>& numbers) {
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

}  // namespace

// The uncut edges between inside nodes that the blades may have met over the last interval.
std::vector<GridEdge> Body::edges_near(std::span<const cutting::SweptBlade> blades,
                                       const Parallel& parallel) {
    geometry::Box blade;
    for (const cutting::SweptBlade& swept : blades) blade.add(swept.bounds);
    if (blade.empty()) return {};
    if (deformation_) return uncut_edges_of(bricks_of_nodes_in(blade));
    const double cell = grid_.rest().cell_size;
    // Whoever tests the edges is generous by far less than the margin.
    const SweptBoxes swept(blades, 1e-3 * cell + 1e-5 * blade.size().norm());
    // A node without a kernel of its own follows a neighbour.
    return moving_bricks_.edges_near({grid_, phyxels_, previous_deformation_, cell}, swept, parallel);
}

std::vector<GridEdge> Body::uncut_edges_of(std::span<const std::uint32_t> bricks) const {
    std::vector<GridEdge> edges;
    for (const std::uint32_t brick : bricks)
        for (unsigned local = 0; local < splitting::brick_places; ++local) {
            if (!(grid_.inside_word(brick) >> local & 1U)) continue;
            const Vec3i node = grid_.bricks().base(brick) + splitting::BrickLayout::local_place(local);
            for (int axis = 0; axis < 3; ++axis)
                if (const GridEdge edge{node, axis}; grid_.has_edge(edge) && !grid_.is_cut(edge))
                    edges.push_back(edge);
        }
    return edges;
}

// The tracker's numbers of the edges' ends, ascending.
std::vector<std::uint32_t> Body::track_ends(std::span<const GridEdge> edges) {
    std::vector<std::uint32_t> nodes;
    for (const GridEdge& edge : edges)
        for (const Vec3i& node : {edge.node, edge.upper()}) nodes.push_back(tracker_.track(grid_, node));
    make_unique(nodes);
    return nodes;
}

// Each edge with its motion over the last interval.
std::vector<cutting::CandidateEdge> Body::candidate_edges(std::span<const GridEdge> edges,
                                                          const StepContext& context) {
    const std::vector<std::uint32_t> nodes = track_ends(edges);
    const TrackerContext tracker = tracker_context(context.parallel);
    tracker_.refresh(tracker);
    cut_position_.resize(tracker_.size(), Vec3::Zero());
    cut_step_.resize(tracker_.size(), -2);
    // Where a node was at the start of the interval: as the last step saw it, so
    // that intervals join without a gap; from the last state of the phyxels where
    // it was not looked at.
    std::vector<std::uint32_t> unseen;
    for (const std::uint32_t node : nodes)
        if (cut_step_[node] != step_ - 1) unseen.push_back(node);
    evaluate_some_before(tracker, unseen);
    // All that are awake have a frame: the tracker may have taken up others.
    std::vector<std::uint32_t> asked = nodes;
    asked.insert(asked.end(), tracker_.fresh().begin(), tracker_.fresh().end());
    make_unique(asked);
    evaluate_some_now(tracker, asked);

    const auto start_of = [&](std::uint32_t node) {
        return cut_step_[node] == step_ - 1 ? cut_position_[node] : frames_before_[node].position;
    };
    std::vector<cutting::CandidateEdge> out;
    out.reserve(edges.size());
    for (const GridEdge& edge : edges) {
        const auto a = static_cast<std::uint32_t>(tracker_.find(edge.node));
        const auto b = static_cast<std::uint32_t>(tracker_.find(edge.upper()));
        cutting::CandidateEdge candidate;
        candidate.id = splitting::edge_id(edge);
        candidate.motion = {start_of(a), start_of(b), frames_[a].position, frames_[b].position};
        candidate.world_from_rest = 0.5 * (frames_[a].jacobian + frames_[b].jacobian);
        out.push_back(candidate);
    }
    for (const std::uint32_t node : nodes) {
        cut_position_[node] = frames_[node].position;
        cut_step_[node] = step_;
    }
    return out;
}

void Body::cut_edges(std::span<const cutting::SweptBlade> blades, std::int32_t cut_number, Vec3& last_normal,
                     const StepContext& context, StepReport& report, const Isometry& tool_before,
                     const Isometry& tool_now, ToolForce& tool_force) {
    const std::vector<GridEdge> edges = edges_near(blades, context.parallel);
    if (edges.empty()) return;
    const std::vector<cutting::CandidateEdge> candidates = candidate_edges(edges, context);
    std::vector<cutting::EdgeCut> cuts =
        cutting::cut_edges(blades, candidates, last_normal, context.parallel);
    settle_node_ties(grid_, cuts);
    for (const cutting::EdgeCut& cut : cuts) {
        const std::int32_t slot = grid_.cut(splitting::edge_from_id(cut.id), cut.parameter, cut.rest_normal,
                                            splitting::Origin::cut, cut_number);
        if (slot < 0) continue;
        new_slots_.push_back(slot);
        accumulate_cut_force(slot, context.dt, tool_before, tool_now, tool_force);
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
    retessellate(parallel, report);
    label_pieces(report);
    update_visibility(context, report);
    resample(context, report);
    rebuild_neighbourhoods(context);
    update_node_frames(context, report);
    update_surface(context, report);
}

}  // namespace splitcubes::body
