#pragma once

/// Tuning constants of bodies: limits that decide about accuracy or time. Each comment gives the unit (none
/// for pure numbers), the sensible range and the effect of larger and smaller values.

#include <cstddef>

namespace splitcubes::body::tuning {

/// Set-up of bodies (surface_occluders.cpp), and advice about them (thin_parts.cpp).
namespace set_up {

/// Cells of the surface in a long serial loop between two checks for cancellation, 100 to 1e5. More react
/// later, fewer cost time.
inline constexpr std::size_t cells_between_checks = 4096;
/// Maximum number of lattice points in the search for thin parts; larger grids are subsampled. More are more
/// accurate and take more time and memory.
inline constexpr double max_lattice_points = 1e6;

}  // namespace set_up

}  // namespace splitcubes::body::tuning
