// Meshes of tetrahedra on lattices: boxes and balls, with linear or quadratic elements.
#pragma once

#include <splitcubes/math/types.h>

#include <array>
#include <functional>
#include <vector>

namespace splitcubes::tetrahedra {

/// The order of the shape functions: elements have 4 or 10 nodes.
enum class Order { linear = 1, quadratic = 2 };

/// The corners of the edges whose middles are the nodes 4 to 9 of a quadratic element.
inline constexpr int edge_corners[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};

struct Mesh {
    int nodes_per_element() const { return order == Order::linear ? 4 : 10; }

    Order order = Order::linear;
    std::vector<Vec3> nodes;
    std::vector<std::array<int, 10>> elements;  // of linear ones only the first four entries count
};

/// Divides the intervals between increasing coordinates into cells, at least one each, so that the largest is
/// as small as possible. Returns the cells' ends.
std::vector<double> divide(const std::vector<double>& breaks, int cells);

/// A box whose cells lie between the coordinates of each axis. A cell is split into the six tetrahedra around
/// its diagonal (Kuhn), mirrored from cell to cell.
Mesh make_box(const std::array<std::vector<double>, 3>& coordinates, Order order);

/// A ball: a cube of so many cells whose concentric cubes are mapped to spheres. The diagonals run outwards,
/// so that no tetrahedron lies flat below the edges of the cube. Edges are straight, but for those of
/// quadratic elements at the surface.
Mesh make_ball(double radius, const Vec3i& cells, Order order);

/// Opens the mesh along a plane of its element faces: nodes at that x for which is_open holds are doubled,
/// and the elements beyond get the copies.
void open_slit(Mesh& mesh, double x, const std::function<bool(const Vec3&)>& is_open);

}  // namespace splitcubes::tetrahedra
