// Positions and normals of a body's surface vertices in world space.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/affine_displacement.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::geometry {
struct RestGrid;
}
namespace splitcubes::splitting {
class NodeGrid;
class Surface;
}  // namespace splitcubes::splitting

namespace splitcubes::body {

class NodeTracker;

/// Moves the surface with the tracked nodes that influence its vertices.
class SurfaceMotion {
  public:
    /// Tracks the nodes of the surface that were added since the last call; they never sleep.
    void track_nodes(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                     NodeTracker& tracker);
    /// The same for all nodes of a surface that replaces the last one. Throws DamagedState if the tracker
    /// does not know one of them.
    void retrack_nodes(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                       NodeTracker& tracker);
    /// Moves the vertices with their nodes. frames: per tracked node, now.
    void update(const splitting::Surface& surface, const geometry::RestGrid& rest, const NodeTracker& tracker,
                std::span<const geometry::Frame> frames, const Parallel& parallel);

    /// Puts a vertex elsewhere, m, world, until the next update.
    void set_position(std::uint32_t vertex, const Vec3& position) {
        positions_[vertex] = position;
        has_set_positions_ = true;
    }
    bool has_set_positions() const { return has_set_positions_; }

    /// Per surface vertex, world frame, as of the last update. Positions in m.
    const std::vector<Vec3>& positions() const { return positions_; }
    const std::vector<Vec3>& normals() const { return normals_; }
    /// Returns the tracker index of a surface node.
    std::uint32_t tracked(std::size_t surface_node) const { return tracked_[surface_node]; }

  private:
    std::vector<std::uint32_t> tracked_;                // per surface node: its tracker index
    std::vector<geometry::AffineDisplacement> motion_;  // per surface node, of this step
    std::vector<Vec3> positions_, normals_;             // per vertex
    bool has_set_positions_ = false;                    // since the last update
};

}  // namespace splitcubes::body
