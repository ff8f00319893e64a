// Rotated, moved, scaled and joined meshes, for tests of all modules.
#pragma once

#include <splitcubes/core/random.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

namespace splitcubes::laws {

/// Returns a direction uniform on the sphere.
inline Vec3 random_direction(Random& random) {
    const double z = random.uniform(-1, 1);
    const double angle = random.uniform(0, 2 * std::numbers::pi);
    const double ring = std::sqrt(1 - z * z);
    return {ring * std::cos(angle), ring * std::sin(angle), z};
}

inline Vec3 random_vector(Random& random, double largest) {
    const double x = random.uniform(-largest, largest);
    const double y = random.uniform(-largest, largest);
    return {x, y, random.uniform(-largest, largest)};
}

inline Quat random_rotation(Random& random) {
    const Vec3 axis = random_direction(random);
    return Quat(Eigen::AngleAxisd(random.uniform(0, 2 * std::numbers::pi), axis));
}

inline geometry::TriangleMesh turned(geometry::TriangleMesh mesh, const Quat& rotation) {
    for (Vec3& p : mesh.positions) p = rotation * p;
    return mesh;
}

inline geometry::TriangleMesh moved(geometry::TriangleMesh mesh, const Vec3& offset) {
    for (Vec3& p : mesh.positions) p += offset;
    return mesh;
}

inline geometry::TriangleMesh scaled(geometry::TriangleMesh mesh, double factor) {
    for (Vec3& p : mesh.positions) p *= factor;
    return mesh;
}

/// Returns the surface with reversed orientation.
inline geometry::TriangleMesh reversed(geometry::TriangleMesh mesh) {
    for (geometry::Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    return mesh;
}

inline geometry::TriangleMesh joined(geometry::TriangleMesh mesh, const geometry::TriangleMesh& other) {
    mesh.append(other);
    return mesh;
}

/// Returns a box between two corners; its vertices are exact to the last bit.
inline geometry::TriangleMesh box_between(const Vec3& low, const Vec3& high) {
    geometry::TriangleMesh mesh;
    for (int c = 0; c < 8; ++c)
        mesh.positions.emplace_back(c & 1 ? high[0] : low[0], c & 2 ? high[1] : low[1],
                                    c & 4 ? high[2] : low[2]);
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
}

/// Returns an octahedron with vertices on the axes through `center`.
inline geometry::TriangleMesh octahedron(const Vec3& center, double radius) {
    geometry::TriangleMesh mesh;
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-1.0, 1.0})
            mesh.positions.push_back(center + side * radius * Vec3::Unit(axis));
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
        geometry::Triangle t{octant & 1U, 2 + (octant >> 1 & 1U), 4 + (octant >> 2 & 1U)};
        // An odd number of negative axes mirrors the triangle.
        if ((std::popcount(octant) & 1) == 0) std::swap(t[1], t[2]);
        mesh.triangles.push_back(t);
    }
    return mesh;
}

/// Returns a tetrahedron oriented outwards for any order of its corners; its volume is zero if they are
/// coplanar.
inline geometry::TriangleMesh tetrahedron(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    geometry::TriangleMesh mesh;
    mesh.positions = {a, b, c, d};
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    return mesh.volume() < 0 ? reversed(mesh) : mesh;
}

}  // namespace splitcubes::laws
