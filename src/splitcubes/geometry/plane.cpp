#include <splitcubes/core/error.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/geometry/plane.h>
#include <splitcubes/geometry/rest_grid.h>

#include <array>
#include <cmath>

namespace splitcubes::geometry {

namespace {

// The plane with a unit normal, and a square on it larger than the projection of the box.
struct Square {
    Vec3 normal;
    double offset;
    double reach;                 // m, exceeds the distance of the box from the plane
    std::array<Vec3, 4> corners;  // counter-clockwise, seen from the front
};

// Returns the axis that the normal is parallel to; -1: none.
int axis_of(const Vec3& normal) {
    for (int axis = 0; axis < 3; ++axis)
        if (std::abs(normal[axis]) == 1) return axis;
    return -1;
}

Square square_on(const CuttingPlane& plane, const Box& box) {
    const double length = plane.normal.stableNorm();
    if (!(length > 0) || !std::isfinite(length))
        throw InputError("plane", "its normal has no direction", "give a normal of a length above zero");
    Square out;
    out.normal = plane.normal / length;
    out.offset = plane.offset / length;
    if (!(std::abs(out.offset) <= max_coordinate))
        throw InputError("plane", "lies too far away",
                         "give an offset of up to " + plain_number(max_coordinate) + " m");
    const double to_center = out.normal.dot(box.center()) - out.offset;
    const double half_side = 2 * box.size().norm();
    const Vec3 center = box.center() - to_center * out.normal;
    const Vec3 s = out.normal.unitOrthogonal(), t = out.normal.cross(s);
    out.reach = std::abs(to_center) + half_side;
    out.corners = {Vec3(center - half_side * (s + t)), Vec3(center + half_side * (s - t)),
                   Vec3(center + half_side * (s + t)), Vec3(center - half_side * (s - t))};
    if (const int axis = axis_of(out.normal); axis >= 0)
        for (Vec3& corner : out.corners) corner[axis] = out.normal[axis] * out.offset;
    return out;
}

}  // namespace

TriangleMesh plane_sheet(const CuttingPlane& plane, const Box& box) {
    const Square square = square_on(plane, box);
    return {{square.corners.begin(), square.corners.end()}, {{0, 1, 2}, {0, 2, 3}}};
}

TriangleMesh half_space_within(const CuttingPlane& plane, const Box& box) {
    const Square square = square_on(plane, box);
    TriangleMesh out{{square.corners.begin(), square.corners.end()}, {{0, 2, 1}, {0, 3, 2}}};
    for (const Vec3& corner : square.corners)
        out.positions.emplace_back(corner + square.reach * square.normal);
    out.triangles.insert(out.triangles.end(), {{4, 5, 6}, {4, 6, 7}});
    for (std::uint32_t k = 0; k < 4; ++k) {
        const std::uint32_t next = (k + 1) % 4;
        out.triangles.push_back({k, next, next + 4});
        out.triangles.push_back({k, next + 4, k + 4});
    }
    return out;
}

}  // namespace splitcubes::geometry
