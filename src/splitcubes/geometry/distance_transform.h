// Distance transform over a lattice of points.
#pragma once

#include <splitcubes/math/types.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::geometry {

/// Returns the squared distance, in lattice steps, from each point of a lattice (x fastest) to the nearest
/// marked point; infinity everywhere if none is marked. Exact and O(points) (Felzenszwalb and Huttenlocher
/// 2012).
std::vector<float> squared_distances(const Vec3i& count, std::span<const std::uint8_t> marked);

}  // namespace splitcubes::geometry
