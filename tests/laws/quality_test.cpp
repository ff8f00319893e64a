// Accuracy of surfaces: the figures of docs/algorithms/splitting-cubes.md, "Accuracy", with bounds of about
// twice the measured values. `splitcubes bench surface` prints them.
#include "accuracy.h"

#include <gtest/gtest.h>
#include <splitcubes/io/read_mesh.h>

#include <filesystem>

namespace splitcubes::laws {
namespace {

const std::vector<app::SmoothRow>& smooth_rows() {
    static const std::vector<app::SmoothRow> rows = app::measure_smooth_shapes();
    return rows;
}

TEST(Quality, SmoothShapesConvergeWithTheSquareOfTheCell) {
    const std::vector<app::SmoothRow>& rows = smooth_rows();
    ASSERT_EQ(rows.size(), 8U);
    for (std::size_t k = 0; k < rows.size(); ++k) {
        const app::SmoothRow& row = rows[k];
        SCOPED_TRACE(row.shape + " " + std::to_string(row.across));
        // Measured with 8 cells across: 4.4e-3 and 4.1e-4 of the radius (sphere).
        EXPECT_LT(row.vertices.max, 0.01 * 64 / (row.across * row.across));
        EXPECT_LT(row.vertices.rms(), 1e-3 * 64 / (row.across * row.across));
        EXPECT_LE(row.moved.max, 0.02 + 1e-6) << "no crossing is moved further along its edge";
        if (k % 4 == 0) continue;
        ASSERT_EQ(row.across, 2 * rows[k - 1].across);
        EXPECT_GT(rows[k - 1].vertices.rms(), 3.2 * row.vertices.rms());  // 6.2 to 16.4
        EXPECT_GT(rows[k - 1].volume_error, 3.2 * row.volume_error);      // 4.0
        if (k % 4 != 3) continue;
        EXPECT_GT(rows[k - 3].vertices.max, 32 * row.vertices.max);  // 127 and 63
    }
}

TEST(Quality, OnSmoothShapesOnlySliversFold) {
    for (const app::SmoothRow& row : smooth_rows()) {
        SCOPED_TRACE(row.shape + " " + std::to_string(row.across));
        EXPECT_LT(row.normals.share(), 6e-4);          // at most 3.1e-4
        EXPECT_LT(row.normals.area_share(), 3e-6);     // at most 1.5e-6
        EXPECT_LT(row.normals.largest, 0.004);         // at most 0.0018 of a cell's face
        EXPECT_LE(row.unmoved_normals.opposing, 20U);  // at most 11
    }
}

TEST(Quality, TiltedBoxesKeepTheirFacesEdgesAndCorners) {
    const app::BoxRow row = app::measure_tilted_boxes(100, Parallel(1));
    ASSERT_GT(row.vertices.count, 200000U);
    EXPECT_LT(row.vertices.max, 0.25);      // 0.207
    EXPECT_LT(row.vertices.rms(), 0.0025);  // 0.0012
    const auto count = static_cast<double>(row.vertices.count);
    EXPECT_LT(static_cast<double>(row.beyond_twentieth), 0.001 * count);  // 0.00007
    EXPECT_LT(static_cast<double>(row.beyond_hundredth), 0.006 * count);  // 0.0031
    EXPECT_LT(row.corners.max, 1e-5);                                     // 7e-7
    EXPECT_LT(row.normals.share(), 0.0054);                               // 0.0027
    EXPECT_LT(row.normals.area_share(), 7e-4);                            // 3.4e-4
}

// Bounds for a plane through a solid, in cells; about twice the measured values.
struct CutBounds {
    const char* shape;
    double radius, boundary_rms, rim_rms, rim_max, volume_change, folds, folded_area;
};

class Cuts : public testing::TestWithParam<CutBounds> {};

INSTANTIATE_TEST_SUITE_P(
    Quality, Cuts,
    // Measured: boundary rms, rim rms and max, volume change, share of opposing triangles and of their area.
    testing::Values(
        CutBounds{"sphere", 5.3, 0.027, 0.035, 0.7, 5e-4, 0.031,
                  0.023},  // .0133 .0176 .35 2.5e-4 .0155 .0114
        CutBounds{"sphere", 9.3, 0.010, 0.010, 0.3, 1e-4, 0.015,
                  0.0075},  // .0061 .0046 .15 3.8e-5 .0075 .0037
        CutBounds{"sphere", 16.3, 0.009, 0.006, 0.3, 1e-4, 0.0085,
                  0.004},                                               // .0044 .0026 .15 1.2e-5 .0042 .0020
        CutBounds{"box", 5.3, 0.040, 0.15, 1.5, 5e-4, 0.046, 0.044},    // .0196 .0970 1.02 2.6e-4 .0232 .0220
        CutBounds{"box", 9.3, 0.015, 0.11, 1.3, 3e-4, 0.025, 0.022},    // .0075 .0538 .63 1.1e-4 .0127 .0108
        CutBounds{"box", 16.3, 0.011, 0.13, 1.5, 3e-4, 0.014, 0.011}),  // .0053 .0644 1.04 3.6e-5 .0069 .0057
    [](const auto& bounds) {
        return bounds.param.shape + std::to_string(static_cast<int>(bounds.param.radius));
    });

TEST_P(Cuts, LeaveTheBoundaryUnchangedAndFollowThePlane) {
    const CutBounds& bounds = GetParam();
    const app::CutRow row = app::measure_cuts(bounds.shape, bounds.radius, 20, Parallel(1));
    ASSERT_GT(row.rim.count, 1000U);
    ASSERT_GT(row.face_normals.triangles, 1000U);
    EXPECT_LT(row.boundary.rms(), bounds.boundary_rms);
    EXPECT_LT(row.rim.rms(), bounds.rim_rms);
    EXPECT_LT(row.rim.max, bounds.rim_max);
    EXPECT_LT(row.largest_volume_change, bounds.volume_change);
    EXPECT_LT(row.normals.share(), bounds.folds);
    EXPECT_LT(row.normals.area_share(), bounds.folded_area);
    // Away from the boundary the cut is the plane, except for vertices that were moved off a node.
    EXPECT_LE(row.face.max, 0.02 + 1e-6);
    EXPECT_LT(row.face.rms(), 0.002);  // 0.0009
    EXPECT_EQ(row.face_normals.opposing, 0U);
}

struct Folds {
    const char* model;
    double at_48, at_96;  // share of opposing triangles, as measured
};

class RealModelFolds : public testing::TestWithParam<Folds> {};

INSTANTIATE_TEST_SUITE_P(Quality, RealModelFolds,
                         testing::Values(Folds{"spot", 0.00605, 0.00292},
                                         Folds{"stanford-bunny", 0.00641, 0.00306},
                                         Folds{"fandisk", 0.00152, 0.00053},
                                         Folds{"cheburashka", 0.00908, 0.00458}),
                         [](const auto& folds) {
                             std::string name = folds.param.model;
                             std::erase(name, '-');
                             return name;
                         });

TEST_P(RealModelFolds, AreFew) {
    const std::filesystem::path file =
        std::filesystem::path(SPLITCUBES_MODELS) / (std::string(GetParam().model) + ".obj");
    if (!std::filesystem::exists(file)) GTEST_SKIP() << GetParam().model << " is not at hand";
    const geometry::TriangleMesh mesh = io::read_mesh(file);
    EXPECT_LT(app::measure_folds(mesh, 48, Parallel(1)).share(), 2 * GetParam().at_48);
    EXPECT_LT(app::measure_folds(mesh, 96, Parallel(1)).share(), 2 * GetParam().at_96);
}

}  // namespace
}  // namespace splitcubes::laws
