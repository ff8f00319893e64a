// Vector operations of conjugate gradients, compiled per instruction set like slice_kernels.cpp.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/elasticity/simd/slice_vectors.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target.h.
#include <hwy/highway.h>

#include <splitcubes/elasticity/simd/flush_tiny.h>
#include <splitcubes/elasticity/simd/slice_kernels.h>

HWY_BEFORE_NAMESPACE();
namespace splitcubes::meshless {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<float, LinkSlices::lanes> d;

// Sixteen double-precision partial sums, whatever the machine's vector width, so results are the same bits.
class LaneSums {
  public:
    template <class Product>
    HWY_INLINE void add(std::size_t lane, const Product& product) {
        hn::Store(hn::Add(hn::Load(wide, sums_ + lane), product), wide, sums_ + lane);
    }
    double total() const {
        double sum = 0;
        for (const double s : sums_) sum += s;
        return sum;
    }
    static constexpr hn::CappedTag<double, 8> wide{};
    static constexpr hn::Rebind<float, hn::CappedTag<double, 8>> narrow{};

  private:
    alignas(64) double sums_[LinkSlices::lanes] = {};
};

using Narrow = hn::Vec<hn::Rebind<float, hn::CappedTag<double, 8>>>;

double product_slices(std::size_t stride, const SliceRange& range, const float* diagonal, float factor,
                      const float* p, float* force) {
    LaneSums sums;
    constexpr auto narrow = LaneSums::narrow;
    constexpr auto wide = LaneSums::wide;
    const Narrow scale = hn::Set(narrow, factor);
    for (std::size_t begin = range.begin * LinkSlices::lanes; begin < range.end * LinkSlices::lanes;
         begin += LinkSlices::lanes)
        for (std::size_t lane = 0; lane < LinkSlices::lanes; lane += hn::Lanes(wide))
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t at = k * stride + begin + lane;
                const Narrow in = hn::LoadU(narrow, p + at);
                const Narrow own = hn::Mul(hn::LoadU(narrow, diagonal + begin + lane), in);
                const Narrow out = hn::Sub(own, hn::Mul(scale, hn::LoadU(narrow, force + at)));
                hn::StoreU(out, narrow, force + at);
                sums.add(lane, hn::Mul(hn::PromoteTo(wide, in), hn::PromoteTo(wide, out)));
            }
    return sums.total();
}

double advance_slices(std::size_t stride, const SliceRange& range, float alpha, const float* inverse,
                      const float* p, const float* q, float* to, float* r) {
    LaneSums sums;
    constexpr auto narrow = LaneSums::narrow;
    constexpr auto wide = LaneSums::wide;
    const Narrow step = hn::Set(narrow, alpha);
    for (std::size_t begin = range.begin * LinkSlices::lanes; begin < range.end * LinkSlices::lanes;
         begin += LinkSlices::lanes)
        for (std::size_t lane = 0; lane < LinkSlices::lanes; lane += hn::Lanes(wide)) {
            const auto weight = hn::PromoteTo(wide, hn::LoadU(narrow, inverse + begin + lane));
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t at = k * stride + begin + lane;
                const Narrow moved =
                    hn::Add(hn::LoadU(narrow, to + at), hn::Mul(step, hn::LoadU(narrow, p + at)));
                hn::StoreU(moved, narrow, to + at);
                const Narrow left =
                    hn::Sub(hn::LoadU(narrow, r + at), hn::Mul(step, hn::LoadU(narrow, q + at)));
                hn::StoreU(left, narrow, r + at);
                const auto precise = hn::PromoteTo(wide, left);
                sums.add(lane, hn::Mul(hn::Mul(precise, precise), weight));
            }
        }
    return sums.total();
}

double begin_slices(std::size_t stride, const SliceRange& range, const float* inverse, const float* r,
                    float* p) {
    LaneSums sums;
    constexpr auto narrow = LaneSums::narrow;
    constexpr auto wide = LaneSums::wide;
    for (std::size_t begin = range.begin * LinkSlices::lanes; begin < range.end * LinkSlices::lanes;
         begin += LinkSlices::lanes)
        for (std::size_t lane = 0; lane < LinkSlices::lanes; lane += hn::Lanes(wide)) {
            const Narrow weight = hn::LoadU(narrow, inverse + begin + lane);
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t at = k * stride + begin + lane;
                const Narrow left = hn::LoadU(narrow, r + at);
                hn::StoreU(hn::Mul(weight, left), narrow, p + at);
                const auto precise = hn::PromoteTo(wide, left);
                sums.add(lane, hn::Mul(hn::Mul(precise, precise), hn::PromoteTo(wide, weight)));
            }
        }
    return sums.total();
}

void turn_slices(std::size_t stride, const SliceRange& range, float beta, const float* inverse,
                 const float* r, const CoarsePart& coarse, float* p) {
    constexpr hn::RebindToSigned<decltype(d)> di;
    const auto share = hn::Set(d, beta);
    for (std::size_t begin = range.begin * LinkSlices::lanes; begin < range.end * LinkSlices::lanes;
         begin += hn::Lanes(d)) {
        const auto weight = hn::LoadU(d, inverse + begin);
        const auto aggregate = hn::LoadU(di, coarse.index + begin);
        for (std::size_t k = 0; k < 3; ++k) {
            float* const to = p + k * stride + begin;
            const auto own = hn::Mul(weight, hn::LoadU(d, r + k * stride + begin));
            const auto fresh = hn::Add(own, hn::GatherIndex(d, coarse.value + k * coarse.stride, aggregate));
            hn::StoreU(hn::Add(fresh, hn::Mul(share, hn::LoadU(d, to))), d, to);
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::meshless
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::meshless {

HWY_EXPORT(product_slices);
HWY_EXPORT(advance_slices);
HWY_EXPORT(begin_slices);
HWY_EXPORT(turn_slices);

double finish_product(std::size_t stride, const SliceRange& range, const float* diagonal, float factor,
                      const float* p, float* force) {
    const FlushTiny flush;
    return HWY_DYNAMIC_DISPATCH(product_slices)(stride, range, diagonal, factor, p, force);
}

double advance(std::size_t stride, const SliceRange& range, float alpha, const float* inverse, const float* p,
               const float* q, float* to, float* r) {
    const FlushTiny flush;
    return HWY_DYNAMIC_DISPATCH(advance_slices)(stride, range, alpha, inverse, p, q, to, r);
}

double begin_direction(std::size_t stride, const SliceRange& range, const float* inverse, const float* r,
                       float* p) {
    const FlushTiny flush;
    return HWY_DYNAMIC_DISPATCH(begin_slices)(stride, range, inverse, r, p);
}

void update_direction(std::size_t stride, const SliceRange& range, float beta, const float* inverse,
                      const float* r, const CoarsePart& coarse, float* p) {
    const FlushTiny flush;
    HWY_DYNAMIC_DISPATCH(turn_slices)(stride, range, beta, inverse, r, coarse, p);
}

}  // namespace splitcubes::meshless
#endif
