#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/plane.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace splitcubes::geometry {
namespace {

const Box box{{-1, 2, 3}, {4, 3, 3.5}};

// Returns whether the convex mesh, oriented outward, contains the point.
bool holds(const TriangleMesh& convex, const Vec3& point) {
    for (const Triangle& t : convex.triangles) {
        const Vec3& a = convex.positions[t[0]];
        const Vec3 normal = (convex.positions[t[1]] - a).cross(convex.positions[t[2]] - a);
        if (normal.dot(point - a) > 1e-12 * normal.norm()) return false;
    }
    return true;
}

Vec3 corner(int k) {
    return {k & 1 ? box.max[0] : box.min[0], k & 2 ? box.max[1] : box.min[1],
            k & 4 ? box.max[2] : box.min[2]};
}

TEST(Plane, SheetsNormalToAnAxisAreExact) {
    for (int axis = 0; axis < 3; ++axis)
        for (const double sign : {1.0, -1.0, 3.0, -0.1}) {
            const double offset = 0.1 * (axis + 1);
            const TriangleMesh sheet = plane_sheet({sign * Vec3::Unit(axis), sign * offset}, box);
            for (const Vec3& p : sheet.positions) EXPECT_DOUBLE_EQ(p[axis], offset);
            const Vec3 normal = (sheet.positions[1] - sheet.positions[0])
                                    .cross(sheet.positions[2] - sheet.positions[0])
                                    .normalized();
            EXPECT_NEAR(normal[axis], sign > 0 ? 1 : -1, 1e-12) << "towards the front";
        }
}

// Points of the box are inside the half space exactly if they lie in front; no edge of the square
// comes near the box.
TEST(Plane, TheHalfSpaceContainsThePartOfTheBoxInFront) {
    for (const Vec3& normal : {Vec3(1, 2, 3), Vec3(-1, 0.1, 0), Vec3(0, 0, 2), Vec3(1e-3, -2e-3, 1e-3)})
        for (const double shift : {-100.0, -0.7, 0.0, 0.2, 0.5, 30.0}) {
            const CuttingPlane plane{normal, normal.dot(box.center()) + shift * normal.norm()};
            const TriangleMesh half = half_space_within(plane, box);
            EXPECT_TRUE(check_mesh(half).valid());
            EXPECT_GT(half.volume(), 0);
            for (int k = 0; k < 8; ++k)
                EXPECT_EQ(holds(half, corner(k)), normal.dot(corner(k)) > plane.offset) << shift << ' ' << k;
            const TriangleMesh sheet = plane_sheet(plane, box);
            for (const Vec3& p : sheet.positions) {
                EXPECT_NEAR(normal.dot(p), plane.offset, 1e-9 * normal.norm() * (1 + std::abs(shift)));
                EXPECT_GT((p - box.center()).norm(), box.size().norm());
            }
        }
}

TEST(Plane, ZeroNormalsAndFarPlanesAreRefused) {
    EXPECT_THROW(plane_sheet({Vec3::Zero(), 1}, box), InputError);
    EXPECT_THROW(plane_sheet({{std::numeric_limits<double>::infinity(), 0, 0}, 1}, box), InputError);
    EXPECT_THROW(plane_sheet({{std::nan(""), 0, 0}, 1}, box), InputError);
    EXPECT_THROW(half_space_within({{1e-10, 0, 0}, 1e70}, box), InputError);
    EXPECT_THROW(half_space_within({Vec3::UnitX(), std::nan("")}, box), InputError);
}

}  // namespace
}  // namespace splitcubes::geometry
