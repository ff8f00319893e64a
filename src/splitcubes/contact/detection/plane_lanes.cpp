// Compiled once per instruction set by Highway's foreach_target.h. Products and sums are not fused, so all
// round alike.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/contact/detection/plane_lanes.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target.h.
#include <hwy/highway.h>

#include <splitcubes/contact/detection/plane_lanes.h>

#include <limits>

HWY_BEFORE_NAMESPACE();
namespace splitcubes::body {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

std::size_t find_nearest(const std::array<const double*, 6>& lanes, std::size_t count, const Vec3& point,
                         const Vec3& outwards, double* squared_distances) {
    constexpr std::size_t max_width = 8;
    const hn::CappedTag<double, max_width> d;
    const std::size_t width = hn::Lanes(d);
    const auto px = hn::Set(d, point.x()), py = hn::Set(d, point.y()), pz = hn::Set(d, point.z());
    const auto ox = hn::Set(d, outwards.x()), oy = hn::Set(d, outwards.y()), oz = hn::Set(d, outwards.z());
    auto nearest = hn::Set(d, std::numeric_limits<double>::infinity());
    auto index = hn::Set(d, static_cast<double>(count));
    for (std::size_t k = 0; k < count; k += width) {
        const auto x = hn::Sub(hn::LoadU(d, lanes[0] + k), px), y = hn::Sub(hn::LoadU(d, lanes[1] + k), py),
                   z = hn::Sub(hn::LoadU(d, lanes[2] + k), pz);
        const auto square = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
        hn::StoreU(square, d, squared_distances + k);
        const auto outward =
            hn::Add(hn::Add(hn::Mul(hn::LoadU(d, lanes[3] + k), ox), hn::Mul(hn::LoadU(d, lanes[4] + k), oy)),
                    hn::Mul(hn::LoadU(d, lanes[5] + k), oz));
        const auto nearer =
            hn::And(hn::And(hn::Le(outward, hn::Zero(d)), hn::Lt(square, nearest)), hn::FirstN(d, count - k));
        nearest = hn::IfThenElse(nearer, square, nearest);
        index = hn::IfThenElse(nearer, hn::Iota(d, static_cast<double>(k)), index);
    }
    std::array<double, max_width> nearest_of_lane{}, index_of_lane{};
    hn::StoreU(nearest, d, nearest_of_lane.data());
    hn::StoreU(index, d, index_of_lane.data());
    std::size_t best = 0;
    for (std::size_t lane = 1; lane < width; ++lane)
        if (nearest_of_lane[lane] < nearest_of_lane[best] ||
            (nearest_of_lane[lane] == nearest_of_lane[best] && index_of_lane[lane] < index_of_lane[best]))
            best = lane;
    return static_cast<std::size_t>(index_of_lane[best]);
}

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::body
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::body {

namespace {

constexpr std::size_t plane_padding = 8;

}  // namespace

HWY_EXPORT(find_nearest);

void PlaneLanes::reset(std::size_t capacity) {
    for (std::vector<double>& lane : lanes_) lane.assign(capacity + plane_padding, 0);
    squared_distances_.resize(capacity + plane_padding);
    size_ = 0;
}

void PlaneLanes::add(const Vec3& position, const Vec3& normal) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        lanes_[axis][size_] = position[static_cast<Eigen::Index>(axis)];
        lanes_[3 + axis][size_] = normal[static_cast<Eigen::Index>(axis)];
    }
    ++size_;
}

std::size_t PlaneLanes::find_nearest(const Vec3& point, const Vec3& outwards) {
    return HWY_DYNAMIC_DISPATCH(find_nearest)({lanes_[0].data(), lanes_[1].data(), lanes_[2].data(),
                                               lanes_[3].data(), lanes_[4].data(), lanes_[5].data()},
                                              size_, point, outwards, squared_distances_.data());
}

}  // namespace splitcubes::body
#endif
