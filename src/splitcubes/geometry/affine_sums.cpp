// Highway's foreach_target.h compiles this file once per instruction set. There are no
// fused operations, so results are the same bits.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/geometry/affine_sums.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target.h.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <splitcubes/geometry/affine_sums.h>
#include <splitcubes/geometry/tuning.h>

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace splitcubes::geometry {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<double, 4> d;
using V = hn::Vec<decltype(d)>;
constexpr std::size_t lanes = hn::MaxLanes(d);
constexpr std::size_t vectors = AffineDisplacement::entry_count / lanes;

// A running sum. Its additions depend on each other; sums of several rows run in parallel.
struct Sum {
    V part[vectors];
    std::uint32_t next, end;

    HWY_INLINE explicit Sum(const AffineRow& row) : next(row.begin), end(row.begin + row.count) {
        for (V& p : part) p = hn::Zero(d);
    }
    HWY_INLINE void add(const std::uint32_t* index, const double* weight, const AffineDisplacement* motions) {
        // Further than hardware prefetches; a prefetch past the end is harmless.
        hwy::Prefetch(weight + next + tuning::affine_sums::prefetch_terms);
        hwy::Prefetch(index + next + tuning::affine_sums::prefetch_terms);
        const V w = hn::Set(d, weight[next]);
        const double* motion = motions[index[next]].entries();
        for (std::size_t v = 0; v < vectors; ++v)
            part[v] = hn::Add(part[v], hn::Mul(w, hn::LoadU(d, motion + v * lanes)));
        ++next;
    }
    HWY_INLINE void store(AffineDisplacement& out) const {
        for (std::size_t v = 0; v < vectors; ++v) hn::StoreU(part[v], d, out.entries() + v * lanes);
    }
};

void sum_rows(std::span<const AffineRow> rows, const std::uint32_t* index, const double* weight,
              const AffineDisplacement* motions, AffineDisplacement* out) {
    const auto finish = [&](Sum& sum, std::size_t r) HWY_ATTR {
        while (sum.next < sum.end) sum.add(index, weight, motions);
        sum.store(out[r]);
    };
    std::size_t r = 0;
    for (; r + 3 < rows.size(); r += 4) {
        Sum a(rows[r]), b(rows[r + 1]), c(rows[r + 2]), e(rows[r + 3]);
        const std::uint32_t common = std::min(std::min(rows[r].count, rows[r + 1].count),
                                              std::min(rows[r + 2].count, rows[r + 3].count));
        for (std::uint32_t k = 0; k < common; ++k) {
            a.add(index, weight, motions);
            b.add(index, weight, motions);
            c.add(index, weight, motions);
            e.add(index, weight, motions);
        }
        finish(a, r);
        finish(b, r + 1);
        finish(c, r + 2);
        finish(e, r + 3);
    }
    for (; r < rows.size(); ++r) {
        Sum sum(rows[r]);
        finish(sum, r);
    }
}

// One point per lane.
constexpr hn::CappedTag<double, transform_width> wide;
using W = hn::Vec<decltype(wide)>;

struct Three {
    W v[3];
};

// Sums three terms in the order of Eigen's product of a 3x3 matrix and a vector: the last row is summed
// from its end.
HWY_INLINE W row_sum(int row, W a, W b, W c) {
    return row < 2 ? hn::Add(hn::Add(a, b), c) : hn::Add(a, hn::Add(b, c));
}

HWY_INLINE Three product(const W (&columns)[3][3], const Three& by) {
    Three out;
    for (int r = 0; r < 3; ++r)
        out.v[r] = row_sum(r, hn::Mul(columns[0][r], by.v[0]), hn::Mul(columns[1][r], by.v[1]),
                           hn::Mul(columns[2][r], by.v[2]));
    return out;
}

HWY_INLINE Three load(const std::array<const double*, 3>& lists, std::size_t k) {
    return {{hn::LoadU(wide, lists[0] + k), hn::LoadU(wide, lists[1] + k), hn::LoadU(wide, lists[2] + k)}};
}

HWY_INLINE void store(const Three& v, std::size_t count, Vec3* out) {
    constexpr std::size_t lanes_a_vector = hn::MaxLanes(wide);
    if (count >= lanes_a_vector) {
        hn::StoreInterleaved3(v.v[0], v.v[1], v.v[2], wide, out->data());
        return;
    }
    HWY_ALIGN double lists[3][lanes_a_vector];
    for (int r = 0; r < 3; ++r) hn::Store(v.v[r], wide, lists[r]);
    for (std::size_t k = 0; k < count; ++k) out[k] = Vec3(lists[0][k], lists[1][k], lists[2][k]);
}

// Transforms the normal by the cofactor matrix; its columns are cross products of the Jacobian's other two.
HWY_INLINE Three turned(const W (&jacobian)[3][3], const Three& normal) {
    W cofactor[3][3];
    for (int k = 0; k < 3; ++k)
        for (int r = 0; r < 3; ++r) {
            const W(&p)[3] = jacobian[(k + 1) % 3];
            const W(&q)[3] = jacobian[(k + 2) % 3];
            cofactor[k][r] =
                hn::Sub(hn::Mul(p[(r + 1) % 3], q[(r + 2) % 3]), hn::Mul(p[(r + 2) % 3], q[(r + 1) % 3]));
        }
    const Three out = product(cofactor, normal);
    const W length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(out.v[0], out.v[0]), hn::Mul(out.v[1], out.v[1])),
                                      hn::Mul(out.v[2], out.v[2])));
    const auto is_long = hn::Gt(length, hn::Set(wide, tuning::affine_sums::min_normal_length));
    Three unit;
    for (int r = 0; r < 3; ++r) unit.v[r] = hn::IfThenElse(is_long, hn::Div(out.v[r], length), normal.v[r]);
    return unit;
}

