// Highway compiles this file per instruction set. The order of operations is fixed and none are fused, so
// results are the same bits on all of them.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/elasticity/simd/slice_kernels.cpp"
#include <hwy/cache_control.h>  // must come after foreach_target.h
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <splitcubes/elasticity/simd/flush_tiny.h>
#include <splitcubes/elasticity/simd/slice_kernels.h>
#include <splitcubes/elasticity/tuning.h>

HWY_BEFORE_NAMESPACE();
namespace splitcubes::meshless {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, LinkSlices::lanes>;
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;
constexpr D d;
struct Three {
    V x, y, z;
};
struct Nine {  // 3x3 matrix, row-major
    V m[9];
};

HWY_INLINE V add_product(V sum, V a, V b) {
    return hn::Add(sum, hn::Mul(a, b));
}

HWY_INLINE Three load3(const float* from, std::size_t stride) {
    return {hn::LoadU(d, from), hn::LoadU(d, from + stride), hn::LoadU(d, from + 2 * stride)};
}

HWY_INLINE V load_streamed(const float* from) {
    hwy::Prefetch(from + tuning::links::prefetch_distance);
    return hn::LoadU(d, from);
}

HWY_INLINE Three load3_streamed(const float* from) {
    return {load_streamed(from), load_streamed(from + LinkSlices::lanes),
            load_streamed(from + 2 * LinkSlices::lanes)};
}

HWY_INLINE Nine load9(const float* from, std::size_t stride) {
    Nine out;
    for (std::size_t k = 0; k < 9; ++k) out.m[k] = hn::LoadU(d, from + k * stride);
    return out;
}

HWY_INLINE void store3(const Three& v, float* to, std::size_t stride) {
    hn::StoreU(v.x, d, to);
    hn::StoreU(v.y, d, to + stride);
    hn::StoreU(v.z, d, to + 2 * stride);
}

HWY_INLINE void store9(const Nine& v, float* to, std::size_t stride) {
    for (std::size_t k = 0; k < 9; ++k) hn::StoreU(v.m[k], d, to + k * stride);
}

// A B, or A^T B.
template <bool transposed>
HWY_INLINE Nine product(const Nine& A, const Nine& B) {
    Nine out;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
            const auto a = [&](int k) { return transposed ? A.m[3 * k + r] : A.m[3 * r + k]; };
            V sum = hn::Mul(a(0), B.m[c]);
            sum = add_product(sum, a(1), B.m[3 + c]);
            out.m[3 * r + c] = add_product(sum, a(2), B.m[6 + c]);
        }
    return out;
}

// Readers of the values of a column's neighbours: contiguous, or one index per lane.
struct RunReader {
    std::size_t at;
    HWY_INLINE V operator()(const float* values) const { return hn::LoadU(d, values + at); }
};
struct GatherReader {
    hn::Vec<DI> index;
    HWY_INLINE V operator()(const float* values) const { return hn::GatherIndex(d, values, index); }
};

// Calls body(column, reader) for the columns of a slice, lanes from `lane` on.
template <class Body>
HWY_INLINE void for_columns(const LinkSlices& slices, std::size_t slice, std::size_t lane, const Body& body) {
    const std::int32_t* const run = slices.run().data();
    const std::size_t end = slices.column_end(slice);
    for (std::size_t column = slices.column_begin(slice); column < end; ++column) {
        if (run[column] >= 0) {
            body(column, RunReader{static_cast<std::size_t>(run[column]) + lane});
        } else {
            const auto set = static_cast<std::size_t>(~run[column]);
            const DI di;
            body(column, GatherReader{hn::LoadU(di, slices.index() + set * LinkSlices::lanes + lane)});
        }
    }
}

struct Gathered {
    Nine gradient;
    Three penalty;
};

HWY_INLINE void add_products(V* row, V a, const Three& b) {  // row += a b^T
    row[0] = add_product(row[0], a, b.x);
    row[1] = add_product(row[1], a, b.y);
    row[2] = add_product(row[2], a, b.z);
}

HWY_INLINE void add_link(const float* link, V x, V y, V z, Gathered& sum) {
    constexpr std::size_t lanes = LinkSlices::lanes;
    const Three g = load3_streamed(link);
    const V m = load_streamed(link + 3 * lanes);
    add_products(sum.gradient.m, x, g);
    add_products(sum.gradient.m + 3, y, g);
    add_products(sum.gradient.m + 6, z, g);
    sum.penalty = {add_product(sum.penalty.x, m, x), add_product(sum.penalty.y, m, y),
                   add_product(sum.penalty.z, m, z)};
}

HWY_INLINE Gathered zero_sums() {
    Gathered sum;
    const V zero = hn::Zero(d);
    for (V& m : sum.gradient.m) m = zero;
    sum.penalty = {zero, zero, zero};
    return sum;
}

