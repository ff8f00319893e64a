// Nearest-neighbour and range queries among points.
#pragma once

#include <splitcubes/math/types.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Uniform grid over points in rest space, built by counting sort. Queries may run on
/// several threads at once, each with its own output.
class PhyxelLocator {
  public:
    PhyxelLocator() = default;
    /// points: m, copied; cell_size: m, > 0, best near the usual query radius
    /// (enlarged if the grid would have too many cells).
    PhyxelLocator(std::span<const Vec3> points, double cell_size);

    std::size_t size() const { return points_.size(); }
    /// Writes the indices of the points with |p - point| < radius, ascending. `out` is replaced.
    void near(const Vec3& point, double radius, std::vector<std::uint32_t>& out) const;
    /// Calls use(index) for the same points, in another but deterministic order, until it returns false.
    /// Returns whether all calls returned true.
    template <class Use>
    bool visit(const Vec3& point, double radius, const Use& use) const;
    /// Writes the `count` points nearest to `point` (all, if there are fewer), nearest
    /// first, equal distances by index. `out` is replaced.
    void nearest(const Vec3& point, std::size_t count, std::vector<std::uint32_t>& out) const;

  private:
    Vec3i cell_of(const Vec3& point) const;
    std::size_t cell_index(int x, int y, int z) const {
        return (static_cast<std::size_t>(z) * static_cast<std::size_t>(count_.y()) +
                static_cast<std::size_t>(y)) *
                   static_cast<std::size_t>(count_.x()) +
               static_cast<std::size_t>(x);
    }

    std::vector<Vec3> points_;            // m, rest space
    Vec3 origin_ = Vec3::Zero();          // m, low corner of the grid
    double cell_size_ = 1;                // m
    Vec3i count_ = Vec3i::Zero();         // cells per axis
    std::vector<std::uint32_t> begin_;    // per cell, first entry of indices_; one more at the end
    std::vector<std::uint32_t> indices_;  // point indices, cell by cell, ascending in a cell
};

template <class Use>
bool PhyxelLocator::visit(const Vec3& point, double radius, const Use& use) const {
    if (points_.empty()) return true;
    const Vec3i low = cell_of(point - Vec3::Constant(radius));
    const Vec3i high = cell_of(point + Vec3::Constant(radius));
    const double limit = radius * radius;
    for (int z = low.z(); z <= high.z(); ++z)
        for (int y = low.y(); y <= high.y(); ++y) {
            const std::uint32_t end = begin_[cell_index(high.x(), y, z) + 1];
            for (std::uint32_t k = begin_[cell_index(low.x(), y, z)]; k < end; ++k)
                if ((points_[indices_[k]] - point).squaredNorm() < limit && !use(indices_[k])) return false;
        }
    return true;
}

}  // namespace splitcubes::meshless
