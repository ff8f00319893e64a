// Signed distances at grid nodes, as images for contouring by other libraries.
#pragma once

#include <splitcubes/geometry/node_winding.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace splitcubes::bench {

/// Returns the squared distance of a point from a triangle: over the plane if the point's foot lies within
/// the three sides, else over the nearest side.
inline double squared_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 normal = (b - a).cross(c - a);
    const auto side = [&](const Vec3& q, const Vec3& r) { return normal.dot((r - q).cross(p - q)); };
    if (normal.squaredNorm() > 0 && side(a, b) >= 0 && side(b, c) >= 0 && side(c, a) >= 0) {
        const double height = normal.dot(p - a);
        return height * height / normal.squaredNorm();
    }
    const auto from_segment = [&](const Vec3& q, const Vec3& r) {
        const Vec3 along = r - q;
        const double length2 = along.squaredNorm();
        const double s = length2 > 0 ? std::clamp(along.dot(p - q) / length2, 0.0, 1.0) : 0;
        return (p - q - s * along).squaredNorm();
    };
    return std::min({from_segment(a, b), from_segment(b, c), from_segment(c, a)});
}

/// Returns the distance of each node (x fastest) from a closed mesh, negative inside; exact within two cells
/// of the mesh, clamped to three cells.
inline std::vector<float> node_distances(const geometry::RestGrid& grid, const geometry::TriangleMesh& mesh) {
    const Vec3i n = grid.node_count;
    const auto index = [&](int x, int y, int z) {
        return static_cast<std::size_t>(x) +
               static_cast<std::size_t>(n[0]) *
                   (static_cast<std::size_t>(y) +
                    static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(z));
    };
    const double far = 3 * grid.cell_size;
    std::vector<double> squared(index(0, 0, n[2]), far * far);
    for (const geometry::Triangle& t : mesh.triangles) {
        const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
        const Vec3i low = (grid.to_grid(a.cwiseMin(b).cwiseMin(c)).array() - 2).ceil().cast<int>().max(0);
        const Vec3i high =
            (grid.to_grid(a.cwiseMax(b).cwiseMax(c)).array() + 2).floor().cast<int>().min(n.array() - 1);
        for (int z = low[2]; z <= high[2]; ++z)
            for (int y = low[1]; y <= high[1]; ++y)
                for (int x = low[0]; x <= high[0]; ++x) {
                    double& d = squared[index(x, y, z)];
                    d = std::min(d, squared_distance(grid.node_position({x, y, z}), a, b, c));
                }
    }
    std::vector<float> out(squared.size());
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = static_cast<float>(std::sqrt(squared[k]));
    for (const geometry::WindingRun& run : geometry::node_windings(grid, mesh))
        for (int x = run.first; x < run.last; ++x) out[index(x, run.y, run.z)] *= -1;
    return out;
}

}  // namespace splitcubes::bench
