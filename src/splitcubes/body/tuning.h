#pragma once

/// Tuning constants of bodies: tolerances, shares, limits and iteration counts that decide about behaviour,
/// accuracy or time, grouped by subject. Each comment gives the unit (none for pure numbers; spacings: mean
/// distances of phyxels), the sensible range and the effect of larger and smaller values.

#include <cstddef>

namespace splitcubes::body::tuning {

/// Set-up of bodies, reading of their state, bookkeeping of changes.
namespace set_up {

/// The same for cells of the surface.
inline constexpr std::size_t cells_between_checks = 4096;
/// Maximum number of lattice points in the search for thin parts; larger grids are subsampled. More are more
/// accurate and take more time and memory.
inline constexpr double max_lattice_points = 1e6;

}  // namespace set_up

}  // namespace splitcubes::body::tuning
