// Compiled once per instruction set by Highway's foreach_target.h. Uses no fused multiply-add, so that the
// results are bit-identical.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splitcubes/fracture/stress_kernels.cpp"
#include <hwy/foreach_target.h>
// Must come after it.
#include <hwy/highway.h>

#include <splitcubes/fracture/stress_kernels.h>

#include <algorithm>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace splitcubes::body {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Phyxels per block, which is transposed into lists.
constexpr std::size_t block = 16;
constexpr hn::CappedTag<double, block> d;
using V = hn::Vec<decltype(d)>;

// 3 x 3 matrices, column-major like Mat3.
struct Matrix {
    V entry[9];

    HWY_INLINE const V& operator()(std::size_t row, std::size_t column) const {
        return entry[3 * column + row];
    }
};

HWY_INLINE Matrix load(const double (&lists)[9][block], std::size_t lane) {
    Matrix out;
    for (std::size_t k = 0; k < 9; ++k) out.entry[k] = hn::Load(d, lists[k] + lane);
    return out;
}

// Sums here and below are in the order of Eigen's two-lane code.
HWY_INLINE V sum_of(const V (&m)[9]) {
    const V even = hn::Add(hn::Add(m[0], m[2]), hn::Add(m[4], m[6]));
    const V odd = hn::Add(hn::Add(m[1], m[3]), hn::Add(m[5], m[7]));
    return hn::Add(hn::Add(even, odd), m[8]);
}

HWY_INLINE V minor_of(const Matrix& m, std::size_t a, std::size_t b, std::size_t c) {
    return hn::Mul(m(0, a), hn::Sub(hn::Mul(m(1, b), m(2, c)), hn::Mul(m(1, c), m(2, b))));
}

HWY_INLINE V determinant_of(const Matrix& m) {
    return hn::Add(hn::Sub(minor_of(m, 0, 1, 2), minor_of(m, 1, 0, 2)), minor_of(m, 2, 0, 1));
}

HWY_INLINE Matrix piola_of(const Matrix& F, const Matrix& R, const StressTask& task) {
    V product[9];
    for (std::size_t k = 0; k < 9; ++k) product[k] = hn::Mul(R.entry[k], F.entry[k]);
    const V stretch = hn::Sub(sum_of(product), hn::Set(d, 3));
    const V shear = hn::Set(d, 2 * task.lame_mu), swell = hn::Mul(hn::Set(d, task.lame_lambda), stretch);
    Matrix out;
    for (std::size_t k = 0; k < 9; ++k)
        out.entry[k] = hn::Add(hn::Mul(shear, hn::Sub(F.entry[k], R.entry[k])), hn::Mul(swell, R.entry[k]));
    return out;
}

HWY_INLINE Matrix cauchy_of(const Matrix& F, const Matrix& piola, V volume) {
    Matrix out;
    for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t column = 0; column < 3; ++column) {
            const auto term = [&](std::size_t k) HWY_ATTR { return hn::Mul(piola(row, k), F(column, k)); };
            const V sum = row < 2 ? hn::Add(hn::Add(term(0), term(1)), term(2))
                                  : hn::Add(term(0), hn::Add(term(1), term(2)));
            out.entry[3 * column + row] = hn::Div(sum, volume);
        }
    return out;
}

HWY_INLINE Matrix symmetric(const Matrix& m) {
    Matrix out;
    for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t column = 0; column < 3; ++column)
            out.entry[3 * column + row] = hn::Mul(hn::Set(d, 0.5), hn::Add(m(row, column), m(column, row)));
    return out;
}

