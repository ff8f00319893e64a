// Compiled once for each instruction set by Highway's foreach_target.h. Multiply
// and add stay apart (no fused operations), so the bits agree.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/geometry/affine_sums.cpp"
#include <hwy/foreach_target.h>
// Must come after it.
#include <hwy/highway.h>

#include <splitcubes/geometry/affine_sums.h>

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace splitcubes::geometry {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<double, 4> d;
using V = hn::Vec<decltype(d)>;
constexpr std::size_t lanes = hn::MaxLanes(d);
constexpr std::size_t vectors = AffineDisplacement::entry_count / lanes;

// A sum on its way. Its additions wait for each other; those of several rows do not.
struct Sum {
    V part[vectors];
    std::uint32_t next, end;

    HWY_INLINE explicit Sum(const AffineRow& row) : next(row.begin), end(row.begin + row.count) {
        for (V& p : part) p = hn::Zero(d);
    }
    HWY_INLINE void add(const std::uint32_t* index, const double* weight, const AffineDisplacement* motions) {
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

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::geometry
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::geometry {

HWY_EXPORT(sum_rows);

void sum_affine(std::span<const AffineRow> rows, const std::uint32_t* index, const double* weight,
                const AffineDisplacement* motions, AffineDisplacement* out) {
    HWY_DYNAMIC_DISPATCH(sum_rows)(rows, index, weight, motions, out);
}

}  // namespace splitcubes::geometry
#endif
