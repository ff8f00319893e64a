#include <splitcubes/math/state_numbers.h>
#include <splitcubes/node_motion/lattice_node_motion.h>

namespace splitcubes::body {

using splitting::GridEdge;

namespace {

// Returns the uncut edges from the inside nodes of some bricks.
std::vector<GridEdge> uncut_edges_of(const splitting::NodeGrid& grid, std::span<const std::uint32_t> bricks) {
    std::vector<GridEdge> edges;
    for (const std::uint32_t brick : bricks)
        for (unsigned local = 0; local < splitting::nodes_per_brick; ++local) {
            if (!(grid.inside_word(brick) >> local & 1U)) continue;
            const Vec3i node = grid.bricks().base(brick) + splitting::BrickLayout::local_node(local);
            for (int axis = 0; axis < 3; ++axis)
                if (const GridEdge edge{node, axis}; grid.has_edge(edge) && !grid.is_cut(edge))
                    edges.push_back(edge);
        }
    return edges;
}

}  // namespace

LatticeNodeMotion::LatticeNodeMotion(const splitting::NodeGrid& grid, const std::vector<Vec3i>& nodes,
                                     const InitialMotion& initial, const deformation::MakeDeformation& make)
    : NodeMotion(grid.bricks()), nodes_(nodes), node_index_(grid.bricks()) {
    deformation::NodeSet set;
    set.rest = grid.rest();
    set.coordinates = nodes_;
    set.velocity = initial.velocity;
    set.angular_velocity = initial.angular_velocity;
    set.mass = initial.mass;
    for (std::size_t n = 0; n < nodes_.size(); ++n)
        node_index_.set(nodes_[n], 0, static_cast<std::int32_t>(n));
    for (std::uint32_t n = 0; n < nodes_.size(); ++n)
        for (int axis = 0; axis < 3; ++axis) {
            const GridEdge edge{nodes_[n], axis};
            if (!grid.has_edge(edge) || grid.is_cut(edge) || !grid.inside(edge.upper())) continue;
            set.uncut_edges.push_back({n, static_cast<std::uint32_t>(index_of(edge.upper())), axis});
        }
    deformation_ = make(std::move(set));
    const Parallel one(1);
    node_frames_.resize(nodes_.size());
    deformation_->node_frames(node_frames_, one);
    node_frames_before_ = node_frames_;
}

deformation::MotionReport LatticeNodeMotion::advance(const deformation::Motion& motion) {
    const deformation::MotionReport moved = deformation_->advance(motion);
    node_frames_before_ = node_frames_;
    deformation_->node_frames(node_frames_, motion.parallel);
    return moved;
}

void LatticeNodeMotion::move_phyxels(const splitting::NodeGrid& grid, std::span<const Vec3i> owner, double dt,
                                     meshless::Phyxels& phyxels) const {
    phyxels.previous_position = phyxels.position;
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const geometry::Frame& frame = node_frames_[index_of(owner[i])];
        const Vec3 from_node = phyxels.rest_position[i] - grid.rest().node_position(owner[i]);
        phyxels.position[i] = frame.position + frame.jacobian * from_node;
        phyxels.deformation[i] = frame.jacobian;
        phyxels.velocity[i] = (phyxels.position[i] - phyxels.previous_position[i]) / dt;
    }
}

deformation::NodeEdge LatticeNodeMotion::between_nodes(const GridEdge& edge) const {
    return {static_cast<std::uint32_t>(index_of(edge.node)),
            static_cast<std::uint32_t>(index_of(edge.upper())), edge.axis};
}

void LatticeNodeMotion::edges_cut(const splitting::NodeGrid& grid, std::span<const std::int32_t> crossings) {
    std::vector<deformation::NodeEdge> edges;
    for (const std::int32_t slot : crossings) edges.push_back(between_nodes(grid.crossing(slot).edge));
    if (!edges.empty()) deformation_->edges_cut(edges);
}

std::vector<GridEdge> LatticeNodeMotion::find_edges_near(const splitting::NodeGrid& grid,
                                                         std::span<const cutting::SweptBlade>,
                                                         const geometry::Box& bounds, const Parallel&) {
    return uncut_edges_of(grid, bricks_of_nodes_in(grid, bounds));
}

void LatticeNodeMotion::pick_frames(const std::vector<geometry::Frame>& nodes,
                                    std::vector<geometry::Frame>& out) const {
    out.resize(tracker().size());
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = nodes[index_of(tracker().nodes()[k])];
}

void LatticeNodeMotion::evaluate_now(const TrackerContext&, std::vector<geometry::Frame>& out) {
    pick_frames(node_frames_, out);
}

void LatticeNodeMotion::evaluate_some_now(const TrackerContext&, std::span<const std::uint32_t>,
                                          std::vector<geometry::Frame>& out) {
    pick_frames(node_frames_, out);
}

void LatticeNodeMotion::evaluate_some_before(const TrackerContext&, std::span<const std::uint32_t>,
                                             std::vector<geometry::Frame>& out) {
    pick_frames(node_frames_before_, out);
}

// Returns the bricks with an edge that may be in the box, m, world, now or a step ago.
std::vector<std::uint32_t> LatticeNodeMotion::bricks_of_nodes_in(const splitting::NodeGrid& grid,
                                                                 const geometry::Box& box) const {
    std::vector<geometry::Box> of_brick(grid.bricks().total());
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
        // A node also belongs to the edges that come from the three lower nodes, whose bricks may differ.
        for (int axis = -1; axis < 3; ++axis) {
            Vec3i node = nodes_[n];
            if (axis >= 0) --node[axis];
            if ((node.array() < 0).any()) continue;
            geometry::Box& own = of_brick[grid.bricks().brick_of(node)];
            own.add(node_frames_[n].position);
            own.add(node_frames_before_[n].position);
        }
    }
    std::vector<std::uint32_t> out;
    for (std::uint32_t brick = 0; brick < of_brick.size(); ++brick)
        if (grid.inside_word(brick) && of_brick[brick].meets(box)) out.push_back(brick);
    return out;
}

void LatticeNodeMotion::save_own(StateWriter& writer) const {
    const std::vector<double> state = deformation_->state();
    writer.add(std::span<const double>(state));
    writer.add(numbers_of(node_frames_before_));
}

void LatticeNodeMotion::load_own(StateReader& reader, const TrackerContext& context) {
    std::vector<double> state;
    read_numbers(reader, deformation_->state().size(), state, "an invalid deformation state");
    read_numbers(reader, nodes_.size(), node_frames_before_, "a node with an invalid frame or position");
    std::vector<deformation::NodeEdge> edges;
    for (const splitting::Crossing& crossing : context.grid.crossings())
        if (context.grid.inside(crossing.edge.node) && context.grid.inside(crossing.edge.upper()))
            edges.push_back(between_nodes(crossing.edge));
    deformation_->edges_cut(edges);
    deformation_->set_state(state);
    deformation_->node_frames(node_frames_, context.parallel);
}

}  // namespace splitcubes::body
