// The edges of a mesh with the triangles that run along them.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace splitcubes::geometry {

struct HalfEdge {
    std::uint32_t low, high;  // the undirected edge
    bool forward;             // runs low to high
    std::uint32_t triangle;
};

/// Uses a vertex twice.
inline bool is_degenerate(const Triangle& t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

/// Of all triangles that are not degenerate, by low end, then high end, then
/// triangle. A counting pass, then short sorts.
std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh);

}  // namespace splitcubes::geometry
