// Settings of tearing: the strength of a body's material and the speed of cracks.
#pragma once

#include <splitcubes/math/types.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <string>

namespace splitcubes::body {

struct TearSettings {
    /// Pa, largest principal Cauchy stress at which a crack begins, > 0.
    double strength = std::numeric_limits<double>::infinity();
    /// Stress at which an existing crack grows, as a share of the strength, (0, 1].
    double propagation_ratio = 0.6;
    /// m/s at rest, >= 0; 0: two fifths of the speed of shear waves, a typical speed of cracks in brittle
    /// materials. Lower speeds look like tough material that tears.
    double crack_speed = 0;
    /// Strength at a rest position as a multiple of `strength`, >= 0; empty: 1.
    std::function<double(const Vec3& rest)> strength_factor;
};

/// Throws InputError(where + ".strength", ...) etc. for a setting out of range.
void check_tearing(const TearSettings& settings, const std::string& where);

/// Cut number (Crossing::cut) of the crossings that tearing makes; those of tools count from 0.
inline constexpr std::int32_t tear_cut_number = 1 << 20;

}  // namespace splitcubes::body
