// The sRGB transfer function (IEC 61966-2-1) per channel, on [0, 1].
#pragma once

#include <algorithm>
#include <cmath>

namespace splitcubes::geometry {

inline float srgb_from_linear(float linear) {
    const double v = std::clamp(static_cast<double>(linear), 0.0, 1.0);
    return static_cast<float>(v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055);
}

inline float linear_from_srgb(float srgb) {
    const double v = std::clamp(static_cast<double>(srgb), 0.0, 1.0);
    return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

}  // namespace splitcubes::geometry
