// Fronts of sheets: where a cut ends within a face of the grid. An edge is cut or not; the front tells how
// far the sheet has come beyond its last cut edges.
#pragma once

#include <splitcubes/splitting/node_grid.h>
#include <splitcubes/splitting/placement.h>

#include <optional>
#include <span>
#include <vector>

namespace splitcubes::splitting {

/// Returns the faces beside these cut edges in which their sheets end.
std::vector<CutFront> fronts_beside(const NodeGrid& grid, std::span<const std::int32_t> slots);

/// Returns corner k of a face's ring (see cube.h).
Vec3i ring_node(const GridFace& face, int k);

/// Returns the way of the sheet through a face in which it ends; cells, from the face's node along the two
/// axes that follow its own.
FrontRay ray_of(const NodeGrid& grid, const CutFront& front);

/// Returns how far a point of the sheet in or near the face is along the way, as a share of it; none for a
/// point that is not in the face, or for a way of no length.
std::optional<double> share_along(const FrontRay& ray, const Vec2& point);

/// Returns the step of NodeGrid::move_front nearest to a share of the way.
int step_at(double share);
/// Returns the step for a front that moves: one of eight at equal distances, also from face to face, as each
/// change costs the visibility of what is near.
int moving_step_at(double share);

}  // namespace splitcubes::splitting
