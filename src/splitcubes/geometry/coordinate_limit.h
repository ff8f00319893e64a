// How large coordinates may be.
#pragma once

#include <string>

namespace splitcubes::geometry {

struct TriangleMesh;

/// m, and numbers of a mesh file in whatever unit. Fourth powers, the squares of areas, still fit single
/// precision, in which surfaces are drawn and disks rasterised; neighbouring doubles there are 1e-7 apart.
inline constexpr double largest_coordinate = 1e9;

/// Throws InputError with `where` as its place for the first vertex with a coordinate that is beyond
/// largest_coordinate or not finite. after: what follows the coordinate, " with --scale 10" say.
void require_coordinates(const TriangleMesh& mesh, const std::string& where, const std::string& after = "");

}  // namespace splitcubes::geometry