// The displacement is high + low: differences of nearby phyxels are exact however far the body has moved.
HWY_INLINE Gathered gather_state(const LinkSlices& slices, std::size_t slice, std::size_t lane,
                                 const float* high, const float* low) {
    const std::size_t n = slices.stride();
    const std::size_t row = slice * LinkSlices::lanes + lane;
    const Three u = load3(high + row, n), rest = load3(low + row, n);
    Gathered sum = zero_sums();
    for_columns(slices, slice, lane, [&](std::size_t column, const auto& read) HWY_ATTR {
        const V x = hn::Add(hn::Sub(read(high), u.x), hn::Sub(read(low), rest.x));
        const V y = hn::Add(hn::Sub(read(high + n), u.y), hn::Sub(read(low + n), rest.y));
        const V z = hn::Add(hn::Sub(read(high + 2 * n), u.z), hn::Sub(read(low + 2 * n), rest.z));
        add_link(slices.forward() + column * 4 * LinkSlices::lanes + lane, x, y, z, sum);
    });
    return sum;
}

HWY_INLINE Gathered gather_direction(const LinkSlices& slices, std::size_t slice, std::size_t lane,
                                     const float* p) {
    const std::size_t n = slices.stride();
    const Three u = load3(p + slice * LinkSlices::lanes + lane, n);
    Gathered sum = zero_sums();
    for_columns(slices, slice, lane, [&](std::size_t column, const auto& read) HWY_ATTR {
        const V x = hn::Sub(read(p), u.x), y = hn::Sub(read(p + n), u.y), z = hn::Sub(read(p + 2 * n), u.z);
        add_link(slices.forward() + column * 4 * LinkSlices::lanes + lane, x, y, z, sum);
    });
    return sum;
}

// X^T X - I of X = I + Y, without the cancellation of forming X.
HWY_INLINE Nine error_of(const Nine& Y) {
    Nine E = product<true>(Y, Y);
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            E.m[3 * r + c] = hn::Add(E.m[3 * r + c], hn::Add(Y.m[3 * r + c], Y.m[3 * c + r]));
    return E;
}

HWY_INLINE V squared_norm(const Nine& A) {
    V sum = hn::Mul(A.m[0], A.m[0]);
    for (int k = 1; k < 9; ++k) sum = add_product(sum, A.m[k], A.m[k]);
    return sum;
}

HWY_INLINE V determinant(const Nine& Y) {  // det(I + Y)
    const V one = hn::Set(d, 1.0F);
    const V a = hn::Add(one, Y.m[0]), e = hn::Add(one, Y.m[4]), i = hn::Add(one, Y.m[8]);
    const V first = hn::Mul(a, hn::Sub(hn::Mul(e, i), hn::Mul(Y.m[5], Y.m[7])));
    const V second = hn::Mul(Y.m[1], hn::Sub(hn::Mul(Y.m[3], i), hn::Mul(Y.m[5], Y.m[6])));
    const V third = hn::Mul(Y.m[2], hn::Sub(hn::Mul(Y.m[3], Y.m[7]), hn::Mul(e, Y.m[6])));
    return hn::Add(hn::Sub(first, second), third);
}

// Computes Y = R - I of F = I + H by Newton-Schulz, X - X (X^T X - I) / 2; each lane stops when it has
// converged, independently of the others. Returns the lanes that converged.
HWY_INLINE M rotate(const Nine& H, Nine& Y) {
    Y = H;
    M done = hn::Lt(hn::Zero(d), hn::Zero(d)), lost = hn::Not(hn::Gt(determinant(H), hn::Zero(d)));
    const V half = hn::Set(d, 0.5F);
    for (int step = 0; step < tuning::links::max_rotation_steps; ++step) {
        const Nine E = error_of(Y);
        const V error = squared_norm(E);
        lost = hn::Or(lost, hn::And(hn::Not(done),
                                    hn::Not(hn::Lt(error, hn::Set(d, tuning::links::far_from_rotation)))));
        const M stop = hn::Or(done, lost);
        if (hn::AllTrue(d, stop)) break;
        const Nine YE = product<false>(Y, E);
        for (int k = 0; k < 9; ++k) {
            const V next = hn::Sub(Y.m[k], hn::Mul(half, hn::Add(E.m[k], YE.m[k])));
            Y.m[k] = hn::IfThenElse(stop, Y.m[k], next);
        }
        done = hn::Or(done, hn::And(hn::Not(stop), hn::Lt(error, hn::Set(d, tuning::links::near_rotation))));
    }
    return hn::And(done, hn::Not(lost));
}

