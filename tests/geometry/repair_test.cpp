#include <gtest/gtest.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/repair.h>
#include <splitcubes/geometry/shapes.h>

#include <algorithm>

namespace splitcubes::geometry {
namespace {

TEST(WithoutDuplicates, KeepsOneOfMany) {
    const TriangleMesh ball = make_sphere(1, 2);
    TriangleMesh many = ball;
    for (int copy = 0; copy < 3; ++copy)
        for (std::size_t t = 0; t < ball.triangles.size(); t += 3) {
            Triangle turned = ball.triangles[t];
            std::rotate(turned.begin(), turned.begin() + copy, turned.end());
            many.triangles.push_back(turned);
        }
    std::size_t dropped = 0;
    const TriangleMesh one = without_duplicates(many, dropped);
    EXPECT_EQ(dropped, many.triangles.size() - ball.triangles.size());
    EXPECT_EQ(one.triangles, ball.triangles);
    EXPECT_EQ(without_duplicates(ball, dropped).triangles, ball.triangles);
    EXPECT_EQ(dropped, 0U);
}

TEST(WithoutDuplicates, OppositeTrianglesCancel) {
    TriangleMesh sheet = make_sphere(1, 1);
    const std::size_t count = sheet.triangles.size();
    for (std::size_t t = 0; t < count; ++t) {
        Triangle back = sheet.triangles[t];
        std::swap(back[0], back[2]);
        sheet.triangles.push_back(back);
    }
    std::size_t dropped = 0;
    EXPECT_TRUE(without_duplicates(sheet, dropped).triangles.empty());
    EXPECT_EQ(dropped, 2 * count);
}

TEST(ConsistentlyOriented, RestoresFlippedTriangles) {
    Random random(3);
    for (int trial = 0; trial < 20; ++trial) {
        TriangleMesh mesh = make_sphere(1, 3);
        TriangleMesh hole = make_box(Vec3(0.3, 0.4, 0.5));
        for (Triangle& t : hole.triangles) std::swap(t[1], t[2]);  // a cavity stays a cavity
        mesh.append(hole);
        TriangleMesh muddled = mesh;
        std::size_t muddle = 0;
        for (Triangle& t : muddled.triangles)
            if (random.unit() < 0.3) {
                std::swap(t[0], t[1]);
                ++muddle;
            }
        std::size_t turned = 0;
        const TriangleMesh back = consistently_oriented(muddled, turned);
        ASSERT_TRUE(is_closed(back));
        EXPECT_NEAR(std::abs(back.volume()), mesh.volume(), 1e-12) << trial;
        EXPECT_LE(turned, muddle + 12);
    }
}

TEST(ConsistentlyOriented, LeavesOpenMeshesAlone) {
    TriangleMesh open = make_sphere(1, 2);
    open.triangles.pop_back();
    std::swap(open.triangles[5][0], open.triangles[5][1]);
    std::size_t turned = 1;
    EXPECT_EQ(consistently_oriented(open, turned).triangles, open.triangles);
    EXPECT_EQ(turned, 0U);
}

}  // namespace
}  // namespace splitcubes::geometry
