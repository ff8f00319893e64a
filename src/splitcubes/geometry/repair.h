// Faults of a mesh that can be mended without a guess.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

#include <cstddef>

namespace splitcubes::geometry {

/// Leaves one of the triangles that stand on the same three vertices, turned as most of
/// them are; none where as many are turned one way as the other, since these bound
/// nothing. Order is kept. dropped: how many went. O(n).
TriangleMesh without_duplicates(const TriangleMesh& mesh, std::size_t& dropped);

/// Turns triangles so that neighbours run along their common edge opposite ways, part
/// by part (connected through edges), as the larger area of the part was turned. Only
/// for meshes that this makes closed: every edge has two triangles, no part is
/// one-sided; any other is returned as it is. turned: how many triangles. O(n).
TriangleMesh consistently_oriented(const TriangleMesh& mesh, std::size_t& turned);

}  // namespace splitcubes::geometry
