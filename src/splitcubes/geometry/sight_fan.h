// Segments from one point to several others through a surface, all at once.
#pragma once

#include <splitcubes/geometry/occluder_grid.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace splitcubes::geometry {

/// How many segments blocked_segments takes.
inline constexpr std::size_t most_fan_segments = 32;

/// Bit k: whether OccluderGrid::segment_blocked(from, to[k]). Triangles near the point are put beside the
/// segments in packs, in single precision; what that leaves open is decided in double. to: m, rest space, at
/// most most_fan_segments. by: of each blocked segment the id of a triangle that it meets (as of
/// OccluderGrid::blocker), the others stay; room for as many, or nullptr.
std::uint32_t blocked_segments(const OccluderGrid& occluders, const Vec3& from, std::span<const Vec3> to,
                               std::uint32_t* by = nullptr);

}  // namespace splitcubes::geometry
