#pragma once

/// Tuning constants of solids, cut cells and their surface: tolerances, shares and limits that decide about
/// shape, accuracy or time, grouped by subject. Each comment gives the unit (none for pure numbers), the
/// sensible range and the effect of larger and smaller values. min_parameter (node_grid.h) belongs to the
/// interface and stays there.

#include <cstddef>

namespace splitcubes::splitting::tuning {

/// Positions of face and centre vertices (placement.cpp, surface.cpp; docs/algorithms/splitting-cubes.md).
namespace placement {

/// Dot product of normals, 0.7 to 1, below which two crossings are sharp: 0.9 is an angle of about 26
/// degrees. Larger makes creases of noise; smaller rounds creases off.
inline constexpr double sharp_cosine = 0.9;
/// Share of the largest eigenvalue, 1e-4 to 0.1, below which a direction counts as undetermined. The normal
/// matrix holds squares, so 0.01 drops singular values below a tenth of the largest. Larger flattens creases;
/// smaller throws vertices far along almost parallel planes.
inline constexpr double eigenvalue_cutoff = 0.01;
/// Cells, 0 to 1, by which a vertex may lie outside its face. Larger follows creases that leave the face and
/// risks folds; smaller makes them jagged.
inline constexpr double face_widening = 0.25;
/// Cells, the same for a centre vertex on a crease.
inline constexpr double crease_widening = 0.5;
/// Cells, 0 to 1: if a cut meets the boundary or an older cut just beyond the face, the face vertex is placed
/// there up to this distance. A crease that stopped at the face would be jagged.
inline constexpr double meeting_widening = 0.5;
/// Cells, 0.8 to 1.5, for a centre vertex that three planes, or a sheet and its cutter, determine at any
/// distance. A corner of a tilted cube was found up to 0.8 of a cell outside the nearest cell that meets all
/// three planes.
inline constexpr double corner_widening = 1.0;
/// Cells, 0.005 to 0.1, by which vertices of cuts may lie beyond tangent planes of the boundary. Larger lets
/// them stick out of it; smaller rounds creases off where it is curved.
inline constexpr double boundary_tolerance = 0.02;
/// The same, 0.05 to 0.5, where cuts meet the boundary: a rim that follows a cut over a curved boundary
/// leaves the tangent planes.
inline constexpr double rim_tolerance = 0.15;
/// Component of a normal along its edge, 0 to 0.2, below which a crossing is grazing and its sign along the
/// edge means nothing. Larger pairs fewer crossings by orientation; smaller trusts rounding.
inline constexpr double grazing_cosine = 0.05;
/// The same where a cell's crossings are gathered.
inline constexpr double grazing_edge_cosine = 0.05;
/// Nodes, 8 to 512, up to which a piece counts as small: its vertices are moved into their faces and cells
/// where they could turn it inside out. Larger takes time; smaller lets larger pieces turn inside out.
inline constexpr std::size_t small_piece_nodes = 64;
/// Share, 1e-9 to 0.1, of the volume that a small piece has with moved vertices: the least that it must have.
/// Larger moves the vertices of sharp corners that are pieces of their own; smaller is within rounding.
inline constexpr double least_share = 1e-7;
/// Cells, 0 to 0.2, between a moved vertex and the rim of its face or cell. Larger is rounder; smaller leaves
/// pieces without volume.
inline constexpr double settled_inset = 0.05;

}  // namespace placement

/// Fronts of cuts within a face (cut_front.cpp).
namespace cut_front {

/// Sides of a face, 0 to 0.3, by which a point of a blade may lie outside it: faces are taken for flat
/// parallelograms. Larger takes in what passes beside the face; smaller misses fronts in bent faces.
inline constexpr double face_margin = 0.1;

}  // namespace cut_front

/// Loops over the surface (surface.cpp, surface_motion.cpp). Affects time only.
namespace surface {

/// Cells between two checks for cancellation, 100 to 1e5.
inline constexpr std::size_t cells_between_checks = 4096;
/// Prefetch distance in vertices, which are read in sequence.
inline constexpr std::size_t vertices_ahead = 64;
/// Prefetch distance of the cells of vertices, an indirect access.
inline constexpr std::size_t cells_ahead = 16;

}  // namespace surface

/// Solids from meshes: what is inside, what is noted or refused (solidify.cpp, boundary_crossings.cpp,
/// solidify_winding.cpp).
namespace solidify {

/// Share of the closed surface, 0.25 to 0.33, above which a mesh is refused as a sheet. A sheet has a winding
/// number of about 1/2 close to it but no inside: more of its surface would be invented than that of a body
/// with holes. Of the grid edges that cross the surface, a half sphere without its base has a quarter in the
/// hole; hilly sheets have a third.
inline constexpr double max_invented_share = 0.3;
/// B, memory of a solid per node; measured with spheres of 50 to 300 cells, closed ones and ones with holes.
/// Larger refuses meshes that would fit; smaller lets the machine run out of memory.
inline constexpr double bytes_per_node = 2;
/// B, the same per cut edge.
inline constexpr double bytes_per_cut_edge = 1800;
/// B, the same per crossing of the mesh with a grid edge.
inline constexpr double bytes_per_crossing = 80;
/// Share of the crossings, 0 to 0.1, above which gaps between walls less than a cell apart are noted: every
/// crease has a few such edges.
inline constexpr double min_gap_share = 0.02;
/// Edges through material that falls between the nodes, 1 to 100, from which on it is noted: every mesh has a
/// few tips and rims.
inline constexpr std::size_t min_lost_edges = 8;
/// Share of the crossings, 0 to 0.1; fewer edges are noted if they are more than that.
inline constexpr double min_lost_share = 0.005;
/// Dot product of the normals of both sides, -1 to 0, below which thin material between two nodes counts as
/// lost slab also beside inside nodes. Larger notes wedges, too; smaller misses tilted walls.
inline constexpr double slab_cosine = -0.9;
/// Products of bricks with a boundary edge and all bricks, 1e6 to 1e10: beyond that no bound on the gradient
/// of the winding number is computed, and it is evaluated at each node. Affects time only.
inline constexpr double max_gradient_work = 1e8;
/// Bound on the error of an evaluated winding number, 1e-3 to 0.05. Larger evaluates it at more nodes;
/// smaller may take a wrong side.
inline constexpr double evaluation_error = 5e-3;
/// Near triangles, 1e3 to 1e5, above which the winding number of a soup is estimated: its last digits are not
/// worth the time.
inline constexpr std::size_t max_near_triangles = 4096;

}  // namespace solidify

/// Sides of the crossings of a triangle soup by interpolated winding numbers (soup_edges.cpp).
namespace soup_edges {

/// Cells, 1e-6 to 1e-4: within this distance of a crossing, the sweep's lattice of 2^-20 cells may put a
/// point on its other side. Larger evaluates more winding numbers; smaller may take a wrong side.
inline constexpr double crossing_resolution = 2e-6;
/// Bound on the difference between WindingNumber::at and the sum over all triangles; 1e-3 to 1e-2, with
/// geometry's winding_number::opening_ratio. Larger costs time, smaller may take a wrong side.
inline constexpr double tree_error = 2e-3;
/// Bound on a sum of independent rounding errors, over the root of the sum of their squares; above 6. Larger
/// costs time, smaller may take a wrong side.
inline constexpr double rounding_spread = 14;
/// Near triangles per point, on average, from which on the interpolation may pay. Affects time only, as the
/// three below.
inline constexpr std::size_t min_near_triangles = 1000;
/// Time of one triangle in the sum over all of them, over that of a near triangle of the tree; measured.
inline constexpr double sum_cost_ratio = 1.0 / 12;
/// Maximum number of nodes; limits memory.
inline constexpr double max_nodes = 1e7;
/// Maximum distance of the mesh from the grid's origin, cells; limits rounding errors.
inline constexpr double max_extent = 1e5;
/// Cells, side of the cubes for which the triangles nearby are gathered, 4 to 16. Affects time only.
inline constexpr int cube_side = 8;

}  // namespace soup_edges

}  // namespace splitcubes::splitting::tuning
