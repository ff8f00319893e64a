// Compiled once for each instruction set by Highway's foreach_target.h. Their different rounding is within
// the error bounds, and samples within these bounds are decided in double precision by shared code.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/occlusion/cpu/packs.cpp"
#include <hwy/foreach_target.h>
// Must follow foreach_target.h.
#include <hwy/highway.h>

#include <splitcubes/occlusion/cpu/packs.h>
#include <splitcubes/occlusion/cpu/rasterize.h>
#include <splitcubes/occlusion/tuning.h>

#include <algorithm>
#include <bit>

HWY_BEFORE_NAMESPACE();
namespace splitcubes::occlusion::cpu {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t width = geometry::OccluderPack::width;
using Lanes = hn::CappedTag<float, width>;
using V = hn::Vec<Lanes>;
using M = hn::Mask<Lanes>;

constexpr float unit = 5.97e-8F;  // relative error of one rounding
constexpr float far = static_cast<float>(far_depth);

// Triangles waiting to be projected, each from one apex.
struct Waiting {
    // [corner][axis], disk radii, with the depth from their apex.
    alignas(64) float corner[3][3][4 * width] = {};
    // Index of the pack, then 4 bits of lane, whether it toggles, apex.
    alignas(64) std::uint32_t tag[4 * width] = {};
    std::size_t count = 0;
};

// Rows of a disk, one bit per column; combined over the lanes they are the rows of the masks.
template <int size>
struct Rows {
    alignas(64) std::uint32_t obscured[size][width] = {};
    alignas(64) std::uint32_t outside[size][width] = {};
    bool toggled = false;
};

template <int size>
struct Scene {
    const Disk& disk;
    const DiskRaster& raster;
    const geometry::OccluderGrid& occluders;
    NearPacks& near;
    DiskMasks& masks;
    Waiting waiting;
    Rows<size> rows;
};

HWY_INLINE V set(float value) {
    return hn::Set(Lanes(), value);
}
HWY_INLINE V min3(V a, V b, V c) {
    return hn::Min(hn::Min(a, b), c);
}
HWY_INLINE V max3(V a, V b, V c) {
    return hn::Max(hn::Max(a, b), c);
}
// Returns a b - c d.
HWY_INLINE V minor(V a, V b, V c, V d) {
    return hn::Sub(hn::Mul(a, b), hn::Mul(c, d));
}
HWY_INLINE std::uint32_t bits_of(M mask) {
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(Lanes(), mask, bytes);
    return static_cast<std::uint32_t>(bytes[0]) | static_cast<std::uint32_t>(bytes[1]) << 8;
}
HWY_INLINE M mask_of(std::uint32_t bits) {
    const std::uint8_t bytes[8] = {static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(bits >> 8)};
    return hn::LoadMaskBits(Lanes(), bytes);
}
// Returns 1 / v to within 4 roundings, for values that are neither tiny nor huge.
HWY_INLINE V reciprocal(V v) {
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
    const V rough = hn::ApproximateReciprocal(v);
    return hn::MulAdd(hn::NegMulAdd(v, rough, set(1)), rough, rough);
#else
    return hn::Div(set(1), v);
#endif
}

// Three corners of one triangle per lane.
struct Corners {
    V x0, y0, z0, x1, y1, z1, x2, y2, z2;
};

// A side of a projected triangle, or the line at which it passes the far depth: a row crosses it at column
// slope * row + inner, or + outer. Columns beyond the first are certainly inside, columns before the second
// certainly outside.
struct Side {
    V slope, inner, outer;
    M left;  // larger columns are inside
};

HWY_INLINE Side side_of(V slope, V at, V error, M left) {
    const V low = hn::Sub(at, error), high = hn::Add(at, error);
    return {slope, hn::IfThenElse(left, high, low), hn::IfThenElse(left, low, high), left};
}

// Columns from .. to of a row.
struct Span {
    V from, to;

