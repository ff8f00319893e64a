// Compiled once for each instruction set by Highway's foreach_target.h. Multiplications and additions stay
// separate (no fused operations), and every lane does the same operations in the same order on each, so the
// bits agree.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/occlusion/cpu/rasterize.cpp"
#include <hwy/foreach_target.h>
// Must follow foreach_target.h.
#include <hwy/highway.h>

#include <splitcubes/occlusion/cpu/rasterize.h>

#include <algorithm>
#include <bit>

HWY_BEFORE_NAMESPACE();
namespace splitcubes::occlusion::cpu {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Error of the sum of products in an edge function, relative to the product of the corners' largest
// coordinates: 30 roundings bound it, with a margin.
constexpr float rounding = 2.5e-6F;

// One block from one apex. Function k at sample (x, y) is f[k][0] x + f[k][1] y + f[k][2], in units of its
// rounding error: three edges, then the near and the far depth.
struct Setup {
    alignas(64) float f[5][3][block_size];
    alignas(64) float root[5][block_size];  // about -1 / f[k][0]; finite, and signed even if that is 0
    alignas(64) std::int32_t first_row[block_size];
    alignas(64) std::int32_t last_row[block_size];
    std::uint32_t alive = 0;     // bit per triangle: may cover a sample
    std::uint32_t deep = 0;      // extends before the near or past the far depth
    std::uint32_t edge_on = 0;   // the sign of its determinant is within rounding
    std::uint32_t negative = 0;  // its functions were negated
};

struct View {
    const Disk& disk;
    const DiskRaster& raster;
    int apex;
    alignas(64) float coordinate[32];  // of a column or row, disk radii
};

// Returns one bit per lane.
template <class D>
HWY_INLINE std::uint32_t bits_of(D d, hn::Mask<D> mask) {
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return static_cast<std::uint32_t>(bytes[0]) | static_cast<std::uint32_t>(bytes[1]) << 8;
}

// Computes the local coordinates of a block, disk radii, in single precision.
HWY_INLINE void transform(const Disk& disk, const TriangleBlock& block, float (&local)[3][3][block_size]) {
    const hn::CappedTag<double, 8> d;
    const hn::Rebind<float, decltype(d)> single;
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t lane = 0; lane < block_size; lane += hn::Lanes(d)) {
            const auto x = hn::Load(d, block.corner[c][0] + lane);
            const auto y = hn::Load(d, block.corner[c][1] + lane);
            const auto z = hn::Load(d, block.corner[c][2] + lane);
            for (int axis = 0; axis < 3; ++axis) {
                const auto sum = hn::Add(hn::Add(hn::Mul(hn::Set(d, disk.axes(axis, 0)), x),
                                                 hn::Mul(hn::Set(d, disk.axes(axis, 1)), y)),
                                         hn::Mul(hn::Set(d, disk.axes(axis, 2)), z));
                hn::Store(hn::DemoteTo(single, sum), single, local[c][axis] + lane);
            }
        }
}

template <class V>
HWY_INLINE V min3(V a, V b, V c) {
    return hn::Min(hn::Min(a, b), c);
}
template <class V>
HWY_INLINE V max3(V a, V b, V c) {
    return hn::Max(hn::Max(a, b), c);
}
// Returns a b - c d.
template <class V>
HWY_INLINE V minor(V a, V b, V c, V d) {
    return hn::Sub(hn::Mul(a, b), hn::Mul(c, d));
}

