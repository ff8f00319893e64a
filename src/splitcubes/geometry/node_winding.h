// Which nodes of a grid a closed mesh winds round, exactly.
#pragma once

#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <vector>

namespace splitcubes::geometry {

/// Nodes first <= x < last of a row, with one winding number that is not zero.
struct WindingRun {
    int y, z, first, last;
    int winding;
};

/// The integer winding numbers of a closed mesh (MeshCheck::closed of the welded
/// mesh) about all nodes of a grid, as runs along x, sorted by z, y, x; nodes in
/// no run have zero. The mesh may lie inside the grid, reach beyond it or enclose it.
///
/// The numbers agree to the last bit with sweep_grid: from a node to the next
/// they change by the directions of the crossings on the edge between them, and
/// only there. A mesh that reaches further than 2^18 cells from the grid's origin
/// is clipped there by sweep_grid; the numbers then differ from exact ones, all by
/// the same, only if every corner of the grid lies on the mesh within rounding.
///
/// Throws InputError for an index out of range or a vertex that is not finite.
std::vector<WindingRun> node_windings(const RestGrid& grid, const TriangleMesh& closed);

}  // namespace splitcubes::geometry