    HWY_INLINE void cut(V at, M left) {
        from = hn::IfThenElse(left, hn::Max(from, at), from);
        to = hn::IfThenElse(left, to, hn::Min(to, at));
    }
    HWY_INLINE void round() {
        from = hn::Ceil(from);
        to = hn::Floor(to);
    }
    // One bit per column; zero for lanes not in `shown`.
    HWY_INLINE hn::Vec<hn::RebindToUnsigned<Lanes>> bits(M shown) const {
        const hn::RebindToSigned<Lanes> integer;
        const hn::RebindToUnsigned<Lanes> unsign;
        const auto limit = hn::Set(unsign, 31);
        const auto all = hn::Set(unsign, ~std::uint32_t{0});
        const auto low = hn::And(hn::BitCast(unsign, hn::ConvertTo(integer, from)), limit);
        const auto high = hn::And(hn::Sub(limit, hn::BitCast(unsign, hn::ConvertTo(integer, to))), limit);
        return hn::IfThenElseZero(hn::RebindMask(unsign, shown),
                                  hn::And(hn::Shl(all, low), hn::Shr(all, high)));
    }
};

// Decides the samples of a row that are within the error bound of a side.
template <int size>
HWY_NOINLINE void decide(Scene<size>& scene, std::size_t begin, std::uint32_t lanes, std::uint32_t negative,
                         int row, const std::uint32_t* open) {
    for (; lanes; lanes &= lanes - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(lanes));
        const std::uint32_t tag = scene.waiting.tag[begin + lane];
        const geometry::OccluderPack& pack = *scene.near.packs[tag >> 6].pack;
        const OpenSamples samples{&scene.occluders.triangle(pack.id[tag >> 2 & 15]),
                                  static_cast<int>(tag & 1), (negative >> lane & 1) != 0 ? -1 : 1, row,
                                  open[lane]};
        resolve(scene.disk, scene.raster, samples, scene.masks);
    }
}

// Triangles projected to the raster, in columns and rows, with bounds of the errors.
struct Projected {
    V c0, r0, c1, r1, c2, r2;  // corners
    V w0, w1, w2;              // reciprocal depths
    V min_column, max_column;
    V first_row, last_row;
    V corner_error;  // of a corner along an axis
    V side_error;    // of a side's function, which is a cross product
    V area;          // twice, signed
};

template <int size>
HWY_INLINE Projected project(const Corners& t, float extent) {
    constexpr float half = 0.5F * size, middle = half - 0.5F;
    Projected p;
    p.w0 = reciprocal(t.z0), p.w1 = reciprocal(t.z1), p.w2 = reciprocal(t.z2);
    const auto to_raster = [&](V v, V w) { return hn::MulAdd(hn::Mul(v, w), set(half), set(middle)); };
    p.c0 = to_raster(t.x0, p.w0), p.c1 = to_raster(t.x1, p.w1), p.c2 = to_raster(t.x2, p.w2);
    p.r0 = to_raster(t.y0, p.w0), p.r1 = to_raster(t.y1, p.w1), p.r2 = to_raster(t.y2, p.w2);
    const V c_low = min3(p.c0, p.c1, p.c2), c_high = max3(p.c0, p.c1, p.c2);
    const V r_low = min3(p.r0, p.r1, p.r2), r_high = max3(p.r0, p.r1, p.r2);
    // Corners have an error of (16 extent + 4 |corner|) roundings; the projection, at most `reach` from the
    // middle, adds a few more.
    const V reach = hn::Mul(hn::Max(hn::Max(hn::Sub(set(middle), c_low), hn::Sub(c_high, set(middle))),
                                    hn::Max(hn::Sub(set(middle), r_low), hn::Sub(r_high, set(middle)))),
                            set(1 / half));
    const V roundings =
        hn::MulAdd(set(16 * extent), max3(p.w0, p.w1, p.w2), hn::MulAdd(set(4), reach, set(12)));
    p.corner_error = hn::Mul(hn::Mul(set(half * unit), hn::Add(reach, set(1))), roundings);
    const V slack = hn::Add(p.corner_error, p.corner_error);
    p.min_column = hn::Max(hn::Sub(c_low, slack), hn::Zero(Lanes()));
    p.max_column = hn::Min(hn::Add(c_high, slack), set(size - 1));
    p.first_row = hn::Ceil(hn::Max(hn::Sub(r_low, slack), hn::Zero(Lanes())));
    p.last_row = hn::Floor(hn::Min(hn::Add(r_high, slack), set(size - 1)));
    // Bounds two corners moved by their errors, a nearly level side tilted by as much, and the roundings in
    // computing a column.
    p.side_error =
        hn::Mul(hn::Mul(set(6), p.corner_error), hn::Add(hn::Sub(c_high, c_low), hn::Sub(r_high, r_low)));
    p.area = minor(hn::Sub(p.c1, p.c0), hn::Sub(p.r2, p.r0), hn::Sub(p.r1, p.r0), hn::Sub(p.c2, p.c0));
    return p;
}

