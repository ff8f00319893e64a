// The shrinker finds planted faults.
#include "splitting/shrink.h"

#include <gtest/gtest.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/splitting/validate.h>

#include <set>

namespace splitcubes::splitting::cases {
namespace {

TEST(Shrink, FindsThePlantedItems) {
    Random random(1);
    for (int trial = 0; trial < 100; ++trial) {
        std::vector<int> items(200);
        for (std::size_t i = 0; i < items.size(); ++i) items[i] = static_cast<int>(i);
        std::set<int> planted;
        while (planted.size() < 1 + random.below(6)) planted.insert(static_cast<int>(random.below(200)));
        const auto fails = [&](const std::vector<int>& some) {
            return std::includes(some.begin(), some.end(), planted.begin(), planted.end());
        };
        const std::vector<int> minimal = shrink(items, fails);
        ASSERT_EQ(minimal, std::vector<int>(planted.begin(), planted.end()));
    }
}

TEST(Shrink, LeavesNothingThatCanGo) {
    // Fails if at least 7 even numbers are left: there are many minimal lists, all of 7.
    std::vector<int> items(101);
    for (std::size_t i = 0; i < items.size(); ++i) items[i] = static_cast<int>(i);
    const auto fails = [](const std::vector<int>& some) {
        return std::count_if(some.begin(), some.end(), [](int i) { return i % 2 == 0; }) >= 7;
    };
    EXPECT_EQ(shrink(items, fails).size(), 7U);
    EXPECT_EQ(shrink(items, [](const std::vector<int>&) { return true; }).size(), 0U);
}

// Planted fault: a cell of the surface in which edges 0 and 9 are both cut inside the body.
TEST(Shrink, FindsThePlantedEdgesOfACase) {
    Random random(3);
    const CutCase large = random_case(random, 5, 0.9, 0.6);
    const Fails planted = [](const CutCase& c) {
        const NodeGrid grid = grid_of(c);
        const Surface surface(grid);
        for (const SurfaceCell& cell : surface.cells()) {
            if ((cell.mask & 0x201U) != 0x201U) continue;
            bool inner = true;
            for (const int e : {0, 9})
                inner =
                    inner && grid.crossing(grid.slot(cell_edge(cell.lowest_node, e))).origin == Origin::cut;
            if (inner) return true;
        }
        return false;
    };
    ASSERT_TRUE(planted(large));
    const CutCase minimal = shrink_case(large, planted);
    EXPECT_TRUE(planted(minimal));
    // Edge 0 joins corners 0 and 1, edge 9 corners 1 and 5.
    EXPECT_EQ(minimal.cuts.size(), 2U);
    EXPECT_EQ(minimal.inside.size(), 3U);
    for (const EdgeCut& c : minimal.cuts) {
        EXPECT_EQ(c.parameter, 0.5);
        EXPECT_EQ(c.normal, Vec3(Vec3::Zero()));
        EXPECT_EQ(c.cut, 0);
    }
    EXPECT_NE(as_code(minimal).find("const CutCase found{{7, 7, 7}, {"), std::string::npos)
        << as_code(minimal);
}

// A fault in the quads: those of one crossed axis are lost if three crossings of that axis meet in a cell.
TEST(Shrink, ShrinksABrokenSurface) {
    const auto trouble = [](const CutCase& c) -> std::string {
        const NodeGrid grid = grid_of(c);
        const Surface surface(grid);
        geometry::TriangleMesh mesh;
        for (const SurfaceVertex& v : surface.vertices()) mesh.positions.push_back(v.rest);
        for (const SurfaceCell& cell : surface.cells()) {
            const bool lossy = (cell.mask & 7U) == 7U && cell.inside == 255;
            for (const SurfaceQuad& q : surface.quads(cell)) {
                if (lossy && grid.crossing(q.crossing).edge.axis == 0) continue;
                mesh.triangles.push_back({q.vertices[0], q.vertices[1], q.vertices[2]});
                mesh.triangles.push_back({q.vertices[0], q.vertices[2], q.vertices[3]});
            }
        }
        const geometry::MeshCheck check = geometry::check_mesh(mesh);
        return check.triangles == 0 || check.valid() ? "" : "an open surface";
    };
    Random random(4);
    CutCase c;
    do c = random_case(random, 4, 0.95, 0.7);
    while (trouble(c).empty());
    const CutCase minimal = shrink_case(c, [&](const CutCase& some) { return !trouble(some).empty(); });
    EXPECT_EQ(minimal.cuts.size(), 3U) << as_code(minimal);
    EXPECT_EQ(minimal.inside.size(), 8U) << as_code(minimal);
    const std::string report = shrunk_report(c, trouble);
    EXPECT_EQ(report.rfind("an open surface; shrunk to 3 cuts and 8 nodes:\nconst CutCase found{", 0), 0U)
        << report;
}

// A test can read what as_code prints: this text was printed by it.
TEST(Shrink, PrintsCodeThatCompiles) {
    const CutCase found{
        {4, 4, 4}, {{1, 1, 1}, {2, 1, 1}}, {{{{1, 1, 1}, 0}, 0.10000000000000001, {0, 0.25, 1}, 2}}};
    EXPECT_EQ(as_code(found),
              "const CutCase found{{4, 4, 4}, {{1, 1, 1}, {2, 1, 1}}, {\n"
              "    {{{1, 1, 1}, 0}, 0.10000000000000001, {0, 0.25, 1}, 2}}};\n");
    EXPECT_EQ(grid_of(found).crossings().size(), 10U + 1U);
    EXPECT_TRUE(validate(grid_of(found)).empty());
}

}  // namespace
}  // namespace splitcubes::splitting::cases
