// Bodies whose nodes a deformation model moves instead of their phyxels.
#include <splitcubes/body/body.h>

#include <algorithm>

namespace splitcubes::body {

using splitting::GridEdge;

void Body::make_deformation() {
    deformation::NodeSet nodes;
    nodes.rest = grid_.rest();
    nodes.place = inside_.node;
    nodes.velocity = settings_.velocity;
    nodes.angular_velocity = settings_.angular_velocity;
    for (const double mass : samples_.phyxels.mass) nodes.mass += mass;
    node_index_ = splitting::SlotMap<1>(grid_.bricks());
    for (std::size_t n = 0; n < inside_.size(); ++n)
        node_index_.set(inside_.node[n], 0, static_cast<std::int32_t>(n));
    for (std::uint32_t n = 0; n < inside_.size(); ++n)
        for (int axis = 0; axis < 3; ++axis) {
            const GridEdge edge{inside_.node[n], axis};
            if (!grid_.has_edge(edge) || grid_.is_cut(edge) || !grid_.inside(edge.upper())) continue;
            nodes.uncut_edges.push_back(
                {n, static_cast<std::uint32_t>(node_index_.get(edge.upper(), 0)), axis});
        }
    deformation_ = settings_.deformation(std::move(nodes));
    const Parallel one(1);
    node_frames_.resize(inside_.size());
    deformation_->node_frames(node_frames_, one);
    node_frames_before_ = node_frames_;
}

void Body::advance_deformation(const StepContext& context, StepReport& report) {
    const BoundaryConditions::HeldPoints held =
        boundary_.hold(inside_.rest_position, context.time, context.dt);
    deformation::Motion motion{context.time, context.dt,    context.gravity, std::nullopt,
                               held.held,    held.position, context.parallel};
    if (context.ground)
        motion.ground = deformation::Motion::Ground{context.ground->normal, context.ground->offset,
                                                    context.ground->friction};
    const deformation::MotionReport moved = deformation_->advance(motion);
    node_frames_before_ = node_frames_;
    deformation_->node_frames(node_frames_, context.parallel);
    move_phyxels_with_nodes(context.dt);
    ++step_;
    report.substeps = std::max(report.substeps, moved.substeps);
    report.contacts += moved.contacts;
    report.kinetic_energy += moved.kinetic_energy;
    report.elastic_energy += moved.elastic_energy;
    report.momentum += moved.momentum;
    report.angular_momentum += moved.angular_momentum;
    report.top_speed = std::max(report.top_speed, moved.top_speed);
    if (!moved.finite) report.flags |= flag_non_finite;
}

void Body::move_phyxels_with_nodes(double dt) {
    samples_.previous_deformation = samples_.phyxels.deformation;
    samples_.phyxels.previous_position = samples_.phyxels.position;
    for (std::size_t i = 0; i < samples_.phyxels.size(); ++i) {
        const geometry::Frame& frame =
            node_frames_[static_cast<std::size_t>(node_index_.get(samples_.owner[i], 0))];
        const Vec3 from_node =
            samples_.phyxels.rest_position[i] - grid_.rest().node_position(samples_.owner[i]);
        samples_.phyxels.position[i] = frame.position + frame.jacobian * from_node;
        samples_.phyxels.deformation[i] = frame.jacobian;
        samples_.phyxels.velocity[i] =
            (samples_.phyxels.position[i] - samples_.phyxels.previous_position[i]) / dt;
    }
}

deformation::NodeEdge Body::between_nodes(const GridEdge& edge) const {
    return {static_cast<std::uint32_t>(node_index_.get(edge.node, 0)),
            static_cast<std::uint32_t>(node_index_.get(edge.upper(), 0)), edge.axis};
}

void Body::notify_cut_edges(const TopologyChange& change) {
    std::vector<deformation::NodeEdge> edges;
    for (const std::int32_t slot : change.crossings)
        edges.push_back(between_nodes(grid_.crossing(slot).edge));
    if (!edges.empty()) deformation_->edges_cut(edges);
}

void Body::restore_deformation(std::span<const double> state) {
    std::vector<deformation::NodeEdge> edges;
    for (const splitting::Crossing& crossing : grid_.crossings())
        if (grid_.inside(crossing.edge.node) && grid_.inside(crossing.edge.upper()))
            edges.push_back(between_nodes(crossing.edge));
    deformation_->edges_cut(edges);
    deformation_->set_state(state);
}

void Body::pick_frames(const std::vector<geometry::Frame>& nodes, std::vector<geometry::Frame>& out) const {
    out.resize(tracker_.size());
    for (std::size_t k = 0; k < out.size(); ++k)
        out[k] = nodes[static_cast<std::size_t>(node_index_.get(tracker_.nodes()[k], 0))];
}

void Body::evaluate_frames_now(const TrackerContext& context) {
    tracker_.clear_fresh();
    if (deformation_) return pick_frames(node_frames_, frames_);
    tracker_.evaluate(context, samples_.phyxels.position, samples_.phyxels.deformation, frames_);
}

// Evaluates the current frames of the given tracked nodes.
void Body::evaluate_some_now(const TrackerContext& context, std::span<const std::uint32_t> nodes) {
    if (deformation_) return pick_frames(node_frames_, frames_);
    tracker_.evaluate_some(context, nodes, samples_.phyxels.position, samples_.phyxels.deformation, frames_);
}

void Body::evaluate_some_before(const TrackerContext& context, std::span<const std::uint32_t> nodes) {
    if (deformation_) return pick_frames(node_frames_before_, frames_before_);
    tracker_.evaluate_some(context, nodes, samples_.phyxels.previous_position, samples_.previous_deformation,
                           frames_before_);
}

// Returns the bricks with an edge that may be in the box, m, world, now or a step ago.
std::vector<std::uint32_t> Body::bricks_of_nodes_in(const geometry::Box& box) const {
    std::vector<geometry::Box> of_brick(grid_.bricks().total());
    for (std::size_t n = 0; n < inside_.size(); ++n) {
        // A node also belongs to the edges that come from the three lower nodes, whose bricks may differ.
        for (int axis = -1; axis < 3; ++axis) {
            Vec3i node = inside_.node[n];
            if (axis >= 0) --node[axis];
            if ((node.array() < 0).any()) continue;
            geometry::Box& own = of_brick[grid_.bricks().brick_of(node)];
            own.add(node_frames_[n].position);
            own.add(node_frames_before_[n].position);
        }
    }
    std::vector<std::uint32_t> out;
    for (std::uint32_t brick = 0; brick < of_brick.size(); ++brick)
        if (grid_.inside_word(brick) && of_brick[brick].meets(box)) out.push_back(brick);
    return out;
}

}  // namespace splitcubes::body
