// How fast what is around a place moves against what is there.
#pragma once

#include <splitcubes/math/types.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Ranges of velocities by cells of a uniform grid, each with those of its neighbours. Its memory is
/// kept from build to build.
class SpeedBounds {
  public:
    struct Range {
        Vec3 low, high;  // m/s
    };
    /// points: m; ranges: of the velocities at each; reach: m, > 0.
    void build(std::span<const Vec3> points, std::span<const Range> ranges, double reach);

    /// m/s, no less than the difference between the velocity and any of those at points within the
    /// reach of this one.
    double against(std::size_t point, const Vec3& velocity) const {
        const Range& range = around_[cell_[point]];
        return (velocity - range.low).cwiseAbs().cwiseMax((velocity - range.high).cwiseAbs()).norm();
    }

  private:
    void spread();

    Vec3i count_ = Vec3i::Ones();        // cells
    std::vector<std::uint32_t> cell_;    // per point
    std::vector<Range> around_, spare_;  // per cell
};

}  // namespace splitcubes::body
