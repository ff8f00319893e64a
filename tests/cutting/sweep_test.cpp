#include <gtest/gtest.h>
#include <splitcubes/cutting/sweep.h>

#include <cmath>
#include <limits>
#include <numbers>

using namespace splitcubes;
using namespace splitcubes::cutting;

namespace {

Blade spinning(double angle, double duration) {
    std::vector<Keyframe> keys;
    const int spans = std::max(1, static_cast<int>(std::ceil(angle / 1.5)));
    for (int k = 0; k <= spans; ++k)
        keys.push_back(
            {duration * k / spans, {0, 0, 0}, Quat(Eigen::AngleAxisd(angle * k / spans, Vec3::UnitZ()))});
    return Blade("spin", make_straight_blade({0.2, 0, 0}, {1, 0, 0}), keys);
}

// Checks that parts follow each other without a gap and are within their bounds.
void check_chain(const std::vector<SweptBlade>& parts) {
    for (std::size_t k = 0; k < parts.size(); ++k) {
        const SweptBlade& part = parts[k];
        EXPECT_LT(part.begin, part.end);
        for (const auto& s : part.segments)
            for (const Vec3& p : {s.a0, s.b0, s.a1, s.b1}) EXPECT_TRUE(part.bounds.contains(p));
        if (k == 0) continue;
        EXPECT_EQ(parts[k - 1].end, part.begin);
        ASSERT_EQ(parts[k - 1].segments.size(), part.segments.size());
        for (std::size_t i = 0; i < part.segments.size(); ++i) {
            EXPECT_EQ(parts[k - 1].segments[i].a1, part.segments[i].a0);
            EXPECT_EQ(parts[k - 1].segments[i].b1, part.segments[i].b0);
        }
    }
}

}  // namespace

TEST(Sweep, OfABladeThatForgotIsTheSame) {
    SampledMotion path;
    for (int k = 0; k < 20; ++k) {
        Isometry frame = Isometry::Identity();
        frame.linear() = Eigen::AngleAxisd(0.2 * k, Vec3::UnitZ()).toRotationMatrix();
        frame.translation() = Vec3(0.1 * k, 0, std::sin(k));
        path.add(0.1 * k, frame);
    }
    const Blade whole("b", make_straight_blade({0, 0, 0}, {0, 0, 1}), path);
    Blade blade = whole;
    blade.forget_before(0.72);
    EXPECT_EQ(blade.samples().times().front(), path.times()[7]);
    const auto a = sweep(whole, 0.72, 1.3), b = sweep(blade, 0.72, 1.3);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) {
        EXPECT_EQ(a[k].begin, b[k].begin);
        EXPECT_EQ(a[k].segments[0].a1, b[k].segments[0].a1);
    }
    blade.set_active(0.8, 0.9);
    EXPECT_TRUE(sweep(blade, 0.9, 1.3).empty());
    EXPECT_FALSE(sweep(blade, 0.72, 1.3).empty());
}

TEST(Sweep, AStraightPathIsOnePart) {
    const Blade blade("b", BladeShape{{{{0, 0, 0}, {0, 0, 1}, {0, 1, 1}}, {{5, 0, 0}, {6, 0, 0}}}},
                      {{0, {0, 0, 0}, Quat::Identity()}, {2, {4, 0, 0}, Quat::Identity()}});
    const auto parts = sweep(blade, 0.5, 1);
    ASSERT_EQ(parts.size(), 1U);
    EXPECT_EQ(parts[0].begin, 0);
    EXPECT_EQ(parts[0].end, 1);
    ASSERT_EQ(parts[0].segments.size(), 3U);
    EXPECT_EQ(parts[0].segments[1].a0, Vec3(1, 0, 1));
    EXPECT_EQ(parts[0].segments[1].b1, Vec3(2, 1, 1));
    EXPECT_EQ(parts[0].segments[2].b1, Vec3(8, 0, 0));
    EXPECT_EQ(parts[0].bounds.min, Vec3(1, 0, 0));
    EXPECT_EQ(parts[0].bounds.max, Vec3(8, 1, 1));
}

