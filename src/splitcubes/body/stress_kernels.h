// Stresses of many phyxels side by side, as vector code reads them.
#pragma once

#include <splitcubes/math/types.h>

#include <cstddef>
#include <cstdint>

namespace splitcubes::body {

/// Phyxels, those of [begin, end) of each array.
struct StressTask {
    const Mat3 *deformation, *rotation;  // d world / d rest, and its rotation
    std::size_t begin, end;
    double lame_mu, lame_lambda;  // Pa
    double min_volume;            // share of the volume at rest: below it the stress says nothing
    double limit, slack;          // Pa; share of a stress's norm
    Mat3* stress;                 // out: Pa, Cauchy; zero where size is negative
    /// In: negative where the phyxel has no say. Out: Pa, the Frobenius norm of its stress, or -1 where that
    /// says nothing; what was negative stays.
    double* size;
    /// Out: 0 where no principal stress is above limit - slack * size, found as has_values_below finds it.
    std::uint8_t* is_above;
};

/// By the corotated model without plasticity and volume stiffness: what meshless::piola_stress gives, to
/// rounding; the same bits for every instruction set.
void find_corotated_stresses(const StressTask& task);

}  // namespace splitcubes::body
