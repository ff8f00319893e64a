#pragma once

/// Tuning constants of elastic samples: tolerances, shares, limits and iteration counts that decide about
/// behaviour, accuracy or time, grouped by subject. Each comment gives the unit (none for pure numbers;
/// spacings: mean distances of phyxels), the sensible range and the effect of larger and smaller values.

#include <cstddef>

namespace splitcubes::body::tuning {

/// Set-up of the samples of a body (material_nodes.cpp, placement.cpp), and reading of their state
/// (elastic_samples_state.cpp).
namespace set_up {

/// Bricks of a long serial loop between two checks for cancellation, 100 to 1e5. More react later, fewer cost
/// time.
inline constexpr std::size_t bricks_between_checks = 4096;
/// B, estimated memory of a phyxel with its links and its share of the nodes; measured. Larger refuses bodies
/// that would fit; smaller lets the machine run out of memory.
inline constexpr double bytes_per_phyxel = 14e3;
/// Largest deviation of a stored rotation of a phyxel from orthogonality, 1e-6 to 0.01. Larger accepts
/// damaged states, smaller refuses rounding.
inline constexpr double rotation_tolerance = 1e-3;
/// Largest sum of the absolute shares of a stored row of mass lumping, 4 to 5: corrections change them by 3
/// in total. Larger accepts damaged states, whose integer sums may overflow; smaller refuses good ones.
inline constexpr double max_absolute_shares = 5;

}  // namespace set_up

/// Phyxels at centroids (centroids.cpp). Lengths in spacings.
namespace lloyd {

/// Distance from the surface up to which phyxels move, 1 to 2. Larger spreads what one place lacks over more
/// phyxels and costs time; smaller crowds them at the surface.
inline constexpr double reach = 1.6;
/// Rounds, 4 to 16. Fewer leave phyxels of turned lattices off their centroids; more cost time.
inline constexpr int max_rounds = 8;
/// Step over the distance to the centroid, 1 to 1.8. Larger needs fewer rounds, but may swing about the goal;
/// smaller needs more.
inline constexpr double relaxation = 1.5;
/// Step, 0 to 0.02, below which a phyxel stays. Larger ends early, smaller costs time.
inline constexpr double converged = 0.01;
/// Size, 0.1 to 0.4, below which a part of material between several phyxels is not halved any more. Larger
/// moves phyxels by the error of their centroids; smaller costs time.
inline constexpr double largest_part = 0.4;
/// Movement below which a phyxel keeps its place in the lattice, 0.01 to 0.1. Larger leaves phyxels off
/// their centroids; smaller dissolves lattices along boxes, which vector loops read in runs.
inline constexpr double still = 0.05;

}  // namespace lloyd

/// New phyxels and rigid fragments (resampling.cpp), and ligaments (ligaments.cpp).
namespace resampling {

/// Phyxels that a small piece gets, if it has as many nodes, before the ranks of neighbourhoods are checked;
/// 4 to 20. More cost time; fewer leave rank-deficient neighbourhoods.
inline constexpr std::size_t min_piece_phyxels = 8;
/// Iterations that add phyxels to neighbourhoods that do not span space, 1 to 5. More cost time and phyxels;
/// fewer leave more rank-deficient neighbourhoods.
inline constexpr int rank_iterations = 3;
/// Phyxels added to such a neighbourhood per iteration, 1 to 3; same effect.
inline constexpr int phyxels_per_rank_iteration = 3;
/// Spacings, 0.2 to 1, by which a new phyxel may be off from where a hold puts it; else it ignores the hold.
/// Larger lets holds pull fragments back; smaller frees strained material beside a hold.
inline constexpr double max_hold_offset = 0.5;
/// Spacings, 1 to 4, about one support radius. A shorter piece is rigid: each of its phyxels would have all
/// others as neighbours, and its deformation would hardly be visible. Larger makes visible splinters stiff;
/// smaller keeps pieces whose strain is not resolved.
inline constexpr double rigid_length = 2;
/// A piece with fewer phyxels that is also shorter than small_length is small: it gets more phyxels, and
/// starts without strain if these, or the cut, would give it elastic energy. Larger resets the strain of more
/// pieces; smaller leaves coarse ones.
inline constexpr std::size_t small_phyxel_count = 64;
/// Spacings, above rigid_length; length of a small piece.
inline constexpr double small_length = 6;
/// Rotation in a step, rad, 0.2 to 1, from which a small piece beside a larger one becomes rigid. Larger
/// leaves it to a solve that is linear in its displacements, which tears it apart; smaller makes fragments
/// rigid that would hardly rotate.
inline constexpr double max_rotation = 0.5;
/// Strain below which elastic energy counts as noise, 1e-6 to 1e-3. Larger keeps strain that new phyxels
/// released; smaller resets strain because of rounding.
inline constexpr double noise_strain = 1e-4;
/// Visibility of a pair that bridges a ligament, above 0 and far below 1. Larger affects phyxels with other
/// neighbours; a phyxel without others follows its bridges at any value.
inline constexpr float bridge_visibility = 0.1F;
/// Iterations that add phyxels where no pair reaches across a ligament, 4 to 16: each halves the distance.
inline constexpr int gap_iterations = 8;
/// Grid edges by which a path through the material may be longer than the path without cuts, 0 to 6. Larger
/// bridges phyxels around the end of a cut; smaller leaves ligaments loose.
inline constexpr int max_bridge_detour = 2;

}  // namespace resampling

/// Contact points of rigid pieces (rigid_outline.cpp). Lengths in cells.
namespace outline {

/// Directions in which outermost vertices are searched, 26 to 500. More cost time and points; fewer round
/// corners off.
inline constexpr int direction_count = 256;
/// Distance between outermost points, 0 to 0.3, below which one stands for both.
inline constexpr double min_spacing = 0.05;
/// Distance of other points from those that are taken, 0.3 to 2. Smaller takes more points; larger lets
/// round obstacles enter flat faces.
inline constexpr double spacing = 0.7;
/// Depth below the outermost vertex up to which a vertex counts as on the hull, 0.01 to 0.2.
inline constexpr double hull_depth = 0.05;

}  // namespace outline

}  // namespace splitcubes::body::tuning
