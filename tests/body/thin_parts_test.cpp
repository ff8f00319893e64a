#include <splitcubes/body/body.h>
#include <splitcubes/body/thin_parts.h>

#include "body/rubber.h"

#include <gtest/gtest.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/splitting/solidify.h>

namespace splitcubes::body {
namespace {

splitting::NodeGrid solid_of(const geometry::TriangleMesh& mesh, double cell) {
    static const Parallel parallel(2);
    splitting::SolidifyReport report;
    return splitting::solidify(mesh, geometry::grid_around(mesh.bounds(), cell), report, parallel);
}

geometry::TriangleMesh turned_by(geometry::TriangleMesh mesh, const Vec3& axis, double angle) {
    const Mat3 turn = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
    for (Vec3& p : mesh.positions) p = turn * p;
    return mesh;
}

TEST(ThinParts, EdgesAndCornersOfThickSolidsAreNotThin) {
    for (const double thickness : {0.1, 0.3, 0.6, 0.9}) {
        EXPECT_EQ(thin_parts(solid_of(geometry::make_box(Vec3(1, 1.1, 1.3)), 0.02), thickness).share, 0)
            << thickness;
        EXPECT_EQ(thin_parts(solid_of(geometry::make_sphere(0.5, 4), 0.02), thickness).share, 0) << thickness;
        EXPECT_LT(
            thin_parts(solid_of(turned_by(geometry::make_box(Vec3(1, 1.1, 1.3)), Vec3(1, 2, 3), 0.7), 0.03),
                       thickness)
                .share,
            0.001)
            << thickness;
    }
}

TEST(ThinParts, PlatesAndBarsAreThinEverywhereInAnyOrientation) {
    const Vec3 plate(1, 1, 0.1), bar(1, 0.15, 0.1);
    for (const Vec3& size : {plate, bar})
        for (const double angle : {0.0, 0.3, 0.785}) {
            const splitting::NodeGrid grid =
                solid_of(turned_by(geometry::make_box(size), Vec3(1, 2, 0.5), angle), 0.015);
            EXPECT_LT(thin_parts(grid, 0.05).share, 0.005) << angle;
            const ThinParts found = thin_parts(grid, 0.16);
            EXPECT_EQ(found.share, 1) << angle;
            EXPECT_NEAR(found.thickness, 0.1, 0.03) << angle;
        }
}

TEST(ThinParts, AFinOnAThickBodyIsTheThinPart) {
    geometry::TriangleMesh mesh = geometry::make_box(Vec3(0.6, 0.6, 0.6));
    const geometry::TriangleMesh fin = fixtures::box_at(Vec3(0.8, 0.6, 0.08), Vec3(0.65, 0, 0));
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), fin.positions.begin(), fin.positions.end());
    for (const geometry::Triangle& t : fin.triangles)
        mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
    const ThinParts found = thin_parts(solid_of(mesh, 0.015), 0.15);
    const double fin_volume = 0.75 * 0.6 * 0.08;
    EXPECT_NEAR(found.share, fin_volume / (fin_volume + 0.216), 0.05);
    EXPECT_NEAR(found.thickness, 0.08, 0.02);
}

TEST(ThinParts, LargeGridsAreMeasuredOnFewerPoints) {
    const ThinParts found = thin_parts(solid_of(geometry::make_box(Vec3(1, 1, 0.1)), 0.003), 0.15);
    EXPECT_GT(found.share, 0.99);
    EXPECT_NEAR(found.thickness, 0.1, 0.02);
}

}  // namespace
}  // namespace splitcubes::body
