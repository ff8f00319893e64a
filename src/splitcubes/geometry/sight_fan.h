// Segments from one point to several others through a surface, all at once.
#pragma once

#include <splitcubes/geometry/occluder_grid.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace splitcubes::geometry {

/// How many segments blocked_segments takes.
inline constexpr std::size_t most_fan_segments = 16;

/// Bit k: whether OccluderGrid::segment_blocked(from, to[k]). Triangles near the point are put beside the
/// segments in packs, in single precision; what that leaves open is decided in double. to: m, rest space, at
/// most most_fan_segments.
std::uint32_t blocked_segments(const OccluderGrid& occluders, const Vec3& from, std::span<const Vec3> to);

}  // namespace splitcubes::geometry
