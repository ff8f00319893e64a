// Displacements with known stress, and meshes to find them on.
#pragma once

#include <tetrahedra/elasticity.h>

#include <algorithm>

namespace splitcubes::fixtures {

/// A box of cells with its lowest corner at the origin.
inline tetrahedra::Mesh box_of(const Vec3& lengths, const Vec3i& cells, tetrahedra::Order order) {
    std::array<std::vector<double>, 3> ends;
    for (std::size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Eigen::Index>(k);
        ends[k] = tetrahedra::divide({0, lengths[axis]}, cells[axis]);
    }
    return tetrahedra::make_box(ends, order);
}

/// The values of a field at the nodes.
template <class Field>
tetrahedra::Vector at_nodes_of(const tetrahedra::Mesh& mesh, const Field& field) {
    tetrahedra::Vector values(static_cast<Eigen::Index>(3 * mesh.nodes.size()));
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
        tetrahedra::entries_of(values, i) = field(mesh.nodes[i]);
    return values;
}

/// Nodes that satisfy a condition are held where a field moves them.
template <class Condition, class Field>
tetrahedra::Held held_where(const tetrahedra::Mesh& mesh, const Condition& condition, const Field& field) {
    tetrahedra::Held held(mesh.nodes.size());
    for (std::size_t i = 0; i < held.size(); ++i)
        if (condition(mesh.nodes[i])) held[i] = field(mesh.nodes[i]);
    return held;
}

}  // namespace splitcubes::fixtures
