// Cutting planes.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/geometry/triangle_mesh.h>

namespace splitcubes::geometry {

/// The plane normal . x = offset. In front of it normal . x is larger.
struct CuttingPlane {
    Vec3 normal = Vec3::UnitZ();  // any positive length
    double offset = 0;            // m, times the normal's length
};

/// Returns a sheet of two triangles on the plane that cuts through all of `box`. For a plane normal to an
/// axis the vertices lie on it exactly. Throws InputError if the normal is zero or the plane lies beyond
/// max_coordinate.
TriangleMesh plane_sheet(const CuttingPlane& plane, const Box& box);

/// Returns a closed mesh, oriented outward, that contains the part of `box` in front of the plane and nothing
/// of the part behind. Throws like plane_sheet.
TriangleMesh half_space_within(const CuttingPlane& plane, const Box& box);

}  // namespace splitcubes::geometry
