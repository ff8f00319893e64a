#pragma once

/// Tuning constants of meshes, occluders and distances: tolerances, shares and limits that decide about
/// accuracy or time, grouped by subject. Each comment gives the unit (none for pure numbers), the sensible
/// range and the effect of larger and smaller values. Limits of an interface (max_cells_per_axis,
/// max_coordinate) stay in its header.

#include <cstddef>
#include <cstdint>

namespace splitcubes::geometry::tuning {

/// Winding numbers by a tree (winding_number.cpp, winding_jets.cpp; Barill et al. 2018).
namespace winding_number {

/// Accuracy parameter of Barill et al., opening distance over node radius; 2 to 5. With 2 the worst errors
/// inside a mesh's bounding box are 6e-3, with 3.25 below 1e-3. Larger is more accurate and slower.
inline constexpr double opening_ratio = 3.25;
/// Triangles per leaf of the tree, 1 to 16. Affects time, and sums in the last bits.
inline constexpr std::uint32_t triangles_per_leaf = 4;
/// Cells, 1e-6 to 1e-4: distance to boundary or triangle below which the lattice of crossings does not
/// resolve the side, and a jet is not sound. Larger evaluates more winding numbers; smaller trusts rounding.
inline constexpr double side_resolution = 2e-6;
/// Triangles per block of single-precision sums, 128 to 8192. Shorter blocks keep the rounding error small;
/// longer ones save time.
inline constexpr std::size_t sum_block = 1024;

}  // namespace winding_number

/// Grid of occluding triangles and its exact and rough tests (occluder_grid.cpp, occluder_lanes.cpp,
/// occluder_pack.cpp).
namespace occluders {

/// Cells, 2 to 32; triangles that are longer are listed apart and tested against every query. Larger lists
/// triangles in many cells; smaller tests more of them always.
inline constexpr int max_span = 8;
/// Cells by which a triangle may reach beyond the brick that lists it, 1 to 8; others are listed apart.
/// Larger makes each query visit more bricks.
inline constexpr int max_overhang = 4;
/// Maximum number of bricks of a grid with direct access, 1 << 16 to 1 << 24: limits memory to 24 MiB. Larger
/// grids look bricks up in a table, which is slower.
inline constexpr double max_direct_bricks = 1 << 21;
/// Bricks along an axis, 2 to 16, up to which a range is tested for being clear; in larger ones the test
/// would cost more than it saves.
inline constexpr int max_clear_bricks = 4;
/// Relative error of the triple products of a segment test, 1e-15 to 1e-11. Larger lets segments beside an
/// edge be blocked; smaller lets them slip through between two triangles.
inline constexpr double segment_tolerance = 1e-13;
/// Area of a triangle over its longest edge squared, 1e-7 to 1e-3, below which its normal is not accurate to
/// single precision and the rough plane test is left out. Affects time only.
inline constexpr double min_plane_area_ratio = 1e-6;
/// Replaces the reciprocal of zero in rough box tests; far beyond any reciprocal of a length, and finite in
/// single precision.
inline constexpr double max_reciprocal = 1e30;
/// Triangles, of 16: a pack with more takes no triangles of other blocks. Larger makes fewer and wider packs,
/// smaller more and tighter ones. Affects time only.
inline constexpr int shared_fill = 8;

}  // namespace occluders

/// Contact times of two moving segments (swept_segments.cpp).
namespace swept_segments {

/// Fraction of the product of its columns' lengths, 1e-14 to 1e-6, below which a determinant may be zero for
/// the exact motion: extrema below it count as double roots. Larger cuts edges that a blade just misses;
/// smaller misses grazing contacts.
inline constexpr double touch_share = 1e-10;
/// The same fraction, above touch_share: a cubic that stays below it does not reliably give the contact time;
/// the times at which an end reaches the other segment are used instead.
inline constexpr double coplanar_share = 1e-7;

}  // namespace swept_segments

/// Signed distances and nearest points (signed_distance.cpp, nearest_point.cpp).
namespace distance {

/// Maximum number of sphere tracing steps, 16 to 256: longer paths graze the solid and count as contact. More
/// cost time; fewer find contacts where a path passes by.
inline constexpr int max_trace_steps = 64;
/// Triangles per leaf of the tree of nearest points, 1 to 16. Affects time only.
inline constexpr std::uint32_t nearest_leaf_size = 4;
/// Maximum depth of that tree; halving 2^32 triangles takes 30.
inline constexpr int nearest_max_depth = 60;

}  // namespace distance

/// Transformed points and normals (affine_sums.cpp).
namespace affine_sums {

/// Prefetch distance, in terms of a sum. Affects time only.
inline constexpr std::size_t prefetch_terms = 512;
/// Length of a transformed unit normal, 1e-12 to 1e-6, below which it keeps its direction at rest.
inline constexpr double min_normal_length = 1e-9;

}  // namespace affine_sums

/// Axes that a shape follows (shape_frame.cpp).
namespace shape_frame {

/// Sum, 0.6 (sphere) to 1 (box), below which a shape follows no axes, 0.65 to 0.75: a long rod has 0.75.
/// Larger keeps the mesh's axes for rods; smaller turns the grids of round bodies for little gain.
inline constexpr double min_sum = 0.7;
/// Gain of the sum, 1e-4 to 0.02, below which the mesh's axes stay: a box turned by an angle about one of its
/// edges gains 4 times its square, in radians, times its share of turned faces. Larger leaves turned bars
/// softer; smaller turns the grid for rounding.
inline constexpr double min_gain = 0.002;
/// Difference of sums, 1e-12 to 1e-6, below which two choices count as the same and the first is taken.
inline constexpr double same_sum = 1e-9;
/// Moment in a plane, 1e-14 to 1e-9, below which no direction in it is better than another.
inline constexpr double min_moment = 1e-12;
/// Rotation in a sweep, rad, at which the iteration ends, 1e-14 to 1e-9. Larger ends sooner, with less exact
/// axes.
inline constexpr double last_turn = 1e-13;
/// Maximum number of sweeps, 10 to 100. Usually five suffice.
inline constexpr int max_sweeps = 60;

}  // namespace shape_frame

}  // namespace splitcubes::geometry::tuning
