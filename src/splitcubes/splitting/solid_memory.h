// What a solid will take.
#pragma once

#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/geometry/triangle_mesh.h>

namespace splitcubes::splitting {

/// About the bytes that the solid of a mesh on a grid, its surface and the surface's mesh take together.
/// solidify asks first whether they are there (core/memory.h).
double solid_memory(const geometry::TriangleMesh& mesh, const geometry::RestGrid& rest);

}  // namespace splitcubes::splitting
