// The grid nodes inside the material of a body.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/samples/mass_lumping.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::splitting {
class NodeGrid;
class Pieces;
class Surface;
}  // namespace splitcubes::splitting

namespace splitcubes::body {

/// The grid nodes inside the material, in brick order, each with its share of the material. The nodes and
/// their volumes are those of the uncut body; only the pieces change. Arrays of one length.
struct MaterialNodes {
    std::vector<Vec3i> node;          // grid coordinates
    std::vector<Vec3> rest_position;  // m, rest space
    std::vector<double> volume;       // m^3; those of a piece sum to the volume its surface enclosed uncut
    std::vector<std::int32_t> piece;  // as of the last label_pieces
    std::vector<std::uint32_t> first_of_brick;  // per brick with nodes, its first node; one extra
    double cell_size = 0;                       // m

    std::size_t size() const { return node.size(); }
    double total_volume() const;
    /// Sets the pieces again after pieces split.
    void label_pieces(const splitting::NodeGrid& grid, const splitting::Pieces& pieces);
    /// Returns the edge lengths, m, descending, of the homogeneous box with the second moments of the volume
    /// of some nodes, each node being a cube of the grid.
    Vec3 extents_of(std::span<const std::uint32_t> nodes) const;
    /// Sets mass, rest centre and inertia of a rigid piece of some nodes from its shape. density: kg/m^3.
    void weigh(std::span<const std::uint32_t> nodes, double density, meshless::RigidPiece& body) const;
    /// Returns the arrays that mass lumping reads; the spans refer to this object.
    meshless::MaterialNodes for_lumping() const { return {rest_position, volume, piece}; }
};

/// Lengths, cells, by which the material of an inside node reaches along each axis: up to the boundary where
/// that crosses the edge, else half way to the next node.
struct NodeExtents {
    Vec3 below, above;
};
NodeExtents node_extents(const splitting::NodeGrid& grid, const Vec3i& node);

/// Lists the inside nodes of an uncut body.
MaterialNodes list_material_nodes(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                                  const splitting::Pieces& pieces, const Parallel& parallel);

}  // namespace splitcubes::body
