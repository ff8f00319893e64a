#pragma once

/// Tuning constants of node motion and of cuts by tools: tolerances, shares, limits and iteration counts that
/// decide about behaviour, accuracy or time, grouped by subject. Each comment gives the unit (none for pure
/// numbers; spacings: mean distances of phyxels), the sensible range and the effect of larger and smaller
/// values.

#include <cstddef>

namespace splitcubes::body::tuning {

/// Elements per chunk of parallel loops. Results do not depend on them. Larger ones leave threads idle,
/// smaller ones cost scheduling; about ten microseconds of work.
namespace grains {

/// Bricks near a moving blade.
inline constexpr std::size_t moving_bricks = 4;

}  // namespace grains

/// Kernels of tracked nodes (node_tracker.cpp).
namespace set_up {

/// Nodes, maximum of a search over uncut edges for the nearest node whose influences are known, 100 to 1e5.
/// More cost time; fewer leave more nodes with influences of their own.
inline constexpr std::size_t max_source_search = 4096;

}  // namespace set_up

/// Cuts by tools (rest_cut.cpp, node_ties.cpp, blade_fronts.cpp), and bounds on the nodes near them
/// (moving_bricks.cpp).
namespace cutting {

/// Share of an edge from its end, 1e-6 to 0.01, within which a hit counts as a hit of the node. Larger moves
/// cuts to nodes; smaller leaves cuts through a node with gaps.
inline constexpr double node_hit_share = 1e-4;
/// Component of a unit normal along an edge, 1e-9 to 1e-3, below which the edge lies in the cut. Larger takes
/// slightly inclined edges for it; smaller decides by rounding.
inline constexpr double in_plane_cosine = 1e-6;
/// Cells, 1e-12 to 1e-6: shorter ways of an edge between two intervals are rounding errors.
inline constexpr double rounding_share = 1e-9;
/// Cells, size of boxes of a cut at rest that are not halved further; 1 to 8. Larger tests more edges,
/// smaller halves more; affects time only.
inline constexpr double rest_cut_leaf_size = 2;
/// Maximum number of halvings; reached only by extreme coordinates.
inline constexpr int rest_cut_max_depth = 100;
/// Cells, 0.5 to 2, by which a face of a front is widened before its box is compared with that of a blade:
/// the box is of the last positions. Larger tests more fronts; smaller misses fronts of fast bodies.
inline constexpr double front_margin = 1;
/// Every so many phyxels are averaged to the motion relative to which bricks are bounded. Larger saves time
/// and may widen bounds, which changes no result.
inline constexpr std::size_t motion_sample_stride = 32;

}  // namespace cutting

}  // namespace splitcubes::body::tuning
