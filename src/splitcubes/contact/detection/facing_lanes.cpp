// Compiled once per instruction set by Highway's foreach_target.h. Callers decide in double precision what
// instruction sets may round differently.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/contact/detection/facing_lanes.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target.h.
#include <hwy/highway.h>

#include <splitcubes/contact/detection/facing_lanes.h>

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
    const auto mx = hn::Set(d, query.wx), my = hn::Set(d, query.wy), mz = hn::Set(d, query.wz);
    const auto ax = hn::Set(d, query.ax), ay = hn::Set(d, query.ay), az = hn::Set(d, query.az);
    const auto radius = hn::Set(d, query.radius), reach = hn::Set(d, query.reach);
    const auto cosine = hn::Set(d, query.cosine);
    const auto height = hn::Set(d, query.height);
    const auto dot = [](auto x1, auto y1, auto z1, auto x2, auto y2, auto z2)
                         HWY_ATTR { return hn::MulAdd(x1, x2, hn::MulAdd(y1, y2, hn::Mul(z1, z2))); };
    std::size_t count = 0;
    auto below = hn::FirstN(d, 0);
    for (const FacingRange& range : ranges)
        for (std::size_t k = range.begin; k < range.end; k += width) {
            const auto wx = hn::Sub(x, hn::LoadU(d, lanes.x + k));
            const auto wy = hn::Sub(y, hn::LoadU(d, lanes.y + k));
            const auto wz = hn::Sub(z, hn::LoadU(d, lanes.z + k));
            const auto ox = hn::LoadU(d, lanes.nx + k), oy = hn::LoadU(d, lanes.ny + k);
            const auto oz = hn::LoadU(d, lanes.nz + k);
            const auto limit = hn::Min(radius, hn::Add(reach, hn::LoadU(d, lanes.extra_reach + k)));
            const auto near = hn::Lt(dot(wx, wy, wz, wx, wy, wz), hn::Mul(limit, limit));
            const auto faces = hn::Lt(dot(nx, ny, nz, ox, oy, oz), cosine);
            const auto chosen = hn::And(hn::And(near, faces), hn::FirstN(d, range.end - k));
            if (hn::AllFalse(d, chosen)) continue;
            const auto ex = hn::Add(wx, hn::Sub(mx, hn::LoadU(d, lanes.wx + k)));
            const auto ey = hn::Add(wy, hn::Sub(my, hn::LoadU(d, lanes.wy + k)));
            const auto ez = hn::Add(wz, hn::Sub(mz, hn::LoadU(d, lanes.wz + k)));
            const auto more =
                dot(hn::Sub(ax, hn::LoadU(d, lanes.ax + k)), hn::Sub(ay, hn::LoadU(d, lanes.ay + k)),
                    hn::Sub(az, hn::LoadU(d, lanes.az + k)), ox, oy, oz);
            const auto next = hn::Add(dot(ex, ey, ez, ox, oy, oz), hn::Min(more, hn::Zero(d)));
            below = hn::Or(below, hn::And(chosen, hn::Le(next, height)));
            // Compress in a register: CompressStore is slow on some processors.
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