HWY_INLINE Nine symmetric_at(const float* moment, std::size_t stride) {  // from its upper triangle
    const V xx = hn::LoadU(d, moment), xy = hn::LoadU(d, moment + stride),
            xz = hn::LoadU(d, moment + 2 * stride);
    const V yy = hn::LoadU(d, moment + 3 * stride), yz = hn::LoadU(d, moment + 4 * stride);
    const V zz = hn::LoadU(d, moment + 5 * stride);
    return {{xx, xy, xz, xy, yy, yz, xz, yz, zz}};
}

// 2 mu (F - R) + lambda tr(R^T F - I) R; F - R = H - Y has no cancellation.
HWY_INLINE Nine corotated_stress(const Nine& H, const Nine& Y, const Lame& lame, V& distortion) {
    Nine strain;
    for (int k = 0; k < 9; ++k) strain.m[k] = hn::Sub(H.m[k], Y.m[k]);
    distortion = squared_norm(strain);
    V trace = hn::Add(hn::Add(strain.m[0], strain.m[4]), strain.m[8]);
    for (int k = 0; k < 9; ++k) trace = add_product(trace, strain.m[k], Y.m[k]);
    const V pressure = hn::Mul(hn::Set(d, lame.lambda), trace);
    const V twice_mu = hn::Set(d, 2 * lame.mu);
    Nine stress;
    for (int k = 0; k < 9; ++k)
        stress.m[k] = hn::Add(hn::Mul(twice_mu, strain.m[k]), hn::Mul(pressure, Y.m[k]));
    for (const int k : {0, 4, 8}) stress.m[k] = hn::Add(stress.m[k], pressure);
    return stress;
}

struct Six {  // upper triangle of a symmetric matrix
    V xx, xy, xz, yy, yz, zz;
};

HWY_INLINE Six load6(const float* from, std::size_t stride) {
    return {hn::LoadU(d, from),
            hn::LoadU(d, from + stride),
            hn::LoadU(d, from + 2 * stride),
            hn::LoadU(d, from + 3 * stride),
            hn::LoadU(d, from + 4 * stride),
            hn::LoadU(d, from + 5 * stride)};
}

// One Jacobi rotation of a symmetric matrix, which annihilates pq, and of its axes: columns p and q of V.
HWY_INLINE void jacobi(V& pp, V& qq, V& pq, V& rp, V& rq, V (&axes)[9], int p, int q) {
    const V difference = hn::Sub(qq, pp), twice = hn::Add(pq, pq);
    const V root = hn::Sqrt(add_product(hn::Mul(difference, difference), twice, twice));
    const V divisor = hn::Add(hn::Abs(difference), root);
    const V zero = hn::Zero(d), one = hn::Set(d, 1.0F);
    const M turns = hn::Gt(divisor, zero);
    V t = hn::Div(twice, hn::IfThenElse(turns, divisor, one));
    t = hn::IfThenElse(hn::Lt(difference, zero), hn::Neg(t), t);
    const V c = hn::Div(one, hn::Sqrt(add_product(one, t, t))), s = hn::Mul(t, c);
    const V change = hn::Mul(t, pq);
    pp = hn::Sub(pp, change);
    qq = hn::Add(qq, change);
    pq = zero;
    const auto turn = [&](V& a, V& b) HWY_ATTR {
        const V old = a;
        a = hn::Sub(hn::Mul(c, old), hn::Mul(s, b));
        b = add_product(hn::Mul(c, b), s, old);
    };
    turn(rp, rq);
    for (int row = 0; row < 3; ++row) turn(axes[3 * row + p], axes[3 * row + q]);
}

// See twist_of in constitutive.cpp.
HWY_INLINE Six twist_of(const Nine& H, const Nine& Y, V stretch, const Lame& lame, V& exact, V& positive) {
    const V zero = hn::Zero(d), half = hn::Set(d, 0.5F), two = hn::Set(d, 2.0F);
    Nine strain;  // R^T (F - R)
    for (int k = 0; k < 9; ++k) strain.m[k] = hn::Sub(H.m[k], Y.m[k]);
    const Nine more = product<true>(Y, strain);
    for (int k = 0; k < 9; ++k) strain.m[k] = hn::Add(strain.m[k], more.m[k]);
    const auto mean = [&](int a, int b) HWY_ATTR { return hn::Mul(half, hn::Add(strain.m[a], strain.m[b])); };
    V xx = hn::Sub(strain.m[0], stretch), yy = hn::Sub(strain.m[4], stretch),
      zz = hn::Sub(strain.m[8], stretch);
    V xy = mean(1, 3), xz = mean(2, 6), yz = mean(5, 7);
    V axes[9] = {zero, zero, zero, zero, zero, zero, zero, zero, zero};
    for (const int k : {0, 4, 8}) axes[k] = hn::Set(d, 1.0F);
    for (int sweep = 0; sweep < tuning::links::jacobi_sweeps; ++sweep) {
        jacobi(xx, yy, xy, xz, yz, axes, 0, 1);
        jacobi(xx, zz, xz, xy, yz, axes, 0, 2);
        jacobi(yy, zz, yz, xy, xz, axes, 1, 2);
    }
    const V trace = hn::Add(hn::Add(xx, yy), zz), mu = hn::Set(d, lame.mu);
    const V pressure = hn::Mul(hn::Set(d, lame.lambda), trace);
    const V least = hn::Set(d, static_cast<float>(tuning::constitutive::min_stretch_sum));
    const V value[3] = {xx, yy, zz};
    V twist[3];
    exact = positive = zero;
    for (int k = 0; k < 3; ++k) {
        const V others = hn::Sub(trace, value[k]);
        const V sum = hn::Max(hn::Add(two, others), least);
        const V found = hn::Div(hn::Mul(two, add_product(pressure, mu, others)), sum);
        exact = hn::Add(exact, found);
        twist[k] = hn::Max(found, zero);
        positive = hn::Add(positive, twist[k]);
    }
    const auto entry = [&](int a, int b) HWY_ATTR {
        V out = zero;
        for (int k = 0; k < 3; ++k)
            out = add_product(out, hn::Mul(twist[k], axes[3 * a + k]), axes[3 * b + k]);
        return out;
    };
    return {entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)};
}

