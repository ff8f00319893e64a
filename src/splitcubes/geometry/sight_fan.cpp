// Compiled once for each instruction set by Highway's foreach_target.h. What they round differently lies
// within the error bounds, and so is decided in double precision by code that they share.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/geometry/sight_fan.cpp"
#include <hwy/foreach_target.h>
// Must come after it.
#include <hwy/highway.h>

#include <splitcubes/geometry/sight_fan.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#ifndef SPLITCUBES_GEOMETRY_SIGHT_FAN_CPP_
#define SPLITCUBES_GEOMETRY_SIGHT_FAN_CPP_
namespace splitcubes::geometry {
namespace {

/// Segments side by side, m from the point that they start at.
struct Fan {
    alignas(64) float way[3][most_fan_segments] = {};
    alignas(64) float low[3][most_fan_segments] = {}, high[3][most_fan_segments] = {};  // of their boxes
};
/// Where a pack lies in the fan's frame.
struct PackPlace {
    std::array<float, 3> from;       // m, the fan's point from the pack's centre
    std::array<float, 3> low, high;  // m, the pack's box from the fan's point
    float extent, way;               // m, of corners from their centre; of the segments
    float reach;                     // m, from the fan's point to the pack's corners along an axis
    float rounding;                  // m, of a corner seen from the fan's point
};
struct Slacks {
    float side, plane;  // m^3, more than rounding makes of the triple products
};

constexpr float unit = 5.97e-8F;  // relative error of a rounding

// Bounds of what rounding makes of the products, by the largest of each factor's coordinates; twice of what
// adding up all roundings gives.
[[maybe_unused]] Slacks slacks_of(const OccluderPack& pack, const PackPlace& p) {
    float size = 0;
    for (std::size_t k = 0; k < 3; ++k) size = std::max(size, pack.high[k] - pack.low[k]);
    const float edge = 4 * p.reach * p.rounding + 6 * unit * p.reach * p.reach;
    const float normal = size * (8 * unit * p.extent + 10 * unit * size);
    return {6 * p.way * (edge + 8 * unit * p.reach * p.reach),
            6 * ((normal + 10 * unit * size * size) * (p.reach + p.way) + 2 * size * size * p.rounding)};
}

}  // namespace
}  // namespace splitcubes::geometry
#endif

