#include <splitcubes/core/error.h>
#include <splitcubes/math/sampled_motion.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace splitcubes {
namespace {

Isometry make_frame(const Vec3& position, double angle) {
    Isometry out = Isometry::Identity();
    out.translation() = position;
    out.linear() = Eigen::AngleAxisd(angle, Vec3(1, 2, 2) / 3).toRotationMatrix();
    return out;
}

TEST(SampledMotion, IsItsSamplesToTheLastBit) {
    SampledMotion motion;
    for (int k = 0; k < 50; ++k)
        motion.add(k / 60.0, make_frame(Vec3(std::sin(k), k * 0.1, 1.0 / (k + 1)), 0.3 * k));
    for (std::size_t k = 0; k < motion.times().size(); ++k)
        EXPECT_EQ(motion.at(motion.times()[k]).matrix(), motion.frames()[k].matrix());
}

TEST(SampledMotion, InterpolatesLinearlyBetweenSamples) {
    SampledMotion motion;
    motion.add(1, make_frame(Vec3(0, 0, 0), 0.2));
    motion.add(3, make_frame(Vec3(4, -2, 0), 1.4));
    EXPECT_TRUE(motion.at(1.5).isApprox(make_frame(Vec3(1, -0.5, 0), 0.5), 1e-14));
    EXPECT_EQ(motion.at(-7).matrix(), motion.frames().front().matrix());
    EXPECT_EQ(motion.at(9).matrix(), motion.frames().back().matrix());
}

TEST(SampledMotion, IsConstantBetweenEqualSamples) {
    SampledMotion motion;
    motion.add(0, make_frame(Vec3(0.1, 0.2, 0.3), 0.7));
    motion.add(1, make_frame(Vec3(0.1, 0.2, 0.3), 0.7));
    EXPECT_EQ(motion.at(1.0 / 3).matrix(), motion.frames()[0].matrix());
}

TEST(SampledMotion, ForgettingChangesNothingFromThatTimeOn) {
    SampledMotion whole;
    for (int k = 0; k < 8; ++k) whole.add(k, make_frame(Vec3(k * k, 0, -k), 0.3 * k));
    for (const double from : {-1.0, 0.0, 2.5, 3.0, 7.0, 9.0}) {
        SampledMotion motion = whole;
        const std::size_t gone = motion.forget_before(from);
        EXPECT_EQ(motion.times().size() + gone, whole.times().size());
        EXPECT_EQ(gone, from < 0 ? 0U : static_cast<std::size_t>(std::min(from, 7.0)));
        for (double time = from; time < 10; time += 0.25)
            EXPECT_EQ(motion.at(time).matrix(), whole.at(time).matrix());
    }
}

TEST(SampledMotion, RefusesInvalidSamples) {
    SampledMotion motion;
    motion.add(1, Isometry::Identity());
    EXPECT_THROW(motion.add(1, Isometry::Identity()), InputError);
    EXPECT_THROW(motion.add(std::numeric_limits<double>::quiet_NaN(), Isometry::Identity()), InputError);
    Isometry infinite = Isometry::Identity();
    infinite.translation().x() = std::numeric_limits<double>::infinity();
    EXPECT_THROW(motion.add(2, infinite), InputError);
    EXPECT_EQ(motion.times().size(), 1U);
}

}  // namespace
}  // namespace splitcubes