HWY_INLINE void store6(const Six& A, float* to, std::size_t stride) {
    hn::StoreU(A.xx, d, to);
    hn::StoreU(A.xy, d, to + stride);
    hn::StoreU(A.xz, d, to + 2 * stride);
    hn::StoreU(A.yy, d, to + 3 * stride);
    hn::StoreU(A.yz, d, to + 4 * stride);
    hn::StoreU(A.zz, d, to + 5 * stride);
}

void twist_slice(const LinkSlices& slices, std::size_t slice, const float* gradient, const float* turn,
                 const float* stretch, const SliceState& state, const Lame& lame) {
    constexpr std::size_t lanes = LinkSlices::lanes;
    const std::size_t n = slices.stride();
    for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
        const std::size_t row = slice * lanes + lane;
        V exact, positive;
        store6(twist_of(load9(gradient + lane, lanes), load9(turn + lane, lanes),
                        hn::LoadU(d, stretch + lane), lame, exact, positive),
               state.twist + row, n);
        hn::StoreU(exact, d, state.twist_sum + row);
        hn::StoreU(positive, d, state.twist_sum + n + row);
    }
}

// R (mu (S + S^T) + lambda tr(S) I + [T w]), S = R^T dH, w the axial vector of skew(S).
HWY_INLINE Nine corotated_change(const Nine& dH, const Nine& Y, const Six& T, const Lame& lame, V share) {
    Nine R = Y;
    const V one = hn::Set(d, 1.0F);
    for (const int k : {0, 4, 8}) R.m[k] = hn::Add(R.m[k], one);
    const Nine S = product<true>(R, dH);
    const V mu = hn::Set(d, lame.mu);
    const V pressure = hn::Mul(hn::Set(d, lame.lambda), hn::Add(hn::Add(S.m[0], S.m[4]), S.m[8]));
    const V half = hn::Mul(hn::Set(d, 0.5F), share);
    const V x = hn::Mul(half, hn::Sub(S.m[7], S.m[5])), y = hn::Mul(half, hn::Sub(S.m[2], S.m[6])),
            z = hn::Mul(half, hn::Sub(S.m[3], S.m[1]));
    const auto row = [&](V a, V b, V c)
                         HWY_ATTR { return add_product(add_product(hn::Mul(a, x), b, y), c, z); };
    const V turned[3] = {row(T.xx, T.xy, T.xz), row(T.xy, T.yy, T.yz), row(T.xz, T.yz, T.zz)};
    Nine inner;
    for (const int k : {0, 4, 8}) inner.m[k] = add_product(pressure, mu, hn::Add(S.m[k], S.m[k]));
    const auto off_diagonal = [&](int lower, int upper, V twist) HWY_ATTR {
        const V mean = hn::Mul(mu, hn::Add(S.m[lower], S.m[upper]));
        inner.m[lower] = hn::Add(mean, twist);
        inner.m[upper] = hn::Sub(mean, twist);
    };
    off_diagonal(7, 5, turned[0]);
    off_diagonal(2, 6, turned[1]);
    off_diagonal(3, 1, turned[2]);
    return product<false>(R, inner);
}

HWY_INLINE std::uint32_t bits_of(M mask) {
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return static_cast<std::uint32_t>(bytes[0]) | static_cast<std::uint32_t>(bytes[1]) << 8;
}

