// When a body's material gives way.
#pragma once

#include <splitcubes/math/types.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <string>

namespace splitcubes::body {

struct TearSettings {
    /// Pa, the largest principal Cauchy stress that uncracked material bears, > 0.
    double strength = std::numeric_limits<double>::infinity();
    /// Share of the strength that the material bears at a crack's tip, (0, 1].
    double propagation_ratio = 0.6;
    /// m/s at rest, > 0; 0: two fifths of the speed of shear waves, as fast as cracks
    /// are seen to run in brittle material. Slower is tougher to watch: a tear.
    double crack_speed = 0;
    /// Strength at a rest position as a multiple of `strength`, >= 0; empty: 1.
    std::function<double(const Vec3& rest)> strength_factor;
};

/// Throws InputError(where + ".strength", ...) and so on for what is out of range.
void check_tearing(const TearSettings& settings, const std::string& where);

/// `cut` number of the crossings that tearing makes; tools count from 0.
inline constexpr std::int32_t tear_cut_number = 1 << 20;

}  // namespace splitcubes::body
