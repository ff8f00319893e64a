// Indexed triangle meshes for input and output.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/geometry/mesh_attributes.h>
#include <splitcubes/math/types.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::geometry {

using Triangle = std::array<std::uint32_t, 3>;

/// Triangles over shared vertices, counter-clockwise seen from outside.
struct TriangleMesh {
    std::vector<Vec3> positions;      // m
    std::vector<Triangle> triangles;  // indices into positions

    Box bounds() const;
    /// Returns the signed volume by the divergence theorem, m^3; meaningful for closed meshes.
    double volume() const;
    /// m^2
    double area() const;
    /// Appends another mesh and offsets its indices.
    void append(const TriangleMesh& other);
};

/// Returns the triangles of the given indices, with the vertices that they use.
TriangleMesh part_of(const TriangleMesh& mesh, std::span<const std::uint32_t> triangles);

/// Origin of a triangle of a body's surface.
enum class Origin : std::uint8_t {
    boundary = 0,  // surface of the input mesh
    cut = 1,       // created by a cut
};

/// A body's surface: the mesh and data per vertex and triangle. Each array is either
/// empty or has one entry per element.
struct SurfaceMesh {
    TriangleMesh mesh;
    std::vector<Vec3> normals;                    // per vertex, unit, outward
    std::vector<std::int32_t> vertex_piece;       // per vertex, id of the connected part
    std::vector<Origin> triangle_origin;          // per triangle
    std::vector<Vec3> rest = {};                  // per vertex, m, rest space
    MeshAttributes attributes = {};               // of the mesh's triangles
    std::vector<std::int32_t> vertex_body = {};   // per vertex, number of the body
    std::vector<std::int32_t> triangle_cut = {};  // per triangle, number of the cut that made it; -1: none

    /// Appends another surface; arrays that only one of the two has are dropped, except for
    /// `attributes` (see MeshAttributes::append).
    void append(const SurfaceMesh& other);
};

}  // namespace splitcubes::geometry
