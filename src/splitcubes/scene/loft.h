// Closed solids over rings of points. Internal to scene.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/math/types.h>

#include <vector>

namespace splitcubes::scene {

/// Returns the solid between rings of equally many points, whose ends are closed by fans; its volume is
/// positive. Requires two rings of three points.
geometry::TriangleMesh loft(const std::vector<std::vector<Vec3>>& rings);

/// Returns a rod of elliptic section with round ends from one point to another; half_width: along `side`,
/// half_height: across both.
geometry::TriangleMesh make_rod(const Vec3& from, const Vec3& to, const Vec3& side, double half_width,
                                double half_height);

/// Returns a tube of a radius along a line of two points at least.
geometry::TriangleMesh make_tube(const std::vector<Vec3>& line, double radius);

/// Returns a line of points at most `step` apart, those of the given one among them.
std::vector<Vec3> subdivided(const std::vector<Vec3>& line, double step);

}  // namespace splitcubes::scene
