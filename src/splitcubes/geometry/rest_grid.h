// Regular grid of rest space.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/geometry/coordinate_limit.h>
#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/math/types.h>

namespace splitcubes::geometry {

/// Nodes at origin + cell_size * (i, j, k), 0 <= (i, j, k) < node_count.
struct RestGrid {
    Vec3 origin = Vec3::Zero();        // m, rest space
    double cell_size = 1;              // m
    Vec3i node_count = Vec3i::Zero();  // per axis

    Vec3 node_position(const Vec3i& node) const { return origin + cell_size * node.cast<double>(); }
    /// Returns a rest point in cells, relative to node (0, 0, 0).
    Vec3 to_grid(const Vec3& rest) const { return (rest - origin) / cell_size; }
    bool contains(const Vec3i& node) const {
        return (node.array() >= 0).all() && (node.array() < node_count.array()).all();
    }
    /// For checkpoints.
    template <class Archive>
    void serialize(Archive& archive) {
        archive(origin, cell_size, node_count);
    }
};

/// Maximum number of cells along an axis of a grid.
inline constexpr int max_cells_per_axis = 1024;

/// Returns a grid that covers `box` with at least one layer of nodes outside on every
/// side. Its nodes are symmetric about the box's centre and, of the two such choices, as
/// far as possible from the box's faces (a surface exactly through nodes is legal but
/// less accurate).
/// Throws InputError if cell_size is not positive or gives too many cells, or if the box
/// extends beyond max_coordinate.
RestGrid grid_around(const Box& box, double cell_size);

/// Returns the cell size for `cells` cells along the longest side of `box`.
double cell_size_for(const Box& box, int cells);
/// Returns the same for the bounds of a mesh along the axes that it follows (shape_frame).
double cell_size_for(const TriangleMesh& mesh, int cells);

}  // namespace splitcubes::geometry
