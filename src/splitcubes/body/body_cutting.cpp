// The first stage of a step, which finds and cuts the grid edges that blades crossed, and cuts at rest.
#include <splitcubes/body/body.h>
#include <splitcubes/body/node_ties.h>
#include <splitcubes/body/rest_cut.h>
#include <splitcubes/splitting/sheet_cut.h>

#include <algorithm>

namespace splitcubes::body {

using splitting::GridEdge;

namespace {

void sort_unique(std::vector<std::uint32_t>& nodes) {
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

}  // namespace

// Returns the uncut edges between inside nodes that the blades may have crossed in the last interval.
std::vector<GridEdge> Body::edges_near(std::span<const cutting::SweptBlade> blades,
                                       const Parallel& parallel) {
    geometry::Box blade;
    for (const cutting::SweptBlade& swept : blades) blade.add(swept.bounds);
    if (blade.empty()) return {};
    if (deformation_) return uncut_edges_of(bricks_of_nodes_in(blade));
    const double cell = grid_.rest().cell_size;
    // The margin is far larger than the tolerance of the exact edge tests that follow.
    const SweptBoxes swept(blades, 1e-3 * cell + 1e-5 * blade.size().norm());
    // One cell of slack, because a node without a kernel follows a neighbouring node.
    return moving_bricks_.edges_near({grid_, samples_.phyxels, samples_.previous_deformation, cell}, swept,
                                     parallel);
}

std::vector<GridEdge> Body::uncut_edges_of(std::span<const std::uint32_t> bricks) const {
    std::vector<GridEdge> edges;
    for (const std::uint32_t brick : bricks)
        for (unsigned local = 0; local < splitting::nodes_per_brick; ++local) {
            if (!(grid_.inside_word(brick) >> local & 1U)) continue;
            const Vec3i node = grid_.bricks().base(brick) + splitting::BrickLayout::local_node(local);
            for (int axis = 0; axis < 3; ++axis)
                if (const GridEdge edge{node, axis}; grid_.has_edge(edge) && !grid_.is_cut(edge))
                    edges.push_back(edge);
        }
    return edges;
}

// Tracks the edges' end nodes and returns their tracker indices, ascending.
std::vector<std::uint32_t> Body::track_ends(std::span<const GridEdge> edges) {
    std::vector<std::uint32_t> nodes;
    for (const GridEdge& edge : edges)
        for (const Vec3i& node : {edge.node, edge.upper()}) nodes.push_back(tracker_.track(grid_, node));
    sort_unique(nodes);
    return nodes;
}

// Returns the edges with their motion over the last interval.
std::vector<cutting::CandidateEdge> Body::candidate_edges(std::span<const GridEdge> edges,
                                                          const StepContext& context) {
    const std::vector<std::uint32_t> nodes = track_ends(edges);
    const TrackerContext tracker = tracker_context(context.parallel);
    tracker_.refresh(tracker);
    cut_position_.resize(tracker_.size(), Vec3::Zero());
    cut_step_.resize(tracker_.size(), -2);
    // An edge starts where the last step's test ended, so that intervals join without a gap. For nodes that
    // the last step did not test, the start is evaluated from the previous state of the phyxels.
    std::vector<std::uint32_t> not_tested;
    for (const std::uint32_t node : nodes)
        if (cut_step_[node] != step_ - 1) not_tested.push_back(node);
    evaluate_some_before(tracker, not_tested);
    // Every awake node needs a frame, also those that the tracker has woken meanwhile.
    std::vector<std::uint32_t> needed = nodes;
    needed.insert(needed.end(), tracker_.fresh().begin(), tracker_.fresh().end());
    sort_unique(needed);
    evaluate_some_now(tracker, needed);

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
                     const StepContext& context, TopologyChange& change, StepReport& report,
                     const Isometry& tool_before, const Isometry& tool_now, ToolForce& tool_force) {
    const std::vector<GridEdge> edges = edges_near(blades, context.parallel);
    if (edges.empty()) return;
    const std::vector<cutting::CandidateEdge> candidates = candidate_edges(edges, context);
    std::vector<cutting::EdgeCut> cuts =
        cutting::cut_edges(blades, candidates, last_normal, context.parallel);
    resolve_node_ties(grid_, cuts);
    for (const cutting::EdgeCut& cut : cuts) {
        const std::int32_t slot = grid_.cut(splitting::edge_from_id(cut.id), cut.parameter, cut.rest_normal,
                                            splitting::Origin::cut, cut_number);
        if (slot < 0) continue;
        change.crossings.push_back(slot);
        accumulate_cut_force(slot, context.dt, tool_before, tool_now, tool_force);
    }
    report.new_cut_edges += cuts.size();
}

std::size_t Body::cut_with_sheet(const geometry::TriangleMesh& sheet, std::int32_t cut_number,
                                 const Parallel& parallel) {
    TopologyChange change;
    change.crossings = splitting::cut_with_sheet(grid_, sheet, cut_number);
    settle_topology(parallel, change);
    return change.crossings.size();
}

std::size_t Body::cut_with_blade(const cutting::Blade& blade, std::int32_t cut_number,
                                 const Parallel& parallel) {
    TopologyChange change;
    change.crossings = body::cut_with_blade(grid_, blade, cut_number, parallel);
    settle_topology(parallel, change);
    return change.crossings.size();
}

void Body::settle_topology(const Parallel& parallel, TopologyChange& change) {
    StepReport report;
    const StepContext context{0, 0, Vec3::Zero(), {}, {}, {}, parallel};
    retessellate(parallel, change, report);
    label_pieces(change);
    update_visibility(context, change, report);
    resample(context, change, report);
    rebuild_neighbourhoods(context, change);
    update_node_frames(context, report);
    update_surface(context, report);
}

}  // namespace splitcubes::body
