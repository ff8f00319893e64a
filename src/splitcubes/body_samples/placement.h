// Places of the phyxels of an uncut body.
#pragma once

#include <splitcubes/math/types.h>

#include <optional>
#include <vector>

namespace splitcubes::body {

struct SampleContext;
struct SampleSettings;

/// Returns the rest positions, m, of the phyxels of an uncut body and sets their spacing, m: a lattice,
/// clipped to the material, of which the points near the surface move to centroids if the settings say so. No
/// point of the material is farther than about a spacing from a phyxel.
std::vector<Vec3> place_phyxels(const SampleContext& context, const SampleSettings& settings,
                                double& spacing);

/// Returns the candidate, m, rest space, if its nearest node is inside and sees it; that node's position if
/// the node is inside but does not see it, so that thin parts are sampled too; else nothing.
std::optional<Vec3> point_in_material(const SampleContext& context, const Vec3& candidate);

/// Returns the points, m, rest space, at which the boundary of the uncut body crosses edges of the grid.
std::vector<Vec3> boundary_points(const SampleContext& context);

}  // namespace splitcubes::body
