#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/cutting/blade.h>

#include <cmath>
#include <limits>
#include <numbers>

using namespace splitcubes;
using namespace splitcubes::cutting;

namespace {

Quat turn(const Vec3& axis, double angle) {
    return Quat(Eigen::AngleAxisd(angle, axis.normalized()));
}

BladeShape stick() {
    return make_straight_blade({0, 0, 0}, {0, 0, 1});
}

double distance(const std::vector<std::vector<Vec3>>& a, const std::vector<std::vector<Vec3>>& b) {
    double out = 0;
    for (std::size_t line = 0; line < a.size(); ++line)
        for (std::size_t i = 0; i < a[line].size(); ++i)
            out = std::max(out, (a[line][i] - b[line][i]).norm());
    return out;
}

}  // namespace

TEST(Blade, PassesThroughItsKeyframesAndRestsOutside) {
    const std::vector<Keyframe> keys = {{1, {0, 0, 0}, turn({0, 0, 1}, 0.2)},
                                        {2, {1, 2, 0}, turn({1, 0, 1}, 1)},
                                        {4, {3, 0, -1}, turn({0, 1, 1}, 2)}};
    const BladeShape shape{{{{0, 0, 0}, {0.1, 0, 1}}, {{1, 0, 0}, {1, 1, 0}, {1, 1, 1}}}};
    for (const PathInterpolation kind : {PathInterpolation::linear, PathInterpolation::smooth}) {
        const Blade blade("b", shape, keys, {.interpolation = kind});
        for (const Keyframe& key : keys) {
            const auto pose = blade.pose(key.time);
            ASSERT_EQ(pose.size(), 2U);
            ASSERT_EQ(pose[1].size(), 3U);
            EXPECT_LT((pose[1][2] - (key.position + key.rotation * Vec3(1, 1, 1))).norm(), 1e-14);
        }
        EXPECT_EQ(distance(blade.pose(-7), blade.pose(1)), 0);
        EXPECT_EQ(distance(blade.pose(400), blade.pose(4)), 0);
        // The path has no jumps.
        for (double t = 0.5; t < 4.5; t += 0.01)
            EXPECT_LT(distance(blade.pose(t), blade.pose(t + 1e-7)), 1e-5);
    }
}

TEST(Blade, LinearPathsAreStraightAndTurnsEven) {
    const Blade blade("b", stick(), {{0, {0, 0, 0}, Quat::Identity()}, {2, {4, 0, 0}, turn({1, 0, 0}, 1.2)}});
    for (const double f : {0.25, 0.5, 0.9}) {
        const Isometry frame = blade.frame(2 * f);
        EXPECT_LT((frame.translation() - Vec3(4 * f, 0, 0)).norm(), 1e-14);
        EXPECT_LT((frame.linear() - turn({1, 0, 0}, 1.2 * f).toRotationMatrix()).norm(), 1e-14);
    }
}

TEST(Blade, SmoothPathsReproduceParabolasAtUnevenTimes) {
    const auto parabola = [](double t) -> Vec3 { return {t, 2 * t * t - t, 1 - 0.5 * t * t}; };
    std::vector<Keyframe> keys;
    for (const double t : {0.0, 0.3, 1.0, 1.2, 2.0}) keys.push_back({t, parabola(t), Quat::Identity()});
    const Blade blade("b", stick(), keys, {.interpolation = PathInterpolation::smooth});
    for (double t = 0; t <= 2; t += 0.07)
        EXPECT_LT((blade.frame(t).translation() - parabola(t)).norm(), 1e-13) << t;
}

TEST(Blade, SmoothPathOfTwoKeyframesIsStraight) {
    const Blade blade("b", stick(), {{0, {0, 0, 0}, Quat::Identity()}, {1, {1, 2, 3}, Quat::Identity()}},
                      {.interpolation = PathInterpolation::smooth});
    EXPECT_LT((blade.frame(0.3).translation() - 0.3 * Vec3(1, 2, 3)).norm(), 1e-14);
}

TEST(Blade, IsActiveFromItsFirstToItsLastKeyframeByDefault) {
    const std::vector<Keyframe> keys = {{1, {0, 0, 0}, Quat::Identity()}, {3, {1, 0, 0}, Quat::Identity()}};
    const Blade whole("b", stick(), keys);
    EXPECT_FALSE(whole.active(0.99));
    EXPECT_TRUE(whole.active(1));
    EXPECT_TRUE(whole.active(3));
    EXPECT_FALSE(whole.active(3.01));
    const Blade part("b", stick(), keys, {.active_from = 2, .active_until = 10});
    EXPECT_FALSE(part.active(1.5));
    EXPECT_TRUE(part.active(9));
}

TEST(Blade, ArcsLieOnTheirCircle) {
    const Vec3 center(1, 2, 3), axis(1, 1, 0);
    const auto points = make_arc_blade(center, 0.5, axis, 0.3, 2.1, 20).polylines.at(0);
    ASSERT_EQ(points.size(), 21U);
    for (std::size_t k = 0; k < points.size(); ++k) {
        EXPECT_NEAR((points[k] - center).norm(), 0.5, 1e-14);
        EXPECT_NEAR((points[k] - center).dot(axis), 0, 1e-14);
        // Right-handed from angle zero, evenly spaced.
        const Quat rotation = turn(axis, 0.3 + 1.8 * static_cast<double>(k) / 20);
        EXPECT_LT((points[k] - center - 0.5 * (rotation * angle_zero_about(axis))).norm(), 1e-14);
    }
}

