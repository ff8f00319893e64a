// Vectorised search for points that face a query point.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace splitcubes::body {

/// Points as structure of arrays: positions, normals, displacements (w), additional displacements (a), m, and
/// extra reach, m. Each array is padded by facing_padding elements.
struct FacingLanes {
    const float *x, *y, *z, *nx, *ny, *nz, *wx, *wy, *wz, *ax, *ay, *az, *extra_reach;
};
inline constexpr std::size_t facing_padding = 16;

struct FacingQuery {
    float x, y, z, nx, ny, nz, wx, wy, wz, ax, ay, az;
    float radius;  // m, distance below which a point is near;
    float reach;   // m, distance, without the point's extra reach, below which it is within reach
    float cosine;  // dot product of the normals below which the point faces the query
    float height;  // m, above the plane through a point after the step, up to which the query is low
};
/// Points begin .. end - 1.
struct FacingRange {
    std::uint32_t begin, end;
};

/// Writes the indices of the points that are near, within reach and face the query to `out`, ascending, and
/// returns how many they are. `out` needs capacity for all points of the ranges and the padding. low: whether
/// the query is low above one of them.
std::size_t select_facing(const FacingLanes& lanes, std::span<const FacingRange> ranges,
                          const FacingQuery& query, std::uint32_t* out, bool& low);

}  // namespace splitcubes::body
