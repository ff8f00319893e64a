#pragma once

/// Tuning constants of the mesh-free discretisation: tolerances, shares, limits and iteration counts that
/// decide about behaviour, accuracy or time, grouped by subject. Each comment gives the unit (none for pure
/// numbers; spacings: mean distances of phyxels), the sensible range and the effect of larger and smaller
/// values.

#include <cstddef>

namespace splitcubes::meshless::tuning {

/// Elements per chunk of parallel loops, about ten microseconds of work. Results do not depend on them.
/// Larger ones leave threads idle, smaller ones cost scheduling. phyxel_grain (loops.h), on which results
/// depend, stays with its loops.
namespace grains {

/// Nodes whose volume is distributed, 64 to 1024; their rows are joined in order.
inline constexpr std::size_t lumping = 512;
/// Nodes whose shares are corrected, 16 to 256. Few, as each solves dense systems of nine unknowns.
inline constexpr std::size_t lumping_moments = 64;

}  // namespace grains

/// Free rotation of rigid pieces (rigid_pieces.cpp).
namespace rigid {

/// rad, maximum rotation per substep of free rotation, 0.05 to 0.5. Smaller is more accurate and slower.
inline constexpr double max_substep_rotation = 0.2;
/// Maximum number of fixed-point iterations of the midpoint rule in a substep. It converges by about
/// max_substep_rotation per iteration, so 20 reach machine precision; the rest is reserve.
inline constexpr int max_midpoint_iterations = 60;

}  // namespace rigid

/// Moment matrices and the penalty of zero-energy modes (neighbourhoods.cpp).
namespace neighbourhoods {

/// Fraction of the largest eigenvalue of a moment matrix, 1e-5 to 5e-3, below which a direction is dropped.
/// Larger takes thin neighbourhoods for flat ones; smaller inverts noise.
inline constexpr double rank_threshold = 3e-3;
/// c_i = this * zero_energy * mu V_i / trace A_i. With 5, zero_energy 0.1 restores the shape of a body whose
/// phyxels start at random positions; 0.02 leaves it crumpled. Larger stiffens bending.
inline constexpr double penalty_factor = 5;
/// Mean square of the lengths of a lattice's links, weighted as in the fit, in squared spacings, 1 to
/// 2: defines the spacing of any neighbourhood. It scales the terms against the ridges of the balance.
inline constexpr double mean_square_length = 1.31;

}  // namespace neighbourhoods

/// Rows of held phyxels, which count no material behind them (neighbourhoods.cpp).
namespace holds {

/// Cosine between a link and the way to the free side, below minus which the link does not count, 0.1 to
/// 0.57: links of a lattice to the layer behind are beyond. Larger counts links into the hold; smaller makes
/// rows depend on rounding.
inline constexpr double behind_cosine = 0.5;
/// Sum of a row's weighted links to free phyxels over the sum of their lengths, 0.1 to 0.5, up to which they
/// do not lie on one side: it is 0.3 for one held phyxel of a surface. Smaller takes volume from such.
inline constexpr double min_one_sided = 0.3;
/// The same, 0.5 to 0.75, from which they do: it is 0.8 for the edge of a hold along a lattice. Larger counts
/// links into the hold.
inline constexpr double max_one_sided = 0.6;

}  // namespace holds

/// Weights of neighbourhoods that are not symmetric (balanced_weights.cpp). Ridges and moments are fractions
/// of the sum of a row's weights, with lengths in spacings.
namespace balance {

/// Ridge on the third moments, 0.01 to 0.1. Larger leaves thin bodies and ligaments too soft in bending;
/// smaller makes shallow notches too stiff.
inline constexpr double third_moment_ridge = 0.03;
/// Ridge on the changes of second moments, 0.03 to 1. Larger lets neighbourhoods of few links become nearly
/// flat, whose stress is noise; smaller leaves thin bodies softer.
inline constexpr double second_moment_ridge = 0.3;
/// Least share of its weight that a link keeps, 0.01 to 0.3. Larger leaves thin bodies softer; at zero a link
/// would end.
inline constexpr double floor = 0.05;
/// Visibility below which links fade from the balance, 0.05 to 0.5. Larger makes notched bodies too stiff;
/// smaller lets thin ligaments stretch (decision 020).
inline constexpr double fading_visibility = 0.08;
/// Fits of a row, of which each but the first keeps more links at the floor, 1 to 10.
inline constexpr int rounds = 4;
/// Third moment below which a neighbourhood is symmetric and keeps its weights, 1e-9 to 1e-3: covers the
/// rounding of positions.
inline constexpr double min_third_moment = 1e-6;

}  // namespace balance

/// Correction of lumping shares to the nodes' moments (lumping_moments.cpp).
namespace lumping {

/// Fraction of a phyxel's uncorrected volume that the correction must leave, 0 to 1. Larger corrects less;
/// smaller makes light phyxels, which shorten explicit substeps.
inline constexpr double min_volume_share = 0.3;
/// Upper bound of the summed absolute changes of a row's shares, 1 to 10. Smaller corrects less; larger
/// allows negative shares.
inline constexpr double max_share_change = 3;
/// Scales the quadratic monomials to the size of the linear ones, as coordinates are below 1; 1 to 10. It
/// sets how much moments_damping affects them.
inline constexpr double square_scale = 3;
/// Regularises directions in which a row's phyxels hardly spread, 1e-4 to 0.05; normal variances are 0.05 and
/// more. Larger biases the result, smaller lets shares explode.
inline constexpr double moments_damping = 0.005;
/// Iterative refinements that remove most of that bias, 0 to 5.
inline constexpr int moments_refinements = 2;
/// Largest change of a phyxel's mass that keeps the centre of mass of its piece, as a share of itself, 0.3 to
/// 0.7. Smaller lets pieces move when they are cut; larger makes light phyxels.
inline constexpr double max_mass_change = 0.7;
/// Radius of gyration along an axis, in support radii, below which a piece has no extent there, 1e-3 to 0.1:
/// its centre of mass stays where its phyxels are. Larger gives up thin pieces; smaller divides by rounding.
inline constexpr double min_extent = 0.02;

}  // namespace lumping

/// Structure of the slices of links (link_slices.cpp).
namespace links {

/// Lanes, of 16, that must share an index offset to form a run: indexed lanes cost more than twice the loads
/// of a run. More makes fewer and fuller runs; only time depends on it, apart from the order of sums.
inline constexpr std::size_t min_run = 8;
/// Relative difference of rest edges that count as equal, 1e-7 to 1e-5: covers the rounding of positions.
/// Larger takes distorted lattices for regular ones.
inline constexpr double edge_tolerance = 3e-7;
/// Spare memory for links of new phyxels is one part of so many, 2 to 100. More parts save memory; fewer
/// postpone the first time that links are copied to larger arrays.
inline constexpr std::size_t spare_part = 8;

}  // namespace links

/// Placing of phyxels (sampling.cpp).
namespace sampling {

/// Maximum number of cells of the grid that finds samples near a point: limits memory in large boxes to 64
/// MiB. Fewer make larger cells, which cost only time.
inline constexpr double max_grid_cells = 0x1p24;
/// Lattice points that are placed at a time: limits memory to 8 MiB. Results do not depend on it.
inline constexpr std::size_t batch_size = std::size_t{1} << 18;

}  // namespace sampling

}  // namespace splitcubes::meshless::tuning
