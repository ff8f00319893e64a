// Highway's foreach_target.h compiles this file once per instruction set. Differences in rounding are within
// the slacks.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/geometry/occluder_lanes.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target.h.
#include <hwy/highway.h>

#include <splitcubes/geometry/occluder_lanes.h>
#include <splitcubes/geometry/tuning.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace splitcubes::geometry {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<float, OccluderLanes::width> d;
constexpr hn::RebindToUnsigned<decltype(d)> du;
using V = hn::Vec<decltype(d)>;
using M = hn::Mask<decltype(d)>;

HWY_INLINE M is_open(const OccluderLanes& lanes, std::size_t lane, std::uint32_t seen, std::uint32_t since) {
    const auto hides = hn::And(hn::Load(du, lanes.tag + lane), hn::Set(du, seen));
    const auto is_listed = hn::Eq(hides, hn::Zero(du));
    const auto is_new = hn::Gt(hn::Load(du, lanes.change + lane), hn::Set(du, since));
    return hn::RebindMask(d, hn::And(is_listed, is_new));
}

HWY_INLINE M meets_box(const OccluderLanes& lanes, std::size_t lane, const RoughBox& box) {
    M out = hn::FirstN(d, hn::Lanes(d));
    for (std::size_t k = 0; k < 3; ++k) {
        const M below = hn::Le(hn::Load(d, lanes.min[k] + lane), hn::Set(d, box.max[k]));
        const M above = hn::Ge(hn::Load(d, lanes.max[k] + lane), hn::Set(d, box.min[k]));
        out = hn::And(out, hn::And(below, above));
    }
    return out;
}

// Returns true only for lanes whose box the segment clearly misses.
HWY_INLINE M is_past(const OccluderLanes& lanes, std::size_t lane, const RoughSegment& segment) {
    V from = hn::Zero(d), to = hn::Set(d, 1);
    for (std::size_t k = 0; k < 3; ++k) {
        const V start = hn::Set(d, segment.start[k]), inverse = hn::Set(d, segment.inverse[k]);
        const V margin = hn::Set(d, segment.margin);
        const V low = hn::Sub(hn::Sub(hn::Load(d, lanes.min[k] + lane), margin), start);
        const V high = hn::Sub(hn::Add(hn::Load(d, lanes.max[k] + lane), margin), start);
        const V t0 = hn::Mul(low, inverse), t1 = hn::Mul(high, inverse);
        from = hn::Max(from, hn::Min(t0, t1));
        to = hn::Min(to, hn::Max(t0, t1));
    }
    // Covers five roundings on either side, also where both are near zero.
    return hn::Gt(hn::Sub(from, to), hn::Mul(hn::Set(d, 1e-6F), hn::Add(from, hn::Abs(to))));
}

// Returns true only for lanes with both ends clearly on one side of the plane.
HWY_INLINE M is_beside(const OccluderLanes& lanes, std::size_t lane, const RoughSegment& segment) {
    // Covers forty roundings of the sums: of the coordinates, the normal and six sums.
    const V offset = hn::Load(d, lanes.offset + lane);
    const V slack = hn::Mul(hn::Set(d, 40 * 6e-8F), hn::Add(hn::Set(d, segment.size), hn::Abs(offset)));
    const V x = hn::Load(d, lanes.normal[0] + lane), y = hn::Load(d, lanes.normal[1] + lane);
    const V z = hn::Load(d, lanes.normal[2] + lane);
    const auto side = [&](const std::array<float, 3>& p) HWY_ATTR {
        const V sum = hn::Add(hn::Mul(hn::Set(d, p[0]), x), hn::Mul(hn::Set(d, p[1]), y));
        return hn::Sub(hn::Add(sum, hn::Mul(hn::Set(d, p[2]), z)), offset);
    };
    const V at_a = side(segment.a), at_b = side(segment.b);
    return hn::Or(hn::Gt(hn::Min(at_a, at_b), slack), hn::Lt(hn::Max(at_a, at_b), hn::Neg(slack)));
}

