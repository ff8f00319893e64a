// Sheets, boxes and random scenes between phyxels.
#pragma once

#include <splitcubes/core/random.h>
#include <splitcubes/geometry/occluder_grid.h>
#include <splitcubes/occlusion/disk.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace splitcubes::occlusion::testing {

using Triangles = std::vector<geometry::OccluderTriangle>;

/// Returns how often to repeat a random trial: fewer times with asserts and sanitizers, which make each one
/// slow.
inline int repetitions(int count) {
#ifdef NDEBUG
    return count;
#else
    return count / 20 + 1;
#endif
}

inline Vec3 random_in_box(Random& random, double half) {
    const double x = random.uniform(-half, half), y = random.uniform(-half, half);
    return {x, y, random.uniform(-half, half)};
}

inline Quat random_turn(Random& random) {
    Eigen::Vector4d q(1, 0, 0, 0);
    do
        for (int k = 0; k < 4; ++k) q[k] = random.uniform(-1, 1);
    while (q.norm() > 1 || q.norm() < 0.1);
    return Quat(q).normalized();
}

/// Puts all triangles in one grid, each in the cell of its first corner (clamped).
inline geometry::OccluderGrid grid_of(const Triangles& triangles, double cell_size = 0.25, int cells = 16) {
    const Vec3 origin = Vec3::Constant(-0.5 * cells * cell_size);
    geometry::OccluderGrid grid(origin, cell_size, Vec3i::Constant(cells));
    std::vector<Triangles> by_cell(static_cast<std::size_t>(cells * cells * cells));
    for (const auto& t : triangles) {
        const Vec3i c =
            ((t.corner[0] - origin) / cell_size).array().floor().max(0).min(cells - 1).cast<int>();
        by_cell[static_cast<std::size_t>(c[0] + cells * (c[1] + cells * c[2]))].push_back(t);
    }
    for (int k = 0; k < cells * cells * cells; ++k)
        grid.set_cell({k % cells, k / cells % cells, k / cells / cells},
                      by_cell[static_cast<std::size_t>(k)]);
    return grid;
}

/// Returns a raster of quads over [u0, u1] x [v0, v1] mapped by `point_at`: inner vertices are moved at
/// random in the plane, each quad is split along a random diagonal, and corners are in a random rotation.
inline Triangles sheet(Random& random, double u0, double u1, double v0, double v1, int quads,
                       const std::function<Vec3(double, double)>& point_at) {
    const int n = quads + 1;
    std::vector<Vec3> at(static_cast<std::size_t>(n * n));
    const double du = (u1 - u0) / quads, dv = (v1 - v0) / quads;
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            double u = i == quads ? u1 : u0 + i * du, v = j == quads ? v1 : v0 + j * dv;
            if (i > 0 && i < quads) u += random.uniform(-0.3, 0.3) * du;
            if (j > 0 && j < quads) v += random.uniform(-0.3, 0.3) * dv;
            at[static_cast<std::size_t>(j * n + i)] = point_at(u, v);
        }
    Triangles out;
    const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
        const std::array<Vec3, 3> p{a, b, c};
        const std::uint32_t turn = random.below(3);
        const bool flip = random.below(2) == 1;
        geometry::OccluderTriangle t;
        for (std::uint32_t k = 0; k < 3; ++k) t.corner[flip ? 2 - k : k] = p[(k + turn) % 3];
        out.push_back(t);
    };
    for (int j = 0; j < quads; ++j)
        for (int i = 0; i < quads; ++i) {
            const auto v = [&](int di, int dj) {
                return at[static_cast<std::size_t>((j + dj) * n + i + di)];
            };
            if (random.below(2)) {
                add(v(0, 0), v(1, 0), v(1, 1));
                add(v(0, 0), v(1, 1), v(0, 1));
            } else {
                add(v(0, 0), v(1, 0), v(0, 1));
                add(v(1, 0), v(1, 1), v(0, 1));
            }
        }
    return out;
}

/// Returns the six sides of a box, quads x quads quads per side, as boundary.
inline Triangles box_boundary(Random& random, const Vec3& low, const Vec3& high, int quads) {
    Triangles out;
    for (int axis = 0; axis < 3; ++axis)
        for (const double level : {low[axis], high[axis]}) {
            const int i = (axis + 1) % 3, j = (axis + 2) % 3;
            const auto point_at = [&](double u, double v) {
                Vec3 p;
                p[axis] = level;
                p[i] = u;
                p[j] = v;
                return p;
            };
            for (auto t : sheet(random, low[i], high[i], low[j], high[j], quads, point_at)) {
                t.boundary = true;
                out.push_back(t);
            }
        }
    return out;
}

inline Triangles moved(const Triangles& triangles, const Isometry& motion) {
    Triangles out = triangles;
    for (auto& t : out)
        for (Vec3& p : t.corner) p = motion * p;
    return out;
}

inline Isometry motion_of(const Quat& turn, const Vec3& shift) {
    Isometry motion = Isometry::Identity();
    motion.linear() = turn.toRotationMatrix();
    motion.translation() = shift;
    return motion;
}

}  // namespace splitcubes::occlusion::testing
