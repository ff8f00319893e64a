#include <gtest/gtest.h>
#include <splitcubes/core/random.h>
#include <splitcubes/cutting/sweep.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

using namespace splitcubes;
using namespace splitcubes::cutting;
using geometry::MovingSegment;

namespace {

Vec3 random_point(Random& random, double size) {
    return size * Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
}

CandidateEdge still_edge(std::uint64_t id, const Vec3& a, const Vec3& b) {
    return {id, {a, b, a, b}, Mat3::Identity()};
}

// Returns the edges of a block of grid cells.
std::vector<CandidateEdge> grid_edges(int side, double cell, const Vec3& origin) {
    std::vector<CandidateEdge> out;
    for (int x = 0; x < side; ++x)
        for (int y = 0; y < side; ++y)
            for (int z = 0; z < side; ++z)
                for (int axis = 0; axis < 3; ++axis) {
                    const Vec3 p = origin + cell * Vec3(x, y, z);
                    out.push_back(still_edge(out.size(), p, p + cell * Vec3::Unit(axis)));
                }
    return out;
}

Blade straight_stroke(const Vec3& from, const Vec3& to, const Vec3& start, const Vec3& end) {
    return Blade("stroke", make_straight_blade(from, to),
                 {{0, start, Quat::Identity()}, {1, end, Quat::Identity()}});
}

// Returns the result that cut_edges must have, by testing all segments.
std::vector<EdgeCut> brute_force_cuts(const std::vector<SweptBlade>& swept,
                                      const std::vector<CandidateEdge>& edges) {
    std::vector<EdgeCut> out;
    for (const CandidateEdge& edge : edges) {
        EdgeCut first{edge.id, 0, Vec3::Zero(), std::numeric_limits<double>::infinity()};
        for (const SweptBlade& part : swept)
            for (const MovingSegment& segment : part.segments) {
                const auto hit = first_hit(segment, geometry::part_of(edge.motion, part.begin, part.end));
                if (!hit) continue;
                const double time = part.begin + hit->time * (part.end - part.begin);
                if (time < first.time - 1e-12) first = {edge.id, hit->edge_parameter, Vec3::Zero(), time};
            }
        if (std::isfinite(first.time)) out.push_back(first);
    }
    std::sort(out.begin(), out.end(), [](const EdgeCut& a, const EdgeCut& b) { return a.id < b.id; });
    return out;
}

bool same(const std::vector<EdgeCut>& a, const std::vector<EdgeCut>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const EdgeCut& x, const EdgeCut& y) {
        return x.id == y.id && x.parameter == y.parameter && x.rest_normal == y.rest_normal &&
               x.time == y.time;
    });
}

}  // namespace

TEST(CutEdges, APlanarStrokeCutsWhatItsPlaneCrosses) {
    const Parallel parallel(1);
    const double cell = 0.1;
    const auto edges = grid_edges(10, cell, {0, 0, 0});
    // Right through, in the plane z = 0.43 + 0.2 x.
    const Vec3 along(1, 0, 0.2), normal = Vec3(-0.2, 0, 1).normalized();
    const Vec3 start = Vec3(0, 0, 0.43) - 2 * along;
    const Blade blade = straight_stroke({0, -1, 0}, {0, 3, 0}, start, start + 5 * along);
    Vec3 last = Vec3::Zero();
    const auto cuts = cut_edges(sweep(blade, 0, 1), edges, last, parallel);
    std::set<std::uint64_t> expected;
    for (const CandidateEdge& edge : edges) {
        const double a = normal.dot(edge.motion.a0 - Vec3(0, 0, 0.43));
        const double b = normal.dot(edge.motion.b0 - Vec3(0, 0, 0.43));
        if ((a < 0) != (b < 0)) expected.insert(edge.id);
    }
    ASSERT_GT(expected.size(), 100U);
    ASSERT_EQ(cuts.size(), expected.size());
    for (std::size_t k = 0; k < cuts.size(); ++k) {
        if (k > 0) {
            EXPECT_LT(cuts[k - 1].id, cuts[k].id);
        }
        EXPECT_TRUE(expected.count(cuts[k].id));
        const MovingSegment& m = edges[cuts[k].id].motion;
        const Vec3 crossing = m.a0 + cuts[k].parameter * (m.b0 - m.a0);
        EXPECT_NEAR(normal.dot(crossing - Vec3(0, 0, 0.43)), 0, 1e-12);
        EXPECT_NEAR(std::abs(cuts[k].rest_normal.dot(normal)), 1, 1e-12);
        EXPECT_NEAR(start.x() + 5 * cuts[k].time, crossing.x(), 1e-12);
    }
    EXPECT_NEAR(std::abs(last.dot(normal)), 1, 1e-12);
}

