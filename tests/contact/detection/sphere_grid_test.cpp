// SphereGrid compared with brute force.
#include <splitcubes/contact/detection/sphere_grid.h>
#include <splitcubes/core/random.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace splitcubes::body {
namespace {

Vec3 random_offset(Random& random, double half) {
    return {random.uniform(-half, half), random.uniform(-half, half), random.uniform(-half, half)};
}

std::vector<SphereGrid::Ball> random_balls(Random& random, int count, double half, double widest) {
    std::vector<SphereGrid::Ball> out;
    for (int k = 0; k < count; ++k)
        out.push_back({random_offset(random, half), widest * random.uniform(0, 1)});
    return out;
}

TEST(SphereGrid, FindsAllBallsThatContainAPoint) {
    SphereGrid grid;
    Random random(3);
    std::vector<std::uint32_t> near;
    std::size_t inside = 0, returned = 0, none = 0;
    for (const int count : {1, 4, 40, 400})
        for (const double widest : {0.0, 0.02, 0.2, 3.0}) {
            const std::vector<SphereGrid::Ball> balls = random_balls(random, count, 1, widest);
            grid.build(balls);
            for (int n = 0; n < 500; ++n) {
                const Vec3 point = random_offset(random, 1.5);
                grid.containing(point, near);
                ASSERT_TRUE(std::is_sorted(near.begin(), near.end()));
                ASSERT_EQ(std::adjacent_find(near.begin(), near.end()), near.end());
                for (std::uint32_t k = 0; k < balls.size(); ++k) {
                    if ((point - balls[k].centre).norm() > balls[k].radius) continue;
                    ++inside;
                    ASSERT_TRUE(std::binary_search(near.begin(), near.end(), k)) << count << ' ' << widest;
                }
                returned += near.size();
                none += near.empty();
            }
        }
    EXPECT_GT(inside, 10000U);
    EXPECT_GT(none, 2000U);
    EXPECT_LE(returned, inside + 100) << "few others are returned";
}

TEST(SphereGrid, FindsAllBallsThatMeetABall) {
    SphereGrid grid;
    Random random(4);
    std::vector<std::uint32_t> found;
    std::size_t meeting = 0, returned = 0;
    for (const int count : {1, 4, 40, 300})
        for (const double widest : {0.0, 0.02, 0.2, 3.0}) {
            std::vector<SphereGrid::Ball> balls = random_balls(random, count, 1, widest);
            balls.back().radius *= 10;  // one that is much larger than the others
            grid.build(balls);
            for (std::uint32_t k = 0; k < balls.size(); ++k) {
                grid.meeting_after(k, found);
                ASSERT_TRUE(std::is_sorted(found.begin(), found.end()));
                ASSERT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
                ASSERT_TRUE(found.empty() || found.front() > k);
                for (std::uint32_t other = k + 1; other < balls.size(); ++other) {
                    if ((balls[k].centre - balls[other].centre).norm() >
                        balls[k].radius + balls[other].radius)
                        continue;
                    ++meeting;
                    ASSERT_TRUE(std::binary_search(found.begin(), found.end(), other))
                        << count << ' ' << widest;
                }
                returned += found.size();
            }
        }
    EXPECT_GT(meeting, 10000U);
    EXPECT_LE(returned, meeting + 100) << "few others are returned";
}

TEST(SphereGrid, ToleratesNoBallsAndBallsFarApart) {
    SphereGrid grid;
    std::vector<std::uint32_t> near;
    grid.build({});
    grid.containing(Vec3::Zero(), near);
    EXPECT_TRUE(near.empty());
    const std::vector<SphereGrid::Ball> balls = {{Vec3(0, 0, 0), 1}, {Vec3(1e90, -1e90, 3), 2}};
    grid.build(balls);
    const auto is_returned = [&](const Vec3& point, std::uint32_t ball) {
        grid.containing(point, near);
        return std::find(near.begin(), near.end(), ball) != near.end();
    };
    EXPECT_TRUE(is_returned(Vec3(0.5, 0, 0), 0));
    EXPECT_TRUE(is_returned(Vec3(1e90, -1e90, 2), 1));
    grid.containing(Vec3::Constant(std::numeric_limits<double>::quiet_NaN()), near);
    EXPECT_TRUE(near.empty());
    grid.meeting_after(0, near);
    EXPECT_TRUE(near.empty() || near == std::vector<std::uint32_t>{1});
}

}  // namespace
}  // namespace splitcubes::body
