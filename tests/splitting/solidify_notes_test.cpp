// Notes about meshes: none without a reason, and no advice that cannot be followed.
#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/solidify.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace splitcubes::splitting {
namespace {

using geometry::TriangleMesh;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TriangleMesh corner_box(const Vec3& low, const Vec3& high) {
    TriangleMesh mesh = geometry::make_box(high - low);
    for (Vec3& p : mesh.positions) p += 0.5 * (low + high);
    return mesh;
}

std::vector<std::string> notes(const TriangleMesh& mesh, int cells) {
    static const Parallel parallel(2);
    SolidifyReport report;
    solidify(mesh, geometry::grid_around(mesh.bounds(), geometry::cell_size_for(mesh.bounds(), cells)),
             report, parallel);
    return report.notes;
}

TEST(SolidifyNotes, NoneForWellResolvedSolids) {
    for (const int cells : {16, 33, 64, 100}) {
        EXPECT_THAT(notes(geometry::make_sphere(1, 4), cells), IsEmpty()) << cells;
        EXPECT_THAT(notes(geometry::make_torus(1, 0.3), cells), IsEmpty()) << cells;
        EXPECT_THAT(notes(geometry::make_pear(1, 64), cells), IsEmpty()) << cells;
    }
}

TEST(SolidifyNotes, AFewGapEdgesAreCountedButNotNoted) {
    TriangleMesh mesh = corner_box(Vec3(0, 0, 0), Vec3(1, 1, 1));
    const TriangleMesh second = corner_box(Vec3(0, 0, 1.004), Vec3(1, 1, 2));
    mesh.append(second);
    // A whole face is more than a few edges.
    EXPECT_THAT(notes(mesh, 40), ElementsAre(HasSubstr("gaps narrower than a cell of 0.05 m run along")));
    // A small foot above a large plate is a few.
    TriangleMesh foot = corner_box(Vec3(0, 0, 0), Vec3(2, 2, 1));
    foot.append(corner_box(Vec3(0.9, 0.9, 1.004), Vec3(1.1, 1.1, 1.4)));
    static const Parallel parallel(2);
    SolidifyReport report;
    solidify(foot, geometry::grid_around(foot.bounds(), 0.0511), report, parallel);
    EXPECT_GT(report.gap_edges, 4U);
    EXPECT_THAT(report.notes, IsEmpty());
}

TEST(SolidifyNotes, LostMaterialIsNotedWithItsShareAndASufficientCellSize) {
    // The plate has 2 % of the block's volume.
    TriangleMesh mesh = corner_box(Vec3(0, 0, 0), Vec3(1, 1, 1));
    mesh.append(corner_box(Vec3(0, 0, 1.41), Vec3(1, 1, 1.43)));
    const std::vector<std::string> found = notes(mesh, 24);
    ASSERT_THAT(found,
                ElementsAre(testing::AllOf(HasSubstr("is lost, about "), HasSubstr("a cell size of 0.01"))));
    const double share = std::stod(found[0].substr(found[0].find("about ") + 6));
    EXPECT_NEAR(share, 2, 1.5);
    EXPECT_THAT(notes(mesh, 110), IsEmpty());
}

TEST(SolidifyNotes, FragmentsAreNotedWithTheirShareAndNoAdviceBeyondTheFinestGrid) {
    // A slanted thread contains nodes that are not neighbours.
    const Mat3 turn =
        (Eigen::AngleAxisd(0.03, Vec3::UnitY()) * Eigen::AngleAxisd(0.04, Vec3::UnitZ())).toRotationMatrix();
    for (const int cells : {100, 1024}) {
        bool is_noted = false;
        for (double thickness = 0.8; thickness < 1.4 && !is_noted; thickness += 0.05) {
            TriangleMesh thread = geometry::make_box(Vec3(1, thickness / cells, thickness / cells));
            for (Vec3& p : thread.positions) p = turn * p;
            for (const std::string& note : notes(thread, cells)) {
                if (note.find("more than the mesh has parts") == std::string::npos) continue;
                is_noted = true;
                EXPECT_THAT(note, HasSubstr(" % of the volume"));
            }
            if (!is_noted || cells < 1024) continue;
            EXPECT_THAT(notes(thread, cells), testing::Each(Not(HasSubstr("; a cell size of"))));
        }
        EXPECT_TRUE(is_noted) << cells;
    }
}

}  // namespace
}  // namespace splitcubes::splitting
