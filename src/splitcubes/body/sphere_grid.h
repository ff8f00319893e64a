// Balls by the cells of a grid that they reach into.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/math/types.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Tells of a point in next to no time which of some balls it may lie in: most points lie in none. The cells
/// are about as wide as the widest ball's radius, or wider where the balls are scattered. Memory is kept from
/// build to build; queries may run on several threads at once.
class SphereGrid {
  public:
    struct Ball {
        Vec3 centre;
        double radius;
    };
    /// Lengths of one unit, at most 1e100; radii >= 0.
    void build(std::span<const Ball> balls);
    /// Numbers of all balls that the point may be in, and of some nearby; ascending.
    std::span<const std::uint32_t> near(const Vec3& point) const;

  private:
    template <class Visit>
    void visit_cells(const Ball& ball, const Visit& visit) const;
    std::size_t cell_at(const Vec3& point) const;
    Vec3i place_at(const Vec3& point) const;
    void lay_out(std::span<const Ball> balls);

    geometry::Box box_;  // around all
    double size_ = 1;    // of a cell
    Vec3i count_ = Vec3i::Ones();
    std::vector<std::uint32_t> begin_, next_;  // per cell, of its numbers; one more at the end
    std::vector<std::uint32_t> number_;
};

}  // namespace splitcubes::body
