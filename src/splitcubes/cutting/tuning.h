#pragma once

/// Tuning constants of blades and cut edges. max_turn (sweep.h) belongs to the interface and stays there.

namespace splitcubes::cutting::tuning {

/// Division of a blade's motion into linear parts (sweep.cpp).
namespace sweep {

/// Linear parts per span between keyframes of a smooth path, 4 to 64. More follow its curve better and cost
/// time.
inline constexpr double parts_per_smooth_span = 16;

}  // namespace sweep

/// Edges that a blade hits (cut_edges.cpp).
namespace cut_edges {

/// Share of the edge's length, 1e-10 to 1e-4: if the relative motion of blade and edge across the blade is
/// below it, it defines no direction, and the cut keeps the last normal. Larger keeps stale normals; smaller
/// takes normals from rounding.
inline constexpr double standstill_share = 1e-7;

}  // namespace cut_edges

}  // namespace splitcubes::cutting::tuning
