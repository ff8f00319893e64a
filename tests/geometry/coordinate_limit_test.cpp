#include <splitcubes/core/error.h>
#include <splitcubes/geometry/coordinate_limit.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace splitcubes::geometry {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TriangleMesh wide_tetrahedron(double size) {
    TriangleMesh mesh;
    mesh.positions = {{-size, -size, -size}, {size, size, -size}, {size, -size, size}, {-size, size, size}};
    mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    return mesh;
}

std::string coordinate_complaint(const TriangleMesh& mesh) {
    try {
        require_coordinates(mesh, "m.obj");
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(CoordinateLimit, the_first_vertex_beyond_it_is_reported) {
    EXPECT_EQ(coordinate_complaint(wide_tetrahedron(max_coordinate)), "");
    TriangleMesh mesh = wide_tetrahedron(1);
    for (const double value : {1.0001e9, -1e300, std::numeric_limits<double>::infinity(),
                               std::numeric_limits<double>::quiet_NaN()}) {
        mesh.positions[2][1] = value;
        EXPECT_THAT(coordinate_complaint(mesh), AllOf(HasSubstr("m.obj: vertex 3 of 4 has the coordinate "),
                                                      HasSubstr("from -1000000000 to 1000000000")));
    }
    mesh.positions[2][1] = -1e300;
    EXPECT_THAT(coordinate_complaint(mesh), HasSubstr("the coordinate -1e300, too large"));
}

TEST(CoordinateLimit, within_it_squared_areas_fit_single_precision) {
    const MeshCheck check = check_mesh(wide_tetrahedron(max_coordinate));
    EXPECT_TRUE(std::isfinite(static_cast<float>(check.volume)));
    EXPECT_TRUE(std::isfinite(static_cast<float>(check.area) * static_cast<float>(check.area)));
}

}  // namespace
}  // namespace splitcubes::geometry