// Sets up the functions of Lanes(d) triangles.
template <class D>
HWY_INLINE void set_up_lanes(D d, const View& view, const float (&local)[3][3][block_size], std::size_t lane,
                             Setup& setup) {
    const auto set = [&](float value) { return hn::Set(d, value); };
    const auto zero = hn::Zero(d);
    const auto x0 = hn::Load(d, local[0][0] + lane), x1 = hn::Load(d, local[1][0] + lane),
               x2 = hn::Load(d, local[2][0] + lane);
    const auto y0 = hn::Load(d, local[0][1] + lane), y1 = hn::Load(d, local[1][1] + lane),
               y2 = hn::Load(d, local[2][1] + lane);
    auto z0 = hn::Load(d, local[0][2] + lane), z1 = hn::Load(d, local[1][2] + lane),
         z2 = hn::Load(d, local[2][2] + lane);
    if (view.apex == 1) {
        z0 = hn::Sub(set(2), z0);
        z1 = hn::Sub(set(2), z1);
        z2 = hn::Sub(set(2), z2);
    }
    const auto near = set(static_cast<float>(near_depth)), far = set(static_cast<float>(far_depth));

    // Triangles out of view: before or behind the depths, or beyond one of eight planes around the cone,
    // which leave the outermost samples a margin.
    const auto z_low = min3(z0, z1, z2), z_high = max3(z0, z1, z2);
    auto out = hn::Or(hn::Lt(z_high, near), hn::Gt(z_low, far));
    const auto beyond = [&](auto p0, auto p1, auto p2, auto slope) {
        const auto s0 = hn::Mul(slope, z0), s1 = hn::Mul(slope, z1), s2 = hn::Mul(slope, z2);
        const auto above = hn::Gt(min3(hn::Sub(p0, s0), hn::Sub(p1, s1), hn::Sub(p2, s2)), zero);
        const auto below = hn::Lt(max3(hn::Add(p0, s0), hn::Add(p1, s1), hn::Add(p2, s2)), zero);
        out = hn::Or(out, hn::Or(above, below));
    };
    beyond(x0, x1, x2, set(1));
    beyond(y0, y1, y2, set(1));
    beyond(hn::Add(x0, y0), hn::Add(x1, y1), hn::Add(x2, y2), set(1.42F));
    beyond(hn::Sub(x0, y0), hn::Sub(x1, y1), hn::Sub(x2, y2), set(1.42F));

    const auto ax = minor(y0, z1, z0, y1), ay = minor(z0, x1, x0, z1), az = minor(x0, y1, y0, x1);
    const auto bx = minor(y1, z2, z1, y2), by = minor(z1, x2, x1, z2), bz = minor(x1, y2, y1, x2);
    const auto cx = minor(y2, z0, z2, y0), cy = minor(z2, x0, x2, z0), cz = minor(x2, y0, y2, x0);
    const auto determinant = hn::Add(hn::Add(hn::Mul(x0, bx), hn::Mul(y0, by)), hn::Mul(z0, bz));
    const auto sign = hn::CopySign(set(1), determinant);

    const auto m0 = max3(hn::Abs(x0), hn::Abs(y0), hn::Abs(z0));
    const auto m1 = max3(hn::Abs(x1), hn::Abs(y1), hn::Abs(z1));
    const auto m2 = max3(hn::Abs(x2), hn::Abs(y2), hn::Abs(z2));
    const auto bound = [&](auto value) { return hn::Add(hn::Mul(set(rounding), value), set(1e-30F)); };
    const auto error_a = bound(hn::Mul(m0, m1)), error_b = bound(hn::Mul(m1, m2)),
               error_c = bound(hn::Mul(m2, m0));
    const auto error_sum = hn::Add(hn::Add(error_a, error_b), error_c);
    const auto error_determinant = bound(hn::Mul(hn::Mul(m0, m1), m2));

    const auto store = [&](int k, auto fx, auto fy, auto fz, auto error) {
        const auto scale = hn::Div(sign, error);
        const auto slope = hn::Mul(fx, scale);
        // Infinity and NaN become the largest value.
        const auto inverse = hn::Abs(hn::ApproximateReciprocal(slope));
        const auto bounded = hn::IfThenElse(hn::Lt(inverse, set(1e30F)), inverse, set(1e30F));
        hn::Store(hn::CopySign(bounded, hn::Neg(slope)), d, setup.root[k] + lane);
        hn::Store(slope, d, setup.f[k][0] + lane);
        hn::Store(hn::Mul(fy, scale), d, setup.f[k][1] + lane);
        hn::Store(hn::Mul(fz, scale), d, setup.f[k][2] + lane);
    };
    store(0, ax, ay, az, error_a);
    store(1, bx, by, bz, error_b);
    store(2, cx, cy, cz, error_c);
    // Depth = determinant / (sum of the edge functions).
    const auto sx = hn::Add(hn::Add(ax, bx), cx), sy = hn::Add(hn::Add(ay, by), cy),
               sz = hn::Add(hn::Add(az, bz), cz);
    store(3, hn::Neg(hn::Mul(near, sx)), hn::Neg(hn::Mul(near, sy)), hn::Sub(determinant, hn::Mul(near, sz)),
          hn::Add(error_determinant, hn::Mul(near, error_sum)));
    store(4, hn::Mul(far, sx), hn::Mul(far, sy), hn::Sub(hn::Mul(far, sz), determinant),
          hn::Add(error_determinant, hn::Mul(far, error_sum)));

    // Rows that the projection spans; all rows if it passes the apex.
    const float half = 0.5F * static_cast<float>(view.raster.size);
    const auto q0 = hn::Div(y0, z0), q1 = hn::Div(y1, z1), q2 = hn::Div(y2, z2);
    const auto row_of = [&](auto y, float slack) {
        return hn::Add(hn::Mul(hn::Add(y, set(1)), set(half)), set(slack - 0.5F));
    };
    const auto ahead = hn::Gt(z_low, set(1e-3F));
    const auto low = hn::IfThenElseZero(ahead, hn::Ceil(row_of(min3(q0, q1, q2), -0.01F)));
    const auto high = hn::IfThenElse(ahead, hn::Floor(row_of(max3(q0, q1, q2), 0.01F)), set(2 * half));
    const hn::RebindToSigned<D> integer;
    hn::Store(hn::ConvertTo(integer, hn::Min(hn::Max(low, zero), set(2 * half))), integer,
              setup.first_row + lane);
    hn::Store(hn::ConvertTo(integer, hn::Max(hn::Min(high, set(2 * half - 1)), set(-1))), integer,
              setup.last_row + lane);

    const auto edge_on = hn::Le(hn::Abs(determinant), error_determinant);
    const auto deep = hn::Or(hn::Or(hn::Lt(z_low, set(static_cast<float>(near_depth + 1e-5))),
                                    hn::Gt(z_high, set(static_cast<float>(far_depth - 1e-5)))),
                             edge_on);
    setup.alive |= (~bits_of(d, out) & ((1U << hn::Lanes(d)) - 1)) << lane;
    setup.deep |= bits_of(d, deep) << lane;
    setup.edge_on |= bits_of(d, edge_on) << lane;
    setup.negative |= bits_of(d, hn::Lt(sign, zero)) << lane;
}

