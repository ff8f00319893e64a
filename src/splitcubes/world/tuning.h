#pragma once

/// Tuning constants of worlds: limits that decide about accuracy or time. Each comment gives the unit (none
/// for pure numbers; spacings: mean distances of phyxels), the sensible range and the effect of larger and
/// smaller values.

namespace splitcubes::body::tuning {

/// Tools that have cut nothing yet (idle_tools.cpp).
namespace cutting {

/// Approximate maximum number of points per line of a blade at which a tool in a body is followed, 20 to
/// 2000; the points are at least half a spacing apart. More cost time; fewer follow the deformation less.
inline constexpr int max_idle_points = 200;

}  // namespace cutting

}  // namespace splitcubes::body::tuning
