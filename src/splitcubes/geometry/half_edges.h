// Half-edges of a mesh, sorted by edge.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace splitcubes::geometry {

struct HalfEdge {
    std::uint32_t low, high;  // vertices of the undirected edge
    bool forward;             // the triangle runs from low to high
    std::uint32_t triangle;
};

/// Returns whether a triangle uses a vertex twice.
inline bool is_degenerate(const Triangle& t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

/// Returns the half-edges of all non-degenerate triangles, sorted by low end, high end,
/// triangle. A counting pass, then short sorts.
std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh);

}  // namespace splitcubes::geometry