// Adds one triangle to the masks; flip = -1 treats it as the other orientation.
template <int size, bool deep>
HWY_INLINE void cover(const View& view, const Setup& setup, std::size_t t, float flip, OpenSamples open,
                      DiskMasks& masks) {
    const hn::CappedTag < float, size<16 ? size : 16> d;
    constexpr std::size_t columns = size;
    const bool toggles = view.apex == 0 && open.triangle->boundary;
    const auto coefficient = [&](int k, int c) { return flip * setup.f[k][c][t]; };
    const float ay = coefficient(0, 1), by = coefficient(1, 1), cy = coefficient(2, 1);
    const float a1 = coefficient(0, 2), b1 = coefficient(1, 2), c1 = coefficient(2, 2);
    const float ny = deep ? coefficient(3, 1) : 0, n1 = deep ? coefficient(3, 2) : 0;
    const float fy = deep ? coefficient(4, 1) : 0, f1 = deep ? coefficient(4, 2) : 0;
    for (std::size_t column = 0; column < columns; column += hn::Lanes(d)) {
        const auto x = hn::Load(d, view.coordinate + column);
        const auto ax = hn::Mul(hn::Set(d, coefficient(0, 0)), x);
        const auto bx = hn::Mul(hn::Set(d, coefficient(1, 0)), x);
        const auto cx = hn::Mul(hn::Set(d, coefficient(2, 0)), x);
        const auto nx = hn::Mul(hn::Set(d, deep ? coefficient(3, 0) : 0), x);
        const auto fx = hn::Mul(hn::Set(d, deep ? coefficient(4, 0) : 0), x);
        for (int row = setup.first_row[t]; row <= setup.last_row[t]; ++row) {
            const float y = view.coordinate[row];
            auto smallest = min3(hn::Add(ax, hn::Set(d, ay * y + a1)), hn::Add(bx, hn::Set(d, by * y + b1)),
                                 hn::Add(cx, hn::Set(d, cy * y + c1)));
            if constexpr (deep)
                smallest = min3(smallest, hn::Add(nx, hn::Set(d, ny * y + n1)),
                                hn::Add(fx, hn::Set(d, fy * y + f1)));
            const std::size_t bit = static_cast<std::size_t>(row) * columns + column;
            const std::uint32_t covered = bits_of(d, hn::Ge(smallest, hn::Set(d, -1.0F)));
            const std::uint32_t certain = bits_of(d, hn::Gt(smallest, hn::Set(d, 1.0F)));
            masks.obscured[bit / 64] |= std::uint64_t{certain} << (bit % 64);
            if (toggles) masks.outside[bit / 64] ^= std::uint64_t{certain} << (bit % 64);
            if (covered != certain) {
                open.row = row;
                open.columns = (covered & ~certain) << column;
                resolve(view.disk, view.raster, open, masks);
            }
        }
    }
}

