// Compiled once per instruction set by Highway's foreach_target.h. Rounding differences between them lie
// within WindingJet::error2.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/geometry/winding_jets.cpp"
#include <hwy/foreach_target.h>
// Must be included after foreach_target.h.
#include <hwy/highway.h>

#include <splitcubes/geometry/tuning.h>
#include <splitcubes/geometry/winding_jets.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#ifndef SPLITCUBES_GEOMETRY_WINDING_JETS_CPP
#define SPLITCUBES_GEOMETRY_WINDING_JETS_CPP
namespace splitcubes::geometry {

// Sums over a block of triangles, by lane.
struct JetLanes {
    static constexpr std::size_t width = WindingTriangles::width;
    float re[width], im[width], turns[width];
    float gradient[3][width], second[3][width];
    float error2[width];
    std::uint32_t doubtful[1024];  // triangles skipped because rounding decides their sign
    std::size_t doubtful_count;
};

}  // namespace splitcubes::geometry
#endif

HWY_BEFORE_NAMESPACE();
namespace splitcubes::geometry {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<float, WindingTriangles::width> d;
using V = hn::Vec<decltype(d)>;
using M = hn::Mask<decltype(d)>;

struct Point {
    V x[3];
};

HWY_INLINE V set(float value) {
    return hn::Set(d, value);
}

HWY_INLINE V dot(const Point& a, const Point& b) {
    return hn::MulAdd(a.x[0], b.x[0], hn::MulAdd(a.x[1], b.x[1], hn::Mul(a.x[2], b.x[2])));
}

// Returns 1 / sqrt, accurate to about one unit in the last place on any instruction set.
HWY_INLINE V inverse_root(V value) {
    value = hn::Max(value, set(1e-30f));
    V root = hn::ApproximateReciprocalSqrt(value);
    const V half = hn::Mul(value, set(0.5f));
    for (int k = 0; k < 2; ++k) root = hn::Mul(root, hn::NegMulAdd(hn::Mul(half, root), root, set(1.5f)));
    return root;
}

HWY_INLINE Point corner(const WindingTriangles& some, std::size_t k, std::size_t first, const Point& from) {
    Point out;
    for (std::size_t axis = 0; axis < 3; ++axis)
        out.x[axis] = hn::Sub(hn::LoadU(d, some.array(3 * k + axis) + first), from.x[axis]);
    return out;
}

// A triangle as seen from a point: half its solid angle is the argument of re + i im, which is normalised.
struct SeenTriangle {
    Point corner[3], area;
    V length[3], inverse[3], product[3];  // product: of the other two lengths and of the other two corners
    V re, im, scale, inverses;
    V error;  // of the argument, in units of rounding
};

HWY_INLINE SeenTriangle see(const WindingTriangles& some, std::size_t first, const Point& from, V reach) {
    SeenTriangle s;
    for (std::size_t k = 0; k < 3; ++k) {
        s.corner[k] = corner(some, k, first, from);
        const V square = dot(s.corner[k], s.corner[k]);
        s.inverse[k] = inverse_root(square);
        s.length[k] = hn::Mul(square, s.inverse[k]);
        s.area.x[k] = hn::LoadU(d, some.array(9 + k) + first);
    }
    V dots[3];
    for (std::size_t k = 0; k < 3; ++k) {
        dots[k] = dot(s.corner[(k + 1) % 3], s.corner[(k + 2) % 3]);
        s.product[k] = hn::MulAdd(s.length[(k + 1) % 3], s.length[(k + 2) % 3], dots[k]);
    }
    // Van Oosterom and Strackee 1983, eq. 8.
    const V volume = dot(s.corner[0], s.area);
    const V rest = hn::MulAdd(s.length[0], s.product[0],
                              hn::MulAdd(s.length[1], dots[1], hn::Mul(s.length[2], dots[2])));
    s.scale = inverse_root(hn::MulAdd(volume, volume, hn::Mul(rest, rest)));
    s.re = hn::Mul(rest, s.scale);
    s.im = hn::Mul(volume, s.scale);
    s.inverses = hn::Add(hn::Add(s.inverse[0], s.inverse[1]), s.inverse[2]);
    const V lengths = hn::Mul(hn::Mul(s.length[0], s.length[1]), s.length[2]);
    s.error = hn::Mul(hn::Mul(lengths, s.scale), hn::MulAdd(reach, hn::Mul(set(4), s.inverses), set(40)));
    return s;
}

// Product of complex numbers. Arguments add up under multiplication modulo full turns, which are counted when
// the product crosses the negative axis.
struct Product {
    V re, im, turns;
};

HWY_INLINE void multiply(Product& p, V re, V im, M used) {
    const V zero = hn::Zero(d), one = set(1);
    re = hn::IfThenElse(used, re, one);
    im = hn::IfThenElseZero(used, im);
    const V next_re = hn::NegMulAdd(p.im, im, hn::Mul(p.re, re));
    const V next_im = hn::MulAdd(p.re, im, hn::Mul(p.im, re));
    const M was_up = hn::Ge(p.im, zero), up = hn::Ge(im, zero), is_up = hn::Ge(next_im, zero);
    const M over = hn::AndNot(is_up, hn::And(was_up, up));
    const M under = hn::AndNot(hn::Or(was_up, up), is_up);
    p.turns = hn::Add(p.turns, hn::IfThenElseZero(over, one));
    p.turns = hn::Sub(p.turns, hn::IfThenElseZero(under, one));
    p.re = next_re;
    p.im = next_im;
}

// Adds the first and second derivative of the argument along an axis, as those of the imaginary part of log
// z. The point moves, so the corners relative to it move the other way.
HWY_INLINE void add_derivatives(const SeenTriangle& s, const V* slopes, std::size_t axis, M used, V& first,
                                V& second) {
    const V two = set(2);
    const V e[3] = {s.corner[0].x[axis], s.corner[1].x[axis], s.corner[2].x[axis]};
    V cosine[3];
    for (std::size_t k = 0; k < 3; ++k) cosine[k] = hn::Mul(e[k], s.inverse[k]);
    const V re1 = hn::Neg(hn::MulAdd(e[0], slopes[0], hn::MulAdd(e[1], slopes[1], hn::Mul(e[2], slopes[2]))));
    const V im1 = hn::Neg(s.area.x[axis]);
    V mixed = hn::Zero(d), bent = hn::Zero(d);
    for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
        mixed = hn::MulAdd(hn::Mul(cosine[i], cosine[j]), s.length[k], mixed);
        mixed = hn::MulAdd(cosine[k], hn::Add(e[i], e[j]), mixed);
        mixed = hn::Add(mixed, s.length[k]);
        bent = hn::MulAdd(hn::NegMulAdd(cosine[k], cosine[k], set(1)), hn::Mul(s.inverse[k], s.product[k]),
                          bent);
    }
    const V re2 = hn::MulAdd(two, mixed, bent);
    const V turn = hn::Mul(s.scale, hn::NegMulAdd(re1, s.im, hn::Mul(im1, s.re)));
    const V growth = hn::Mul(s.scale, hn::MulAdd(re1, s.re, hn::Mul(im1, s.im)));
    const V bend = hn::Neg(hn::MulAdd(hn::Mul(re2, s.scale), s.im, hn::Mul(hn::Mul(two, growth), turn)));
    first = hn::Add(first, hn::IfThenElseZero(used, turn));
    second = hn::Add(second, hn::IfThenElseZero(used, bend));
}

