// Uniform grid over balls.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/math/types.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Uniform grid that finds the balls that may contain a point or meet another ball. Cells are about as wide
/// as the mean radius, or wider if some balls are much larger or the balls are scattered. Memory is reused
/// from build to build; queries may run on several threads at once.
class SphereGrid {
  public:
    struct Ball {
        Vec3 centre;
        double radius;
    };
    /// Rebuilds the grid. All lengths have one unit and are at most 1e100; radii >= 0.
    void build(std::span<const Ball> balls);
    /// Replaces `out` by the indices, ascending, of all balls that contain the point, and possibly of some
    /// whose surface it nearly touches.
    void containing(const Vec3& point, std::vector<std::uint32_t>& out) const;
    /// Replaces `out` by the indices above k, ascending, of all balls that meet ball k, and possibly of some
    /// that nearly do.
    void meeting_after(std::uint32_t k, std::vector<std::uint32_t>& out) const;

  private:
    /// Cells that the bounding box of a ball meets.
    struct Cover {
        Vec3i low, high;
    };
    /// Ball in single precision, a little larger: centre from the low corner of the box, m; and index.
    struct Entry {
        Vec3f centre;
        float radius;
        std::uint32_t ball;
    };
    template <class Visit>
    void visit_cells(const Cover& cover, const Visit& visit) const;
    std::size_t cell_index(int x, int y, int z) const;
    Vec3i cell_coordinates(const Vec3& point) const;
    void lay_out(std::span<const Ball> balls);

    geometry::Box box_;  // around all balls
    double size_ = 1;    // of a cell
    Vec3i count_ = Vec3i::Ones();
    std::vector<std::uint32_t> begin_, next_;  // per cell: first of its indices; plus one at the end
    std::vector<Entry> entries_;               // sorted by cell
    std::vector<Entry> balls_;                 // per ball
    std::vector<Cover> covers_;                // per ball
};

}  // namespace splitcubes::body
