// Phyxels at the centroids of their material.
#pragma once

#include <splitcubes/math/types.h>

#include <vector>

namespace splitcubes::body {

struct SampleContext;

/// Moves the phyxels near the surface of an uncut body to the centroid of the material that is nearer to them
/// than to others (Lloyd 1982), in rounds. A phyxel counts as near only where it is seen. A phyxel that would
/// hardly move stays, so that a lattice along a box remains one. positions: m, rest space; spacing: m, mean
/// distance of phyxels.
void move_to_centroids(const SampleContext& context, double spacing, std::vector<Vec3>& positions);

}  // namespace splitcubes::body
