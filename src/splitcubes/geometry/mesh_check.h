// What a triangle mesh is: closed, oriented, manifold, in how many parts.
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
    std::size_t non_manifold_edges = 0;     // with more than two
    std::size_t misoriented_edges = 0;      // with two triangles that run along it the same way
    std::size_t unbalanced_edges = 0;       // run along more often one way than the other
    std::size_t non_manifold_vertices = 0;  // whose triangles form more than one fan
    std::size_t degenerate_triangles = 0;   // with a repeated vertex
    std::size_t non_finite_vertices = 0;
    std::vector<MeshPart> parts;  // connected through shared vertices, largest |volume| first
    double volume = 0;            // m^3, signed
    double area = 0;              // m^2

    /// Every edge is run along as often one way as the other: the mesh is a cycle
    /// and winding numbers about it are integers, even where edges have four triangles.
    bool closed() const { return triangles > 0 && unbalanced_edges == 0 && degenerate_triangles == 0; }
    /// Exactly two triangles an edge, running opposite ways.
    bool oriented() const { return non_manifold_edges == 0 && misoriented_edges == 0; }
    /// Edges with at most two triangles, one fan a vertex.
    bool manifold() const { return non_manifold_edges == 0 && non_manifold_vertices == 0; }
    bool valid() const {
        return closed() && oriented() && manifold() && boundary_edges == 0 && non_finite_vertices == 0;
    }
};

/// By index: vertices at the same place but with different indices are different
/// (weld first where a format keeps none). O(n log n).
MeshCheck check_mesh(const TriangleMesh& mesh);

/// An edge that is run along more often one way than the other: |balance| times.
/// They are the boundary of the mesh as a chain; a closed mesh has none.
struct UnbalancedEdge {
    std::uint32_t low, high;  // vertices
    std::uint32_t balance;
};
std::vector<UnbalancedEdge> unbalanced_edges(const TriangleMesh& mesh);

/// MeshCheck::closed() alone, faster. O(n).
bool is_closed(const TriangleMesh& mesh);

/// The mesh with vertices of bitwise equal position merged (0 and -0 equal) and
/// triangles that collapse left out. Order is kept.
TriangleMesh weld_equal_vertices(const TriangleMesh& mesh);

/// Number of the connected part (through shared vertices) of each triangle,
/// numbered by first triangle.
std::vector<std::int32_t> triangle_parts(const TriangleMesh& mesh, std::size_t& part_count);

}  // namespace splitcubes::geometry
