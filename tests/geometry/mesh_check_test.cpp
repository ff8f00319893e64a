#include <splitcubes/geometry/mesh_check.h>

#include "laws/solids.h"

#include <gtest/gtest.h>
#include <splitcubes/geometry/shapes.h>

#include <cmath>
#include <limits>

namespace splitcubes::geometry {
namespace {

using namespace laws;

const Vec3 zero = Vec3::Zero();
const Vec3 ones = Vec3::Ones();

TEST(MeshCheck, ASolidIsValid) {
    const MeshCheck check = check_mesh(box_between(zero, Vec3(1, 2, 3)));
    EXPECT_TRUE(check.valid());
    EXPECT_EQ(check.vertices, 8U);
    EXPECT_EQ(check.triangles, 12U);
    ASSERT_EQ(check.parts.size(), 1U);
    EXPECT_DOUBLE_EQ(check.volume, 6);
    EXPECT_DOUBLE_EQ(check.area, 22);
    EXPECT_TRUE(check_mesh(make_torus(2, 0.5)).valid()) << "any number of handles";
}

TEST(MeshCheck, AnEmptyMeshIsInvalid) {
    EXPECT_FALSE(check_mesh({}).valid());
    EXPECT_FALSE(check_mesh({}).closed());
}

TEST(MeshCheck, AMissingTriangleLeavesThreeBoundaryEdges) {
    TriangleMesh mesh = make_sphere(1, 2);
    mesh.triangles.pop_back();
    const MeshCheck check = check_mesh(mesh);
    EXPECT_EQ(check.boundary_edges, 3U);
    EXPECT_EQ(check.unbalanced_edges, 3U);
    EXPECT_FALSE(check.closed());
    EXPECT_FALSE(check.valid());
    EXPECT_TRUE(check.oriented());
    EXPECT_TRUE(check.manifold());
}

TEST(MeshCheck, AFlippedTriangleMisorientsThreeEdges) {
    TriangleMesh mesh = make_sphere(1, 2);
    std::swap(mesh.triangles[7][0], mesh.triangles[7][1]);
    const MeshCheck check = check_mesh(mesh);
    EXPECT_EQ(check.boundary_edges, 0U);
    EXPECT_EQ(check.misoriented_edges, 3U);
    EXPECT_FALSE(check.closed());
    EXPECT_FALSE(check.oriented());
    EXPECT_TRUE(check.manifold());
}

TEST(MeshCheck, SolidsThatTouchInAVertex) {
    TriangleMesh mesh = joined(box_between(zero, ones), box_between(ones, 2 * ones));
    mesh = weld_equal_vertices(mesh);
    const MeshCheck check = check_mesh(mesh);
    EXPECT_EQ(check.non_manifold_vertices, 1U);
    EXPECT_EQ(check.non_manifold_edges, 0U);
    EXPECT_TRUE(check.closed());
    EXPECT_FALSE(check.manifold());
    EXPECT_FALSE(check.valid());
    EXPECT_EQ(check.parts.size(), 1U);
}

TEST(MeshCheck, SolidsThatTouchAlongAnEdge) {
    const TriangleMesh mesh =
        weld_equal_vertices(joined(box_between(zero, ones), box_between(Vec3(1, 1, 0), Vec3(2, 2, 1))));
    const MeshCheck check = check_mesh(mesh);
    EXPECT_EQ(check.non_manifold_edges, 1U);
    EXPECT_TRUE(check.closed()) << "four triangles, two each way";
    EXPECT_FALSE(check.manifold());
    EXPECT_FALSE(check.oriented());
}

TEST(MeshCheck, PartsAreOrderedBySizeAndKeepTheirSign) {
    TriangleMesh mesh = box_between(zero, ones);
    mesh.append(moved(reversed(box_between(zero, 2 * ones)), Vec3(5, 0, 0)));
    mesh.append(moved(box_between(zero, 3 * ones), Vec3(0, 9, 0)));
    const MeshCheck check = check_mesh(mesh);
    ASSERT_EQ(check.parts.size(), 3U);
    EXPECT_NEAR(check.parts[0].volume, 27, 1e-12);
    EXPECT_NEAR(check.parts[1].volume, -8, 1e-12);
    EXPECT_NEAR(check.parts[2].volume, 1, 1e-12);
    EXPECT_NEAR(check.volume, 20, 1e-12);
    EXPECT_NEAR(check.parts[0].area, 54, 1e-12);
    EXPECT_EQ(check.parts[2].triangles, 12U);
    EXPECT_TRUE(check.valid());

    std::size_t count = 0;
    const std::vector<std::int32_t> part = triangle_parts(mesh, count);
    ASSERT_EQ(count, 3U);
    for (std::size_t t = 0; t < part.size(); ++t) ASSERT_EQ(part[t], static_cast<std::int32_t>(t / 12));
}

TEST(MeshCheck, CountsNonFiniteVerticesAndDegenerateTriangles) {
    TriangleMesh mesh = box_between(zero, ones);
    mesh.triangles.push_back({3, 3, 5});
    mesh.positions.emplace_back(std::numeric_limits<double>::quiet_NaN(), 0, 0);  // not used
    MeshCheck check = check_mesh(mesh);
    EXPECT_EQ(check.degenerate_triangles, 1U);
    EXPECT_EQ(check.non_finite_vertices, 0U);
    EXPECT_EQ(check.vertices, 8U);
    EXPECT_FALSE(check.valid());
    mesh.triangles.pop_back();
    EXPECT_TRUE(check_mesh(mesh).valid());
    mesh.positions[2][1] = std::numeric_limits<double>::infinity();
    check = check_mesh(mesh);
    EXPECT_EQ(check.non_finite_vertices, 1U);
    EXPECT_FALSE(check.valid());
}

TEST(WeldEqualVertices, MakesASolidOfUnconnectedTriangles) {
    const TriangleMesh sphere = make_sphere(1, 2);
    TriangleMesh loose;
    for (const Triangle& t : sphere.triangles) {
        const auto first = static_cast<std::uint32_t>(loose.positions.size());
        for (const std::uint32_t v : t) loose.positions.push_back(sphere.positions[v]);
        loose.triangles.push_back({first, first + 1, first + 2});
    }
    EXPECT_EQ(check_mesh(loose).boundary_edges, 3 * sphere.triangles.size());
    const TriangleMesh welded = weld_equal_vertices(loose);
    EXPECT_EQ(welded.positions.size(), sphere.positions.size());
    EXPECT_TRUE(check_mesh(welded).valid());
    EXPECT_DOUBLE_EQ(welded.volume(), sphere.volume());
}

TEST(WeldEqualVertices, MergesBothZerosAndKeepsOneBitDifferences) {
    TriangleMesh mesh;
    const double next = std::nextafter(1.0, 2.0);
    mesh.positions = {Vec3(0, 1, 0), Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(-0.0, 1, 0), Vec3(next, 0, 0)};
    mesh.triangles = {{0, 1, 2}, {3, 2, 1}, {0, 3, 1}, {0, 4, 1}};
    const TriangleMesh welded = weld_equal_vertices(mesh);
    EXPECT_EQ(welded.positions.size(), 4U);
    ASSERT_EQ(welded.triangles.size(), 3U) << "one triangle collapsed";
    EXPECT_EQ(welded.triangles[0], (Triangle{0, 1, 2}));
    EXPECT_EQ(welded.triangles[1], (Triangle{0, 2, 1}));
    EXPECT_EQ(welded.triangles[2], (Triangle{0, 3, 1}));
}

}  // namespace
}  // namespace splitcubes::geometry