// Returns the side from corner i to j of triangles whose winding is `sign`.
HWY_INLINE Side make_side(const Projected& p, V sign, V ci, V ri, V cj, V rj) {
    const V rise = hn::Sub(rj, ri);
    const V min_rise = hn::Add(p.corner_error, p.corner_error);
    const V steep = hn::CopySign(hn::Max(hn::Abs(rise), min_rise), rise);
    const V inverse = reciprocal(steep);
    const V slope = hn::Mul(hn::Sub(cj, ci), inverse);
    const M left = hn::Lt(hn::Mul(sign, steep), hn::Zero(Lanes()));
    return side_of(slope, hn::NegMulAdd(slope, ri, ci), hn::Mul(p.side_error, hn::Abs(inverse)), left);
}

// Returns the line at which triangles pass the far depth. Reciprocal depth is linear on the raster (Blinn
// 1992): it is the sum over corners of their value times the function of the opposite side.
HWY_INLINE Side make_depth_side(const Projected& p, V sign, V z_high, float extent) {
    const V far_w = set(1 / far);
    const V h0 = hn::Sub(p.w0, far_w), h1 = hn::Sub(p.w1, far_w), h2 = hn::Sub(p.w2, far_w);
    const auto sum = [&](V a0, V a1, V a2) {
        return hn::MulAdd(hn::Sub(a2, a1), h0, hn::MulAdd(hn::Sub(a0, a2), h1, hn::Mul(hn::Sub(a1, a0), h2)));
    };
    const V across = hn::Neg(hn::Mul(sign, sum(p.r0, p.r1, p.r2)));
    const V along = hn::Mul(sign, sum(p.c0, p.c1, p.c2));
    const V wide = hn::Sub(max3(p.c0, p.c1, p.c2), min3(p.c0, p.c1, p.c2));
    const V high = hn::Sub(max3(p.r0, p.r1, p.r2), min3(p.r0, p.r1, p.r2));
    const V w = max3(p.w0, p.w1, p.w2);
    const V w_error = hn::Mul(hn::Mul(w, set(unit)), hn::MulAdd(set(16 * extent), w, set(16)));
    const V h = max3(hn::Abs(h0), hn::Abs(h1), hn::Abs(h2));
    const V error =
        hn::MulAdd(hn::Mul(set(3), p.side_error), h, hn::Mul(hn::Mul(set(8), w_error), hn::Mul(wide, high)));
    const V min_across = hn::Div(error, hn::Max(wide, set(1e-6F)));
    const V steep = hn::CopySign(hn::Max(hn::Abs(across), min_across), across);
    const V inverse = reciprocal(steep);
    const V slope = hn::Neg(hn::Mul(along, inverse));
    const V at = hn::Sub(hn::NegMulAdd(slope, p.r0, p.c0), hn::Mul(hn::Mul(hn::Abs(p.area), h0), inverse));
    const Side side = side_of(slope, at, hn::Mul(hn::Add(error, error), hn::Abs(inverse)),
                              hn::Gt(steep, hn::Zero(Lanes())));
    // Disabled for triangles that end before the far depth.
    const M before = hn::Lt(z_high, set(far - 1e-4F - 64 * unit * extent));
    const V all = set(-1e6F);
    return {hn::IfThenZeroElse(before, side.slope), hn::IfThenElse(before, all, side.inner),
            hn::IfThenElse(before, all, side.outer), hn::Or(before, side.left)};
}

