#pragma once

/// Tuning constants of the public interface: limits of input and of change ranges. Each comment gives the
/// unit (none for pure numbers), the sensible range and the effect of larger and smaller values.

#include <cstdint>

namespace splitcubes::api::tuning {

/// Limits of what a caller may give (convert.cpp, session.cpp).
namespace input {

/// Largest value of a setting, in its own unit, 1e12 to 1e75: squares and products stay finite. Smaller
/// refuses settings that work.
inline constexpr double max_setting = 1e30;
/// Cells along the longest side of the distance grid of a mesh as collider, 16 to 256. More follow its
/// surface better; memory and set-up grow with their cube. Scenes have the same (scene/tuning.h).
inline constexpr int collider_cells = 64;

}  // namespace input

/// Change ranges of surfaces (surface_stream.cpp).
namespace surface_stream {

/// Slots, 0 to 100: gaps of up to this many unchanged slots are joined into a range, as a copy more is
/// cheaper than a range more. Larger copies more, smaller makes more ranges.
inline constexpr std::uint32_t max_gap = 8;

}  // namespace surface_stream

}  // namespace splitcubes::api::tuning
