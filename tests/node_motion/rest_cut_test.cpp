// A blade on its path cuts a body at rest like the sheet that it sweeps.
#include <splitcubes/node_motion/rest_cut.h>

#include "laws/solids.h"

#include <gtest/gtest.h>
#include <splitcubes/cutting/sweep.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/solidify.h>
#include <splitcubes/splitting/validate.h>

#include <map>

namespace splitcubes::body {
namespace {

using namespace laws;
using cutting::Blade;
using cutting::BladeShape;
using cutting::Keyframe;
using geometry::TriangleMesh;
using splitting::Crossing;
using splitting::NodeGrid;

const Parallel two(2);

NodeGrid solid(const TriangleMesh& mesh, int cells) {
    splitting::SolidifyReport report;
    return splitting::solidify(
        mesh, geometry::grid_around(mesh.bounds(), geometry::cell_size_for(mesh.bounds(), cells)), report,
        two);
}

NodeGrid ball() {
    return solid(geometry::make_sphere(0.5, 3), 24);
}

std::map<std::uint64_t, Crossing> cuts_of(const NodeGrid& grid) {
    std::map<std::uint64_t, Crossing> out;
    for (const Crossing& c : grid.crossings())
        if (c.origin == splitting::Origin::cut) out.emplace(splitting::edge_id(c.edge), c);
    return out;
}

void expect_same_cuts(const NodeGrid& a, const NodeGrid& b, double tolerance) {
    const auto one = cuts_of(a), other = cuts_of(b);
    ASSERT_EQ(one.size(), other.size());
    for (const auto& [id, c] : one) {
        const auto found = other.find(id);
        ASSERT_NE(found, other.end());
        ASSERT_NEAR(c.hit, found->second.hit, tolerance);
        ASSERT_LE((c.normal - found->second.normal).norm(), tolerance);
    }
}

Blade straight(const Vec3& from, const Vec3& to, const Vec3& move, std::vector<double> times = {0, 1}) {
    std::vector<Keyframe> keys;
    for (const double t : times) keys.push_back({t * t + t, t * move, Quat::Identity()});
    return Blade("knife", cutting::make_straight_blade(from, to), keys);
}

TEST(RestCut, AStraightBladeOnAStraightPathCutsLikeTheSweptSheet) {
    Random random(21);
    std::size_t edges = 0;
    for (int trial = 0; trial < 20; ++trial) {
        SCOPED_TRACE(trial);
        const Vec3 from = random_vector(random, 0.8), to = random_vector(random, 0.8);
        const Vec3 move = random_vector(random, 1.2);
        NodeGrid by_blade = ball(), by_sheet = by_blade;
        const auto slots = cut_with_blade(by_blade, straight(from, to, move), 3, two);
        for (const std::int32_t slot : slots) ASSERT_EQ(by_blade.crossing(slot).cut, 3);
        const TriangleMesh sheet{{from, to, from + move, to + move}, {{0, 1, 2}, {1, 3, 2}}};
        EXPECT_EQ(splitting::cut_with_sheet(by_sheet, sheet, 3).size(), slots.size());
        // The sheet is snapped to 2^-20 cells: half a step for each of four corners.
        expect_same_cuts(by_blade, by_sheet, 1e-4);
        EXPECT_TRUE(splitting::validate(by_blade).empty());
        edges += slots.size();
    }
    EXPECT_GT(edges, 2000U);
}

TEST(RestCut, FurtherKeyframesOnTheSamePathChangeNothing) {
    Random random(22);
    for (int trial = 0; trial < 6; ++trial) {
        SCOPED_TRACE(trial);
        const Vec3 from = random_vector(random, 0.8), to = random_vector(random, 0.8);
        const Vec3 move = random_vector(random, 1.2);
        NodeGrid few = ball(), many = few;
        cut_with_blade(few, straight(from, to, move), 0, two);
        std::vector<double> times = {0};
        while (times.back() < 1) times.push_back(std::min(1.0, times.back() + random.uniform(0.001, 0.2)));
        cut_with_blade(many, straight(from, to, move, times), 0, two);
        expect_same_cuts(few, many, 1e-9);
    }
}

// Bent blade that rotates along a winding path.
Blade curved(cutting::PathInterpolation interpolation) {
    BladeShape shape = cutting::make_arc_blade(Vec3(0, 0.1, 0), 0.45, Vec3::UnitZ(), -1.2, 1.9, 12);
    shape.polylines.push_back({{-0.2, 0.3, 0.1}, {0.1, 0.2, -0.1}, {0.3, 0.31, 0.05}});
    const auto turn = [](double angle) {
        return Quat(Eigen::AngleAxisd(angle, Vec3(1, 0.3, 2).normalized()));
    };
    return Blade("curved", shape,
                 {{0, Vec3(0.1, -0.2, -0.6), turn(0)},
                  {0.4, Vec3(-0.1, 0.1, -0.2), turn(0.9)},
                  {1.3, Vec3(0.15, 0.1, 0.6), turn(-0.6)}},
                 {.interpolation = interpolation, .active_from = 0.11, .active_until = 1.2});
}

TEST(RestCut, CutsEveryEdgeThatTheBladeCrosses) {
    for (const auto interpolation :
         {cutting::PathInterpolation::linear, cutting::PathInterpolation::smooth}) {
        const Blade blade = curved(interpolation);
        NodeGrid grid = ball(), all = grid;
        const auto slots = cut_with_blade(grid, blade, 0, two);
        EXPECT_GT(slots.size(), 500U);
        // Reference: all edges of the grid are candidates in each span.
        Vec3 normal = Vec3::Zero();
        for (const auto& [t0, t1] : {std::pair{0.11, 0.4}, std::pair{0.4, 1.2}}) {
            std::vector<cutting::CandidateEdge> candidates;
            const Vec3i n = grid.rest().node_count;
            for (int k = 0; k < n.prod(); ++k)
                for (int axis = 0; axis < 3; ++axis) {
                    const splitting::GridEdge edge{{k % n[0], k / n[0] % n[1], k / (n[0] * n[1])}, axis};
                    if (!all.has_edge(edge) || !all.inside(edge.node) || !all.inside(edge.upper())) continue;
                    const Vec3 a = all.rest().node_position(edge.node);
                    const Vec3 b = all.rest().node_position(edge.upper());
                    candidates.push_back({splitting::edge_id(edge), {a, b, a, b}, Mat3::Identity()});
                }
            for (const cutting::EdgeCut& c :
                 cutting::cut_edges(cutting::sweep(blade, t0, t1), candidates, normal, two))
                all.cut(splitting::edge_from_id(c.id), c.parameter, c.rest_normal, splitting::Origin::cut, 0);
        }
        expect_same_cuts(grid, all, 0);
    }
}

TEST(RestCut, SameBitsForAnyNumberOfThreads) {
    NodeGrid one = ball(), other = one;
    const auto slots = cut_with_blade(one, curved(cutting::PathInterpolation::smooth), 0, Parallel(1));
    EXPECT_EQ(cut_with_blade(other, curved(cutting::PathInterpolation::smooth), 0, Parallel(3)), slots);
    expect_same_cuts(one, other, 0);
}

TEST(RestCut, AClosedPathCutsOutACore) {
    NodeGrid grid = solid(geometry::make_box(Vec3(1, 1, 0.5)), 24);
    const BladeShape loop =
        cutting::make_arc_blade(Vec3::Zero(), 0.25, Vec3::UnitZ(), 0.1, 0.1 + 2 * std::numbers::pi, 48);
    const Blade corer(
        "corer", loop,
        {{0, Vec3(0.01, 0.02, 1), Quat::Identity()}, {1, Vec3(0.01, 0.02, -1), Quat::Identity()}});
    EXPECT_FALSE(cut_with_blade(grid, corer, 0, two).empty());
    const splitting::Pieces pieces(grid);
    ASSERT_EQ(pieces.count(), 2U);
    const double h = grid.rest().cell_size;
    EXPECT_NEAR(static_cast<double>(pieces.node_counts()[1]) * h * h * h, std::numbers::pi * 0.0625 * 0.5,
                0.005);
}

// Planes through nodes, normal to one axis of the grid and to diagonals of two and three.
TEST(RestCut, ABladeThroughGridNodesMakesTwoPieces) {
    const NodeGrid whole = solid(geometry::make_box(Vec3(1, 0.8, 0.6)), 20);
    const Vec3 node = whole.rest().node_position(whole.rest().node_count / 2);
    for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(0, 1, 0), Vec3(1, 0, 0), Vec3(0, 1, 1), Vec3(1, -1, 0)}) {
        const Vec3 along = 2 * normal.unitOrthogonal();
        const Vec3 across = 2 * normal.normalized().cross(along.normalized());
        NodeGrid grid = whole;
        cut_with_blade(grid, straight(node - along - across, node + along - across, 2 * across), 0, two);
        const splitting::Pieces pieces(grid);
        std::size_t fragments = 0;
        for (int k = 0; k < static_cast<int>(pieces.count()); ++k)
            fragments += pieces.node_counts()[static_cast<std::size_t>(k)] < 100;
        EXPECT_EQ(pieces.count() - fragments, 2U) << normal.transpose();
        EXPECT_EQ(fragments, 0U) << normal.transpose();
    }
}

