#include <splitcubes/math/state_numbers.h>
#include <splitcubes/node_motion/node_motion.h>
#include <splitcubes/node_motion/tuning.h>

#include <algorithm>
#include <limits>

namespace splitcubes::body {

using splitting::GridEdge;

namespace {

void sort_unique(std::vector<std::uint32_t>& nodes) {
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

}  // namespace

std::vector<GridEdge> NodeMotion::edges_near(const splitting::NodeGrid& grid,
                                             std::span<const cutting::SweptBlade> blades,
                                             const Parallel& parallel) {
    geometry::Box bounds;
    for (const cutting::SweptBlade& swept : blades) bounds.add(swept.bounds);
    if (bounds.empty()) return {};
    return find_edges_near(grid, blades, bounds, parallel);
}

// Tracks the edges' end nodes and returns their tracker indices, ascending.
std::vector<std::uint32_t> NodeMotion::track_ends(std::span<const GridEdge> edges,
                                                  const splitting::NodeGrid& grid) {
    std::vector<std::uint32_t> nodes;
    for (const GridEdge& edge : edges)
        for (const Vec3i& node : {edge.node, edge.upper()}) nodes.push_back(tracker_.track(grid, node));
    sort_unique(nodes);
    return nodes;
}

cutting::CandidateEdge NodeMotion::candidate(const GridEdge& edge) const {
    const auto a = static_cast<std::size_t>(tracker_.find(edge.node));
    const auto b = static_cast<std::size_t>(tracker_.find(edge.upper()));
    return {
        splitting::edge_id(edge),
        {frames_before_[a].position, frames_before_[b].position, frames_[a].position, frames_[b].position},
        0.5 * (frames_[a].jacobian + frames_[b].jacobian)};
}

// Adds the way of an edge from the end of the last test to the start of its motion, if that is longer than a
// tolerance, m.
void NodeMotion::add_shifted(const cutting::CandidateEdge& moving, const GridEdge& edge, double tolerance,
                             std::vector<cutting::CandidateEdge>& shifted) const {
    const auto end_of_last = [&](const Vec3i& at, const Vec3& start) {
        const auto node = static_cast<std::size_t>(tracker_.find(at));
        return cut_step_[node] == step_count_ - 1 ? cut_position_[node] : start;
    };
    const Vec3 a = end_of_last(edge.node, moving.motion.a0), b = end_of_last(edge.upper(), moving.motion.b0);
    const double squared = (a - moving.motion.a0).squaredNorm() + (b - moving.motion.b0).squaredNorm();
    if (!(squared > tolerance * tolerance)) return;
    shifted.push_back({moving.id, {a, b, moving.motion.a0, moving.motion.b0}, moving.world_from_rest});
}

NodeMotion::Candidates NodeMotion::candidate_edges(std::span<const GridEdge> edges,
                                                   const TrackerContext& context) {
    const std::vector<std::uint32_t> nodes = track_ends(edges, context.grid);
    tracker_.refresh(context);
    cut_position_.resize(tracker_.size(), Vec3::Zero());
    cut_step_.resize(tracker_.size(), -2);
    evaluate_some_before(context, nodes, frames_before_);
    // Every awake node needs a frame, also those that the tracker has woken meanwhile.
    std::vector<std::uint32_t> needed = nodes;
    needed.insert(needed.end(), tracker_.fresh().begin(), tracker_.fresh().end());
    sort_unique(needed);
    evaluate_some_now(context, needed, frames_);

    const double tolerance = tuning::cutting::rounding_share * context.grid.rest().cell_size;
    Candidates out;
    out.moving.reserve(edges.size());
    for (const GridEdge& edge : edges) {
        out.moving.push_back(candidate(edge));
        add_shifted(out.moving.back(), edge, tolerance, out.shifted);
    }
    for (const std::uint32_t node : nodes) {
        cut_position_[node] = frames_[node].position;
        cut_step_[node] = step_count_;
    }
    return out;
}

void NodeMotion::update_frames(const TrackerContext& context) {
    tracker_.refresh(context);
    tracker_.clear_fresh();
    evaluate_now(context, frames_);
}

void NodeMotion::save(StateWriter& writer, const meshless::Phyxels& phyxels) const {
    tracker_.save(writer, phyxels);
    writer.add(numbers_of(frames_));
    writer.add(step_count_);
    // Only the positions of nodes that were near a blade in the last step are used again.
    std::vector<std::uint32_t> nodes;
    std::vector<Vec3> positions;
    for (std::uint32_t node = 0; node < cut_step_.size(); ++node) {
        if (cut_step_[node] != step_count_ - 1) continue;
        nodes.push_back(node);
        positions.push_back(cut_position_[node]);
    }
    writer.add(std::uint64_t{nodes.size()});
    writer.add(std::span<const std::uint32_t>(nodes));
    writer.add(numbers_of(positions));
    save_own(writer);
}

void NodeMotion::load(StateReader& reader, const TrackerContext& context) {
    tracker_.load(reader, context);
    read_numbers(reader, tracker_.size(), frames_, "a node with an invalid frame or position");
    step_count_ =
        reader.number<std::int64_t>(0, std::numeric_limits<std::int32_t>::max(), "an invalid step count");
    const std::size_t near_blades = reader.count(sizeof(Vec3) + sizeof(std::uint32_t));
    const std::vector<std::uint32_t> nodes = reader.numbers<std::uint32_t>(near_blades);
    std::vector<Vec3> positions;
    read_numbers(reader, near_blades, positions, "a node with an invalid frame or position");
    cut_position_.assign(tracker_.size(), Vec3::Zero());
    cut_step_.assign(tracker_.size(), -2);
    for (std::size_t k = 0; k < near_blades; ++k) {
        require_state(nodes[k] < tracker_.size(), "an unknown node");
        cut_position_[nodes[k]] = positions[k];
        cut_step_[nodes[k]] = step_count_ - 1;
    }
    load_own(reader, context);
}

}  // namespace splitcubes::body
