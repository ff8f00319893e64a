#include <splitcubes/core/compensated_sum.h>
#include <splitcubes/geometry/triangle_mesh.h>

namespace splitcubes::geometry {

Box TriangleMesh::bounds() const {
    Box box;
    for (const Triangle& t : triangles)
        for (const std::uint32_t v : t) box.add(positions[v]);
    return box;
}

double TriangleMesh::volume() const {
    if (triangles.empty()) return 0;
    // Relative to a vertex of the mesh, so that a body far from the origin loses no digits.
    const Vec3 origin = positions[triangles.front()[0]];
    CompensatedSum six_volumes;
    for (const Triangle& t : triangles) {
        const Vec3 a = positions[t[0]] - origin;
        const Vec3 b = positions[t[1]] - origin;
        const Vec3 c = positions[t[2]] - origin;
        six_volumes.add(a.dot(b.cross(c)));
    }
    return six_volumes.value() / 6;
}

double TriangleMesh::area() const {
    double twice_area = 0;
    for (const Triangle& t : triangles) {
        const Vec3& a = positions[t[0]];
        twice_area += (positions[t[1]] - a).cross(positions[t[2]] - a).norm();
    }
    return twice_area / 2;
}

void TriangleMesh::append(const TriangleMesh& other) {
    const auto shift = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), other.positions.begin(), other.positions.end());
    triangles.reserve(triangles.size() + other.triangles.size());
    for (const Triangle& t : other.triangles) triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
}

TriangleMesh part_of(const TriangleMesh& mesh, std::span<const std::uint32_t> triangles) {
    TriangleMesh out;
    std::vector<std::uint32_t> new_index(mesh.positions.size(), UINT32_MAX);
    for (const std::uint32_t t : triangles) {
        Triangle& copy = out.triangles.emplace_back(mesh.triangles[t]);
        for (std::uint32_t& v : copy) {
            if (new_index[v] == UINT32_MAX) {
                new_index[v] = static_cast<std::uint32_t>(out.positions.size());
                out.positions.push_back(mesh.positions[v]);
            }
            v = new_index[v];
        }
    }
    return out;
}

namespace {

/// Appends to an array, or clears it if one of the two is missing: arrays are empty or complete.
template <class Value>
void append_or_drop(std::vector<Value>& own, std::size_t own_count, const std::vector<Value>& other,
                    std::size_t other_count) {
    if (own.size() == own_count && other.size() == other_count)
        own.insert(own.end(), other.begin(), other.end());
    else
        own.clear();
}

}  // namespace

void SurfaceMesh::append(const SurfaceMesh& other) {
    const std::size_t vertices = mesh.positions.size(), more_vertices = other.mesh.positions.size();
    const std::size_t triangles = mesh.triangles.size(), more_triangles = other.mesh.triangles.size();
    append_or_drop(normals, vertices, other.normals, more_vertices);
    append_or_drop(vertex_piece, vertices, other.vertex_piece, more_vertices);
    append_or_drop(rest, vertices, other.rest, more_vertices);
    append_or_drop(vertex_body, vertices, other.vertex_body, more_vertices);
    append_or_drop(triangle_cut, triangles, other.triangle_cut, more_triangles);
    append_or_drop(triangle_origin, triangles, other.triangle_origin, more_triangles);
    attributes.append(triangles, other.attributes, more_triangles);
    mesh.append(other.mesh);
}

}  // namespace splitcubes::geometry