template <bool with_derivatives>
HWY_INLINE void add_block(const WindingTriangles& some, std::size_t begin, std::size_t end,
                          const float* point, float reach, JetLanes& out) {
    const Point from{{set(point[0]), set(point[1]), set(point[2])}};
    const std::size_t width = hn::Lanes(d);
    const V far = set(reach), unit = set(0x1p-24f);
    Product product{set(1), hn::Zero(d), hn::Zero(d)};
    V first[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)}, second[3] = {first[0], first[0], first[0]};
    V error2 = hn::Zero(d);
    out.doubtful_count = 0;
    for (std::size_t t = begin; t < end; t += width) {
        const SeenTriangle s = see(some, t, from, far);
        const M in = hn::FirstN(d, end - t);
        const V error = hn::Mul(s.error, unit);
        // The angle is undefined at the triangle's boundary and jumps inside the triangle.
        const M within = hn::And(hn::Lt(s.re, hn::Zero(d)), hn::Le(hn::Abs(s.im), hn::Mul(set(4), error)));
        const M at_rim = hn::Or(hn::Gt(error, set(5e-3f)), hn::Gt(s.inverses, set(1e5f)));
        const M doubtful = hn::And(in, hn::Or(within, at_rim));
        const M used = hn::AndNot(doubtful, in);
        if (HWY_UNLIKELY(!hn::AllFalse(d, doubtful))) {
            std::uint8_t bits[8] = {};
            hn::StoreMaskBits(d, doubtful, bits);
            for (std::size_t k = 0; k < width; ++k)
                if (bits[k / 8] >> (k % 8) & 1)
                    out.doubtful[out.doubtful_count++] = static_cast<std::uint32_t>(t + k);
        }
        multiply(product, s.re, s.im, used);
        error2 = hn::MulAdd(error, hn::IfThenElseZero(used, error), error2);
        if constexpr (with_derivatives) {
            V slopes[3];
            for (std::size_t k = 0; k < 3; ++k)
                slopes[k] = hn::MulAdd(s.product[k], s.inverse[k],
                                       hn::Add(s.length[(k + 1) % 3], s.length[(k + 2) % 3]));
            for (std::size_t axis = 0; axis < 3; ++axis)
                add_derivatives(s, slopes, axis, used, first[axis], second[axis]);
        }
    }
    const auto store = [&](V value, float idle, float* lanes) {
        hn::StoreU(value, d, lanes);
        std::fill(lanes + width, lanes + JetLanes::width, idle);
    };
    store(product.re, 1, out.re);
    store(product.im, 0, out.im);
    store(product.turns, 0, out.turns);
    store(error2, 0, out.error2);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        store(first[axis], 0, out.gradient[axis]);
        store(second[axis], 0, out.second[axis]);
    }
}