// Rasterises projected triangles; alive: lanes.
template <int size, bool deep>
HWY_INLINE void cover(Scene<size>& scene, std::size_t begin, const Projected& p, M alive, V z_high,
                      M toggles) {
    const V sign = hn::CopySign(set(1), p.area);
    const Side s0 = make_side(p, sign, p.c0, p.r0, p.c1, p.r1);
    const Side s1 = make_side(p, sign, p.c1, p.r1, p.c2, p.r2);
    const Side s2 = make_side(p, sign, p.c2, p.r2, p.c0, p.r0);
    const Side s3 = deep ? make_depth_side(p, sign, z_high, scene.near.extent) : s2;
    const std::uint32_t negative = bits_of(hn::Lt(sign, hn::Zero(Lanes())));
    const hn::RebindToUnsigned<Lanes> unsign;
    const bool any_toggles = !hn::AllFalse(Lanes(), hn::And(toggles, alive));
    scene.rows.toggled = scene.rows.toggled || any_toggles;

    const auto first =
        static_cast<int>(hn::GetLane(hn::MinOfLanes(Lanes(), hn::IfThenElse(alive, p.first_row, set(size)))));
    const auto last =
        static_cast<int>(hn::GetLane(hn::MaxOfLanes(Lanes(), hn::IfThenElse(alive, p.last_row, set(-1)))));
    for (int row = first; row <= last; ++row) {
        const V r = set(static_cast<float>(row));
        Span certain{p.min_column, p.max_column}, possible = certain;
        const auto cut = [&](const Side& side) {
            certain.cut(hn::MulAdd(side.slope, r, side.inner), side.left);
            possible.cut(hn::MulAdd(side.slope, r, side.outer), side.left);
        };
        cut(s0);
        cut(s1);
        cut(s2);
        if constexpr (deep) cut(s3);
        certain.round();
        possible.round();
        const M present = hn::And(alive, hn::And(hn::Ge(r, p.first_row), hn::Le(r, p.last_row)));
        const auto bits = certain.bits(hn::And(present, hn::Le(certain.from, certain.to)));
        const M some = hn::And(present, hn::Le(possible.from, possible.to));
        const M open =
            hn::And(some, hn::Or(hn::Ne(certain.from, possible.from), hn::Ne(certain.to, possible.to)));
        std::uint32_t* obscured = scene.rows.obscured[row];
        hn::Store(hn::Or(hn::Load(unsign, obscured), bits), unsign, obscured);
        if (any_toggles) {
            std::uint32_t* outside = scene.rows.outside[row];
            const auto toggled = hn::IfThenElseZero(hn::RebindMask(unsign, toggles), bits);
            hn::Store(hn::Xor(hn::Load(unsign, outside), toggled), unsign, outside);
        }
        if (const std::uint32_t lanes = bits_of(open); lanes != 0) {
            alignas(64) std::uint32_t columns[width];
            hn::Store(hn::AndNot(bits, possible.bits(open)), unsign, columns);
            decide(scene, begin, lanes, negative, row, columns);
        }
    }
}

