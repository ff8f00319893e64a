// Decompositions of 3x3 matrices: symmetric eigenvalues, rotation part.
#pragma once

#include <splitcubes/math/types.h>

namespace splitcubes {

/// Eigenvalues and eigenvectors of a symmetric matrix: vectors * values.asDiagonal() * vectors^T.
struct SymmetricEigen {
    Vec3 values;   // descending
    Mat3 vectors;  // columns, orthonormal, right-handed
};

/// Computes the decomposition to rounding by cyclic Jacobi rotations; the identity gives the identity
/// exactly. The strict upper triangle of the input is not read.
SymmetricEigen eigen_symmetric(const Mat3& matrix);

/// Returns whether limit * I - matrix is found positive definite: true only if the largest eigenvalue is
/// below the limit, or above it by no more than rounding (1e-14 of the matrix and the limit). Costs a tenth
/// of eigen_symmetric. The input must be symmetric; returns false if an entry is NaN.
bool has_eigenvalues_below(const Mat3& matrix, double limit);
/// Returns the symmetric matrix with its negative eigenvalues set to zero, to 1e-14 of its norm.
Mat3 positive_part(const Mat3& matrix);
/// Returns an upper bound of the largest eigenvalue of a symmetric matrix, above it by at most 2e-7 of the
/// norm: the root of the characteristic cubic by cosines (Smith 1961).
double largest_eigenvalue_bound(const Mat3& matrix);

/// Returns the rotation nearest to F (polar decomposition with det = +1; for an inverted F the smallest
/// singular value takes the sign). A rotation gives itself to rounding, the identity gives itself exactly. If
/// F leaves directions undetermined (rank 1 or 0), returns the candidate nearest to `last`.
Mat3 rotation_of(const Mat3& F, const Mat3& last = Mat3::Identity());

/// Returns the rotation by the smallest angle that takes the direction of `from` to that of `to`. For
/// opposite directions its axis is a fixed perpendicular one; it is the identity if either vector is zero.
Mat3 minimal_rotation(const Vec3& from, const Vec3& to);

}  // namespace splitcubes