HWY_BEFORE_NAMESPACE();
namespace splitcubes::geometry {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, OccluderPack::width>;
using V = hn::Vec<Lanes>;

struct V3 {
    V x, y, z;
};
HWY_INLINE V3 load(const float (&corner)[3][OccluderPack::width], std::size_t lane) {
    const Lanes d;
    return {hn::Load(d, corner[0] + lane), hn::Load(d, corner[1] + lane), hn::Load(d, corner[2] + lane)};
}
HWY_INLINE V3 minus(const V3& a, const V3& b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE V minor(V a, V b, V c, V d) {
    return hn::MulSub(a, b, hn::Mul(c, d));
}
HWY_INLINE V3 cross(const V3& a, const V3& b) {
    return {minor(a.y, b.z, a.z, b.y), minor(a.z, b.x, a.x, b.z), minor(a.x, b.y, a.y, b.x)};
}
HWY_INLINE V dot(const V3& a, const V3& b) {
    return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}
HWY_INLINE std::uint32_t bits_of(hn::Mask<Lanes> mask) {
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(Lanes(), mask, bytes);
    return static_cast<std::uint32_t>(bytes[0]) | static_cast<std::uint32_t>(bytes[1]) << 8;
}

// Which of the open segments have a box that meets the pack's.
HWY_INLINE std::uint32_t near_pack(const Fan& fan, const PackPlace& place, std::uint32_t open) {
    const Lanes d;
    std::uint32_t out = 0;
    for (std::size_t first = 0; first < most_fan_segments; first += hn::Lanes(d)) {
        auto meets = hn::FirstN(d, hn::Lanes(d));
        for (std::size_t k = 0; k < 3; ++k) {
            const auto below = hn::Le(hn::Load(d, fan.low[k] + first), hn::Set(d, place.high[k]));
            const auto above = hn::Le(hn::Set(d, place.low[k]), hn::Load(d, fan.high[k] + first));
            meets = hn::And(meets, hn::And(below, above));
        }
        out |= bits_of(meets) << first;
    }
    return out & open;
}

// The segments that may meet triangles of the pack, and for each of them which.
std::uint32_t look(const OccluderPack& pack, const PackPlace& place, const Fan& fan, std::uint32_t open,
                   std::uint32_t* lanes) {
    const Lanes d;
    open = near_pack(fan, place, open);
    if (open == 0) return 0;
    for (std::uint32_t left = open; left != 0; left &= left - 1) lanes[std::countr_zero(left)] = 0;
    const V3 from{hn::Set(d, place.from[0]), hn::Set(d, place.from[1]), hn::Set(d, place.from[2])};
    const Slacks slacks = slacks_of(pack, place);
    const V high = hn::Set(d, slacks.side), low = hn::Neg(high);
    const V above = hn::Set(d, slacks.plane), below = hn::Neg(above);
    for (std::size_t first = 0; first < OccluderPack::width; first += hn::Lanes(d)) {
        const V3 c0 = load(pack.corner[0], first), c1 = load(pack.corner[1], first);
        const V3 c2 = load(pack.corner[2], first);
        const V3 p0 = minus(c0, from), p1 = minus(c1, from), p2 = minus(c2, from);
        const V3 edge0 = cross(p0, p1), edge1 = cross(p1, p2), edge2 = cross(p2, p0);
        const V3 normal = cross(minus(c1, c0), minus(c2, c0));
        const V side = hn::Neg(dot(normal, p0));
        for (std::uint32_t left = open; left != 0; left &= left - 1) {
            const auto k = static_cast<std::size_t>(std::countr_zero(left));
            const V3 way{hn::Set(d, fan.way[0][k]), hn::Set(d, fan.way[1][k]), hn::Set(d, fan.way[2][k])};
            const V e0 = dot(way, edge0), e1 = dot(way, edge1), e2 = dot(way, edge2);
            const V end = hn::Add(side, dot(normal, way));
            const auto beside = hn::And(hn::Lt(hn::Min(hn::Min(e0, e1), e2), low),
                                        hn::Gt(hn::Max(hn::Max(e0, e1), e2), high));
            const auto before = hn::Or(hn::Gt(hn::Min(side, end), above), hn::Lt(hn::Max(side, end), below));
            lanes[k] |= bits_of(hn::Not(hn::Or(beside, before))) << first;
        }
    }
    std::uint32_t out = 0;
    for (std::uint32_t left = open; left != 0; left &= left - 1) {
        const auto k = static_cast<std::size_t>(std::countr_zero(left));
        lanes[k] &= pack.used;
        if (lanes[k] != 0) out |= std::uint32_t{1} << k;
    }
    return out;
}

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::geometry
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::geometry {

HWY_EXPORT(look);

namespace {

// Segments that are walked along sooner than packs are looked at.
constexpr std::size_t few = 4;

std::uint32_t blocked_one_by_one(const OccluderGrid& occluders, const Vec3& from, std::span<const Vec3> to,
                                 std::uint32_t* by) {
    std::uint32_t out = 0;
    for (std::size_t k = 0; k < to.size(); ++k) {
        const std::uint32_t id = occluders.blocker(from, to[k]);
        if (id == OccluderGrid::no_triangle) continue;
        out |= std::uint32_t{1} << k;
        if (by) by[k] = id;
    }
    return out;
}

// extent, way: as in PackPlace.
PackPlace place_of(const OccluderPack& pack, const std::array<float, 3>& from, float extent, float way) {
    PackPlace out{from, {}, {}, extent, way, 0, 0};
    float start = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        out.reach = std::max({out.reach, std::abs(pack.low[k] - from[k]), std::abs(pack.high[k] - from[k])});
        start = std::max(start, std::abs(from[k]));
    }
    out.rounding = unit * (extent + start + out.reach);
    const float room = 2 * out.rounding + 2 * unit * way;
    for (std::size_t k = 0; k < 3; ++k) {
        out.low[k] = pack.low[k] - from[k] - room;
        out.high[k] = pack.high[k] - from[k] + room;
    }
    return out;
}

}  // namespace

std::uint32_t blocked_segments(const OccluderGrid& occluders, const Vec3& from, std::span<const Vec3> to,
                               std::uint32_t* by) {
    if (to.size() < few) return blocked_one_by_one(occluders, from, to, by);
    Box box{from, from};
    Fan fan;
    float way = 0;
    for (std::size_t k = 0; k < to.size(); ++k) {
        box.add(to[k]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<Eigen::Index>(axis);
            const auto along = static_cast<float>(to[k][a] - from[a]);
            fan.way[axis][k] = along;
            fan.low[axis][k] = std::min(along, 0.0F);
            fan.high[axis][k] = std::max(along, 0.0F);
            way = std::max(way, std::abs(along));
        }
    }
    box = box.grown(1e-9 * box.size().maxCoeff());
    if (occluders.is_clear(box)) return 0;
    static_assert(most_fan_segments <= 32);
    std::uint32_t open = ~std::uint32_t{0} >> (32 - to.size()), blocked = 0;
    const auto decide = [&](std::size_t k, std::uint32_t id) {
        const OccluderTriangle& triangle = occluders.triangle(id);
        const Box around{from.cwiseMin(to[k]), from.cwiseMax(to[k])};
        if (!triangle.bounds().meets(around.grown(2e-9 * around.size().maxCoeff())) ||
            !segment_meets_triangle(from, to[k], triangle.corner))
            return;
        blocked |= std::uint32_t{1} << k;
        open &= ~(std::uint32_t{1} << k);
        if (by) by[k] = id;
    };
    occluders.visit_packs(
        box,
        [&](const OccluderPack& pack, const PackedTriangles& packed) {
            if (open == 0) return;
            const Eigen::Vector3f start = (from - packed.centre()).cast<float>();
            const PackPlace place = place_of(pack, {start.x(), start.y(), start.z()}, packed.extent(), way);
            std::array<std::uint32_t, most_fan_segments> lanes;
            for (std::uint32_t met = HWY_DYNAMIC_DISPATCH(look)(pack, place, fan, open, lanes.data());
                 met != 0; met &= met - 1) {
                const auto k = static_cast<std::size_t>(std::countr_zero(met));
                for (std::uint32_t left = lanes[k]; left != 0 && (open >> k & 1) != 0; left &= left - 1)
                    decide(k, pack.id[std::countr_zero(left)]);
            }
        },
        [&](std::uint32_t id) {
            for (std::size_t k = 0; k < to.size(); ++k)
                if ((open >> k & 1) != 0) decide(k, id);
        });
    return blocked;
}

}  // namespace splitcubes::geometry
#endif
