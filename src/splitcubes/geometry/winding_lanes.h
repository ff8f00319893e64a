// Solid angles of many triangles at once.
#pragma once

#include <splitcubes/math/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::geometry {

/// The corners of triangles, one array a coordinate, for loops over several triangles side by side.
class WindingLanes {
  public:
    /// Triangles first <= t < last.
    struct Run {
        std::uint32_t first, last;
    };
    /// What `error` is at most where the sum is `sound`, for each triangle.
    static constexpr double error = 1e-8;

    void reserve(std::size_t triangles);
    void add(const std::array<Vec3, 3>& corners);
    /// After the last one.
    void finish();

    /// The sum of the signed solid angles that the triangles have as seen from the point. False, where it
    /// lies so close to one of them or to its rim that rounding decides which side it is on.
    bool solid_angle(const Vec3& point, std::span<const Run> runs, double& sum) const;

    // For the loop.
    static constexpr std::size_t width = 8;
    const double* coordinate(std::size_t corner, std::size_t axis) const {
        return coordinates_[3 * corner + axis].data();
    }

  private:
    std::array<std::vector<double>, 9> coordinates_;
};

}  // namespace splitcubes::geometry
