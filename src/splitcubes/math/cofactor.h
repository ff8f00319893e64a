// Cofactor matrix of a 3x3 matrix.
#pragma once

#include <splitcubes/math/types.h>

namespace splitcubes {

/// Returns det F F^-T, also for singular F: it maps area vectors (Nanson's formula) and is the derivative of
/// det F by F. Each column is the cross product of the other two.
inline Mat3 cofactor_of(const Mat3& F) {
    Mat3 out;
    out.col(0) = F.col(1).cross(F.col(2));
    out.col(1) = F.col(2).cross(F.col(0));
    out.col(2) = F.col(0).cross(F.col(1));
    return out;
}

}  // namespace splitcubes
