#pragma once

/// Tuning constants of worlds: tolerances, shares, limits and iteration counts that decide about behaviour,
/// accuracy or time, grouped by subject. Each comment gives the unit (none for pure numbers; spacings: mean
/// distances of phyxels), the sensible range and the effect of larger and smaller values.

namespace splitcubes::body::tuning {

/// Cuts by tools (rest_cut.cpp, node_ties.cpp, idle_tools.cpp, moving_bricks.cpp).
namespace cutting {

/// Points, about the most per line of a blade at which an idle tool in a body is followed, every half spacing
/// otherwise. More cost time; fewer follow the deformation less.
inline constexpr int max_idle_points = 200;

}  // namespace cutting

}  // namespace splitcubes::body::tuning
