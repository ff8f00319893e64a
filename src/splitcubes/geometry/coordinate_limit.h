// Upper bound of coordinates.
#pragma once

#include <string>

namespace splitcubes::geometry {

struct TriangleMesh;

/// Bound of |coordinate|, in m, and of numbers in mesh files in any unit. Fourth powers (squared areas) still
/// fit single precision, which rendering and rasterised disks use; the spacing of doubles there is 1e-7.
inline constexpr double max_coordinate = 1e9;

/// Throws InputError with the location `where` for the first vertex with a coordinate beyond
/// max_coordinate or not finite. after: text after the coordinate, such as " with --scale 10".
void require_coordinates(const TriangleMesh& mesh, const std::string& where, const std::string& after = "");

}  // namespace splitcubes::geometry
