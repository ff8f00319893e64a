// Shapes for the render tests, with outlines known in closed form.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

#include <cmath>
#include <cstdint>
#include <numbers>

namespace splitcubes::test_shapes {

using geometry::TriangleMesh;

/// Returns a sphere of rings x 2 rings quads, each two triangles.
inline TriangleMesh sphere(const Vec3& center, double radius, std::uint32_t rings = 64) {
    TriangleMesh mesh;
    const std::uint32_t around = 2 * rings;
    for (std::uint32_t i = 1; i < rings; ++i) {
        const double polar = std::numbers::pi * i / rings;
        for (std::uint32_t j = 0; j < around; ++j) {
            const double turn = 2 * std::numbers::pi * j / around;
            mesh.positions.push_back(center + radius * Vec3(std::sin(polar) * std::cos(turn),
                                                            std::sin(polar) * std::sin(turn),
                                                            std::cos(polar)));
        }
    }
    const auto top = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(center + radius * Vec3::UnitZ());
    mesh.positions.push_back(center - radius * Vec3::UnitZ());
    for (std::uint32_t j = 0; j < around; ++j) {
        const std::uint32_t next = (j + 1) % around;
        mesh.triangles.push_back({top, j, next});
        for (std::uint32_t i = 0; i + 2 < rings; ++i) {
            const std::uint32_t a = i * around;
            mesh.triangles.push_back({a + j, a + around + j, a + around + next});
            mesh.triangles.push_back({a + j, a + around + next, a + next});
        }
        const std::uint32_t last = (rings - 2) * around;
        mesh.triangles.push_back({last + j, top + 1, last + next});
    }
    return mesh;
}

/// Returns an axis-aligned box with 8 shared corners.
inline TriangleMesh block(const Vec3& low, const Vec3& high) {
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i) {
        mesh.positions.emplace_back((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                                    (i & 4) != 0 ? high.z() : low.z());
    }
    // Two triangles per side: -x, +x, -y, +y, -z, +z.
    mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
    return mesh;
}

/// Returns a block cut across x = 0 into two pieces, `gap` metres apart; the two faces at the cut have origin
/// cut.
inline geometry::SurfaceMesh cut_block(double half_side, double gap) {
    using geometry::Origin;
    geometry::SurfaceMesh surface;
    const Vec3 corner = Vec3::Constant(half_side);
    surface.mesh = block(-corner - Vec3(gap / 2, 0, 0), Vec3(-gap / 2, half_side, half_side));
    surface.mesh.append(block(Vec3(gap / 2, -half_side, -half_side), corner + Vec3(gap / 2, 0, 0)));
    surface.vertex_piece.assign(16, 0);
    for (std::size_t v = 8; v < 16; ++v) surface.vertex_piece[v] = 1;
    surface.triangle_origin.assign(24, Origin::boundary);
    for (const std::size_t t : {2, 3, 12, 13}) surface.triangle_origin[t] = Origin::cut;
    return surface;
}

}  // namespace splitcubes::test_shapes
