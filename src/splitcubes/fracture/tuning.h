#pragma once

/// Tuning constants of tearing: tolerances, shares, limits and iteration counts that decide about behaviour,
/// accuracy or time, grouped by subject. Each comment gives the unit (none for pure numbers; spacings: mean
/// distances of phyxels), the sensible range and the effect of larger and smaller values.

#include <cstddef>

namespace splitcubes::body::tuning {

/// Elements per chunk of parallel loops. Results do not depend on them. Larger ones leave threads idle,
/// smaller ones cost scheduling; about ten microseconds of work.
namespace grains {

/// Phyxels whose stress is measured.
inline constexpr std::size_t stressed_phyxels = 256;
/// Nodes at which the stress is averaged.
inline constexpr std::size_t stress_nodes = 32;
/// Cells that are searched for edges that cracks have passed.
inline constexpr std::size_t passed_cells = 8;
/// Nodes or edges at which a crack may start.
inline constexpr std::size_t crack_starts = 8;
/// Open edges beside crack faces.
inline constexpr std::size_t crack_faces = 256;
/// Edges ahead of a crack front.
inline constexpr std::size_t front_edges = 16;
/// Cells of a front, and a quarter of the cells with a crack in a chunk.
inline constexpr std::size_t crack_cells = 64;

}  // namespace grains

/// Cracks: where they begin, how they grow, what they leave (Tearing and its parts; docs/replication.md).
namespace tearing {

/// Cosine of 60 degrees: largest angle between the planes of one crack, and between a crack's normal and the
/// principal direction where the crack grows. Larger makes cracks stop where the stress turns and shields
/// less beside them; smaller lets them turn sharply and suppresses branches.
inline constexpr double min_opening_cosine = 0.5;
/// Edge lengths beyond its ends, 0 to 0.5, in which a plane still counts as crossing an edge. Planes of one
/// crack differ by about as much; an edge that all of them miss would stay as a ligament. Larger cuts edges
/// beside the crack.
inline constexpr double edge_slack = 0.1;
/// Stress implied by the crack opening, over the strength, from which on a crack may split off a slab; above
/// 1. Larger has fewer parallel cracks, smaller more.
inline constexpr double slab_opening = 4;
/// Cosine of 45 degrees: largest angle between principal direction and deformed edge where a crack begins.
/// Every direction has an edge within 55 degrees; larger delays oblique cracks, smaller begins them on edges
/// that lie in the crack.
inline constexpr double min_edge_cosine = 0.7071;
/// Phyxels, 4 to 100; a piece with fewer resolves no stress field and does not tear. Smaller makes dust.
inline constexpr std::size_t min_tear_phyxels = 16;
/// Nodes, 8 to 1000; likewise.
inline constexpr std::size_t min_tear_nodes = 64;
/// Searches per step around phyxels where no edge turns out to be above its strength, 1 to 100. More cost
/// time; fewer may delay a crack by a step.
inline constexpr int max_vain_tries = 4;
/// Cells, 1 to 5: largest distance between the two sheets of a step in a crack whose riser is cut. Larger
/// closes more gaps between cracks, but may join cracks that would pass each other.
inline constexpr int max_riser = 3;
/// Passes that cut edges that cracks have passed, 1 to 10; each may make new ones. More cost time, fewer
/// leave ligaments until the next step.
inline constexpr int max_passed_edge_passes = 4;
/// Cells, 2 to 6: radius of the ball in which a weak plane is looked for. Larger finds planes that are far
/// away and blurs bent ones; smaller sees too little of the layer; time grows with its cube.
inline constexpr int weak_plane_radius = 3;
/// Share of the principal direction in the normal of a crack's continuation, 0 to 1. The phyxels' stress is
/// noisy around a tip, so larger makes cracks rough; smaller makes them turn late. max_turn_tangent and
/// certain_shielding_cosine follow from it.
inline constexpr double principal_share = 0.25;
/// Tangent of the largest angle by which a crack's plane turns in one continuation: 13.9 degrees, atan(t sin
/// a / (1 - t + t cos a)) for the share t = principal_share of a direction a = 60 degrees off
/// (min_opening_cosine).
inline constexpr double max_turn_tangent = 0.2475;
/// Cosine of 45 degrees less that angle. If a tip's normal is this close to a crossing's, each normal that it
/// may propose is within 45 degrees of it, hence also their mean over several tips, well within
/// min_opening_cosine.
inline constexpr double certain_shielding_cosine = 0.857;
/// Relative margin of bounds on stress, 1e-9 to 1e-3, far above the rounding error of the bound and of the
/// bounded values. Larger costs time, smaller misses loads.
inline constexpr double stress_bound_slack = 1e-6;
/// Share of its volume at rest, 0 to 0.5: a phyxel compressed below that, or inverted, is left out of the
/// stress field. Larger leaves out crushed material, smaller trusts stresses that the material law does not
/// resolve.
inline constexpr double min_volume_share = 0.05;

}  // namespace tearing

}  // namespace splitcubes::body::tuning
