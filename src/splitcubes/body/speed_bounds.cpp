#include <splitcubes/body/speed_bounds.h>
#include <splitcubes/geometry/box.h>

#include <algorithm>
#include <limits>

namespace splitcubes::body {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

void add(const SpeedBounds::Range& from, SpeedBounds::Range& to) {
    to.low = to.low.cwiseMin(from.low);
    to.high = to.high.cwiseMax(from.high);
}

}  // namespace

// Takes in the ranges of the 26 cells around, axis by axis.
void SpeedBounds::spread() {
    std::size_t stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const auto length = static_cast<std::size_t>(count_[axis]);
        spare_ = around_;
        for (std::size_t c = 0; c < around_.size(); ++c) {
            const std::size_t at = c / stride % length;
            if (at > 0) add(spare_[c - stride], around_[c]);
            if (at + 1 < length) add(spare_[c + stride], around_[c]);
        }
        stride *= length;
    }
}

void SpeedBounds::build(std::span<const Vec3> points, std::span<const Range> ranges, double reach) {
    geometry::Box box;
    for (const Vec3& point : points)
        if (point.allFinite()) box.add(point);
    const Vec3 extent = box.empty() ? Vec3(Vec3::Zero()) : Vec3(box.size());
    double size = 1.0001 * reach;
    // At most about as many cells as points, whatever their spread.
    const double limit = static_cast<double>(points.size()) + 64;
    while (((extent / size).array().floor() + 1).prod() > limit) size *= 1.5;
    count_ = (extent / size).array().floor().cast<int>() + 1;
    around_.assign(static_cast<std::size_t>(count_.cast<std::int64_t>().prod()),
                   {Vec3::Constant(infinity), Vec3::Constant(-infinity)});
    cell_.resize(points.size());
    for (std::size_t k = 0; k < points.size(); ++k) {
        std::size_t cell = 0;
        for (int axis = 2; axis >= 0; --axis) {
            const double at = (points[k][axis] - box.min[axis]) / size;
            // Neither a far point nor one that is none overflows.
            const int place = at > 0 ? static_cast<int>(std::min<double>(at, count_[axis] - 1)) : 0;
            cell = cell * static_cast<std::size_t>(count_[axis]) + static_cast<std::size_t>(place);
        }
        cell_[k] = static_cast<std::uint32_t>(cell);
        add(ranges[k], around_[cell]);
    }
    spread();
}

}  // namespace splitcubes::body
