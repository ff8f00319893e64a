// The axes that a shape follows go with the shape.
#include <gtest/gtest.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/geometry/shape_frame.h>
#include <splitcubes/geometry/shapes.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::geometry {
namespace {

// Not within five degrees of the rotations that take the axes to each other.
Mat3 oblique_rotation(Random& random) {
    for (;;) {
        const Vec3 about(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        const Mat3 out = Eigen::AngleAxisd(random.uniform(0, 3.1), about.normalized()).toRotationMatrix();
        if (out.cwiseAbs().colwise().maxCoeff().minCoeff() < 0.996) return out;
    }
}

TriangleMesh turned_mesh(TriangleMesh mesh, const Mat3& by) {
    for (Vec3& p : mesh.positions) p = by * p;
    return mesh;
}

Box bounds_along(const TriangleMesh& mesh, const Mat3& axes) {
    Box out;
    for (const Vec3& p : mesh.positions) out.add(axes.transpose() * p);
    return out;
}

// The lengths of a box, in increasing order.
Vec3 sorted(Vec3 size) {
    std::sort(size.begin(), size.end());
    return size;
}

TEST(ShapeFrame, FollowsARotatedBox) {
    Random random(1);
    for (int k = 0; k < 200; ++k) {
        const Vec3 size(random.uniform(0.02, 1), random.uniform(0.02, 1), random.uniform(0.02, 1));
        const TriangleMesh box = turned_mesh(make_box(size), oblique_rotation(random));
        const Mat3 axes = shape_frame(box);
        EXPECT_NEAR(axes.determinant(), 1, 1e-12);
        EXPECT_LT((axes.transpose() * axes - Mat3::Identity()).norm(), 1e-12);
        EXPECT_LT((sorted(bounds_along(box, axes).size()) - sorted(size)).norm(), 1e-7);
        EXPECT_NEAR(cell_size_for(box, 10), size.maxCoeff() / 10, 1e-7);
        // Of the equal choices the nearest to the identity: no axis is more than 63 degrees off.
        EXPECT_GT(axes.diagonal().minCoeff(), 0.4);
    }
}

TEST(ShapeFrame, FollowsTheAxisOfARod) {
    Random random(2);
    for (int k = 0; k < 50; ++k) {
        const double length = random.uniform(3, 9);
        const Mat3 by = oblique_rotation(random);
        const Mat3 axes = shape_frame(turned_mesh(make_cylinder(1, length, 64), by));
        EXPECT_GT((axes.transpose() * by.col(2)).cwiseAbs().maxCoeff(), 1 - 1e-9);
    }
}

TEST(ShapeFrame, IsExactlyTheIdentityWhereNothingIsGained) {
    EXPECT_EQ(shape_frame(make_box({1, 2, 3})), Mat3::Identity());
    EXPECT_EQ(shape_frame(make_cylinder(1, 4)), Mat3::Identity());
    EXPECT_EQ(shape_frame({}), Mat3::Identity());
    Random random(3);
    for (int k = 0; k < 20; ++k) {
        EXPECT_EQ(shape_frame(turned_mesh(make_sphere(1, 4), oblique_rotation(random))), Mat3::Identity());
        EXPECT_EQ(shape_frame(turned_mesh(make_torus(1, 0.3), oblique_rotation(random))), Mat3::Identity());
        const Vec3 about(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        const Mat3 slight = Eigen::AngleAxisd(0.005, about.normalized()).toRotationMatrix();
        EXPECT_EQ(shape_frame(turned_mesh(make_box({1, 2, 3}), slight)), Mat3::Identity());
    }
}

}  // namespace
}  // namespace splitcubes::geometry