void transform_lanes(std::size_t count, const AffineDisplacement* motions, const TransformedPoints& points,
                     Vec3* positions, Vec3* normals) {
    constexpr std::size_t step = hn::MaxLanes(wide);
    static_assert(transform_width % step == 0);
    const auto entry_offsets =
        hn::Mul(hn::Iota(hn::RebindToSigned<decltype(wide)>(), 0),
                hn::Set(hn::RebindToSigned<decltype(wide)>(), std::int64_t{AffineDisplacement::entry_count}));
    for (std::size_t k = 0; k < count; k += step) {
        const W factor = hn::LoadU(wide, points.factor + k);
        const auto entry = [&](std::size_t e) HWY_ATTR {
            return hn::Mul(hn::GatherIndex(wide, motions[k].entries() + e, entry_offsets), factor);
        };
        W gradient[3][3], jacobian[3][3], shift[3];
        for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t r = 0; r < 3; ++r) {
                gradient[c][r] = entry(3 * c + r);
                jacobian[c][r] = hn::Add(hn::Set(wide, c == r ? 1.0 : 0.0), gradient[c][r]);
            }
        for (std::size_t r = 0; r < 3; ++r) shift[r] = entry(9 + r);
        const Three point = load(points.point, k);
        Three image = product(gradient, point);
        for (int r = 0; r < 3; ++r) image.v[r] = hn::Add(point.v[r], hn::Add(shift[r], image.v[r]));
        store(image, count - k, positions + k);
        store(turned(jacobian, load(points.normal, k)), count - k, normals + k);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::geometry
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::geometry {

HWY_EXPORT(sum_rows);
HWY_EXPORT(transform_lanes);

void sum_affine(std::span<const AffineRow> rows, const std::uint32_t* index, const double* weight,
                const AffineDisplacement* motions, AffineDisplacement* out) {
    HWY_DYNAMIC_DISPATCH(sum_rows)(rows, index, weight, motions, out);
}

void transform_points(std::size_t count, const AffineDisplacement* motions, const TransformedPoints& points,
                      Vec3* positions, Vec3* normals) {
    HWY_DYNAMIC_DISPATCH(transform_lanes)(count, motions, points, positions, normals);
}

}  // namespace splitcubes::geometry
#endif
