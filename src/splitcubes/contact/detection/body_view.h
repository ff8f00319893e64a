// Read-only view of a body for contact search and the contacts of rigid fragments.
#pragma once

#include <splitcubes/contact/response/contact.h>
#include <splitcubes/samples/rigid_pieces.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace splitcubes {
namespace geometry {
class OccluderGrid;
}
namespace meshless {
struct Phyxels;
class PhyxelLocator;
}  // namespace meshless
namespace splitting {
class NodeGrid;
class Pieces;
class Surface;
}  // namespace splitting
}  // namespace splitcubes

namespace splitcubes::body {

class NodeTracker;
class SurfaceChanges;
class SurfaceMotion;
class SurfaceSampler;

/// The parts of a body that contacts depend on. Valid until a step of the body begins, or the body is loaded.
struct BodyView {
    const splitting::NodeGrid& grid;
    const splitting::Surface& surface;
    const splitting::Pieces& pieces;
    const geometry::OccluderGrid& occluders;
    const SurfaceChanges& surface_changes;  // regions in which the occluders may have changed
    const SurfaceSampler& sampler;          // chooses the samples of the surface
    const SurfaceMotion& surface_motion;    // moves its vertices
    const NodeTracker& nodes;
    meshless::Phyxels& phyxels;              // RigidContacts pushes them
    const meshless::PhyxelLocator& locator;  // of the rest positions of the phyxels
    double spacing;                          // m, between phyxels
    bool is_lattice_driven;  // a deformation model moves the body: it takes no part in contacts
    std::span<const meshless::RigidKinematicTarget> kinematic_rigid_pieces;  // of the last step
    bool is_pulled;                                                          // it has handles

    /// Whether a constraint moves a rigid piece in the last step. index: in RigidPieces::bodies.
    bool holds_rigid(std::size_t index) const;
    /// Returns the tracked node with the largest weight at a surface vertex.
    std::uint32_t dominant_node(std::uint32_t vertex) const;
    /// Returns the phyxels of a piece with the largest weights at a surface vertex; never empty. node: the
    /// vertex's dominant_node. part: index of this body in its contact island.
    meshless::ContactSide influences_of(std::uint32_t vertex, std::uint32_t node, std::int32_t piece,
                                        std::uint32_t part) const;
};

}  // namespace splitcubes::body
