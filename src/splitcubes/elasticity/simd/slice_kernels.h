// Single-precision loops over slices of links, compiled for several instruction sets and dispatched at
// run time. All give the same bits: one row per lane, the same operations in the same order, none fused.
#pragma once

#include <splitcubes/samples/link_slices.h>

#include <cstddef>
#include <cstdint>

namespace splitcubes::meshless {

/// Arrays over rows; component k of row i is at k * stride + i. Arrays of nine components hold 3x3
/// matrices, row-major.
struct SliceState {
    // Displacement u = high + low, m.
    const float* high = nullptr;  // 3
    const float* low = nullptr;   // 3
    // Results of state_pass.
    float* gradient = nullptr;    // 9, H = sum_j (u_j - u_i) g_ij^T
    float* turn = nullptr;        // 9, R - I, of corotated material
    float* twist = nullptr;       // 6, upper triangle of Tangent::twist, Pa
    float* twist_sum = nullptr;   // 2, Twist::exact and positive, Pa
    float* distortion = nullptr;  // 1, whether is_distorted
    float* majorizer = nullptr;   // 1, whether the twist is the majorizer's
    float* tension = nullptr;     // 9, N m
    float* penalty = nullptr;     // 3, sum_j m_ij (u_j - u_i), N
    std::uint16_t* fallback =
        nullptr;  // per slice, a bit per row: left to double precision (rank or rotation)
};

/// Lame's constants, Pa.
struct Lame {
    float mu = 0, lambda = 0;
};

/// Range of slices [begin, end).
struct SliceRange {
    std::size_t begin = 0, end = 0;
};

/// Computes H and the penalty sums; with `corotated` also the rotations and tensions of all rows that are
/// not `fallback`.
void state_pass(const LinkSlices& slices, const SliceRange& range, const SliceState& state, bool corotated,
                const Lame& lame);

/// Computes the twists of one slice, twist_of of F = I + H with rotation R = I + Y. gradient, turn: H and Y
/// of the slice's rows, component k of row i at k * LinkSlices::lanes + i. stretch: subtracted from the
/// principal strains of each row.
void twist_pass(const LinkSlices& slices, std::size_t slice, const float* gradient, const float* turn,
                const float* stretch, const SliceState& state, const Lame& lame);

/// Computes the gradients and penalty sums of a direction p (3 per row, m); with `corotated` also the
/// tensions by the tangents that `turn` and `twist` define. twist_share: factor on the twists, up to 1,
/// except on the majorizer's.
void direction_pass(const LinkSlices& slices, const SliceRange& range, const float* p,
                    const SliceState& state, bool corotated, const Lame& lame, float twist_share);

/// Computes force = T_i G_i - sum_j T_j g_ji + penalty, 3 per row, N.
void force_pass(const LinkSlices& slices, const SliceRange& range, const SliceState& state, float* force);

/// The same two passes from weights instead of gradients, for corotated material: with
/// LinkSlices::weights_pay they read a third of the link data. The first leaves T A^+ in `tension`. In nearly
/// flat neighbourhoods the relative error grows with the square root of the condition number of A, so they
/// serve the linear solve, not the state.
void weighted_direction_pass(const LinkSlices& slices, const SliceRange& range, const float* p,
                             const SliceState& state, const Lame& lame, float twist_share);
void weighted_force_pass(const LinkSlices& slices, const SliceRange& range, const SliceState& state,
                         float* force);

/// Returns the energy of the rows that are not `fallback`, J, after state_pass with `corotated`. Writes each
/// row's energy to the row array `rows`; entries of `fallback` rows are undefined.
double energy_pass(const LinkSlices& slices, const SliceRange& range, const SliceState& state,
                   const Lame& lame, float* rows);

/// Computes q = diagonal p - factor force, in place of `force`; returns p . q.
double finish_product(std::size_t stride, const SliceRange& range, const float* diagonal, float factor,
                      const float* p, float* force);

/// Computes to += alpha p, r -= alpha q; returns r . inverse r.
double advance(std::size_t stride, const SliceRange& range, float alpha, const float* inverse, const float* p,
               const float* q, float* to, float* r);

/// Coarse-level correction of a preconditioner, the same for all rows of an aggregate.
struct CoarsePart {
    const std::int32_t* index = nullptr;  // per row
    const float* value = nullptr;         // component k of aggregate c at k * stride + c
    std::size_t stride = 0;
};

/// Computes p = inverse r + coarse + beta p.
void update_direction(std::size_t stride, const SliceRange& range, float beta, const float* inverse,
                      const float* r, const CoarsePart& coarse, float* p);

/// Sets p to inverse r; returns r . inverse r.
double begin_direction(std::size_t stride, const SliceRange& range, const float* inverse, const float* r,
                       float* p);

/// The two gathers of a stiffness product alone, by weights if weights_pay, as a baseline for benchmarks:
/// sums over neighbours of p (9 per row), then of tensions (3 per row).
void bare_gradients(const LinkSlices& slices, const SliceRange& range, const float* p, float* gradient);
void bare_forces(const LinkSlices& slices, const SliceRange& range, const float* tension, float* force);

/// Returns the name of the instruction set in use, for example "AVX2".
const char* instruction_set();

}  // namespace splitcubes::meshless
