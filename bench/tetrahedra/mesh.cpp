#include "mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>

namespace splitcubes::tetrahedra {

namespace {

constexpr double same = 1e-9;  // m: coordinates that differ by less are equal

// The nodes of a box of cells: corners, and between them the middles that quadratic elements have.
struct Lattice {
    Lattice(const Vec3i& cell_count, Order order)
        : cells(cell_count), step(static_cast<int>(order)), nodes(step * cells + Vec3i::Ones()) {}
    int index(const Vec3i& node) const { return node[0] + nodes[0] * (node[1] + nodes[1] * node[2]); }
    bool is_at_surface(const Vec3i& node) const {
        return (node.array() == 0).any() || (node.array() == nodes.array() - 1).any();
    }

    Vec3i cells;
    int step;     // nodes from corner to corner
    Vec3i nodes;  // along each axis
};

template <class Visit>
void for_each_index(const Vec3i& count, const Visit& visit) {
    Vec3i at;
    for (at[2] = 0; at[2] < count[2]; ++at[2])
        for (at[1] = 0; at[1] < count[1]; ++at[1])
            for (at[0] = 0; at[0] < count[0]; ++at[0]) visit(at);
}

// Adds the six tetrahedra around the diagonal of a cell, along the axes that are not mirrored from their low
// to their high end.
void add_cell(const Lattice& lattice, const Vec3i& cell, const std::array<bool, 3>& mirrored, Mesh& mesh) {
    std::array<int, 3> axes{0, 1, 2};
    do {
        std::array<Vec3i, 4> corners;
        for (int axis = 0; axis < 3; ++axis) corners[0][axis] = mirrored[static_cast<std::size_t>(axis)];
        for (std::size_t k = 0; k < 3; ++k) {
            corners[k + 1] = corners[k];
            corners[k + 1][axes[k]] = 1 - corners[k][axes[k]];
        }
        Mat3 edges;
        for (int k = 0; k < 3; ++k)
            edges.col(k) = (corners[static_cast<std::size_t>(k) + 1] - corners[0]).cast<double>();
        if (edges.determinant() < 0) std::swap(corners[2], corners[3]);
        for (Vec3i& corner : corners) corner = lattice.step * (cell + corner);
        std::array<int, 10> element{};
        for (std::size_t k = 0; k < 4; ++k) element[k] = lattice.index(corners[k]);
        if (mesh.order == Order::quadratic)
            for (std::size_t e = 0; e < 6; ++e) {
                const auto [a, b] = edge_corners[e];
                const Vec3i sum = corners[static_cast<std::size_t>(a)] + corners[static_cast<std::size_t>(b)];
                element[4 + e] = lattice.index(sum / 2);
            }
        mesh.elements.push_back(element);
    } while (std::next_permutation(axes.begin(), axes.end()));
}

// Moves the middles of the edges between their corners, but for those that stay.
void straighten(const std::vector<bool>& stays, Mesh& mesh) {
    for (const std::array<int, 10>& element : mesh.elements)
        for (std::size_t e = 0; e < 6; ++e) {
            const auto node = static_cast<std::size_t>(element[4 + e]);
            if (stays[node]) continue;
            const auto corner = [&](int k) {
                return mesh.nodes[static_cast<std::size_t>(element[static_cast<std::size_t>(k)])];
            };
            mesh.nodes[node] = 0.5 * (corner(edge_corners[e][0]) + corner(edge_corners[e][1]));
        }
}

}  // namespace

std::vector<double> divide(const std::vector<double>& breaks, int cells) {
    std::vector<int> count(breaks.size() - 1, 1);
    const auto cell_size = [&](std::size_t k) { return (breaks[k + 1] - breaks[k]) / count[k]; };
    for (int used = static_cast<int>(count.size()); used < cells; ++used) {
        std::size_t largest = 0;
        for (std::size_t k = 1; k < count.size(); ++k)
            if (cell_size(k) > cell_size(largest) + same) largest = k;
        ++count[largest];
    }
    std::vector<double> ends;
    for (std::size_t k = 0; k < count.size(); ++k)
        for (int i = 0; i < count[k]; ++i) ends.push_back(breaks[k] + cell_size(k) * i);
    ends.push_back(breaks.back());
    return ends;
}

Mesh make_box(const std::array<std::vector<double>, 3>& coordinates, Order order) {
    Vec3i cells;
    for (int axis = 0; axis < 3; ++axis)
        cells[axis] = static_cast<int>(coordinates[static_cast<std::size_t>(axis)].size()) - 1;
    const Lattice lattice(cells, order);
    Mesh mesh{order, {}, {}};
    for_each_index(lattice.nodes, [&](const Vec3i& node) {
        Vec3 position;
        for (int axis = 0; axis < 3; ++axis) {
            const std::vector<double>& ends = coordinates[static_cast<std::size_t>(axis)];
            const auto low = static_cast<std::size_t>(node[axis] / lattice.step);
            const bool is_middle = node[axis] % lattice.step != 0;
            position[axis] = is_middle ? 0.5 * (ends[low] + ends[low + 1]) : ends[low];
        }
        mesh.nodes.push_back(position);
    });
    for_each_index(cells, [&](const Vec3i& cell) {
        add_cell(lattice, cell, {cell[0] % 2 == 1, cell[1] % 2 == 1, cell[2] % 2 == 1}, mesh);
    });
    return mesh;
}

Mesh make_ball(double radius, const Vec3i& cells, Order order) {
    const Lattice lattice(cells, order);
    Mesh mesh{order, {}, {}};
    std::vector<bool> at_surface;
    for_each_index(lattice.nodes, [&](const Vec3i& node) {
        const Vec3 in_cube =
            2 * node.cast<double>().cwiseQuotient((lattice.nodes - Vec3i::Ones()).cast<double>()) -
            Vec3::Ones();
        const double length = in_cube.norm();
        mesh.nodes.push_back(length > 0 ? Vec3(radius * in_cube.cwiseAbs().maxCoeff() / length * in_cube)
                                        : Vec3(Vec3::Zero()));
        at_surface.push_back(lattice.is_at_surface(node));
    });
    for_each_index(cells, [&](const Vec3i& cell) {
        add_cell(lattice, cell,
                 {2 * cell[0] < cells[0] - 1, 2 * cell[1] < cells[1] - 1, 2 * cell[2] < cells[2] - 1}, mesh);
    });
    if (order == Order::quadratic) straighten(at_surface, mesh);
    return mesh;
}

void open_slit(Mesh& mesh, double x, const std::function<bool(const Vec3&)>& is_open) {
    std::map<int, int> copies;
    const std::size_t node_count = mesh.nodes.size();
    for (std::size_t i = 0; i < node_count; ++i) {
        const Vec3 position = mesh.nodes[i];
        if (std::abs(position.x() - x) > same || !is_open(position)) continue;
        copies[static_cast<int>(i)] = static_cast<int>(mesh.nodes.size());
        mesh.nodes.push_back(position);
    }
    for (std::array<int, 10>& element : mesh.elements) {
        double centre = 0;
        for (std::size_t k = 0; k < 4; ++k)
            centre += 0.25 * mesh.nodes[static_cast<std::size_t>(element[k])].x();
        if (centre < x) continue;
        for (int k = 0; k < mesh.nodes_per_element(); ++k) {
            const auto copy = copies.find(element[static_cast<std::size_t>(k)]);
            if (copy != copies.end()) element[static_cast<std::size_t>(k)] = copy->second;
        }
    }
}

}  // namespace splitcubes::tetrahedra
