// Meshes and blades as the caller holds them: views that are read during the call and not kept.
#pragma once

#include <splitcubes/api/types.h>

#include <cstdint>
#include <span>

namespace splitcubes {

/// A triangle mesh in arrays of the caller. A solid may be closed, open, self-intersecting or inside out; a
/// sheet is any set of triangles. Arrays of another length than their comment says, indices out of range and
/// positions that are not finite are an Error (ErrorKind::invalid_argument).
struct MeshView {
    std::span<const double> positions;         ///< x, y, z of each vertex, m
    std::span<const std::uint32_t> triangles;  ///< three vertices a triangle, counter-clockwise from outside
    /// u, v of each corner, six numbers a triangle, (0, 0) at the picture's lower left; empty: none.
    std::span<const float> corner_uv = {};
    /// A number >= 0 a triangle, -1: none; empty: none. SurfaceView::triangle_material goes on with it.
    std::span<const std::int32_t> triangle_material = {};
};

/// The edge of a tool that cuts, in the tool's own frame: straight lines from point to point. Two points or
/// more, not all at one point.
struct BladeView {
    std::span<const Vector3> points;  ///< m, own frame
};

}  // namespace splitcubes
