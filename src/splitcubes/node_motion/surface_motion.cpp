#include <splitcubes/node_motion/node_tracker.h>
#include <splitcubes/node_motion/surface_motion.h>
#include <splitcubes/splitting/surface.h>

namespace splitcubes::body {

void SurfaceMotion::track_nodes(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                                NodeTracker& tracker) {
    const std::vector<Vec3i>& nodes = surface.nodes();
    for (std::size_t k = tracked_.size(); k < nodes.size(); ++k)
        tracked_.push_back(tracker.hold(grid, nodes[k]));
}

void SurfaceMotion::retrack_nodes(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                                  NodeTracker& tracker) {
    tracked_.clear();
    for (const Vec3i& node : surface.nodes()) {
        require_state(tracker.find(node) >= 0, "a node of the surface that is not tracked");
        tracked_.push_back(tracker.hold(grid, node));
    }
}

void SurfaceMotion::update(const splitting::Surface& surface, const geometry::RestGrid& rest,
                           const NodeTracker& tracker, std::span<const geometry::Frame> frames,
                           const Parallel& parallel) {
    motion_.resize(tracked_.size());
    parallel.for_each(motion_.size(), 512, [&](std::size_t k) {
        const std::uint32_t node = tracked_[k];
        motion_[k] = geometry::AffineDisplacement(tracker.rest_positions()[node], frames[node]);
    });
    splitting::deform(surface, rest, motion_, positions_, normals_, parallel);
    has_set_positions_ = false;
}

}  // namespace splitcubes::body