// Same test as has_eigenvalues_below.
HWY_INLINE hn::Mask<decltype(d)> is_below(const Matrix& m, V limit) {
    const V zero = hn::Zero(d);
    const V first = hn::Sub(limit, m(0, 0));
    const V a = hn::Div(m(1, 0), first), b = hn::Div(m(2, 0), first);
    const V second = hn::Sub(hn::Sub(limit, m(1, 1)), hn::Mul(a, m(1, 0)));
    const V across = hn::Add(m(2, 1), hn::Mul(b, m(1, 0)));
    const V third = hn::Sub(hn::Sub(hn::Sub(limit, m(2, 2)), hn::Mul(b, m(2, 0))),
                            hn::Div(hn::Mul(across, across), second));
    return hn::And(hn::And(hn::Gt(first, zero), hn::Gt(second, zero)), hn::Gt(third, zero));
}

struct Lists {
    HWY_ALIGN double deformation[9][block];
    HWY_ALIGN double rotation[9][block];
    HWY_ALIGN double stress[9][block];
    HWY_ALIGN double size[block];
    HWY_ALIGN double is_above[block];  // 1 or 0
};

void find_lanes(const StressTask& task, Lists& lists, std::size_t lane) {
    const V zero = hn::Zero(d);
    const Matrix F = load(lists.deformation, lane), R = load(lists.rotation, lane);
    const V volume = determinant_of(F);
    const Matrix cauchy = cauchy_of(F, piola_of(F, R, task), volume), stress = symmetric(cauchy);
    const V input_size = hn::Load(d, lists.size + lane);
    auto is_included = hn::And(hn::Ge(input_size, zero), hn::Gt(volume, hn::Set(d, task.min_volume)));
    // Excludes infinity and NaN.
    const V infinity = hn::Set(d, std::numeric_limits<double>::infinity());
    for (const V& entry : cauchy.entry) is_included = hn::And(is_included, hn::Lt(hn::Abs(entry), infinity));
    V squares[9];
    for (std::size_t k = 0; k < 9; ++k) squares[k] = hn::Mul(stress.entry[k], stress.entry[k]);
    const V size = hn::Sqrt(sum_of(squares));
    const V limit = hn::Set(d, task.limit);
    const auto low =
        hn::Or(hn::Lt(size, limit), is_below(stress, hn::Sub(limit, hn::Mul(hn::Set(d, task.slack), size))));
    for (std::size_t k = 0; k < 9; ++k)
        hn::Store(hn::IfThenElse(is_included, stress.entry[k], zero), d, lists.stress[k] + lane);
    const V none = hn::IfThenElse(hn::Lt(input_size, zero), input_size, hn::Set(d, -1));
    hn::Store(hn::IfThenElse(is_included, size, none), d, lists.size + lane);
    hn::Store(hn::IfThenElse(hn::AndNot(low, is_included), hn::Set(d, 1), zero), d, lists.is_above + lane);
}

void find_stresses(const StressTask& task) {
    Lists lists;
    for (std::size_t first = task.begin; first < task.end; first += block) {
        const std::size_t count = std::min(block, task.end - first);
        // The last phyxel is repeated to fill the block.
        for (std::size_t lane = 0; lane < block; ++lane) {
            const std::size_t i = first + std::min(lane, count - 1);
            const double *F = task.deformation[i].data(), *R = task.rotation[i].data();
            for (std::size_t k = 0; k < 9; ++k) lists.deformation[k][lane] = F[k];
            for (std::size_t k = 0; k < 9; ++k) lists.rotation[k][lane] = R[k];
            lists.size[lane] = task.size[i];
        }
        for (std::size_t lane = 0; lane < count; lane += hn::Lanes(d)) find_lanes(task, lists, lane);
        for (std::size_t lane = 0; lane < count; ++lane) {
            double* stress = task.stress[first + lane].data();
            for (std::size_t k = 0; k < 9; ++k) stress[k] = lists.stress[k][lane];
            task.size[first + lane] = lists.size[lane];
            task.is_above[first + lane] = lists.is_above[lane] != 0;
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace splitcubes::body
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace splitcubes::body {

HWY_EXPORT(find_stresses);

void find_corotated_stresses(const StressTask& task) {
    HWY_DYNAMIC_DISPATCH(find_stresses)(task);
}

}  // namespace splitcubes::body
#endif
