// Memory estimate of a solid.
#pragma once

#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/geometry/triangle_mesh.h>

namespace splitcubes::splitting {

/// Returns about the bytes that the solid of a mesh on a grid, its surface and the surface's mesh take
/// together. solidify checks first that they are available (core/memory.h).
double solid_memory(const geometry::TriangleMesh& mesh, const geometry::RestGrid& rest);

}  // namespace splitcubes::splitting
