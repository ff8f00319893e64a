// Cuts a body at rest with a triangle sheet or a closed mesh.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/splitting/crossed_edges.h>
#include <splitcubes/splitting/node_grid.h>

#include <vector>

namespace splitcubes::splitting {

/// Cuts every uncut edge between two inside nodes that the sheet crosses (rest space; exact, see
/// geometry::sweep_grid: no edge passes between two triangles). If the sheet crosses an edge more than once,
/// the crossing nearest to the edge's middle is used. Where the sheet ends in a face beside them, the front
/// is at its rim. Returns the slots of the new cut edges. Throws InputError if a position is not finite or an
/// index is out of range.
std::vector<std::int32_t> cut_with_sheet(NodeGrid& grid, const geometry::TriangleMesh& sheet,
                                         std::int32_t cut_number);

/// Counts the edges of the body that the sheet crosses. The sheet must have passed cut_with_sheet.
CrossedEdges edges_crossed_by_sheet(const NodeGrid& grid, const geometry::TriangleMesh& sheet);

}  // namespace splitcubes::splitting
