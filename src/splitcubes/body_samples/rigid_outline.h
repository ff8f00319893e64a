// Contact points of rigid pieces, taken from the surface that is drawn.
#pragma once

#include <splitcubes/math/types.h>

#include <span>
#include <vector>

namespace splitcubes::splitting {
class NodeGrid;
class Surface;
}  // namespace splitcubes::splitting

namespace splitcubes::body {

/// Returns vertices that stand for the convex hull of a piece: the outermost ones in many directions, and
/// those between them on its faces, about half a cell apart; m, rest space. nodes: of the piece, in grid
/// coordinates.
std::vector<Vec3> rigid_outline(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                                std::span<const Vec3i> nodes);

}  // namespace splitcubes::body
