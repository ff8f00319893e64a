// The occluders of a body's surface: the triangles that can block a line of sight.
#pragma once

#include <splitcubes/contact/detection/surface_changes.h>
#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/occluder_grid.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::splitting {
class NodeGrid;
class Surface;
}  // namespace splitcubes::splitting

namespace splitcubes::body {

/// Grid of the surface's triangles in rest space, kept up to date cell by cell, and the record of where they
/// changed.
class SurfaceOccluders {
  public:
    /// Makes an empty set for a surface of this grid.
    explicit SurfaceOccluders(const geometry::RestGrid& rest);

    /// Adds the occluders of a whole surface to the empty set.
    void build(const splitting::NodeGrid& grid, const splitting::Surface& surface, const Parallel& parallel);
    /// Replaces all occluders by those of a surface, as a change everywhere.
    void rebuild(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                 const Parallel& parallel);
    /// Replaces the occluders of the surface cells that were made again. Returns boxes (m, rest space) that
    /// contain the old and the new occluders of these cells: visibility changes near both. There is one box
    /// per brick of changed cells, so the boxes are few and none is much larger than the changed region.
    std::vector<geometry::Box> update(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                                      std::span<const std::uint32_t> cells, const Parallel& parallel);

    const geometry::OccluderGrid& grid() const { return grid_; }
    /// Regions in which the occluders may have changed.
    const SurfaceChanges& changes() const { return changes_; }

  private:
    void set_cells(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                   std::span<const std::uint32_t> cells, const Parallel& parallel);

    geometry::OccluderGrid grid_;
    SurfaceChanges changes_;               // of the occluders
    std::vector<geometry::Box> cell_box_;  // per surface cell: of its occluders, m, rest space
};

}  // namespace splitcubes::body