std::uint32_t may_meet(const OccluderLanes& lanes, const RoughSegment& segment, std::uint32_t seen,
                       std::uint32_t since) {
    std::uint32_t out = 0;
    for (std::size_t lane = 0; lane < OccluderLanes::width; lane += hn::Lanes(d)) {
        const M near = hn::And(is_open(lanes, lane, seen, since), meets_box(lanes, lane, segment.box));
        if (hn::AllFalse(d, near)) continue;
        const M passed = hn::Or(is_beside(lanes, lane, segment), is_past(lanes, lane, segment));
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, hn::AndNot(passed, near), bits);
        out |= static_cast<std::uint32_t>(bits[0]) << lane;
    }
    return out;
}

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::geometry
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::geometry {

HWY_EXPORT(may_meet);

namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();

// Returns the next larger float, like std::nextafter but inlined. For finite numbers.
float next_above(float number) {
    if (number == 0) return std::numeric_limits<float>::denorm_min();
    const auto bits = std::bit_cast<std::uint32_t>(number);
    return std::bit_cast<float>(number > 0 ? bits + 1 : bits - 1);
}

}  // namespace

RoughBox RoughBox::around(const Box& box) {
    RoughBox out;
    for (std::size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Eigen::Index>(k);
        out.min[k] = -next_above(-static_cast<float>(box.min[axis]));
        out.max[k] = next_above(static_cast<float>(box.max[axis]));
    }
    return out;
}

RoughPlane::RoughPlane(const std::array<Vec3, 3>& corner, const Vec3& origin) {
    const Vec3 p = corner[1] - corner[0], q = corner[2] - corner[0], across = p.cross(q);
    const double length = across.norm();
    if (!(length > tuning::occluders::min_plane_area_ratio *
                       std::max({p.squaredNorm(), q.squaredNorm(), (p - q).squaredNorm()})))
        return;
    const Vec3 unit = across / length;
    for (std::size_t k = 0; k < 3; ++k) normal[k] = static_cast<float>(unit[static_cast<Eigen::Index>(k)]);
    offset = static_cast<float>(unit.dot(corner[0] - origin));
}

RoughSegment::RoughSegment(const Vec3& from, const Vec3& to, const Box& around, const Vec3& origin)
    : box(RoughBox::around(around)) {
    const Vec3 p = from - origin, q = to - origin;
    for (std::size_t k = 0; k < 3; ++k) {
        a[k] = static_cast<float>(p[static_cast<Eigen::Index>(k)]);
        b[k] = static_cast<float>(q[static_cast<Eigen::Index>(k)]);
    }
    size = static_cast<float>(std::max(p.lpNorm<1>(), q.lpNorm<1>()));
    for (std::size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Eigen::Index>(k);
        const double difference = to[axis] - from[axis];
        start[k] = static_cast<float>(from[axis]);
        inverse[k] = static_cast<float>(std::abs(difference) * tuning::occluders::max_reciprocal > 1
                                            ? 1 / difference
                                            : tuning::occluders::max_reciprocal);
    }
    margin = static_cast<float>(3e-7 * (around.max.cwiseAbs().maxCoeff() + around.min.cwiseAbs().maxCoeff()) +
                                1e-7 * around.size().maxCoeff());
}

void OccluderLanes::clear(std::size_t lane) {
    set(lane, {{infinite, infinite, infinite}, {-infinite, -infinite, -infinite}}, {}, 0, 0, 0);
}

void OccluderLanes::set(std::size_t lane, const RoughBox& box, const RoughPlane& plane, std::uint32_t id,
                        std::uint32_t spread, std::uint32_t change_number) {
    assert(id >> (32 - spread_bits) == 0 && spread >> spread_bits == 0);
    for (std::size_t k = 0; k < 3; ++k) {
        min[k][lane] = box.min[k];
        max[k][lane] = box.max[k];
        normal[k][lane] = plane.normal[k];
    }
    offset[lane] = plane.offset;
    tag[lane] = id << spread_bits | spread;
    change[lane] = change_number;
}

std::uint32_t lanes_that_may_meet(const OccluderLanes& lanes, const RoughSegment& segment, std::uint32_t seen,
                                  std::uint32_t since) {
    return HWY_DYNAMIC_DISPATCH(may_meet)(lanes, segment, seen, since);
}

}  // namespace splitcubes::geometry
#endif
