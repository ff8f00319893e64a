// Topological checks of a triangle mesh: closed, oriented, manifold, connected parts.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace splitcubes::geometry {

struct MeshPart {
    std::size_t triangles = 0;
    double volume = 0;  // m^3, signed
    double area = 0;    // m^2
};

struct MeshCheck {
    std::size_t vertices = 0;  // used by a triangle
    std::size_t triangles = 0;
    std::size_t boundary_edges = 0;         // with one triangle
    std::size_t non_manifold_edges = 0;     // with more than two triangles
    std::size_t misoriented_edges = 0;      // with two triangles that use it in the same direction
    std::size_t unbalanced_edges = 0;       // used more often in one direction than in the other
    std::size_t non_manifold_vertices = 0;  // whose triangles form more than one fan
    std::size_t degenerate_triangles = 0;   // with a repeated vertex
    std::size_t non_finite_vertices = 0;
    std::vector<MeshPart> parts;  // connected through shared vertices, largest |volume| first
    double volume = 0;            // m^3, signed
    double area = 0;              // m^2

    /// Every edge is used equally often in both directions: the mesh is a cycle and winding
    /// numbers about it are integers, even if edges have four triangles.
    bool closed() const { return triangles > 0 && unbalanced_edges == 0 && degenerate_triangles == 0; }
    /// No edge has more than two triangles, and two use it in opposite directions.
    bool oriented() const { return non_manifold_edges == 0 && misoriented_edges == 0; }
    /// Edges have at most two triangles, vertices one fan.
    bool manifold() const { return non_manifold_edges == 0 && non_manifold_vertices == 0; }
    bool valid() const {
        return closed() && oriented() && manifold() && boundary_edges == 0 && non_finite_vertices == 0;
    }
};

/// Checks a mesh by vertex index: vertices at the same position with different indices are
/// different (weld first if a format has no indices). O(n log n).
MeshCheck check_mesh(const TriangleMesh& mesh);

/// An edge that is used `balance` times more often in one direction than in the other.
/// These edges are the boundary of the mesh as a chain; a closed mesh has none.
struct UnbalancedEdge {
    std::uint32_t low, high;  // vertices
    std::uint32_t balance;
};
std::vector<UnbalancedEdge> unbalanced_edges(const TriangleMesh& mesh);

/// Returns MeshCheck::closed() alone, faster. O(n).
bool is_closed(const TriangleMesh& mesh);

/// Returns the mesh with vertices of bitwise equal position merged (0 and -0 are equal)
/// and without triangles that collapse. Keeps the order.
TriangleMesh weld_equal_vertices(const TriangleMesh& mesh);

/// Returns the index of each triangle's connected part (through shared vertices); parts are
/// ordered by their first triangle.
std::vector<std::int32_t> triangle_parts(const TriangleMesh& mesh, std::size_t& part_count);

}  // namespace splitcubes::geometry
