// Contact points of rigid pieces, taken from the surface that is drawn.
#pragma once

#include <splitcubes/math/types.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {
struct RigidPiece;
struct RigidPieces;
}  // namespace splitcubes::meshless

namespace splitcubes::splitting {
class NodeGrid;
class Pieces;
class Surface;
}  // namespace splitcubes::splitting

namespace splitcubes::body {

/// Returns vertices that stand for the convex hull of a piece: the outermost ones in many directions, and
/// those between them on its faces, about half a cell apart; m, rest space. nodes: of the piece, in grid
/// coordinates.
std::vector<Vec3> rigid_outline(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                                std::span<const Vec3i> nodes);

/// Returns the contact points of a rigid piece, its outline; m, in its own frame.
std::vector<Vec3> contact_points(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                                 std::span<const Vec3i> nodes, const meshless::RigidPiece& body);

/// Sets the contact points of rigid pieces anew where `cells` of the surface were made again: a cut beside a
/// piece moves vertices of its surface.
void refresh_outlines(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                      const splitting::Pieces& pieces, std::span<const std::uint32_t> cells,
                      meshless::RigidPieces& rigid);

}  // namespace splitcubes::body
