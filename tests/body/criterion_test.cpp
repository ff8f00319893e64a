// Pair factors updated by cuts, against factors computed from scratch.
#include <splitcubes/body/body.h>
#include <splitcubes/geometry/shapes.h>

#include <gtest/gtest.h>

namespace splitcubes::body {
namespace {

geometry::TriangleMesh plane_sheet(double x, double from, double to) {
    geometry::TriangleMesh mesh;
    mesh.positions = {{x, from, -1}, {x, to, -1}, {x, to, 1}, {x, from, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

class BodyCriterion : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(All, BodyCriterion, ::testing::Range(0, 4));

TEST_P(BodyCriterion, IsAFunctionOfThePresentSurface) {
    const Parallel parallel(2);
    BodySettings settings;
    settings.cell_size = 0.0125;
    settings.phyxel_count = 200;
    settings.criterion = static_cast<occlusion::CriterionKind>(GetParam());
    Body body(geometry::make_box(Vec3::Constant(0.2)), settings, parallel);
    const auto criterion =
        occlusion::make_criterion(settings.criterion, occlusion::make_cpu_backend(settings.visibility));
    const auto check = [&] {
        const occlusion::PairSet pairs = body.pair_set();
        std::vector<std::uint32_t> all(pairs.size());
        for (std::uint32_t k = 0; k < all.size(); ++k) all[k] = k;
        std::vector<float> factor(all.size());
        criterion->evaluate(body.occluders(), pairs, all, factor, parallel);
        int low = 0, across = 0;
        for (std::size_t k = 0; k < all.size(); ++k) {
            if (pairs.piece[pairs.a[k]] != pairs.piece[pairs.b[k]]) {
                factor[k] = 0;
                ++across;
            }
            low += factor[k] < 1;
            EXPECT_EQ(body.pairs().visibility[k], factor[k]) << k;
        }
        EXPECT_TRUE(body.validate().empty());
        return std::pair{low, across};
    };
    EXPECT_EQ(check(), (std::pair{0, 0}));
    body.cut_with_sheet(plane_sheet(0.0042, -1, -0.031), 0, parallel);
    const int partial = check().first;
    EXPECT_GT(partial, 10);
    body.cut_with_sheet(plane_sheet(0.0042, -0.04, 0.026), 1, parallel);
    EXPECT_GT(check().first, partial);
    body.cut_with_sheet(plane_sheet(0.0042, 0.02, 1), 2, parallel);
    EXPECT_GT(check().second, 20);
    EXPECT_EQ(body.pieces().count(), 2U);
}

// A cut that leaves the body has no front there: nothing behind it is visible.
TEST(BodyTransparency, ACutEndsAtItsFrontOnly) {
    const Parallel parallel(2);
    BodySettings settings;
    settings.cell_size = 0.0125;
    settings.phyxel_count = 500;
    settings.criterion = occlusion::CriterionKind::transparency;
    Body body(geometry::make_box(Vec3::Constant(0.2)), settings, parallel);
    constexpr double x = 0.0042, front = 0.05;
    body.cut_with_sheet(plane_sheet(x, -1, front), 0, parallel);
    const occlusion::PairSet pairs = body.pair_set();
    int deep = 0, shallow = 0;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        const Vec3 &a = pairs.rest[pairs.a[k]], &b = pairs.rest[pairs.b[k]];
        // The surface deviates from the sheet by a fraction of a cell.
        if (std::max(a[0], b[0]) < x + 0.004 || std::min(a[0], b[0]) > x - 0.004) continue;
        const double y = a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1]);
        const double behind = front - y, opaque = 0.5 * pairs.reach(k);
        if (behind > opaque + settings.cell_size) {
            EXPECT_EQ(body.pairs().visibility[k], 0) << y << ' ' << a.transpose() << ", " << b.transpose();
            ++deep;
        }
        shallow += body.pairs().visibility[k] > 0 && body.pairs().visibility[k] < 1;
    }
    EXPECT_GT(deep, 50);
    EXPECT_GT(shallow, 3);
}

}  // namespace
}  // namespace splitcubes::body
