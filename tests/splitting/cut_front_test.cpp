// Fronts of sheets within faces: they follow a sheet's rim, and a surface with moved fronts is that of its
// grid.
#include <splitcubes/splitting/cut_front.h>

#include "laws/solids.h"
#include "splitting/cut_area.h"
#include "splitting/shrink.h"

#include <gtest/gtest.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/solidify.h>
#include <splitcubes/splitting/validate.h>

#include <numeric>

namespace splitcubes::splitting::cases {
namespace {

using laws::random_direction;
using laws::random_vector;

TEST(CutFront, FacesBesideAnEdgeSpanItAndItsOpposite) {
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 4; ++side) {
            const GridEdge edge{{5, 6, 7}, axis}, opposite = opposite_edge(edge, side);
            const GridFace face = face_beside(edge, side);
            EXPECT_EQ((opposite.node - edge.node).cwiseAbs().sum(), 1);
            EXPECT_EQ((opposite.node - edge.node)[axis], 0);
            EXPECT_EQ((opposite.node - edge.node)[face.axis], 0);
            EXPECT_EQ((opposite.node - edge.node).sum(), side % 2 == 0 ? -1 : 1);
            Vec3i sum = Vec3i::Zero();
            for (int k = 0; k < 4; ++k) sum += ring_node(face, k);
            EXPECT_EQ(sum, edge.node + edge.upper() + opposite.node + opposite.upper());
        }
}

// Moves random fronts of the grid to random steps and returns them.
std::vector<CutFront> move_some(NodeGrid& grid, Random& random) {
    std::vector<std::int32_t> slots(grid.crossings().size());
    std::iota(slots.begin(), slots.end(), 0);
    std::vector<CutFront> moved;
    for (const CutFront& front : fronts_beside(grid, slots)) {
        if (random.below(3) > 0) continue;
        grid.move_front(front, 1 + static_cast<int>(random.below(front_steps - 1)));
        moved.push_back(front);
    }
    return moved;
}

TEST(CutFront, ASurfaceKeptUpToDateIsMadeFromNothing) {
    Random random(61);
    std::size_t count = 0;
    for (int trial = 0; trial < 60; ++trial) {
        CutCase c = random_case(random, 2 + static_cast<int>(random.below(4)), 1, random.uniform(0.02, 0.4));
        shuffle(c.cuts, random);
        NodeGrid grid = uncut_grid(c);
        Surface surface(grid);
        for (std::size_t i = 0; i < c.cuts.size();) {
            const std::size_t batch = std::min<std::size_t>(1 + random.below(20), c.cuts.size() - i);
            const std::vector<std::int32_t> slots = apply_all(grid, std::span(c.cuts).subspan(i, batch));
            const std::vector<CutFront> moved = move_some(grid, random);
            surface.retessellate(grid, slots, moved);
            i += batch;
            count += moved.size();
            ASSERT_EQ(canonical_quads(surface), canonical_quads(Surface(grid))) << as_code(c);
        }
        ASSERT_EQ(validate(grid, surface, Pieces(grid)), std::vector<std::string>{});
    }
    EXPECT_GT(count, 1000U);
}

TEST(CutFront, AMovedFrontChangesOnlyWhatIsNear) {
    Random random(62);
    NodeGrid grid = grid_of(random_case(random, 8, 1, 0.1));
    Surface surface(grid);
    std::vector<std::int32_t> slots(grid.crossings().size());
    std::iota(slots.begin(), slots.end(), 0);
    std::size_t moved = 0;
    for (const CutFront& front : fronts_beside(grid, slots)) {
        const std::vector<SurfaceVertex> before = surface.vertices();
        grid.move_front(front, 3);
        surface.retessellate(grid, {}, std::array{front});
        ASSERT_EQ(before.size(), surface.vertices().size());
        const GridFace face = face_beside(grid.crossing(front.slot).edge, front.side);
        for (std::size_t k = 0; k < before.size(); ++k) {
            if (before[k].rest == surface.vertices()[k].rest) continue;
            ++moved;
            const Vec3 off = grid.rest().to_grid(surface.vertices()[k].rest) - face.node.cast<double>();
            ASSERT_LE(off.cwiseAbs().maxCoeff(), 3);
        }
    }
    EXPECT_GT(moved, 100U);
}

// Without fronts the rim is off by up to half a cell anywhere.
TEST(CutFront, TheCutHasTheAreaOfItsSheet) {
    Random random(63);
    SolidifyReport report;
    const geometry::TriangleMesh block = geometry::make_box(Vec3::Constant(1));
    const NodeGrid uncut =
        solidify(block, geometry::grid_around(block.bounds(), 1.0 / 20), report, Parallel(1));
    double worst = 0, worst_unknown = 0;
    for (int trial = 0; trial < 60; ++trial) {
        const Vec3 u = random_direction(random), v = u.cross(random_direction(random)).normalized();
        const double a = random.uniform(0.15, 0.35), b = random.uniform(0.15, 0.35);
        const Vec3 at = random_vector(random, 0.03);
        const geometry::TriangleMesh sheet{
            {at + a * u + b * v, at - a * u + b * v, at - a * u - b * v, at + a * u - b * v},
            {{0, 1, 2}, {0, 2, 3}}};
        NodeGrid grid = uncut;
        const std::vector<std::int32_t> slots = cut_with_sheet(grid, sheet, 0);
        const double band = 4 * (a + b) / 20;  // a cell wide along the rim
        worst = std::max(worst, std::abs(area_of_cut(grid, Surface(grid)) - 4 * a * b) / band);
        NodeGrid unknown = uncut;
        for (const std::int32_t slot : slots) {
            Crossing crossing = grid.crossing(slot);
            crossing.front = {};
            unknown.put(crossing);
        }
        worst_unknown =
            std::max(worst_unknown, std::abs(area_of_cut(unknown, Surface(unknown)) - 4 * a * b) / band);
    }
    EXPECT_LE(worst, 0.05);
    EXPECT_GT(worst_unknown, 0.1);
}

TEST(CutFront, StepsAreAtEqualDistances) {
    for (int k = 0; k < 8; ++k)
        for (const double within : {0.01, 0.5, 0.99}) {
            const int step = moving_step_at((k + within) / 8);
            EXPECT_EQ(step, 2 * k + 1);
            EXPECT_NEAR(static_cast<double>(step) / front_steps, (k + 0.5) / 8, 1e-12);
        }
    EXPECT_EQ(moving_step_at(-3), 1);
    EXPECT_EQ(moving_step_at(7), front_steps - 1);
    EXPECT_EQ(step_at(0.5), front_steps / 2);
    EXPECT_EQ(step_at(-3), 1);
    EXPECT_EQ(step_at(7), front_steps - 1);
}

}  // namespace
}  // namespace splitcubes::splitting::cases
