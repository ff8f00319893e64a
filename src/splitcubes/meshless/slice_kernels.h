// Loops over slices of links, in single precision, compiled for several instruction
// sets and chosen when the program runs. All give the same bits: one lane a row, the
// same operations in the same order, no fused ones.
#pragma once

#include <splitcubes/meshless/link_slices.h>

#include <cstddef>
#include <cstdint>

namespace splitcubes::meshless {

/// Arrays over rows; component k of row i is at k * stride + i. Those of nine hold
/// matrices, row by row.
struct SliceState {
    // Where the body is: displacement u, as the sum of two numbers, m.
    const float* high = nullptr;  // 3
    const float* low = nullptr;   // 3
    // What the state pass finds.
    float* gradient = nullptr;     // 9, H = sum_j (u_j - u_i) g_ij^T
    float* turn = nullptr;         // 9, R - I, of corotated material
    float* majorizer = nullptr;    // 1, Tangent::turning
    float* tension = nullptr;      // 9, N m
    float* penalty = nullptr;      // 3, sum_j m_ij (u_j - u_i), N
    std::uint16_t* odd = nullptr;  // per slice, a bit a row: not done, rank or rotation
};

/// Lame's constants, Pa.
struct Lame {
    float mu = 0, lambda = 0;
};

/// Chunk of slices [begin, end).
struct SliceRange {
    std::size_t begin = 0, end = 0;
};

/// H and the penalties' sums; with `corotated` rotations and tensions too, but those of `odd` rows.
void state_pass(const LinkSlices& slices, const SliceRange& range, const SliceState& state, bool corotated,
                const Lame& lame);

/// The same of a direction p (3 per row, m): gradients, and with `corotated` tensions by the
/// tangents that `turn` and `turning` stand for.
void direction_pass(const LinkSlices& slices, const SliceRange& range, const float* p,
                    const SliceState& state, bool corotated, const Lame& lame);

/// force = T_i G_i - sum_j T_j g_ji + penalty, 3 per row, N.
void force_pass(const LinkSlices& slices, const SliceRange& range, const SliceState& state, float* force);

/// The same two from weights instead of gradients, of corotated material: a third of what is read of links
/// where LinkSlices::weights_pay. The first leaves T A^+ in `tension`. Where a neighbourhood is nearly flat
/// single precision loses digits as (largest over least eigenvalue)^(1/2) of A: for solving, not for the
/// state.
void weighted_direction_pass(const LinkSlices& slices, const SliceRange& range, const float* p,
                             const SliceState& state, const Lame& lame);
void weighted_force_pass(const LinkSlices& slices, const SliceRange& range, const SliceState& state,
                         float* force);

/// Energy of the rows that are not `odd` after a state pass with `corotated`, J. Each row's own
/// goes to `rows`, a row array; of `odd` ones it means nothing.
double energy_pass(const LinkSlices& slices, const SliceRange& range, const SliceState& state,
                   const Lame& lame, float* rows);

/// q = diagonal p - factor force, in place of `force`; returns p . q.
double finish_product(std::size_t stride, const SliceRange& range, const float* diagonal, float factor,
                      const float* p, float* force);

/// to += alpha p, r -= alpha q; returns r . inverse r.
double advance(std::size_t stride, const SliceRange& range, float alpha, const float* inverse, const float* p,
               const float* q, float* to, float* r);

/// What a preconditioner adds that is the same for all rows of an aggregate.
struct CoarsePart {
    const std::int32_t* index = nullptr;  // per row
    const float* value = nullptr;         // component k of aggregate c at k * stride + c
    std::size_t stride = 0;
};

/// p = inverse r + coarse + beta p.
void turn_direction(std::size_t stride, const SliceRange& range, float beta, const float* inverse,
                    const float* r, const CoarsePart& coarse, float* p);

/// Sum of r . inverse r; p is set to inverse r.
double begin_direction(std::size_t stride, const SliceRange& range, const float* inverse, const float* r,
                       float* p);

/// The two gathers of a product and nothing else, from weights where they pay, to measure what the
/// machine allows: sums over neighbours of p (9 per row), then of tensions (3 per row).
void bare_gradients(const LinkSlices& slices, const SliceRange& range, const float* p, float* gradient);
void bare_forces(const LinkSlices& slices, const SliceRange& range, const float* tension, float* force);

/// What was chosen, AVX3 or AVX2, say.
const char* instruction_set();

}  // namespace splitcubes::meshless
