// Compiled once per instruction set by Highway's foreach_target.h. Rounding differences between them lie
// within WindingLanes::error.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/geometry/winding_lanes.cpp"
#include <hwy/foreach_target.h>
// Must be included after foreach_target.h.
#include <hwy/highway.h>

#include <splitcubes/geometry/winding_lanes.h>

#include <cmath>
#include <numbers>

HWY_BEFORE_NAMESPACE();
namespace splitcubes::geometry {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<double, WindingLanes::width> d;
using V = hn::Vec<decltype(d)>;
using M = hn::Mask<decltype(d)>;

struct Point {
    V x, y, z;
};

HWY_INLINE V dot(const Point& a, const Point& b) {
    return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

HWY_INLINE V length(const Point& a) {
    return hn::Sqrt(dot(a, a));
}

HWY_INLINE Point corner(const WindingLanes& lanes, std::size_t k, std::size_t first, const Point& from) {
    return {hn::Sub(hn::LoadU(d, lanes.coordinate(k, 0) + first), from.x),
            hn::Sub(hn::LoadU(d, lanes.coordinate(k, 1) + first), from.y),
            hn::Sub(hn::LoadU(d, lanes.coordinate(k, 2) + first), from.z)};
}

// Product of complex numbers. Half the solid angle of a triangle is the argument of a complex number, and a
// sum of arguments that of the product modulo full turns, which are counted when the product crosses the
// negative axis.
struct Product {
    V re, im, turns;
};

HWY_INLINE void multiply(Product& p, V re, V im, M used) {
    const V zero = hn::Zero(d), one = hn::Set(d, 1);
    re = hn::IfThenElse(used, re, one);
    im = hn::IfThenElseZero(used, im);
    const V next_re = hn::NegMulAdd(p.im, im, hn::Mul(p.re, re));
    const V next_im = hn::MulAdd(p.re, im, hn::Mul(p.im, re));
    const M was_up = hn::Ge(p.im, zero), up = hn::Ge(im, zero), is_up = hn::Ge(next_im, zero);
    const M over = hn::AndNot(is_up, hn::And(was_up, up));
    const M under = hn::AndNot(hn::Or(was_up, up), is_up);
    p.turns = hn::Add(p.turns, hn::IfThenElseZero(over, one));
    p.turns = hn::Sub(p.turns, hn::IfThenElseZero(under, one));
    // Scaled to about one: a product of thousands would overflow.
    const V scale = hn::Div(one, hn::Add(hn::Abs(next_re), hn::Abs(next_im)));
    p.re = hn::Mul(next_re, scale);
    p.im = hn::Mul(next_im, scale);
}

// Adds one vector of triangles (van Oosterom and Strackee 1983, eq. 8); returns the lanes in which rounding
// decides.
HWY_INLINE M add_triangles(const WindingLanes& lanes, std::size_t first, M used, const Point& from,
                           Product& product) {
    const Point a = corner(lanes, 0, first, from), b = corner(lanes, 1, first, from);
    const Point c = corner(lanes, 2, first, from);
    const Point cross{hn::Sub(hn::Mul(b.y, c.z), hn::Mul(b.z, c.y)),
                      hn::Sub(hn::Mul(b.z, c.x), hn::Mul(b.x, c.z)),
                      hn::Sub(hn::Mul(b.x, c.y), hn::Mul(b.y, c.x))};
    const V volume = dot(a, cross), la = length(a), lb = length(b), lc = length(c);
    const V lengths = hn::Mul(hn::Mul(la, lb), lc);
    const V rest = hn::MulAdd(dot(a, b), lc, hn::MulAdd(dot(b, c), la, hn::MulAdd(dot(c, a), lb, lengths)));
    const V size = hn::Add(hn::Abs(volume), hn::Abs(rest));
    // The angle is undefined at the triangle's boundary and jumps inside the triangle.
    const M at_rim = hn::Le(size, hn::Mul(hn::Set(d, 1e-6), lengths));
    const M within =
        hn::And(hn::Lt(rest, hn::Zero(d)), hn::Le(hn::Abs(volume), hn::Mul(hn::Set(d, 1e-8), hn::Abs(rest))));
    const M doubtful = hn::And(used, hn::Or(at_rim, within));
    multiply(product, rest, volume, hn::AndNot(doubtful, used));
    return doubtful;
}

bool add_runs(const WindingLanes& lanes, const double* point, std::span<const WindingLanes::Run> runs,
              double* re, double* im, double* turns) {
    const Point from{hn::Set(d, point[0]), hn::Set(d, point[1]), hn::Set(d, point[2])};
    const std::size_t width = hn::Lanes(d);
    Product product{hn::Set(d, 1), hn::Zero(d), hn::Zero(d)};
    M doubtful = hn::FirstN(d, 0);
    for (const WindingLanes::Run& run : runs) {
        for (std::size_t t = run.first; t < run.last; t += width)
            doubtful = hn::Or(doubtful, add_triangles(lanes, t, hn::FirstN(d, run.last - t), from, product));
        if (!hn::AllFalse(d, doubtful)) return false;
    }
    hn::StoreU(product.re, d, re);
    hn::StoreU(product.im, d, im);
    hn::StoreU(product.turns, d, turns);
    for (std::size_t k = width; k < WindingLanes::width; ++k) re[k] = 1, im[k] = 0, turns[k] = 0;
    return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::geometry
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::geometry {

HWY_EXPORT(add_runs);

void WindingLanes::reserve(std::size_t triangles) {
    for (std::vector<double>& values : coordinates_) values.reserve(triangles + width);
}

void WindingLanes::add(const std::array<Vec3, 3>& corners) {
    for (std::size_t k = 0; k < 9; ++k)
        coordinates_[k].push_back(corners[k / 3][static_cast<Eigen::Index>(k % 3)]);
}

// Pads the arrays: the loops read whole vectors.
void WindingLanes::finish() {
    for (std::vector<double>& values : coordinates_) values.insert(values.end(), width, 0.0);
}

bool WindingLanes::solid_angle(const Vec3& point, std::span<const Run> runs, double& sum) const {
    double re[width], im[width], turns[width];
    if (!HWY_DYNAMIC_DISPATCH(add_runs)(*this, point.data(), runs, re, im, turns)) return false;
    sum = 0;
    for (std::size_t k = 0; k < width; ++k) {
        const bool idle = im[k] == 0 && re[k] > 0;
        sum += 2 * ((idle ? 0 : std::atan2(im[k], re[k])) + 2 * std::numbers::pi * turns[k]);
    }
    return true;
}

}  // namespace splitcubes::geometry
#endif