TEST(Blade, AngleZeroIsAcrossTheAxis) {
    EXPECT_LT((angle_zero_about({0, 0, 5}) - Vec3::UnitX()).norm(), 1e-15);
    EXPECT_LT((angle_zero_about({1e-200, 0, 0}) - Vec3::UnitY()).norm(), 1e-15);
    for (const double degrees : {24.0, 26.0, 154.0, 156.0}) {
        const double angle = degrees * std::numbers::pi / 180;
        const Vec3 axis(std::cos(angle), 0, std::sin(angle)), zero = angle_zero_about(axis);
        EXPECT_NEAR(zero.norm(), 1, 1e-15);
        EXPECT_NEAR(zero.dot(axis), 0, 1e-15);
        EXPECT_NEAR(zero.y(), degrees == 24 || degrees == 156 ? 1 : 0, 1e-15);
    }
    EXPECT_THROW(angle_zero_about({0, 0, 0}), InputError);
}

TEST(Blade, CircularPathsGoRoundAtAConstantRate) {
    const Vec3 center(1, 0, 2), axis(0, 0, 2);
    for (const double turns : {0.5, 2.25, -1.0})
        for (const bool with_path : {true, false}) {
            const auto keys = circular_path(center, axis, 3, 0.4, turns, 1, 5, with_path, 32);
            EXPECT_EQ(keys.size(), static_cast<std::size_t>(std::ceil(std::abs(turns) * 32)) + 1);
            EXPECT_EQ(keys.front().time, 1);
            EXPECT_EQ(keys.back().time, 5);
            const Blade blade("b", stick(), keys, {.interpolation = PathInterpolation::smooth});
            for (double t = 1; t <= 5; t += 0.013) {
                const double passed = 2 * std::numbers::pi * turns * (t - 1) / 4;
                const Isometry frame = blade.frame(t);
                const Vec3 expected = center + 3 * Vec3(std::cos(0.4 + passed), std::sin(0.4 + passed), 0);
                // Third order at the ends: (2 pi / 32)^3 / 15 of the radius.
                EXPECT_LT((frame.translation() - expected).norm(), 3 * 1e-3);
                const Quat rotation = turn(axis, with_path ? passed : 0);
                EXPECT_LT((frame.linear() - rotation.toRotationMatrix()).norm(), 1e-12);
            }
        }
}

TEST(Blade, RefusesInvalidShapesAndPaths) {
    const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
    const std::vector<Keyframe> keys = {{0, {0, 0, 0}, Quat::Identity()}, {1, {1, 0, 0}, Quat::Identity()}};
    const auto with = [&](const BladeShape& shape, const std::vector<Keyframe>& path,
                          const BladeOptions& options = {}) { return Blade("knife", shape, path, options); };
    EXPECT_NO_THROW(with(stick(), keys));
    EXPECT_NO_THROW(with(stick(), {keys[0]}));
    EXPECT_THROW(with({}, keys), InputError);
    EXPECT_THROW(with({{{}}}, keys), InputError);
    EXPECT_THROW(with({{{{0, 0, 0}}}}, keys), InputError);
    EXPECT_THROW(with({{{{1, 0, 0}, {1, 0, 0}}}}, keys), InputError);
    EXPECT_THROW(with({{{{1, 0, 0}, {inf, 0, 0}}}}, keys), InputError);
    EXPECT_THROW(with(stick(), {}), InputError);
    EXPECT_THROW(with(stick(), {keys[1], keys[0]}), InputError);
    EXPECT_THROW(with(stick(), {keys[0], keys[0]}), InputError);
    EXPECT_THROW(with(stick(), {{nan, {0, 0, 0}, Quat::Identity()}}), InputError);
    EXPECT_THROW(with(stick(), {{0, {0, nan, 0}, Quat::Identity()}}), InputError);
    EXPECT_THROW(with(stick(), {{0, {0, 0, 0}, Quat(0, 0, 0, 0)}}), InputError);
    EXPECT_THROW(with(stick(), {{0, {0, 0, 0}, Quat(nan, 0, 0, 0)}}), InputError);
    EXPECT_THROW(with(stick(), keys, {.active_from = 2}), InputError);
    EXPECT_THROW(with(stick(), keys, {.active_until = nan}), InputError);
    EXPECT_THROW(make_straight_blade({0, 0, 0}, {0, 0, 0}), InputError);
    EXPECT_THROW(make_arc_blade({0, 0, 0}, -1, {0, 0, 1}, 0, 1), InputError);
    EXPECT_THROW(make_arc_blade({0, 0, 0}, 1, {0, 0, 0}, 0, 1), InputError);
    EXPECT_THROW(make_arc_blade({0, 0, 0}, 1, {0, 0, 1}, 1, 1), InputError);
    EXPECT_THROW(make_arc_blade({0, 0, 0}, 1, {0, 0, 1}, 0, 1, 0), InputError);
    EXPECT_THROW(circular_path({0, 0, 0}, {0, 0, 1}, 1, 0, 1, 1, 1), InputError);
    EXPECT_THROW(circular_path({0, 0, 0}, {0, 0, 1}, -1, 0, 1, 0, 1), InputError);
    EXPECT_THROW(circular_path({0, 0, 0}, {0, 0, 1}, 1, 0, nan, 0, 1), InputError);
    try {
        with({{{{0, 0, 0}}}}, keys);
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("blade 'knife', polyline 0"), std::string::npos)
            << error.what();
    }
}

TEST(Blade, RotationsNeedNotBeUnit) {
    const Quat rotation = turn({1, 2, 3}, 0.7);
    Quat longer = rotation;
    longer.coeffs() *= 17;
    const Blade blade("b", stick(), {{0, {0, 0, 0}, longer}});
    EXPECT_LT((blade.frame(0).linear() - rotation.toRotationMatrix()).norm(), 1e-14);
}