// V P - c H A
HWY_INLINE Nine tension_of(const LinkSlices& slices, std::size_t row, const Nine& stress, const Nine& H) {
    const V volume = hn::LoadU(d, slices.volume() + row);
    Nine T = product<false>(H, symmetric_at(slices.penalty_moment() + row, slices.stride()));  // c H A
    for (int k = 0; k < 9; ++k) T.m[k] = hn::Sub(hn::Mul(volume, stress.m[k]), T.m[k]);
    return T;
}

// Returns the lanes that are finite.
HWY_INLINE M store_tension(const LinkSlices& slices, std::size_t row, const Nine& stress, const Nine& H,
                           float* tension) {
    const Nine T = tension_of(slices, row, stress, H);
    V sum = hn::Zero(d);
    for (int k = 0; k < 9; ++k) sum = hn::Add(sum, hn::Abs(T.m[k]));
    store9(T, tension + row, slices.stride());
    return hn::Lt(sum, hn::Set(d, 1e37F));
}

void state_slices(const LinkSlices& slices, const SliceRange& range, const SliceState& state, bool corotated,
                  const Lame& lame) {
    const std::size_t n = slices.stride();
    for (std::size_t slice = range.begin; slice < range.end; ++slice) {
        std::uint32_t fallback = corotated ? slices.deficient()[slice] : 0xffffU;
        for (std::size_t lane = 0; lane < LinkSlices::lanes; lane += hn::Lanes(d)) {
            const std::size_t row = slice * LinkSlices::lanes + lane;
            const Gathered sum = gather_state(slices, slice, lane, state.high, state.low);
            store9(sum.gradient, state.gradient + row, n);
            store3(sum.penalty, state.penalty + row, n);
            if (!corotated) continue;
            Nine Y;
            const M rotated = rotate(sum.gradient, Y);
            V distortion;
            const Nine stress = corotated_stress(sum.gradient, Y, lame, distortion);
            const M finite = store_tension(slices, row, stress, sum.gradient, state.tension);
            store9(Y, state.turn + row, n);
            const M distorted =
                hn::Gt(distortion, hn::Set(d, static_cast<float>(tuning::constitutive::far_from_rest)));
            hn::StoreU(hn::IfThenElse(distorted, hn::Set(d, 1.0F), hn::Zero(d)), d, state.distortion + row);
            fallback |= bits_of(hn::Not(hn::And(rotated, finite))) << lane;
        }
        state.fallback[slice] = static_cast<std::uint16_t>(fallback);
    }
}

void direction_slices(const LinkSlices& slices, const SliceRange& range, const float* p,
                      const SliceState& state, bool corotated, const Lame& lame, float twist_share) {
    const std::size_t n = slices.stride();
    const V share = hn::Set(d, twist_share);
    for (std::size_t slice = range.begin; slice < range.end; ++slice)
        for (std::size_t lane = 0; lane < LinkSlices::lanes; lane += hn::Lanes(d)) {
            const std::size_t row = slice * LinkSlices::lanes + lane;
            const Gathered sum = gather_direction(slices, slice, lane, p);
            store3(sum.penalty, state.penalty + row, n);
            if (!corotated) {
                store9(sum.gradient, state.gradient + row, n);
                continue;
            }
            const Nine Y = load9(state.turn + row, n);
            const Six twist = load6(state.twist + row, n);
            const V majorizer = hn::LoadU(d, state.majorizer + row);
            store_tension(slices, row,
                          corotated_change(sum.gradient, Y, twist, lame, hn::Max(share, majorizer)),
                          sum.gradient, state.tension);
        }
}

HWY_INLINE Three edge_of(const LinkSlices& slices, std::size_t column, std::size_t lane) {  // x_ij
    const std::int32_t at = slices.edge_at()[column];
    if (at < 0) return load3(slices.edge() + ~at + lane, LinkSlices::lanes);
    const float* const edge = slices.edge() + at;
    return {hn::Set(d, edge[0]), hn::Set(d, edge[1]), hn::Set(d, edge[2])};
}

// H = (sum_j w_ij (p_j - p_i) x_ij^T) A_i^+, and the penalty sums.
HWY_INLINE Gathered gather_weighted(const LinkSlices& slices, std::size_t slice, std::size_t lane,
                                    const float* p) {
    const std::size_t n = slices.stride();
    const std::size_t row = slice * LinkSlices::lanes + lane;
    const Three u = load3(p + row, n);
    Gathered sum = zero_sums();
    for_columns(slices, slice, lane, [&](std::size_t column, const auto& read) HWY_ATTR {
        const float* const link = slices.forward_weight() + column * 2 * LinkSlices::lanes + lane;
        const V w = load_streamed(link), m = load_streamed(link + LinkSlices::lanes);
        const Three x = edge_of(slices, column, lane);
        const V difference[3] = {hn::Sub(read(p), u.x), hn::Sub(read(p + n), u.y),
                                 hn::Sub(read(p + 2 * n), u.z)};
        for (int k = 0; k < 3; ++k) add_products(sum.gradient.m + 3 * k, hn::Mul(w, difference[k]), x);
        sum.penalty = {add_product(sum.penalty.x, m, difference[0]),
                       add_product(sum.penalty.y, m, difference[1]),
                       add_product(sum.penalty.z, m, difference[2])};
    });
    sum.gradient = product<false>(sum.gradient, symmetric_at(slices.inverse_moment() + row, n));
    return sum;
}

