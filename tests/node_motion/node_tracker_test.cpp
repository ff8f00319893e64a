// Revisions of the rows of tracked nodes.
#include <splitcubes/body/body.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/node_motion/node_tracker.h>

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace splitcubes::body {
namespace {

using Row = std::vector<std::pair<std::uint32_t, double>>;  // phyxel, weight

struct Rows {
    std::vector<Row> row;
    std::vector<std::uint64_t> revision;
};

Rows rows_of(const NodeTracker& nodes) {
    Rows out;
    const meshless::NodeKernels& kernels = nodes.kernels();
    for (std::uint32_t i = 0; i < kernels.size(); ++i) {
        out.row.emplace_back();
        const meshless::NodeKernels::Row& row = kernels.rows[i];
        for (std::uint32_t k = row.begin; k < row.begin + row.count; ++k)
            out.row.back().emplace_back(kernels.phyxel[k], kernels.weight[k]);
        out.revision.push_back(nodes.row_revision(i));
    }
    return out;
}

// Triangle from outside the face x = -0.1 to x = depth, at height z.
geometry::TriangleMesh notch(double depth, double z) {
    return {{Vec3(-1, -2, z), Vec3(-1, 2, z + 0.001), Vec3(depth, 0, z)}, {{0, 1, 2}}};
}

// Caches keyed by a row's revision are refreshed where the row changed, and only there.
TEST(NodeTracker, RevisionsChangeExactlyWithTheRows) {
    const Parallel parallel(2);
    BodySettings settings;
    settings.cell_size = 0.01;
    settings.phyxel_spacing = 0.02;
    Body body(geometry::make_box(Vec3(0.2, 0.2, 0.2)), settings, parallel);
    Rows before = rows_of(body.nodes());
    std::size_t changed = 0, kept = 0;
    int cut_number = 0;
    for (const double z : {0.011, -0.0312, 0.0511, -0.0713}) {
        const std::size_t phyxels = body.phyxels().size();
        body.cut_with_sheet(notch(0.03 + z, z), cut_number++, parallel);
        ASSERT_EQ(body.phyxels().size(), phyxels);
        Rows now = rows_of(body.nodes());
        for (std::size_t i = 0; i < before.row.size(); ++i) {
            const bool is_changed = now.row[i] != before.row[i];
            EXPECT_EQ(now.revision[i] != before.revision[i], is_changed) << i;
            changed += is_changed;
            kept += !is_changed;
        }
        before = std::move(now);
    }
    EXPECT_GT(changed, 100U);
    EXPECT_GT(kept, 100U);
}

}  // namespace
}  // namespace splitcubes::body
