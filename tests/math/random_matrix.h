// Random matrices for tests.
#pragma once

#include <splitcubes/core/random.h>
#include <splitcubes/math/types.h>

namespace splitcubes::fixtures {

/// Returns a matrix with entries uniform in [-1, 1].
inline Mat3 random_matrix(Random& random) {
    Mat3 matrix;
    for (int k = 0; k < 9; ++k) matrix(k) = random.uniform(-1, 1);
    return matrix;
}

}  // namespace splitcubes::fixtures