void weighted_direction_slices(const LinkSlices& slices, const SliceRange& range, const float* p,
                               const SliceState& state, const Lame& lame, float twist_share) {
    const std::size_t n = slices.stride();
    const V share = hn::Set(d, twist_share);
    for (std::size_t slice = range.begin; slice < range.end; ++slice)
        for (std::size_t lane = 0; lane < LinkSlices::lanes; lane += hn::Lanes(d)) {
            const std::size_t row = slice * LinkSlices::lanes + lane;
            const Gathered sum = gather_weighted(slices, slice, lane, p);
            store3(sum.penalty, state.penalty + row, n);
            const Nine Y = load9(state.turn + row, n);
            const Six twist = load6(state.twist + row, n);
            const V majorizer = hn::LoadU(d, state.majorizer + row);
            Nine T = corotated_change(sum.gradient, Y, twist, lame, hn::Max(share, majorizer));
            const V volume = hn::LoadU(d, slices.volume() + row), held = hn::LoadU(d, slices.penalty() + row);
            for (V& entry : T.m) entry = hn::Mul(volume, entry);
            T = product<false>(T, symmetric_at(slices.inverse_moment() + row, n));
            // c H A A^+ is c H, as H = B A^+.
            for (int k = 0; k < 9; ++k) T.m[k] = hn::Sub(T.m[k], hn::Mul(held, sum.gradient.m[k]));
            store9(T, state.tension + row, n);
        }
}

// sum_j w_ji T_j x_ij, where T holds T A^+.
HWY_INLINE Three gather_weighted_tension(const LinkSlices& slices, std::size_t slice, std::size_t lane,
                                         const float* T) {
    const std::size_t n = slices.stride();
    V sum[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    for_columns(slices, slice, lane, [&](std::size_t column, const auto& read) HWY_ATTR {
        const V w = load_streamed(slices.backward_weight() + column * LinkSlices::lanes + lane);
        const Three x = edge_of(slices, column, lane);
        for (std::size_t k = 0; k < 3; ++k) {
            const V first = hn::Mul(read(T + 3 * k * n), x.x);
            const V second = add_product(first, read(T + (3 * k + 1) * n), x.y);
            sum[k] = add_product(sum[k], w, add_product(second, read(T + (3 * k + 2) * n), x.z));
        }
    });
    return {sum[0], sum[1], sum[2]};
}

// T_i G_i - sum_j T_j g_ji + penalty, computed from T A^+.
void weighted_force_slices(const LinkSlices& slices, const SliceRange& range, const SliceState& state,
                           float* force) {
    const std::size_t n = slices.stride();
    for (std::size_t slice = range.begin; slice < range.end; ++slice)
        for (std::size_t lane = 0; lane < LinkSlices::lanes; lane += hn::Lanes(d)) {
            const std::size_t row = slice * LinkSlices::lanes + lane;
            const Three sum = gather_weighted_tension(slices, slice, lane, state.tension);
            const Nine own = load9(state.tension + row, n);
            const Three E = load3(slices.edge_sum() + row, n), held = load3(state.penalty + row, n);
            const auto all = [&](int k, V others, V penalty) HWY_ATTR {
                const V first = add_product(hn::Mul(own.m[3 * k], E.x), own.m[3 * k + 1], E.y);
                return hn::Add(hn::Add(add_product(first, own.m[3 * k + 2], E.z), others), penalty);
            };
            store3({all(0, sum.x, held.x), all(1, sum.y, held.y), all(2, sum.z, held.z)}, force + row, n);
        }
}

// sum_j T_j g_ji
HWY_INLINE Three gather_tension(const LinkSlices& slices, std::size_t slice, std::size_t lane,
                                const float* T) {
    const std::size_t n = slices.stride();
    constexpr std::size_t lanes = LinkSlices::lanes;
    Three sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    for_columns(slices, slice, lane, [&](std::size_t column, const auto& read) HWY_ATTR {
        const Three g = load3_streamed(slices.backward() + column * 3 * lanes + lane);
        const auto part = [&](std::size_t k) HWY_ATTR {
            const V first = hn::Mul(read(T + 3 * k * n), g.x);
            const V second = add_product(first, read(T + (3 * k + 1) * n), g.y);
            return add_product(second, read(T + (3 * k + 2) * n), g.z);
        };
        sum = {hn::Add(sum.x, part(0)), hn::Add(sum.y, part(1)), hn::Add(sum.z, part(2))};
    });
    return sum;
}

void force_slices(const LinkSlices& slices, const SliceRange& range, const SliceState& state, float* force) {
    const std::size_t n = slices.stride();
    constexpr std::size_t lanes = LinkSlices::lanes;
    for (std::size_t slice = range.begin; slice < range.end; ++slice)
        for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
            const std::size_t row = slice * lanes + lane;
            const Three sum = gather_tension(slices, slice, lane, state.tension);
            const Nine own = load9(state.tension + row, n);
            const Three G = load3(slices.gradient_sum() + row, n);
            const Three penalty = load3(state.penalty + row, n);
            const auto own_part = [&](int k) HWY_ATTR {
                const V first = hn::Mul(own.m[3 * k], G.x);
                return add_product(add_product(first, own.m[3 * k + 1], G.y), own.m[3 * k + 2], G.z);
            };
            store3({hn::Add(hn::Sub(own_part(0), sum.x), penalty.x),
                    hn::Add(hn::Sub(own_part(1), sum.y), penalty.y),
                    hn::Add(hn::Sub(own_part(2), sum.z), penalty.z)},
                   force + row, n);
        }
}