// The same edges are cut at the same positions for any division of the stroke into steps, and whether the
// blade or the body moves.
TEST(CutEdges, StrokesDoNotDependOnTheirSteps) {
    const Parallel parallel(1);
    const auto edges = grid_edges(6, 0.16, {-0.5, -0.5, -0.5});
    const Vec3 start(-1, 0.03, 0.07), path(2, 0.1, -0.06);
    const Blade blade = straight_stroke({0, -2, 0.1}, {0.3, 2, -0.2}, start, start + path);
    const auto stroke = [&](int steps, bool body_moves) {
        std::vector<EdgeCut> all;
        std::set<std::uint64_t> done;
        Vec3 last = Vec3::Zero();
        for (int k = 0; k < steps; ++k) {
            const double t0 = static_cast<double>(k) / steps, t1 = static_cast<double>(k + 1) / steps;
            std::vector<CandidateEdge> left;
            for (CandidateEdge edge : edges) {
                if (done.count(edge.id)) continue;
                if (body_moves) {
                    const Vec3 d0 = -t0 * path, d1 = -t1 * path;
                    edge.motion = {edge.motion.a0 + d0, edge.motion.b0 + d0, edge.motion.a0 + d1,
                                   edge.motion.b0 + d1};
                }
                left.push_back(edge);
            }
            const Blade still = straight_stroke({0, -2, 0.1}, {0.3, 2, -0.2}, start, start);
            for (const EdgeCut& cut :
                 cut_edges(sweep(body_moves ? still : blade, t0, t1), left, last, parallel)) {
                all.push_back(cut);
                done.insert(cut.id);
            }
        }
        std::sort(all.begin(), all.end(), [](const EdgeCut& a, const EdgeCut& b) { return a.id < b.id; });
        return all;
    };
    const auto whole = stroke(1, false);
    ASSERT_GT(whole.size(), 30U);
    for (const int steps : {1, 2, 5, 16})
        for (const bool body_moves : {false, true}) {
            const auto parts = stroke(steps, body_moves);
            ASSERT_EQ(parts.size(), whole.size()) << steps;
            for (std::size_t k = 0; k < whole.size(); ++k) {
                EXPECT_EQ(parts[k].id, whole[k].id);
                EXPECT_NEAR(parts[k].parameter, whole[k].parameter, 1e-9);
                EXPECT_NEAR(std::abs(parts[k].rest_normal.dot(whole[k].rest_normal)), 1, 1e-9);
            }
        }
}

TEST(CutEdges, AgreeWithTryingAllSegments) {
    Random random(1);
    const Parallel parallel(1);
    std::size_t total = 0;
    for (int trial = 0; trial < 12; ++trial) {
        const int points = 2 + static_cast<int>(random.below(30));
        BladeShape shape;
        for (int line = 0; line < 1 + trial % 3; ++line) {
            std::vector<Vec3> polyline = {random_point(random, 1)};
            for (int k = 1; k < points; ++k) polyline.push_back(polyline.back() + random_point(random, 0.2));
            shape.polylines.push_back(polyline);
        }
        std::vector<Keyframe> keys;
        for (int k = 0; k < 4; ++k)
            keys.push_back(
                {0.3 * k, random_point(random, 0.3),
                 Quat(Eigen::AngleAxisd(random.uniform(0, 1), random_point(random, 1).normalized()))});
        const Blade blade("b", shape, keys);
        const auto swept = sweep(blade, 0.1, 0.8);
        std::vector<CandidateEdge> edges;
        for (std::uint64_t k = 0; k < 200; ++k) {
            const Vec3 a = random_point(random, 1), b = a + random_point(random, 0.2);
            edges.push_back({997 * k % 200,
                             {a, b, a + random_point(random, 0.1), b + random_point(random, 0.1)},
                             Mat3::Identity()});
        }
        Vec3 last = Vec3::Zero();
        const auto cuts = cut_edges(swept, edges, last, parallel);
        const auto expected = brute_force_cuts(swept, edges);
        total += cuts.size();
        ASSERT_EQ(cuts.size(), expected.size());
        for (std::size_t k = 0; k < cuts.size(); ++k) {
            EXPECT_EQ(cuts[k].id, expected[k].id);
            EXPECT_NEAR(cuts[k].time, expected[k].time, 1e-9);
            EXPECT_NEAR(cuts[k].parameter, expected[k].parameter, 1e-6);
            EXPECT_NEAR(cuts[k].rest_normal.norm(), 1, 1e-14);
        }
    }
    EXPECT_GT(total, 60U);
}