TEST(RestCut, CutsNothingOutsideTheBodyOrTwice) {
    NodeGrid grid = ball();
    EXPECT_TRUE(cut_with_blade(grid, straight({2, 0, 0}, {3, 0, 0}, {0, 0, 1}), 0, two).empty());
    EXPECT_TRUE(cut_with_blade(grid, straight({1e7, -1e7, 0}, {1e7, 1e7, 3}, {0, 0, 1e7}), 0, two).empty());
    // A path smaller than a cell, between the nodes.
    const Vec3 at = grid.rest().node_position(grid.rest().node_count / 2) + Vec3::Constant(0.3) / 24;
    EXPECT_TRUE(
        cut_with_blade(grid, straight(at, at + Vec3(0.002, 0.001, 0), {0, 0, 0.003}), 0, two).empty());
    EXPECT_TRUE(cuts_of(grid).empty());
    // A large path cuts, but not again where the body is cut already.
    const Blade huge = straight({-1e6, 0.01, -1e6}, {1e6, 0.02, -1e6}, {0.1, 0.1, 2e6});
    EXPECT_FALSE(cut_with_blade(grid, huge, 0, two).empty());
    EXPECT_TRUE(cut_with_blade(grid, huge, 1, two).empty());
}

TEST(RestCut, StopsBetweenSpansOnRequest) {
    NodeGrid grid = ball(), part = grid;
    const Blade blade = straight({-1, 0, -0.6}, {1, 0.1, -0.6}, {0, 0, 1.2}, {0, 0.25, 0.5, 0.75, 1});
    const std::size_t all = cut_with_blade(grid, blade, 0, two).size();
    int calls = 0;
    const std::size_t some = cut_with_blade(part, blade, 0, two, [&] { return ++calls > 2; }).size();
    EXPECT_EQ(calls, 3);
    EXPECT_GT(some, 0U);
    EXPECT_LT(some, all);
}

}  // namespace
}  // namespace splitcubes::body