// Rasterises the last waiting triangles, as many as there are lanes or all.
template <int size>
HWY_INLINE void rasterize_waiting(Scene<size>& scene) {
    const Lanes d;
    const hn::RebindToUnsigned<Lanes> unsign;
    const std::size_t taken = std::min(scene.waiting.count, hn::Lanes(d));
    const std::size_t begin = scene.waiting.count -= taken;
    const auto load = [&](int corner, int axis) {
        return hn::LoadU(d, scene.waiting.corner[corner][axis] + begin);
    };
    const Corners t{load(0, 0), load(0, 1), load(0, 2), load(1, 0), load(1, 1),
                    load(1, 2), load(2, 0), load(2, 1), load(2, 2)};
    const Projected p = project<size>(t, scene.near.extent);
    // Triangles between the samples cover none.
    const M on =
        hn::And(hn::Le(p.first_row, p.last_row), hn::Le(hn::Ceil(p.min_column), hn::Floor(p.max_column)));
    const M present = hn::And(hn::FirstN(d, taken), on);
    const M facing = hn::Gt(hn::Abs(p.area), p.side_error);
    for (std::uint32_t lanes = bits_of(hn::AndNot(facing, present)); lanes; lanes &= lanes - 1) {
        const std::uint32_t tag =
            scene.waiting.tag[begin + static_cast<std::size_t>(std::countr_zero(lanes))];
        scene.near.leftover.push_back(
            {scene.near.packs[tag >> 6].pack->id[tag >> 2 & 15], static_cast<int>(tag & 1)});
    }
    const M alive = hn::And(present, facing);
    if (hn::AllFalse(d, alive)) return;
    const auto tags = hn::LoadU(unsign, scene.waiting.tag + begin);
    const M toggles = hn::RebindMask(d, hn::TestBit(tags, hn::Set(unsign, 2)));
    const V z_high = max3(t.z0, t.z1, t.z2);
    const M deep = hn::Ge(z_high, set(far - 1e-4F - 64 * unit * scene.near.extent));
    if (hn::AllFalse(d, hn::And(deep, alive)))
        cover<size, false>(scene, begin, p, alive, z_high, toggles);
    else
        cover<size, true>(scene, begin, p, alive, z_high, toggles);
}

// Appends the triangles of some lanes of a pack, projected from one apex, to the waiting ones.
template <int size>
HWY_INLINE void append_waiting(Scene<size>& scene, Corners t, std::uint32_t pack, std::size_t lane, int apex,
                               M seen) {
    const Lanes d;
    const hn::RebindToUnsigned<Lanes> unsign;
    Waiting& waiting = scene.waiting;
    const auto store = [&](int corner, int axis, V v) {
        hn::CompressStore(v, seen, d, waiting.corner[corner][axis] + waiting.count);
    };
    if (apex == 1) {
        t.z0 = hn::Sub(set(2), t.z0);
        t.z1 = hn::Sub(set(2), t.z1);
        t.z2 = hn::Sub(set(2), t.z2);
    }
    store(0, 0, t.x0), store(0, 1, t.y0), store(0, 2, t.z0);
    store(1, 0, t.x1), store(1, 1, t.y1), store(1, 2, t.z1);
    store(2, 0, t.x2), store(2, 1, t.y2), store(2, 2, t.z2);
    auto tag = hn::ShiftLeft<2>(hn::Iota(unsign, static_cast<std::uint32_t>(lane)));
    tag = hn::Or(tag, hn::Set(unsign, pack << 6 | static_cast<std::uint32_t>(apex)));
    if (apex == 0) {
        const M is_boundary = mask_of(scene.near.packs[pack].pack->boundary >> lane);
        tag = hn::Or(tag, hn::IfThenElseZero(hn::RebindMask(unsign, is_boundary), hn::Set(unsign, 2)));
    }
    waiting.count +=
        hn::CompressStore(tag, hn::RebindMask(unsign, seen), unsign, waiting.tag + waiting.count);
    while (waiting.count >= hn::Lanes(d)) rasterize_waiting(scene);
}

// An axis of the disk: maps a corner to x, y and z times these coefficients plus an offset.
struct Axis {
    V x, y, z, offset;
};