// Rows of a disk's masks, one bit per column.
template <int size>
struct Rows {
    alignas(64) std::uint32_t obscured[size] = {};
    alignas(64) std::uint32_t outside[size] = {};

    void add_to(DiskMasks& masks) const {
        for (std::size_t row = 0; row < size; ++row) {
            masks.obscured[row * size / 64] |= std::uint64_t{obscured[row]} << (row * size % 64);
            masks.outside[row * size / 64] ^= std::uint64_t{outside[row]} << (row * size % 64);
        }
    }
};

// Adds one triangle, all rows at once: in a row, a function changes its sign at one column, and its value is
// nearest to zero at the column next to the root. Returns false and adds nothing if that value is within
// rounding of zero in a row of the triangle.
template <int size, int functions>
HWY_INLINE bool cover_rows(const View& view, const Setup& setup, std::size_t t, bool toggles,
                           Rows<size>& rows) {
    const hn::CappedTag < float, size<16 ? size : 16> d;
    const hn::RebindToSigned<decltype(d)> integer;
    const hn::RebindToUnsigned<decltype(d)> bits;
    constexpr float half = 0.5F * size;
    alignas(64) std::uint32_t covered[size];
    const auto first_row = hn::Set(d, view.coordinate[0] + static_cast<float>(setup.first_row[t]) / half);
    const auto last_row = hn::Set(d, view.coordinate[0] + static_cast<float>(setup.last_row[t]) / half);
    auto doubtful = hn::FirstN(d, 0);
    for (std::size_t row = 0; row < size; row += hn::Lanes(d)) {
        const auto y = hn::Load(d, view.coordinate + row);
        const auto spanned = hn::And(hn::Ge(y, first_row), hn::Le(y, last_row));
        auto inside = hn::Set(bits, ~std::uint32_t{0});
        for (int k = 0; k < functions; ++k) {
            const auto slope = hn::Set(d, setup.f[k][0][t]);
            const auto rest = hn::Add(hn::Mul(hn::Set(d, setup.f[k][1][t]), y), hn::Set(d, setup.f[k][2][t]));
            const auto at =
                hn::Mul(hn::Add(hn::Mul(rest, hn::Set(d, setup.root[k][t])), hn::Set(d, 1 - 0.5F / half)),
                        hn::Set(d, half));
            const auto column = hn::Round(hn::Min(hn::Max(at, hn::Zero(d)), hn::Set(d, size - 1.0F)));
            const auto x = hn::Sub(hn::Mul(column, hn::Set(d, 1 / half)), hn::Set(d, 1 - 0.5F / half));
            const auto value = hn::Add(hn::Mul(slope, x), rest);
            // The limit exceeds 1 because the approximate root can be half a column off.
            doubtful = hn::Or(doubtful, hn::AndNot(hn::Gt(hn::Abs(value), hn::Set(d, 1.1F)), spanned));
            const auto beyond = hn::ShiftRight<31>(hn::BitCast(bits, hn::Xor(value, slope)));
            const auto from = hn::BitCast(bits, hn::ConvertTo(integer, column));
            const auto upward = hn::Shl(hn::Shl(hn::Set(bits, ~std::uint32_t{0}), from), beyond);
            const auto falling = hn::BitCast(
                bits,
                hn::ShiftRight<31>(hn::BitCast(integer, slope)));  // all bits where the slope is negative
            inside = hn::And(inside, hn::Xor(upward, falling));
        }
        inside = hn::And(inside, hn::Set(bits, static_cast<std::uint32_t>((std::uint64_t{1} << size) - 1)));
        hn::Store(hn::IfThenElseZero(hn::RebindMask(bits, spanned), inside), bits, covered + row);
    }
    if (!hn::AllFalse(d, doubtful)) return false;
    for (std::size_t row = 0; row < size; row += hn::Lanes(d)) {
        const auto add = hn::Load(bits, covered + row);
        hn::Store(hn::Or(hn::Load(bits, rows.obscured + row), add), bits, rows.obscured + row);
        if (toggles) hn::Store(hn::Xor(hn::Load(bits, rows.outside + row), add), bits, rows.outside + row);
    }
    return true;
}

