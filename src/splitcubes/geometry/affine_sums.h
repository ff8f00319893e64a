// Many weighted sums of affine motions at once.
#pragma once

#include <splitcubes/geometry/affine_displacement.h>

#include <array>
#include <cstddef>
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

inline constexpr std::size_t carried_width = 8;

/// Points of rest space with normals that go along with motions, coordinate by coordinate; each list has room
/// for a whole number of `carried_width` of them, and so have the motions.
struct CarriedPoints {
    std::array<const double*, 3> point;   // m, rest space
    std::array<const double*, 3> normal;  // rest space
    const double* factor;                 // of the motion's numbers
};

/// positions[k] = image of point k by motions[k] times factor[k]; normals[k] = its normal by the cofactor
/// matrix of that motion's Jacobian, unit, or as it was where nothing is left of it. To the last bit what
/// AffineDisplacement and Eigen's products give one by one, for every instruction set.
void carry_points(std::size_t count, const AffineDisplacement* motions, const CarriedPoints& points,
                  Vec3* positions, Vec3* normals);

}  // namespace splitcubes::geometry
