// Looking through points with normals in vectors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace splitcubes::body {

/// Points side by side: coordinates, those of normals, of ways, and of what may be added to those; how much
/// farther they are reached. Each array has room for facing_padding more.
struct FacingLanes {
    const float *x, *y, *z, *nx, *ny, *nz, *wx, *wy, *wz, *ax, *ay, *az, *farther;
};
inline constexpr std::size_t facing_padding = 16;

struct FacingQuery {
    float x, y, z, nx, ny, nz, wx, wy, wz, ax, ay, az;
    float radius;  // distance below which a point is near,
    float reach;   // and below which, with how much farther it is reached, it is within reach
    float cosine;  // of the normals, below which it faces
    float height;  // above the plane through it, after both ways, up to which the query is low
};
/// Points begin .. end - 1.
struct FacingRange {
    std::uint32_t begin, end;
};

/// Places in the lanes of the points that are near, within reach and face the query to `out`, ascending,
/// which has room for all and the padding; returns how many. low: whether the query is low above one of them.
std::size_t select_facing(const FacingLanes& lanes, std::span<const FacingRange> ranges,
                          const FacingQuery& query, std::uint32_t* out, bool& low);

}  // namespace splitcubes::body
