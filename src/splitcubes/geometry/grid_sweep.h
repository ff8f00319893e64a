// Exact crossings of the edges of a regular grid with a triangle mesh.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace splitcubes::geometry {

/// Crossing of a grid edge and a triangle. The edge runs from `node` to node + axis.
struct EdgeCrossing {
    Vec3i node;              // the edge's lower node
    std::int8_t axis;        // 0, 1, 2
    std::int8_t direction;   // sign of the triangle's normal along the axis: -1, +1
    double parameter;        // along the edge, [0, 1]
    std::uint32_t triangle;  // of the mesh
};

/// All crossings of a grid's edges, sorted by axis, then line (v, u), then node,
/// parameter, triangle. A line of axis a is identified by its node coordinates
/// u = (a+1)%3 and v = (a+2)%3.
struct GridCrossings {
    std::vector<EdgeCrossing> crossings;
    /// First crossing of each axis; four entries.
    std::size_t axis_begin[4];
    /// Number of crossings on a line beyond the grid's last or before its first node:
    /// zero for closed meshes inside the grid.
    std::size_t beyond_grid = 0;
};

/// Intersects the three families of grid lines with the mesh, without tolerance.
/// Vertices are snapped to an integer lattice of 2^20 steps per cell and every decision
/// is the sign of an integer determinant. The grid is shifted by infinitesimals
/// (e1 >> e2 >> e3) so that no node lies on a triangle and no line meets an edge
/// (simulation of simplicity, Edelsbrunner and Muecke 1990). So a line crosses exactly
/// one of two adjacent triangles at their edge, its directions through a closed oriented
/// mesh sum to zero, and the three families agree on which nodes are inside. Triangles
/// far outside the grid are clipped. Triangles without area in a projection cross no line
/// of that family.
GridCrossings sweep_grid(const RestGrid& grid, const TriangleMesh& mesh,
                         const Parallel& parallel = Parallel(1));

/// Returns the unit normal of a triangle of the mesh; zero if it has no area.
Vec3 triangle_normal(const TriangleMesh& mesh, std::uint32_t triangle);

}  // namespace splitcubes::geometry
