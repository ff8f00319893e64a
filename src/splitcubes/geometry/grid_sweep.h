// Where the edges of a regular grid cross a triangle mesh, exactly.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace splitcubes::geometry {

/// A grid edge met by a triangle. The edge runs from `node` to node + axis.
struct EdgeCrossing {
    Vec3i node;              // the edge's lower node
    std::int8_t axis;        // 0, 1, 2
    std::int8_t direction;   // sign of the triangle's normal along the axis: -1, +1
    double parameter;        // along the edge, [0, 1]
    std::uint32_t triangle;  // of the mesh
};

/// All crossings of a grid's edges, sorted by axis, then line (v, u), then node,
/// parameter, triangle. A line of axis a is numbered by its node coordinates
/// u = (a+1)%3 and v = (a+2)%3.
struct GridCrossings {
    std::vector<EdgeCrossing> crossings;
    /// First crossing of each axis; four entries.
    std::size_t axis_begin[4];
    /// Crossings that lie on a line but beyond the grid's last or before its
    /// first node, as winding steps: for closed meshes inside the grid, zero.
    std::size_t beyond_grid = 0;
};

/// Crosses the three families of grid lines with the mesh, without tolerance:
/// vertices are snapped to an integer lattice of 2^20 steps a cell and every
/// decision is the sign of an integer determinant, the grid being shifted by
/// infinitesimals (e1 >> e2 >> e3) so that no node lies on a triangle and no
/// line meets an edge (simulation of simplicity, Edelsbrunner and Muecke 1990).
/// So a line meets neighbouring triangles exactly once between them, crosses a
/// closed oriented mesh with directions that sum to zero, and the three families
/// agree on which nodes are inside. Triangles far outside the grid are clipped.
/// Triangles without area in a projection cross no line of that family.
GridCrossings sweep_grid(const RestGrid& grid, const TriangleMesh& mesh,
                         const Parallel& parallel = Parallel(1));

/// Unit normal of a triangle of the mesh; zero where it has no area.
Vec3 triangle_normal(const TriangleMesh& mesh, std::uint32_t triangle);

}  // namespace splitcubes::geometry
