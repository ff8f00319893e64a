// Uniform grid over balls.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/math/types.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Uniform grid that finds the balls that may contain a point. Cells are about as wide as the largest radius,
/// or wider if the balls are scattered. Memory is reused from build to build; queries may run on several
/// threads at once.
class SphereGrid {
  public:
    struct Ball {
        Vec3 centre;
        double radius;
    };
    /// Rebuilds the grid. All lengths have one unit and are at most 1e100; radii >= 0.
    void build(std::span<const Ball> balls);
    /// Returns the indices, ascending, of all balls that contain the point, and possibly of some nearby.
    std::span<const std::uint32_t> near(const Vec3& point) const;

  private:
    template <class Visit>
    void visit_cells(const Ball& ball, const Visit& visit) const;
    std::size_t cell_at(const Vec3& point) const;
    Vec3i cell_coordinates(const Vec3& point) const;
    void lay_out(std::span<const Ball> balls);

    geometry::Box box_;  // around all balls
    double size_ = 1;    // of a cell
    Vec3i count_ = Vec3i::Ones();
    std::vector<std::uint32_t> begin_, next_;  // per cell: first of its indices; plus one at the end
    std::vector<std::uint32_t> ball_;
};

}  // namespace splitcubes::body