// Finds the triangles of a pack that may be visible from each apex.
template <int size>
HWY_INLINE void project_visible(Scene<size>& scene, std::uint32_t pack_index) {
    const Lanes d;
    const PlacedPack& placed = scene.near.packs[pack_index];
    const auto& corner = placed.pack->corner;
    const auto axis = [&](int k) {
        const auto along = [&](int rest) { return set(static_cast<float>(scene.disk.axes(k, rest))); };
        return Axis{along(0), along(1), along(2), set(placed.offset[static_cast<std::size_t>(k)])};
    };
    const Axis ax = axis(0), ay = axis(1), az = axis(2);
    const float rounding = unit * (16 * scene.near.extent + 64);
    for (std::size_t lane = 0; lane < width; lane += hn::Lanes(d)) {
        const auto local = [&](std::size_t c, const Axis& a) {
            return hn::MulAdd(a.x, hn::Load(d, corner[c][0] + lane),
                              hn::MulAdd(a.y, hn::Load(d, corner[c][1] + lane),
                                         hn::MulAdd(a.z, hn::Load(d, corner[c][2] + lane), a.offset)));
        };
        const Corners t{local(0, ax), local(0, ay), local(0, az), local(1, ax), local(1, ay),
                        local(1, az), local(2, ax), local(2, ay), local(2, az)};
        const auto beside = [&](V v0, V v1, V v2) {
            return hn::Max(hn::Max(min3(v0, v1, v2), hn::Neg(max3(v0, v1, v2))), hn::Zero(d));
        };
        const V dx = beside(t.x0, t.x1, t.x2), dy = beside(t.y0, t.y1, t.y2);
        const V aside = hn::MulAdd(dx, dx, hn::Mul(dy, dy));
        const V z_low = min3(t.z0, t.z1, t.z2), z_high = max3(t.z0, t.z1, t.z2);
        const auto from_apex = [&](int apex, V low, V high) {
            const V radius = hn::Add(hn::Min(high, set(far)), set(4 * rounding + 1e-5F));
            const M seen = hn::And(hn::And(hn::Le(low, set(far + rounding)),
                                           hn::Ge(high, set(static_cast<float>(near_depth) - rounding))),
                                   hn::Le(aside, hn::Mul(radius, radius)));
            if (hn::AllFalse(d, seen)) return;
            const M ahead = hn::Ge(low, set(tuning::disks::min_projected_depth));
            for (std::uint32_t left = bits_of(hn::AndNot(ahead, seen)); left; left &= left - 1)
                scene.near.leftover.push_back(
                    {placed.pack->id[lane + static_cast<std::size_t>(std::countr_zero(left))], apex});
            append_waiting(scene, t, pack_index, lane, apex, hn::And(seen, ahead));
        };
        from_apex(0, z_low, z_high);
        from_apex(1, hn::Sub(set(2), z_high), hn::Sub(set(2), z_low));
    }
}

template <int size>
HWY_INLINE void add_rows(const Rows<size>& rows, DiskMasks& masks) {
    const auto joined = [](const std::uint32_t* lanes, auto join) {
        std::uint32_t all = 0;
        for (std::size_t k = 0; k < hn::Lanes(Lanes()); ++k) all = join(all, lanes[k]);
        return std::uint64_t{all};
    };
    for (std::size_t row = 0; row < size; ++row) {
        const std::size_t bit = row * size;
        masks.obscured[bit / 64] |=
            joined(rows.obscured[row], [](std::uint32_t a, std::uint32_t b) { return a | b; }) << (bit % 64);
        if (rows.toggled)
            masks.outside[bit / 64] ^=
                joined(rows.outside[row], [](std::uint32_t a, std::uint32_t b) { return a ^ b; })
                << (bit % 64);
    }
}

template <int size>
void rasterize_size(const Disk& disk, const DiskRaster& raster, const geometry::OccluderGrid& occluders,
                    NearPacks& near, DiskMasks& masks) {
    Scene<size> scene{disk, raster, occluders, near, masks, {}, {}};
    for (std::size_t k = 0; k < near.packs.size(); ++k) project_visible(scene, static_cast<std::uint32_t>(k));
    if (scene.waiting.count > 0) rasterize_waiting(scene);
    add_rows(scene.rows, masks);
}

void rasterize_near(const Disk& disk, const DiskRaster& raster, const geometry::OccluderGrid& occluders,
                    NearPacks& near, DiskMasks& masks) {
    if (raster.size == 8) rasterize_size<8>(disk, raster, occluders, near, masks);
    if (raster.size == 16) rasterize_size<16>(disk, raster, occluders, near, masks);
    if (raster.size == 32) rasterize_size<32>(disk, raster, occluders, near, masks);
}

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::occlusion::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::occlusion::cpu {

HWY_EXPORT(rasterize_near);

void rasterize_packs(const Disk& disk, const DiskRaster& raster, const geometry::OccluderGrid& occluders,
                     NearPacks& near, DiskMasks& masks) {
    HWY_DYNAMIC_DISPATCH(rasterize_near)(disk, raster, occluders, near, masks);
}

}  // namespace splitcubes::occlusion::cpu
#endif