TEST(CutEdges, AreTheSameOnAnyNumberOfThreads) {
    const auto edges = grid_edges(12, 0.1, {-0.6, -0.6, -0.6});
    const Blade blade("arc", make_arc_blade({0, 0, 0}, 0.4, {0, 1, 0}, 0, 3, 40),
                      circular_path({0.3, -0.3, 0}, {0, 0, 1}, 0.4, 0, 1, 0, 1));
    const auto swept = sweep(blade, 0, 1);
    Vec3 last1 = Vec3::Zero(), last4 = Vec3::Zero();
    const auto one = cut_edges(swept, edges, last1, Parallel(1));
    const auto four = cut_edges(swept, edges, last4, Parallel(4));
    EXPECT_GT(one.size(), 100U);
    EXPECT_TRUE(same(one, four));
    EXPECT_EQ(last1, last4);
    // The result does not depend on the order of the candidates either.
    auto turned = edges;
    std::reverse(turned.begin(), turned.end());
    Vec3 last_turned = Vec3::Zero();
    EXPECT_TRUE(same(one, cut_edges(swept, turned, last_turned, Parallel(2))));
    EXPECT_EQ(last1, last_turned);
}

// A rod that makes a full turn cuts a disk, in one step as in many; no chord cuts off the rim.
TEST(CutEdges, AFullTurnInOneStepCutsADisk) {
    const Parallel parallel(1);
    std::vector<Keyframe> keys;
    for (int k = 0; k <= 8; ++k)
        keys.push_back(
            {k / 8.0, {0, 0, 0}, Quat(Eigen::AngleAxisd(2 * std::numbers::pi * k / 8, Vec3::UnitZ()))});
    const Blade blade("rod", make_straight_blade({0.01, 0, 0}, {1, 0, 0}), keys);
    std::vector<CandidateEdge> edges;
    Random random(2);
    std::size_t inside = 0;
    for (std::uint64_t id = 0; id < 800; ++id) {
        const double r = random.uniform(0.02, 1.2), angle = random.uniform(0, 2 * std::numbers::pi);
        if (std::abs(r - 1) < 2e-3) continue;
        inside += r < 1;
        const Vec3 p(r * std::cos(angle), r * std::sin(angle), 0);
        edges.push_back(still_edge(id, p - Vec3(0, 0, 0.1), p + Vec3(0, 0, 0.3)));
    }
    Vec3 last = Vec3::Zero();
    const auto cuts = cut_edges(sweep(blade, 0, 1), edges, last, parallel);
    EXPECT_EQ(cuts.size(), inside);
    for (const EdgeCut& cut : cuts) {
        EXPECT_NEAR(cut.parameter, 0.25, 1e-9);
        EXPECT_NEAR(std::abs(cut.rest_normal.z()), 1, 1e-12);
    }
}

TEST(CutEdges, NormalsArePulledBackToRest) {
    Random random(3);
    const Parallel parallel(1);
    for (int trial = 0; trial < 200; ++trial) {
        Mat3 jacobian = Mat3::Identity();
        for (int c = 0; c < 3; ++c) jacobian.col(c) += random_point(random, 0.3);
        const Vec3 rest_normal = random_point(random, 1).normalized();
        // Two rest directions of the cut plane, mapped to the world.
        const Vec3 s = rest_normal.unitOrthogonal(), t = rest_normal.cross(s);
        const Vec3 blade_direction = jacobian * s, motion = jacobian * t, edge = jacobian * rest_normal;
        const CandidateEdge candidate{7, {-edge, edge, -edge, edge}, jacobian};
        const Blade blade = straight_stroke(-blade_direction, blade_direction, -motion, motion);
        Vec3 last = Vec3::Zero();
        const auto cuts = cut_edges(sweep(blade, 0, 1), std::vector{candidate}, last, parallel);
        ASSERT_EQ(cuts.size(), 1U);
        EXPECT_NEAR(std::abs(cuts[0].rest_normal.dot(rest_normal)), 1, 1e-12);
        EXPECT_NEAR(cuts[0].parameter, 0.5, 1e-12);
    }
}

