// Planes to cut with.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/geometry/triangle_mesh.h>

namespace splitcubes::geometry {

/// The points x with normal . x = offset. Its front is where normal . x is larger.
struct CuttingPlane {
    Vec3 normal = Vec3::UnitZ();  // of any length above zero
    double offset = 0;            // m, times the normal's length
};

/// A sheet of two triangles on the plane that parts all of `box`. The vertices of a plane across an axis
/// lie on it exactly. InputError where the plane has no direction or lies beyond largest_coordinate.
TriangleMesh plane_sheet(const CuttingPlane& plane, const Box& box);

/// A closed mesh, oriented outward, around what of `box` lies in front of the plane and nothing of what
/// lies behind. Errors are those of plane_sheet.
TriangleMesh half_space_within(const CuttingPlane& plane, const Box& box);

}  // namespace splitcubes::geometry
