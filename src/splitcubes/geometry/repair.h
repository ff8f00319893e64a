// Unambiguous mesh repairs.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

#include <cstddef>

namespace splitcubes::geometry {

/// Returns the mesh with one of the triangles on the same three vertices, oriented as the
/// majority of them; with none if both orientations are equally frequent, since these
/// enclose nothing. Keeps the order. dropped: number of removed triangles. O(n).
TriangleMesh without_duplicates(const TriangleMesh& mesh, std::size_t& dropped);

/// Flips triangles so that neighbours use their common edge in opposite directions. Each
/// part (connected through edges) gets the orientation of the larger share of its area.
/// Applies only to meshes that become closed: every edge has two triangles, all parts are
/// orientable; others are returned unchanged. turned: number of flipped triangles. O(n).
TriangleMesh consistently_oriented(const TriangleMesh& mesh, std::size_t& turned);

}  // namespace splitcubes::geometry