void add_jets(const WindingTriangles& some, std::size_t begin, std::size_t end, const float* point,
              float reach, JetLanes& out) {
    add_block<true>(some, begin, end, point, reach, out);
}

void add_values(const WindingTriangles& some, std::size_t begin, std::size_t end, const float* point,
                float reach, JetLanes& out) {
    add_block<false>(some, begin, end, point, reach, out);
}

// Computes per triangle the distance of its boundary from a point, and a bound on the integral of r^-7 along
// its boundary, r being the distance to any point of the ball of that radius around the point.
void rim_distances(const WindingTriangles& some, const float* point, float radius, float* distances,
                   float* bounds) {
    const Point from{{set(point[0]), set(point[1]), set(point[2])}};
    const std::size_t width = hn::Lanes(d);
    const V tiny = set(1e-30f);
    for (std::size_t t = 0; t < some.size(); t += width) {
        const Point c[3] = {corner(some, 0, t, from), corner(some, 1, t, from), corner(some, 2, t, from)};
        V least2 = set(1e30f), bound = hn::Zero(d);
        for (std::size_t k = 0; k < 3; ++k) {
            const Point& a = c[k];
            Point side;
            for (std::size_t axis = 0; axis < 3; ++axis)
                side.x[axis] = hn::Sub(c[(k + 1) % 3].x[axis], a.x[axis]);
            const V length2 = hn::Max(dot(side, side), tiny), inverse = inverse_root(length2);
            const V along = hn::Neg(hn::Mul(dot(a, side), hn::Mul(inverse, inverse)));
            const V at = hn::Min(hn::Max(along, hn::Zero(d)), set(1));
            Point r;
            for (std::size_t axis = 0; axis < 3; ++axis) r.x[axis] = hn::MulAdd(at, side.x[axis], a.x[axis]);
            const V square = dot(r, r), distance = hn::Mul(square, inverse_root(square));
            least2 = hn::Min(least2, square);
            const V gap = hn::Max(hn::Sub(distance, set(radius)), set(1e-3f));
            const V i = hn::Div(set(1), gap), i2 = hn::Mul(i, i), i6 = hn::Mul(i2, hn::Mul(i2, i2));
            const V length = hn::Mul(length2, inverse);
            // An infinite straight line has the integral 16/15 r^-6.
            bound = hn::MulAdd(i6, hn::Min(hn::Mul(length, i), set(16.0f / 15)), bound);
        }
        hn::StoreU(hn::Mul(least2, inverse_root(least2)), d, distances + t);
        hn::StoreU(bound, d, bounds + t);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::geometry
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::geometry {

HWY_EXPORT(add_jets);
HWY_EXPORT(add_values);
HWY_EXPORT(rim_distances);

namespace {

// Product of one number at a time.
struct ScalarProduct {
    double re = 1, im = 0, turns = 0;

    void multiply(double other_re, double other_im) {
        const bool was_up = im >= 0, up = other_im >= 0;
        const double next = re * other_im + im * other_re;
        re = re * other_re - im * other_im;
        im = next;
        const bool is_up = im >= 0;
        if (was_up && up && !is_up) ++turns;
        if (!was_up && !up && is_up) --turns;
    }
};

// Adds a triangle to the jet in double precision, with the same formulas.
void add_triangle(const WindingTriangles::Corners& corners, const Vec3& point, WindingJet& jet) {
    const Vec3 c[3] = {corners[0] - point, corners[1] - point, corners[2] - point};
    const Vec3 area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    const double l[3] = {c[0].norm(), c[1].norm(), c[2].norm()};
    double dots[3], products[3];
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        dots[k] = c[i].dot(c[j]);
        products[k] = l[i] * l[j] + dots[k];
    }
    const double volume = c[0].dot(area);
    const double rest = l[0] * products[0] + l[1] * dots[1] + l[2] * dots[2];
    const double square = volume * volume + rest * rest, lengths = l[0] * l[1] * l[2];
    const double shortest = std::min({l[0], l[1], l[2]});
    if (!(square > 0) ||
        std::sqrt(square) * shortest < 30 * tuning::winding_number::side_resolution * lengths ||
        (rest < 0 && std::abs(volume) < tuning::winding_number::side_resolution * area.norm())) {
        jet.sound = false;
        return;
    }
    jet.value += std::atan2(volume, rest) / (2 * std::numbers::pi);
    for (int axis = 0; axis < 3; ++axis) {
        double first = 0, second = 0;
        for (int k = 0; k < 3; ++k) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            const double e = c[k][axis], cosine = e / l[k];
            first -= e * (products[k] / l[k] + l[i] + l[j]);
            second += (1 - cosine * cosine) / l[k] * products[k] + 2 * l[k] +
                      2 * cosine * (c[i][axis] + c[j][axis]) +
                      2 * c[i][axis] / l[i] * c[j][axis] / l[j] * l[k];
        }
        const double turn = (-area[axis] * rest - first * volume) / square;
        const double growth = (first * rest - area[axis] * volume) / square;
        jet.gradient[axis] += turn / (2 * std::numbers::pi);
        jet.second[axis] -= (second * volume / square + 2 * growth * turn) / (2 * std::numbers::pi);
    }
}

}  // namespace

void WindingTriangles::clear() {
    for (std::vector<float>& values : arrays_) values.clear();
    ids_.clear();
}

void WindingTriangles::add(const Corners& corners, std::uint32_t id) {
    const Vec3 area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    for (std::size_t k = 0; k < 9; ++k)
        arrays_[k].push_back(static_cast<float>(corners[k / 3][static_cast<Eigen::Index>(k % 3)]));
    for (std::size_t k = 0; k < 3; ++k)
        arrays_[9 + k].push_back(static_cast<float>(area[static_cast<Eigen::Index>(k)]));
    ids_.push_back(id);
}

// Pads the arrays: the loops read whole vectors.
void WindingTriangles::finish() {
    for (std::vector<float>& values : arrays_) values.resize(ids_.size() + width, 0.0f);
}

double WindingTriangles::near(const Vec3& center, double radius, double gap, WindingTriangles& kept) const {
    thread_local std::vector<float> distances, bounds;
    distances.resize(size() + width);
    bounds.resize(size() + width);
    const float at[3] = {static_cast<float>(center[0]), static_cast<float>(center[1]),
                         static_cast<float>(center[2])};
    HWY_DYNAMIC_DISPATCH(rim_distances)
    (*this, at, static_cast<float>(radius), distances.data(), bounds.data());
    const auto limit = static_cast<float>(radius + gap);
    kept.ids_.clear();
    double sum = 0;
    thread_local std::vector<std::uint32_t> indices;
    indices.clear();
    for (std::size_t t = 0; t < size(); ++t) {
        if (distances[t] < limit)
            indices.push_back(static_cast<std::uint32_t>(t));
        else
            sum += static_cast<double>(bounds[t]);
    }
    for (const std::uint32_t t : indices) kept.ids_.push_back(ids_[t]);
    for (std::size_t k = 0; k < arrays_.size(); ++k) {
        kept.arrays_[k].resize(indices.size() + width);
        for (std::size_t t = 0; t < indices.size(); ++t) kept.arrays_[k][t] = arrays_[k][indices[t]];
        std::fill(kept.arrays_[k].end() - width, kept.arrays_[k].end(), 0.0f);
    }
    return 1.01 * sum;
}

WindingJets::WindingJets(std::vector<WindingTriangles::Corners> all) : all_(std::move(all)) {
    for (std::uint32_t t = 0; t < all_.size(); ++t) {
        triangles_.add(all_[t], t);
        for (const Vec3& corner : all_[t])
            reach_ = std::max(reach_, static_cast<float>(corner.cwiseAbs().maxCoeff()));
    }
    triangles_.finish();
}

template <bool with_derivatives>
WindingJet WindingJets::sum(const WindingTriangles& some, const Vec3& point) const {
    const float at[3] = {static_cast<float>(point[0]), static_cast<float>(point[1]),
                         static_cast<float>(point[2])};
    WindingJet out;
    JetLanes lanes;
    ScalarProduct product;
    for (std::size_t begin = 0; begin < some.size(); begin += tuning::winding_number::sum_block) {
        const std::size_t end = std::min(begin + tuning::winding_number::sum_block, some.size());
        if constexpr (with_derivatives)
            HWY_DYNAMIC_DISPATCH(add_jets)(some, begin, end, at, reach_, lanes);
        else
            HWY_DYNAMIC_DISPATCH(add_values)(some, begin, end, at, reach_, lanes);
        for (std::size_t k = 0; k < JetLanes::width; ++k) {
            product.multiply(static_cast<double>(lanes.re[k]), static_cast<double>(lanes.im[k]));
            product.turns += static_cast<double>(lanes.turns[k]);
            out.error2 += static_cast<double>(lanes.error2[k]);
            for (std::size_t axis = 0; with_derivatives && axis < 3; ++axis) {
                const auto i = static_cast<Eigen::Index>(axis);
                out.gradient[i] += static_cast<double>(lanes.gradient[axis][k]) / (2 * std::numbers::pi);
                out.second[i] += static_cast<double>(lanes.second[axis][k]) / (2 * std::numbers::pi);
            }
        }
        for (std::size_t k = 0; k < lanes.doubtful_count; ++k)
            add_triangle(all_[some.id(lanes.doubtful[k])], point, out);
    }
    out.value += product.turns + std::atan2(product.im, product.re) / (2 * std::numbers::pi);
    out.error2 /= 4 * std::numbers::pi * std::numbers::pi;
    return out;
}

WindingJet WindingJets::jet(const WindingTriangles& some, const Vec3& point) const {
    return sum<true>(some, point);
}

WindingJet WindingJets::value(const WindingTriangles& some, const Vec3& point) const {
    return sum<false>(some, point);
}

}  // namespace splitcubes::geometry
#endif
