// Vectorised solid angles of many triangles.
#pragma once

#include <splitcubes/math/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::geometry {

/// Corners of triangles, one array per coordinate, for loops over several triangles at once.
class WindingLanes {
  public:
    /// Triangles first <= t < last.
    struct Run {
        std::uint32_t first, last;
    };
    /// Bound on the error per triangle if solid_angle returns true.
    static constexpr double error = 1e-8;

    void reserve(std::size_t triangles);
    void add(const std::array<Vec3, 3>& corners);
    /// To be called after the last triangle.
    void finish();

    /// Computes the sum of the signed solid angles of the triangles as seen from the point. Returns false if
    /// the point is so close to a triangle or its boundary that rounding decides the side.
    bool solid_angle(const Vec3& point, std::span<const Run> runs, double& sum) const;

    // For the vectorised loops.
    static constexpr std::size_t width = 8;
    const double* coordinate(std::size_t corner, std::size_t axis) const {
        return coordinates_[3 * corner + axis].data();
    }

  private:
    std::array<std::vector<double>, 9> coordinates_;
};

}  // namespace splitcubes::geometry
