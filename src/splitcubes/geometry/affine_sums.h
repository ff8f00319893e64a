// Many weighted sums of affine motions at once.
#pragma once

#include <splitcubes/geometry/affine_displacement.h>

#include <cstdint>
#include <span>

namespace splitcubes::geometry {

/// The terms of one sum, in the lists that all sums share.
struct AffineRow {
    std::uint32_t begin = 0, count = 0;
};

/// out[r] = sum over the terms k of rows[r], in their order, of weight[k] motions[index[k]]: what
/// AffineDisplacement::add gives one after the other, to the last bit, for every instruction set.
/// `out` has room for as many as there are rows.
void sum_affine(std::span<const AffineRow> rows, const std::uint32_t* index, const double* weight,
                const AffineDisplacement* motions, AffineDisplacement* out);

}  // namespace splitcubes::geometry