void bare_gradient_slices(const LinkSlices& slices, const SliceRange& range, const float* p,
                          float* gradient) {
    const bool weights = slices.weights_pay();
    for (std::size_t slice = range.begin; slice < range.end; ++slice)
        for (std::size_t lane = 0; lane < LinkSlices::lanes; lane += hn::Lanes(d)) {
            const Gathered sum =
                weights ? gather_weighted(slices, slice, lane, p) : gather_direction(slices, slice, lane, p);
            store9(sum.gradient, gradient + slice * LinkSlices::lanes + lane, slices.stride());
        }
}

void bare_force_slices(const LinkSlices& slices, const SliceRange& range, const float* tension,
                       float* force) {
    const bool weights = slices.weights_pay();
    for (std::size_t slice = range.begin; slice < range.end; ++slice)
        for (std::size_t lane = 0; lane < LinkSlices::lanes; lane += hn::Lanes(d)) {
            const Three sum = weights ? gather_weighted_tension(slices, slice, lane, tension)
                                      : gather_tension(slices, slice, lane, tension);
            store3(sum, force + slice * LinkSlices::lanes + lane, slices.stride());
        }
}

const char* own_target() {
    return hwy::TargetName(HWY_TARGET);
}

// sum_j c_i w_ij |H_i x_ij - (u_j - u_i)|^2, by c_i w_ij |x_ij|^2 = (c_i A_i g_ij) . x_ij.
HWY_INLINE V penalties(const LinkSlices& slices, std::size_t slice, std::size_t lane, const SliceState& state,
                       const Nine& H) {
    const std::size_t n = slices.stride();
    const std::size_t row = slice * LinkSlices::lanes + lane;
    const float* const rest = slices.rest_position();
    const float *const high = state.high, *const low = state.low;
    const Three X = load3(rest + row, n), u = load3(high + row, n), v = load3(low + row, n);
    const Nine A = symmetric_at(slices.penalty_moment() + row, n);
    V sum = hn::Zero(d);
    for_columns(slices, slice, lane, [&](std::size_t column, const auto& read) HWY_ATTR {
        const Three g = load3_streamed(slices.forward() + column * 4 * LinkSlices::lanes + lane);
        const V x[3] = {hn::Sub(read(rest), X.x), hn::Sub(read(rest + n), X.y),
                        hn::Sub(read(rest + 2 * n), X.z)};
        const V difference[3] = {hn::Add(hn::Sub(read(high), u.x), hn::Sub(read(low), v.x)),
                                 hn::Add(hn::Sub(read(high + n), u.y), hn::Sub(read(low + n), v.y)),
                                 hn::Add(hn::Sub(read(high + 2 * n), u.z), hn::Sub(read(low + 2 * n), v.z))};
        V error = hn::Zero(d), weight = hn::Zero(d), length = hn::Set(d, 1e-30F);
        for (int k = 0; k < 3; ++k) {
            const V fitted = add_product(add_product(hn::Mul(H.m[3 * k], x[0]), H.m[3 * k + 1], x[1]),
                                         H.m[3 * k + 2], x[2]);
            const V off = hn::Sub(fitted, difference[k]);
            error = add_product(error, off, off);
            const V Ag =
                add_product(add_product(hn::Mul(A.m[3 * k], g.x), A.m[3 * k + 1], g.y), A.m[3 * k + 2], g.z);
            weight = add_product(weight, Ag, x[k]);
            length = add_product(length, x[k], x[k]);
        }
        sum = hn::Add(sum, hn::Div(hn::Mul(weight, error), length));
    });
    return sum;
}

