// Decompositions of 3x3 matrices: symmetric eigenvalues, rotation part.
#pragma once

#include <splitcubes/math/types.h>

namespace splitcubes {

/// A symmetric matrix as vectors * values.asDiagonal() * vectors^T.
struct SymmetricEigen {
    Vec3 values;   // descending
    Mat3 vectors;  // columns, orthonormal, right-handed
};

/// Cyclic Jacobi rotations, to rounding; the identity gives the identity exactly.
/// The input's upper triangle is not read.
SymmetricEigen eigen_symmetric(const Mat3& matrix);

/// Whether limit * I - matrix is found positive definite: true only where the largest eigenvalue is below
/// the limit, or above it by no more than rounding (1e-14 of the matrix and the limit). At a tenth of the
/// cost of eigen_symmetric. The input must be symmetric; false where an entry is NaN.
bool has_values_below(const Mat3& matrix, double limit);
/// An upper bound of the largest eigenvalue of a symmetric matrix, above it by no more than 2e-7 of
/// the norm: the cubic's root by cosines (Smith 1961).
double greatest_value_bound(const Mat3& matrix);

/// The rotation that is nearest to F (polar decomposition with det = +1: of an
/// inverted F the smallest singular value takes the sign). A rotation gives
/// itself to rounding, the identity itself exactly. Where F leaves directions
/// undetermined (rank 1 or 0) the rotation is the one nearest to `last`.
Mat3 rotation_of(const Mat3& F, const Mat3& last = Mat3::Identity());

/// The rotation by the smallest angle that takes the direction of `from` to that
/// of `to`; for opposite directions about a fixed perpendicular axis; the
/// identity where one of them is zero.
Mat3 minimal_rotation(const Vec3& from, const Vec3& to);

}  // namespace splitcubes