template <int size>
void cover_block(const View& view, const TriangleBlock& block, const Setup& setup, Rows<size>& rows,
                 DiskMasks& masks) {
    for (std::uint32_t alive = setup.alive; alive; alive &= alive - 1) {
        const auto t = static_cast<std::size_t>(std::countr_zero(alive));
        const auto has = [&](std::uint32_t bits) { return (bits >> t & 1) != 0; };
        const bool toggles = view.apex == 0 && block.source[t]->boundary;
        if (!has(setup.edge_on) && (has(setup.deep) ? cover_rows<size, 5>(view, setup, t, toggles, rows)
                                                    : cover_rows<size, 3>(view, setup, t, toggles, rows)))
            continue;
        OpenSamples open{block.source[t], view.apex, has(setup.negative) ? -1 : 1, 0, 0};
        if (has(setup.deep))
            cover<size, true>(view, setup, t, 1, open, masks);
        else
            cover<size, false>(view, setup, t, 1, open, masks);
        if (has(setup.edge_on)) {
            open.orientation = -open.orientation;
            cover<size, true>(view, setup, t, -1, open, masks);
        }
    }
}

template <int size>
void rasterize_size(const Disk& disk, const DiskRaster& raster, const TriangleList& triangles,
                    DiskMasks& masks) {
    const hn::CappedTag<float, block_size> d;
    View view{disk, raster, 0, {}};
    for (int k = 0; k < size; ++k) view.coordinate[k] = static_cast<float>(raster.coordinate(k));
    Rows<size> rows;
    for (std::size_t begin = 0; begin < triangles.count(); begin += block_size) {
        const TriangleBlock& block = triangles.blocks()[begin / block_size];
        const auto filled = static_cast<std::uint32_t>(std::min(triangles.count() - begin, block_size));
        alignas(64) float local[3][3][block_size];
        transform(disk, block, local);
        for (view.apex = 0; view.apex < 2; ++view.apex) {
            Setup setup;
            for (std::size_t lane = 0; lane < filled; lane += hn::Lanes(d))
                set_up_lanes(d, view, local, lane, setup);
            setup.alive &= block.seen[view.apex];
            cover_block<size>(view, block, setup, rows, masks);
        }
    }
    rows.add_to(masks);
}

void rasterize_blocks(const Disk& disk, const DiskRaster& raster, const TriangleList& triangles,
                      DiskMasks& masks) {
    if (raster.size == 8) rasterize_size<8>(disk, raster, triangles, masks);
    if (raster.size == 16) rasterize_size<16>(disk, raster, triangles, masks);
    if (raster.size == 32) rasterize_size<32>(disk, raster, triangles, masks);
}

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::occlusion::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::occlusion::cpu {

HWY_EXPORT(rasterize_blocks);

void rasterize(const Disk& disk, const DiskRaster& raster, const TriangleList& triangles, DiskMasks& masks) {
    HWY_DYNAMIC_DISPATCH(rasterize_blocks)(disk, raster, triangles, masks);
}

}  // namespace splitcubes::occlusion::cpu
#endif
