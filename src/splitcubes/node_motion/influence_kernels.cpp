// Compiled once per instruction set by Highway's foreach_target.h. Uses no fused multiply-add, so that the
// results are bit-identical.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/node_motion/influence_kernels.cpp"
#include <hwy/foreach_target.h>
// Must come after it.
#include <hwy/highway.h>

#include <splitcubes/node_motion/influence_kernels.h>

#include <limits>

HWY_BEFORE_NAMESPACE();
namespace splitcubes::body {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t max_lanes = 16;
constexpr hn::CappedTag<float, max_lanes> d;
using V = hn::Vec<decltype(d)>;
using M = hn::Mask<decltype(d)>;
constexpr std::size_t lanes = hn::MaxLanes(d);

// Lists of a table; see InfluenceTable.
constexpr std::size_t square_list = 3, first_state = 4, state_size = 12, matrix_list = 3;
constexpr std::size_t list_count = first_state + 2 * state_size;

struct Point {
    V x, y, z;
};

HWY_INLINE Point offset_of(const InfluenceLists& from, std::size_t k, const Vec3f& centre) {
    const auto along = [&](std::size_t axis, float c) HWY_ATTR {
        return hn::Sub(hn::LoadU(d, from.numbers + axis * from.stride + k), hn::Set(d, c));
    };
    return {along(0, centre[0]), along(1, centre[1]), along(2, centre[2])};
}

HWY_INLINE M reaching(const InfluenceLists& from, std::size_t k, const Point& offset, float half) {
    const V zero = hn::Zero(d), side = hn::Set(d, half);
    const auto outside = [&](V v) HWY_ATTR { return hn::Max(hn::Sub(hn::Abs(v), side), zero); };
    const V x = outside(offset.x), y = outside(offset.y), z = outside(offset.z);
    const V distance = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
    const M within = hn::Le(distance, hn::LoadU(d, from.numbers + square_list * from.stride + k));
    return hn::And(within, hn::FirstN(d, from.end - k));
}

std::size_t choose(const InfluenceLists& from, const InfluenceTable::Cube& cube, bool recentre, float* to,
                   std::size_t to_stride) {
    std::size_t count = 0;
    for (std::size_t k = from.begin; k < from.end; k += lanes) {
        const Point offset = offset_of(from, k, cube.centre);
        const M near = reaching(from, k, offset, cube.half);
        if (hn::AllFalse(d, near)) continue;
        const auto list = [&](std::size_t f)
                              HWY_ATTR { return hn::LoadU(d, from.numbers + f * from.stride + k); };
        const auto put = [&](std::size_t f, V value)
                             HWY_ATTR { hn::CompressStore(value, near, d, to + f * to_stride + count); };
        put(0, recentre ? offset.x : list(0));
        put(1, recentre ? offset.y : list(1));
        put(2, recentre ? offset.z : list(2));
        put(square_list, list(square_list));
        for (std::size_t state = first_state; state < list_count; state += state_size) {
            for (std::size_t f = state + matrix_list; f < state + state_size; ++f) put(f, list(f));
            for (std::size_t r = 0; r < 3; ++r) {
                V off = list(state + r);
                if (recentre) {
                    // Value of the map at the cube's centre, which is at -offset from the entry's position.
                    off = hn::Sub(off, hn::Mul(list(state + 3 + r), offset.x));
                    off = hn::Sub(off, hn::Mul(list(state + 6 + r), offset.y));
                    off = hn::Sub(off, hn::Mul(list(state + 9 + r), offset.z));
                }
                put(state + r, off);
            }
        }
        count += hn::CountTrue(d, near);
    }
    return count;
}

void sum(const float* first, std::size_t stride, std::size_t count, std::span<float, 9> sums) {
    for (std::size_t f = 0; f < 9; ++f) {
        const float* list = first + f * stride;
        HWY_ALIGN float part[max_lanes];
        for (std::size_t l = 0; l < max_lanes; l += lanes) {
            V total = hn::Zero(d);
            for (std::size_t k = l; k < count; k += max_lanes)
                total = hn::Add(total, hn::IfThenElseZero(hn::FirstN(d, count - k), hn::LoadU(d, list + k)));
            hn::Store(total, d, part + l);
        }
        sums[f] = 0;
        for (const float p : part) sums[f] += p;
    }
}

template <bool is_point>
void bound(const InfluenceLists& from, const InfluenceTable::Cube& cube, std::span<float, 3> low,
           std::span<float, 3> high) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    const V max_value = hn::Set(d, infinity), min_value = hn::Set(d, -infinity);
    const V x = hn::Set(d, cube.centre[0]), y = hn::Set(d, cube.centre[1]), z = hn::Set(d, cube.centre[2]);
    const V half = hn::Set(d, cube.half);
    V lowest[3], highest[3];
    for (std::size_t r = 0; r < 3; ++r) {
        lowest[r] = max_value;
        highest[r] = min_value;
    }
    for (std::size_t k = from.begin; k < from.end; k += lanes) {
        const M near = reaching(from, k, offset_of(from, k, cube.centre), cube.half);
        if (hn::AllFalse(d, near)) continue;
        for (std::size_t state = first_state; state < list_count; state += state_size)
            for (std::size_t r = 0; r < 3; ++r) {
                const auto list = [&](std::size_t f) HWY_ATTR {
                    return hn::LoadU(d, from.numbers + (state + f) * from.stride + k);
                };
                const V a = list(3 + r), b = list(6 + r), c = list(9 + r);
                V at = hn::Add(list(r), hn::Mul(a, x));
                at = hn::Add(at, hn::Mul(b, y));
                at = hn::Add(at, hn::Mul(c, z));
                V under = at, over = at;
                if (!is_point) {
                    const V spread = hn::Mul(half, hn::Add(hn::Add(hn::Abs(a), hn::Abs(b)), hn::Abs(c)));
                    under = hn::Sub(at, spread);
                    over = hn::Add(at, spread);
                }
                lowest[r] = hn::Min(lowest[r], hn::IfThenElse(near, under, max_value));
                highest[r] = hn::Max(highest[r], hn::IfThenElse(near, over, min_value));
            }
    }
    for (std::size_t r = 0; r < 3; ++r) {
        low[r] = hn::GetLane(hn::MinOfLanes(d, lowest[r]));
        high[r] = hn::GetLane(hn::MaxOfLanes(d, highest[r]));
    }
}

void bound_any(const InfluenceLists& from, const InfluenceTable::Cube& cube, std::span<float, 3> low,
               std::span<float, 3> high) {
    if (cube.half == 0) {
        bound<true>(from, cube, low, high);
    } else {
        bound<false>(from, cube, low, high);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::body
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::body {

HWY_EXPORT(choose);
HWY_EXPORT(sum);
HWY_EXPORT(bound_any);

std::size_t choose_influences(const InfluenceLists& from, const InfluenceTable::Cube& cube, bool recentre,
                              float* to, std::size_t to_stride) {
    return HWY_DYNAMIC_DISPATCH(choose)(from, cube, recentre, to, to_stride);
}

void sum_lists(const float* first, std::size_t stride, std::size_t count, std::span<float, 9> sums) {
    HWY_DYNAMIC_DISPATCH(sum)(first, stride, count, sums);
}

void bound_influences(const InfluenceLists& from, const InfluenceTable::Cube& cube, std::span<float, 3> low,
                      std::span<float, 3> high) {
    HWY_DYNAMIC_DISPATCH(bound_any)(from, cube, low, high);
}

}  // namespace splitcubes::body
#endif
