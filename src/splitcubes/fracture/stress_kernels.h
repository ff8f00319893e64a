// SIMD kernels for the stresses of many phyxels.
#pragma once

#include <splitcubes/math/types.h>

#include <cstddef>
#include <cstdint>

namespace splitcubes::body {

/// Phyxels begin to end - 1 of each array.
struct StressTask {
    const Mat3 *deformation, *rotation;  // d world / d rest, and its rotation
    std::size_t begin, end;
    double lame_mu, lame_lambda;  // Pa
    double min_volume;            // share of the volume at rest, below which a phyxel is excluded
    double limit, slack;          // Pa; share of a stress's norm
    Mat3* stress;                 // out: Pa, Cauchy; zero where size is negative
    /// In: negative for an excluded phyxel. Out: Pa, Frobenius norm of the stress; -1 for a phyxel that is
    /// excluded here (compressed below min_volume, or not finite); negative input is kept.
    double* size;
    /// Out: 0 if no principal stress is above limit - slack * size, by the test of has_eigenvalues_below;
    /// else 1.
    std::uint8_t* is_above;
};

/// Computes the stresses of the corotated model without plasticity and volume stiffness: those of
/// meshless::piola_stress up to rounding, bit-identical for every instruction set.
void find_corotated_stresses(const StressTask& task);

}  // namespace splitcubes::body