TEST(Sweep, IsCutAtKeyframesAndWhereTheBladeIsNotActive) {
    const std::vector<Keyframe> keys = {
        {1, {0, 0, 0}, Quat::Identity()}, {2, {1, 0, 0}, Quat::Identity()}, {3, {1, 1, 0}, Quat::Identity()}};
    const Blade blade("b", make_straight_blade({0, 0, 0}, {0, 0, 1}), keys);
    const auto parts = sweep(blade, 0, 4);
    check_chain(parts);
    ASSERT_EQ(parts.size(), 2U);
    EXPECT_DOUBLE_EQ(parts[0].begin, 0.25);
    EXPECT_DOUBLE_EQ(parts[0].end, 0.5);
    EXPECT_DOUBLE_EQ(parts[1].end, 0.75);
    EXPECT_TRUE(sweep(blade, 0, 1).empty());
    EXPECT_TRUE(sweep(blade, 3, 9).empty());
    EXPECT_TRUE(sweep(blade, 1.5, 1.5).empty());
    // A blade at rest still cuts edges that move towards it.
    const Blade longer("b", blade.shape(), keys, {.active_until = std::numeric_limits<double>::infinity()});
    const auto rest = sweep(longer, 5, 6);
    ASSERT_EQ(rest.size(), 1U);
    EXPECT_EQ(rest[0].segments[0].a0, rest[0].segments[0].a1);
}

TEST(Sweep, FastTurnsStayCurved) {
    for (const double angle : {0.05, 0.5, 3.0, 40.0}) {
        const Blade blade = spinning(angle, 1);
        const auto parts = sweep(blade, 0, 1);
        check_chain(parts);
        EXPECT_GE(parts.size(), static_cast<std::size_t>(angle / max_turn));
        EXPECT_LE(parts.size(), static_cast<std::size_t>(angle / max_turn + angle / 1.5 + 2));
        EXPECT_EQ(parts.front().begin, 0);
        EXPECT_EQ(parts.back().end, 1);
        for (const SweptBlade& part : parts) {
            const auto& s = part.segments[0];
            EXPECT_GT((0.5 * (s.b0 + s.b1)).norm(), 1 - 1.26e-3);
            EXPECT_NEAR(s.b1.norm(), 1, 1e-12);
        }
    }
}

TEST(Sweep, SmoothPathsStayCurved) {
    const auto keys = circular_path({0, 0, 0}, {0, 0, 1}, 1, 0, 1, 0, 1, false, 16);
    const Blade blade("b", make_straight_blade({0, 0, 0}, {0, 0, 1}), keys,
                      {.interpolation = PathInterpolation::smooth});
    const auto parts = sweep(blade, 0, 1);
    check_chain(parts);
    for (const SweptBlade& part : parts) {
        const Vec3 middle = 0.5 * (part.segments[0].a0 + part.segments[0].a1);
        EXPECT_NEAR(middle.norm(), 1, 8e-3);  // distance of the path itself from the circle
        const double time = 0.5 * (part.begin + part.end);
        EXPECT_LT((middle - blade.frame(time).translation()).norm(), 1e-4);
    }
}

TEST(Sweep, ConsecutiveIntervalsJoinWithoutAGap) {
    const Blade blade = spinning(7, 1);
    std::vector<SweptBlade> before;
    for (int step = 0; step < 60; ++step) {
        const auto parts = sweep(blade, step / 60.0, (step + 1) / 60.0);
        check_chain(parts);
        ASSERT_FALSE(parts.empty());
        if (step > 0) {
            EXPECT_EQ(before.back().segments[0].a1, parts.front().segments[0].a0);
            EXPECT_EQ(before.back().segments[0].b1, parts.front().segments[0].b0);
        }
        before = parts;
    }
}
