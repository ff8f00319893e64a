// Fronts of the cuts of blades: they are where the blade is, also within cells and in moving bodies.
#include <splitcubes/node_motion/blade_fronts.h>

#include "laws/solids.h"
#include "laws/worlds.h"
#include "splitting/cut_area.h"

#include <gtest/gtest.h>
#include <splitcubes/node_motion/face_reach.h>
#include <splitcubes/node_motion/rest_cut.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/solidify.h>
#include <splitcubes/splitting/surface.h>

namespace splitcubes::body {
namespace {

using namespace laws;
using splitting::CutFront;

MovingFace unit_face(const Isometry& before, const Isometry& now, const splitting::FrontRay& ray) {
    MovingFace out;
    const std::array<Vec3, 4> corners = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0)};
    for (std::size_t k = 0; k < 4; ++k) {
        out.before[k] = before * corners[k];
        out.now[k] = now * corners[k];
    }
    out.ray = ray;
    return out;
}

cutting::SweptBlade swept(const geometry::MovingSegment& segment) {
    cutting::SweptBlade out;
    out.segments = {segment};
    out.bounds = geometry::bounds_of(segment);
    return out;
}

// A blade across the face moves along the way of the sheet, while both are carried along.
TEST(FaceReach, IsWhereTheBladeIsInTheFace) {
    Random random(71);
    const splitting::FrontRay ray{Vec2(0.4, 0), Vec2(0.1, 1)};
    for (int trial = 0; trial < 200; ++trial) {
        const Isometry before = Eigen::Translation3d(random_vector(random, 3)) * random_rotation(random);
        Isometry now = before;
        now.pretranslate(random_vector(random, 1));
        const double from = random.uniform(-0.5, 0.3), to = random.uniform(0.4, 0.9);
        const auto at = [&](double share, double height) {
            const Vec2 in_face = ray.start + share * ray.way;
            return Vec3(in_face.x(), in_face.y(), height);
        };
        const double low = random.uniform(-2, -0.1), high = random.uniform(0.1, 2);
        const cutting::SweptBlade blade =
            swept({before * at(from, low), before * at(from, high), now * at(to, low), now * at(to, high)});
        const auto share = reach_in(unit_face(before, now, ray), std::array{blade});
        ASSERT_TRUE(share);
        EXPECT_NEAR(*share, to, 1e-12);
    }
}

// The end of the blade passes through the face and goes on.
TEST(FaceReach, IsWhereTheEndOfTheBladePassedTheFace) {
    const splitting::FrontRay ray{Vec2(0, 0.5), Vec2(1, 0)};
    const MovingFace face = unit_face(Isometry::Identity(), Isometry::Identity(), ray);
    const cutting::SweptBlade blade =
        swept({Vec3(-1, 0.5, -1), Vec3(0.3, 0.5, -1), Vec3(-1, 0.5, 3), Vec3(0.7, 0.5, 3)});
    const auto share = reach_in(face, std::array{blade});
    ASSERT_TRUE(share);
    EXPECT_NEAR(*share, 0.4, 1e-12);
    EXPECT_FALSE(reach_in(
        face, std::array{swept({Vec3(-1, 0.5, 1), Vec3(0.3, 0.5, 1), Vec3(-1, 0.5, 3), Vec3(0.7, 0.5, 3)})}));
}

splitting::NodeGrid ball_grid() {
    const geometry::TriangleMesh ball = geometry::make_sphere(0.5, 3);
    splitting::SolidifyReport report;
    return splitting::solidify(ball, geometry::grid_around(ball.bounds(), 1.0 / 24), report, Parallel(2));
}

TEST(BladeFronts, AtRestAreThoseOfTheSweptSheet) {
    Random random(72);
    std::size_t known = 0, missing = 0;
    for (int trial = 0; trial < 20; ++trial) {
        const Vec3 from = random_vector(random, 0.4), to = random_vector(random, 0.4);
        const Vec3 move = random_vector(random, 0.6);
        splitting::NodeGrid by_blade = ball_grid(), by_sheet = by_blade;
        std::vector<cutting::Keyframe> keys;
        for (const double t : {0.0, 0.3, 1.0}) keys.push_back({t, t * move, Quat::Identity()});
        cut_with_blade(by_blade, cutting::Blade("knife", cutting::make_straight_blade(from, to), keys), 0,
                       Parallel(2));
        const geometry::TriangleMesh sheet{{from, to, from + move, to + move}, {{0, 1, 2}, {1, 3, 2}}};
        const std::vector<std::int32_t> slots = splitting::cut_with_sheet(by_sheet, sheet, 0);
        for (const CutFront& front : splitting::fronts_beside(by_sheet, slots)) {
            const splitting::Crossing& c = by_sheet.crossing(front.slot);
            const std::int32_t other = by_blade.slot(c.edge);
            ASSERT_GE(other, 0);
            const int one = c.front[front.side], two = by_blade.crossing(other).front[front.side];
            missing += one == 0 || two == 0;
            if (one == 0 || two == 0) continue;
            ++known;
            ASSERT_NEAR(one, two, 1);
        }
    }
    EXPECT_GT(known, 500U);
    EXPECT_LE(missing, known / 20);
}

// A blade moves into a block that flies. In every step the cut has the area that the blade has
// swept in the block, however few edges that step cuts.
TEST(BladeFronts, TheCutGrowsWithTheBlade) {
    constexpr double side = 0.1, cell = side / 16;
    World world(free_space(), threads(2));
    BodySettings settings = soft(cell, 200);
    settings.material.youngs_modulus = 1e6;
    settings.velocity = Vec3(0.1, 0.05, -0.2);
    Body& body = world.add_body(geometry::make_box(Vec3::Constant(side)), settings);
    // The blade flies along with the block. It starts above it and moves down by a fifth of a cell a step.
    const double duration = 1, depth = 12 * cell;
    const Vec3 carried = settings.velocity * duration;
    const Vec3 top(0.2 * cell, 0, 0.5 * side);
    world.add_tool(moving_blade(Vec3(0, -side, 0), Vec3(0, side, 0), top, top + carried - Vec3(0, 0, depth),
                                0, duration));
    int still = 0;
    double last = 0;
    for (int step = 0; step <= 60; ++step) {
        const StepReport report = world.step();
        const double area = area_of_cut(body.grid(), body.surface());
        EXPECT_GE(area, last - 1e-9);
        const double sunk = depth * step / 60;
        if (sunk > cell) {  // no edge lies above half a cell
            EXPECT_NEAR(area, side * sunk, 0.15 * cell * side) << step;
        }
        still += report.counts.new_cut_edges == 0 && area > last;
        last = area;
    }
    EXPECT_GT(still, 10);
}

}  // namespace
}  // namespace splitcubes::body
