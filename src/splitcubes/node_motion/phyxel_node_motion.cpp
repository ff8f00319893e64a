#include <splitcubes/node_motion/phyxel_node_motion.h>

namespace splitcubes::body {

std::vector<splitting::GridEdge> PhyxelNodeMotion::find_edges_near(
    const splitting::NodeGrid& grid, std::span<const cutting::SweptBlade> blades, const geometry::Box& bounds,
    const Parallel& parallel) {
    const double cell = grid.rest().cell_size;
    // The margin is far larger than the tolerance of the exact edge tests that follow.
    const SweptBoxes swept(blades, 1e-3 * cell + 1e-5 * bounds.size().norm());
    // One cell of slack, because a node without a kernel follows a neighbouring node.
    return moving_bricks_.edges_near({grid, phyxels_, previous_deformation_, cell}, swept, parallel);
}

void PhyxelNodeMotion::evaluate_now(const TrackerContext& context, std::vector<geometry::Frame>& out) {
    tracker().evaluate(context, phyxels_.position, phyxels_.deformation, out);
}

void PhyxelNodeMotion::evaluate_some_now(const TrackerContext& context, std::span<const std::uint32_t> nodes,
                                         std::vector<geometry::Frame>& out) {
    tracker().evaluate_some(context, nodes, phyxels_.position, phyxels_.deformation, out);
}

void PhyxelNodeMotion::evaluate_some_before(const TrackerContext& context,
                                            std::span<const std::uint32_t> nodes,
                                            std::vector<geometry::Frame>& out) {
    tracker().evaluate_some(context, nodes, phyxels_.previous_position, previous_deformation_, out);
}

}  // namespace splitcubes::body
