#pragma once

#include <splitcubes/math/types.h>

namespace splitcubes {

/// Returns the matrix that multiplies by the cross product: cross_matrix(v) w = v x w.
inline Mat3 cross_matrix(const Vec3& v) {
    Mat3 out;
    out << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return out;
}

}  // namespace splitcubes
