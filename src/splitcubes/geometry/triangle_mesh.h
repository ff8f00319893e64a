// Indexed triangle meshes, as they come in and as they go out.
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

/// Triangles over shared vertices. Counter-clockwise seen from outside.
struct TriangleMesh {
    std::vector<Vec3> positions;      // m
    std::vector<Triangle> triangles;  // indices into positions

    Box bounds() const;
    /// Signed volume by the divergence theorem, m^3; meaningful for closed meshes.
    double volume() const;
    /// m^2
    double area() const;
    /// Appends another mesh; its indices are shifted.
    void append(const TriangleMesh& other);
};

/// The triangles of the given numbers, with the vertices that they use.
TriangleMesh part_of(const TriangleMesh& mesh, std::span<const std::uint32_t> triangles);

/// Where a triangle of a body's surface comes from.
enum class Origin : std::uint8_t {
    boundary = 0,  // the surface that the input mesh had
    cut = 1,       // made by a cut
};

/// A body's surface: the mesh and what each vertex and triangle is. The
/// attribute arrays are either empty or as long as what they describe.
struct SurfaceMesh {
    TriangleMesh mesh;
    std::vector<Vec3> normals;               // per vertex, unit, outward
    std::vector<std::int32_t> vertex_piece;  // per vertex, number of the connected part
    std::vector<Origin> triangle_origin;     // per triangle
    std::vector<Vec3> rest = {};             // per vertex, m, rest space
    MeshAttributes attributes = {};          // of the mesh's triangles

    /// Appends another surface; what only one of the two has is dropped, but for
    /// `attributes`, see there.
    void append(const SurfaceMesh& other);
};

}  // namespace splitcubes::geometry
