// Exact integer winding numbers of a closed mesh at grid nodes.
#pragma once

#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <vector>

namespace splitcubes::geometry {

/// Nodes first <= x < last of a row with the same non-zero winding number.
struct WindingRun {
    int y, z, first, last;
    int winding;
};

/// Returns the integer winding numbers of a closed mesh (MeshCheck::closed of the welded mesh) at all nodes
/// of a grid, as runs along x, sorted by z, y, x; nodes in no run have zero. The mesh may lie inside the
/// grid, reach beyond it or enclose it.
///
/// The numbers agree exactly with sweep_grid: between neighbouring nodes they change by the directions of the
/// crossings on the edge, and only there. sweep_grid clips a mesh that reaches further than 2^18 cells from
/// the grid's origin; the numbers are then off by a common constant only if every corner of the grid lies on
/// the mesh within rounding.
///
/// Throws InputError for an index out of range or a vertex that is not finite.
std::vector<WindingRun> node_windings(const RestGrid& grid, const TriangleMesh& closed);

}  // namespace splitcubes::geometry
