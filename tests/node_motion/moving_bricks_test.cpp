// Every edge that a blade crosses is found, for any deformation of the body.
#include <splitcubes/body/body.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/node_motion/moving_bricks.h>
#include <splitcubes/samples/frames.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <span>
#include <vector>

namespace splitcubes::body {
namespace {

using splitting::GridEdge;

struct Bent {
    meshless::Phyxels phyxels;
    std::vector<Mat3> previous_deformation;
};

// Returns the body's phyxels twisted, bent and perturbed, now and a step ago.
Bent bent(const Body& body, double twist, Random& random) {
    Bent out{body.phyxels(), {}};
    meshless::Phyxels& phyxels = out.phyxels;
    out.previous_deformation.resize(phyxels.size());
    const auto shaken = [&](double size) {
        return Vec3(size * random.uniform(-1, 1), size * random.uniform(-1, 1), size * random.uniform(-1, 1));
    };
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const Vec3& rest = phyxels.rest_position[i];
        const auto deform = [&](double rate, const Vec3& shift, Vec3& position, Mat3& deformation) {
            const Mat3 turn = Eigen::AngleAxisd(rate * rest.z(), Vec3::UnitZ()).toRotationMatrix();
            position = turn * rest + shift + shaken(0.01);
            deformation = turn;
            deformation.col(2) += rate * Vec3::UnitZ().cross(turn * rest);
            for (int k = 0; k < 3; ++k) deformation.col(k) += shaken(0.05);
        };
        deform(twist, Vec3(0.3, -0.2, 1), phyxels.position[i], phyxels.deformation[i]);
        deform(0.9 * twist, Vec3(0.28, -0.2, 1.04), phyxels.previous_position[i],
               out.previous_deformation[i]);
    }
    return out;
}

std::vector<geometry::Frame> frames_of(const std::vector<Vec3>& rest, const Bent& bent, const Body& body,
                                       bool now, const Parallel& parallel) {
    const std::vector<std::int32_t> piece(rest.size(), 0);
    const meshless::PhyxelLocator locator(bent.phyxels.rest_position, body.phyxel_spacing());
    const meshless::NodeKernels kernels =
        meshless::build_kernels(rest, piece, bent.phyxels, locator, {}, parallel);
    std::vector<geometry::Frame> out(rest.size());
    if (now) {
        meshless::evaluate_frames(kernels, rest, bent.phyxels, out, parallel);
    } else {
        meshless::evaluate_frames(kernels, rest, bent.phyxels, bent.phyxels.previous_position,
                                  bent.previous_deformation, out, parallel);
    }
    return out;
}

class MovingBricksAtTwist : public testing::TestWithParam<double> {};

TEST_P(MovingBricksAtTwist, ListEveryEdgeThatABladeCrosses) {
    const Parallel parallel(2);
    BodySettings settings;
    settings.cell_size = 0.05;
    settings.phyxel_spacing = 0.1;
    const Body body(geometry::make_box(Vec3(0.8, 0.8, 1.2)), settings, parallel);
    Random random(7);
    const Bent now = bent(body, GetParam(), random);

    std::vector<GridEdge> edges;
    std::vector<Vec3> lower, upper;
    const splitting::NodeGrid& grid = body.grid();
    for (std::size_t brick = 0; brick < grid.bricks().total(); ++brick)
        for (unsigned local = 0; local < splitting::nodes_per_brick; ++local) {
            const Vec3i node = grid.bricks().base(brick) + splitting::BrickLayout::local_node(local);
            if (!grid.rest().contains(node) || !grid.inside(node)) continue;
            for (int axis = 0; axis < 3; ++axis) {
                const GridEdge edge{node, axis};
                if (!grid.has_edge(edge) || grid.is_cut(edge)) continue;
                edges.push_back(edge);
                lower.push_back(grid.rest().node_position(node));
                upper.push_back(grid.rest().node_position(edge.upper()));
            }
        }
    const auto lower_before = frames_of(lower, now, body, false, parallel);
    const auto upper_before = frames_of(upper, now, body, false, parallel);
    const auto lower_now = frames_of(lower, now, body, true, parallel);
    const auto upper_now = frames_of(upper, now, body, true, parallel);

    MovingBricks bricks;
    std::size_t met = 0, listed = 0;
    for (int stroke = 0; stroke < 30; ++stroke) {
        const auto point = [&](double size) {
            return Vec3(size * random.uniform(-1, 1), size * random.uniform(-1, 1),
                        size * random.uniform(-1, 1));
        };
        cutting::SweptBlade blade;
        const Vec3 a = Vec3(0.3, -0.2, 1) + point(0.5), b = a + point(1.0), shift = point(0.05);
        blade.segments.push_back({a, b, a + shift, b + shift + point(0.02)});
        blade.bounds = geometry::bounds_of(blade.segments.front());
        const SweptBoxes swept(std::span(&blade, 1), 1e-5);
        const std::vector<GridEdge> near =
            bricks.edges_near({grid, now.phyxels, now.previous_deformation, 0}, swept, parallel);
        std::set<std::uint64_t> ids;
        for (const GridEdge& edge : near) {
            ids.insert(splitting::edge_id(edge));
            EXPECT_FALSE(grid.is_cut(edge));
        }
        EXPECT_EQ(ids.size(), near.size());
        listed += near.size();
        for (std::size_t e = 0; e < edges.size(); ++e) {
            const geometry::MovingSegment motion{lower_before[e].position, upper_before[e].position,
                                                 lower_now[e].position, upper_now[e].position};
            if (!geometry::first_hit(blade.segments.front(), motion)) continue;
            ++met;
            EXPECT_TRUE(ids.contains(splitting::edge_id(edges[e])));
        }
    }
    EXPECT_GT(met, 100U);
    EXPECT_LT(listed, 30 * edges.size() / 4);  // most edges are excluded
}

INSTANTIATE_TEST_SUITE_P(Twists, MovingBricksAtTwist, testing::Values(0.0, 0.4, 2.0));

TEST(SweptBoxes, ContainTheSweepTightly) {
    const geometry::MovingSegment slanted{{0, 0, 0}, {1, 1, 1}, {0.1, -0.1, 0}, {1.1, 0.9, 1}};
    cutting::SweptBlade blade;
    blade.segments.push_back(slanted);
    blade.bounds = geometry::bounds_of(slanted);
    const SweptBoxes swept(std::span(&blade, 1), 1e-6);
    std::vector<std::uint32_t> found;
    const auto around = [](const Vec3& point) { return geometry::Box{point, point}.grown(0.01); };
    for (double s = 0; s <= 1; s += 0.125)
        for (double t = 0; t <= 1; t += 0.125) {
            const geometry::MovingSegment part = geometry::part_of(slanted, t, 1);
            swept.meeting(around(geometry::moving_point(part.a0, part.b0, s)), found);
            EXPECT_EQ(found.size(), 1U);
        }
    // Inside the axis-aligned bounds but off the swept plane.
    swept.meeting(around({0.2, 0.8, 0.5}), found);
    EXPECT_TRUE(found.empty());
    EXPECT_TRUE(swept.bounds().contains({0.2, 0.8, 0.5}));
    swept.meeting(around({0.5, 0.5, 0.9}), found);
    EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace splitcubes::body
