// Distances over a lattice of points.
#pragma once

#include <splitcubes/math/types.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::geometry {

/// From each point of a lattice, x fastest, to the nearest point that is marked, squared, in steps of the
/// lattice; infinity everywhere where none is marked. Exact, in time proportional to the points
/// (Felzenszwalb and Huttenlocher 2012).
std::vector<float> squared_distances(const Vec3i& count, std::span<const std::uint8_t> marked);

}  // namespace splitcubes::geometry