double energy_slices(const LinkSlices& slices, const SliceRange& range, const SliceState& state,
                     const Lame& lame, float* rows) {
    const std::size_t n = slices.stride();
    const V half = hn::Set(d, 0.5F);
    double total = 0;
    for (std::size_t slice = range.begin; slice < range.end; ++slice) {
        float* const energy = rows + slice * LinkSlices::lanes;
        for (std::size_t lane = 0; lane < LinkSlices::lanes; lane += hn::Lanes(d)) {
            const std::size_t row = slice * LinkSlices::lanes + lane;
            const Nine H = load9(state.gradient + row, n), Y = load9(state.turn + row, n);
            V distortion = hn::Zero(d), trace = hn::Zero(d);
            for (int k = 0; k < 9; ++k) {
                const V strain = hn::Sub(H.m[k], Y.m[k]);
                distortion = add_product(distortion, strain, strain);
                trace = add_product(trace, strain, k % 4 == 0 ? hn::Add(Y.m[k], hn::Set(d, 1.0F)) : Y.m[k]);
            }
            const V density = add_product(hn::Mul(hn::Set(d, lame.mu), distortion),
                                          hn::Mul(half, hn::Set(d, lame.lambda)), hn::Mul(trace, trace));
            const V held = penalties(slices, slice, lane, state, H);
            hn::StoreU(add_product(hn::Mul(half, held), hn::LoadU(d, slices.volume() + row), density), d,
                       energy + lane);
        }
        for (std::size_t lane = 0; lane < LinkSlices::lanes; ++lane)
            if ((state.fallback[slice] >> lane & 1U) == 0) total += static_cast<double>(energy[lane]);
    }
    return total;
}

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::meshless
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::meshless {

HWY_EXPORT(state_slices);
HWY_EXPORT(twist_slice);
HWY_EXPORT(direction_slices);
HWY_EXPORT(force_slices);
HWY_EXPORT(weighted_direction_slices);
HWY_EXPORT(weighted_force_slices);
HWY_EXPORT(energy_slices);
HWY_EXPORT(bare_gradient_slices);
HWY_EXPORT(bare_force_slices);
HWY_EXPORT(own_target);

void state_pass(const LinkSlices& slices, const SliceRange& range, const SliceState& state, bool corotated,
                const Lame& lame) {
    const FlushTiny flush;
    HWY_DYNAMIC_DISPATCH(state_slices)(slices, range, state, corotated, lame);
}

void twist_pass(const LinkSlices& slices, std::size_t slice, const float* gradient, const float* turn,
                const float* stretch, const SliceState& state, const Lame& lame) {
    const FlushTiny flush;
    HWY_DYNAMIC_DISPATCH(twist_slice)(slices, slice, gradient, turn, stretch, state, lame);
}

void direction_pass(const LinkSlices& slices, const SliceRange& range, const float* p,
                    const SliceState& state, bool corotated, const Lame& lame, float twist_share) {
    const FlushTiny flush;
    HWY_DYNAMIC_DISPATCH(direction_slices)(slices, range, p, state, corotated, lame, twist_share);
}

void force_pass(const LinkSlices& slices, const SliceRange& range, const SliceState& state, float* force) {
    const FlushTiny flush;
    HWY_DYNAMIC_DISPATCH(force_slices)(slices, range, state, force);
}

void weighted_direction_pass(const LinkSlices& slices, const SliceRange& range, const float* p,
                             const SliceState& state, const Lame& lame, float twist_share) {
    const FlushTiny flush;
    HWY_DYNAMIC_DISPATCH(weighted_direction_slices)(slices, range, p, state, lame, twist_share);
}

void weighted_force_pass(const LinkSlices& slices, const SliceRange& range, const SliceState& state,
                         float* force) {
    const FlushTiny flush;
    HWY_DYNAMIC_DISPATCH(weighted_force_slices)(slices, range, state, force);
}

double energy_pass(const LinkSlices& slices, const SliceRange& range, const SliceState& state,
                   const Lame& lame, float* rows) {
    const FlushTiny flush;
    return HWY_DYNAMIC_DISPATCH(energy_slices)(slices, range, state, lame, rows);
}

void bare_gradients(const LinkSlices& slices, const SliceRange& range, const float* p, float* gradient) {
    HWY_DYNAMIC_DISPATCH(bare_gradient_slices)(slices, range, p, gradient);
}

void bare_forces(const LinkSlices& slices, const SliceRange& range, const float* tension, float* force) {
    HWY_DYNAMIC_DISPATCH(bare_force_slices)(slices, range, tension, force);
}

const char* instruction_set() {
    return HWY_DYNAMIC_DISPATCH(own_target)();
}

}  // namespace splitcubes::meshless
#endif
