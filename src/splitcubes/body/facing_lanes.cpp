// Compiled once for each instruction set by Highway's foreach_target.h. What they round differently
// is decided in double precision by those who ask.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/body/facing_lanes.cpp"
#include <hwy/foreach_target.h>
// Must come after it.
#include <hwy/highway.h>

#include <splitcubes/body/facing_lanes.h>

HWY_BEFORE_NAMESPACE();
namespace splitcubes::body {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

std::size_t select(const FacingLanes& lanes, std::span<const FacingRange> ranges, const FacingQuery& query,
                   std::uint32_t* out, bool& low) {
    const hn::CappedTag<float, facing_padding> d;
    const hn::RebindToUnsigned<decltype(d)> d_index;
    const std::size_t width = hn::Lanes(d);
    const auto x = hn::Set(d, query.x), y = hn::Set(d, query.y), z = hn::Set(d, query.z);
    const auto nx = hn::Set(d, query.nx), ny = hn::Set(d, query.ny), nz = hn::Set(d, query.nz);
    const auto square = hn::Set(d, query.square), cosine = hn::Set(d, query.cosine);
    const auto height = hn::Set(d, query.height);
    const auto dot = [](auto ax, auto ay, auto az, auto bx, auto by, auto bz)
                         HWY_ATTR { return hn::MulAdd(ax, bx, hn::MulAdd(ay, by, hn::Mul(az, bz))); };
    std::size_t count = 0;
    auto below = hn::FirstN(d, 0);
    for (const FacingRange& range : ranges)
        for (std::size_t k = range.begin; k < range.end; k += width) {
            const auto wx = hn::Sub(x, hn::LoadU(d, lanes.x + k));
            const auto wy = hn::Sub(y, hn::LoadU(d, lanes.y + k));
            const auto wz = hn::Sub(z, hn::LoadU(d, lanes.z + k));
            const auto ox = hn::LoadU(d, lanes.nx + k), oy = hn::LoadU(d, lanes.ny + k);
            const auto oz = hn::LoadU(d, lanes.nz + k);
            const auto near = hn::Lt(dot(wx, wy, wz, wx, wy, wz), square);
            const auto faces = hn::Lt(dot(nx, ny, nz, ox, oy, oz), cosine);
            const auto chosen = hn::And(hn::And(near, faces), hn::FirstN(d, range.end - k));
            below = hn::Or(below, hn::And(chosen, hn::Le(dot(wx, wy, wz, ox, oy, oz), height)));
            if (hn::AllFalse(d, chosen)) continue;
            // Within a register: straight to memory is slow on some processors.
            const auto packed = hn::Compress(hn::Iota(d_index, static_cast<std::uint32_t>(k)),
                                             hn::RebindMask(d_index, chosen));
            hn::StoreU(packed, d_index, out + count);
            count += hn::CountTrue(d, chosen);
        }
    low = !hn::AllFalse(d, below);
    return count;
}

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::body
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::body {

HWY_EXPORT(select);

std::size_t select_facing(const FacingLanes& lanes, std::span<const FacingRange> ranges,
                          const FacingQuery& query, std::uint32_t* out, bool& low) {
    return HWY_DYNAMIC_DISPATCH(select)(lanes, ranges, query, out, low);
}

}  // namespace splitcubes::body
#endif