TEST(CutEdges, TheRelativeMotionGivesTheNormal) {
    const Parallel parallel(1);
    // The blade moves along x, the edge towards it along y at the same speed.
    const Blade blade = straight_stroke({0, 0, -1}, {0, 0, 1}, {-1, 0, 0}, {1, 0, 0});
    const MovingSegment motion{{-0.1, 1, 0}, {0.1, 1, 0}, {-0.1, -1, 0}, {0.1, -1, 0}};
    Vec3 last = Vec3::Zero();
    const auto cuts = cut_edges(sweep(blade, 0, 1), std::vector<CandidateEdge>{{1, motion, Mat3::Identity()}},
                                last, parallel);
    ASSERT_EQ(cuts.size(), 1U);
    EXPECT_NEAR(std::abs(cuts[0].rest_normal.dot(Vec3(1, -1, 0).normalized())), 1, 1e-12);
}

TEST(CutEdges, ABladeAtRestReusesTheStrokesNormal) {
    const Parallel parallel(1);
    const std::vector<CandidateEdge> edges = {still_edge(3, {0, 0, -1}, {0, 0, 1})};
    const Blade still = straight_stroke({-1, 0, 0}, {1, 0, 0}, {0, 0, 0}, {0, 0, 0});
    const Vec3 stroke = Vec3(0, 0.6, 0.8);
    Vec3 last = stroke;
    auto cuts = cut_edges(sweep(still, 0, 1), edges, last, parallel);
    ASSERT_EQ(cuts.size(), 1U);
    EXPECT_EQ(cuts[0].rest_normal, stroke);
    EXPECT_EQ(last, stroke);
    // Sliding along itself is not motion across itself.
    const Blade sliding = straight_stroke({-1, 0, 0}, {1, 0, 0}, {0, 0, 0}, {0.5, 0, 0});
    cuts = cut_edges(sweep(sliding, 0, 1), edges, last, parallel);
    ASSERT_EQ(cuts.size(), 1U);
    EXPECT_EQ(cuts[0].rest_normal, stroke);
    // Without a stroke the normal separates the edge's ends; also along the blade itself.
    last = Vec3::Zero();
    cuts = cut_edges(sweep(still, 0, 1), edges, last, parallel);
    ASSERT_EQ(cuts.size(), 1U);
    EXPECT_NEAR(std::abs(cuts[0].rest_normal.z()), 1, 1e-12);
    EXPECT_EQ(last, Vec3::Zero());
    cuts =
        cut_edges(sweep(still, 0, 1), std::vector{still_edge(4, {-0.5, 0, 0}, {0.5, 0, 0})}, last, parallel);
    ASSERT_EQ(cuts.size(), 1U);
    EXPECT_NEAR(cuts[0].rest_normal.norm(), 1, 1e-12);
}

TEST(CutEdges, IgnoresEdgesThatAreNotFinite) {
    const Parallel parallel(1);
    const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
    const Blade blade = straight_stroke({0, -1, 0}, {0, 1, 0}, {-1, 0, 0}, {1, 0, 0});
    std::vector<CandidateEdge> edges = {
        still_edge(0, {0, 0, -1}, {0, nan, 1}),   still_edge(1, {0, 0, -inf}, {0, 0, inf}),
        still_edge(2, {0, 0, 0}, {0, 0, 0}),      still_edge(3, {0.1, 0, -1}, {0.1, 0, 1}),
        still_edge(4, {0.2, 0, -1}, {0.2, 0, 1}),
    };
    edges[3].world_from_rest.setZero();
    edges[4].world_from_rest.setConstant(nan);
    Vec3 last = Vec3::Zero();
    const auto cuts = cut_edges(sweep(blade, 0, 1), edges, last, parallel);
    ASSERT_GE(cuts.size(), 2U);
    for (const EdgeCut& cut : cuts) {
        EXPECT_GE(cut.id, 2U);
        EXPECT_NEAR(cut.rest_normal.norm(), 1, 1e-12);
        EXPECT_GE(cut.parameter, 0);
        EXPECT_LE(cut.parameter, 1);
    }
    EXPECT_TRUE(last.allFinite());
}

TEST(CutEdges, EmptyInputGivesNoCuts) {
    const Parallel parallel(1);
    Vec3 last(0, 0, 1);
    EXPECT_TRUE(cut_edges({}, std::vector{still_edge(0, {0, 0, 0}, {1, 0, 0})}, last, parallel).empty());
    const Blade blade = straight_stroke({0, -1, 0}, {0, 1, 0}, {-1, 0, 0}, {1, 0, 0});
    EXPECT_TRUE(cut_edges(sweep(blade, 0, 1), {}, last, parallel).empty());
    EXPECT_EQ(last, Vec3(0, 0, 1));
}
