// Vectorised weighted sums of affine motions.
#pragma once

#include <splitcubes/geometry/affine_displacement.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace splitcubes::geometry {

/// The terms of one sum, as a range of the lists shared by all sums.
struct AffineRow {
    std::uint32_t begin = 0, count = 0;
};

/// Computes out[r] = sum over the terms k of rows[r], in order, of weight[k] motions[index[k]]. The same
/// bits as successive AffineDisplacement::add, for every instruction set. `out` must hold rows.size()
/// entries.
void sum_affine(std::span<const AffineRow> rows, const std::uint32_t* index, const double* weight,
                const AffineDisplacement* motions, AffineDisplacement* out);

inline constexpr std::size_t transform_width = 8;

/// Rest points and normals to be transformed by motions, as one array per coordinate. The capacity of each
/// array, and of the motions, must be a multiple of `transform_width`.
struct TransformedPoints {
    std::array<const double*, 3> point;   // m, rest space
    std::array<const double*, 3> normal;  // rest space
    const double* factor;                 // scales the entries of the motion
};

/// Computes positions[k] = image of point k under motions[k] scaled by factor[k], and normals[k] = its normal
/// transformed by the cofactor matrix of that motion's Jacobian, normalised, or unchanged if it vanishes. The
/// same bits as AffineDisplacement and Eigen's products one by one, for every instruction set.
void transform_points(std::size_t count, const AffineDisplacement* motions, const TransformedPoints& points,
                      Vec3* positions, Vec3* normals);

}  // namespace splitcubes::geometry
