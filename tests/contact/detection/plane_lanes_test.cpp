// PlaneLanes compared with a plain loop.
#include <splitcubes/contact/detection/plane_lanes.h>
#include <splitcubes/core/random.h>

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace splitcubes::body {
namespace {

Vec3 random_vector_in(Random& random, double half) {
    const double x = random.uniform(-half, half), y = random.uniform(-half, half);
    return {x, y, random.uniform(-half, half)};
}

TEST(PlaneLanes, FindsTheNearestPlaneThatAPointFaces) {
    Random random(5);
    PlaneLanes lanes;
    std::size_t none = 0;
    for (int trial = 0; trial < 400; ++trial) {
        const auto count = static_cast<std::size_t>(random.uniform(0, 40));
        std::vector<Vec3> positions, normals;
        lanes.reset(count);
        for (std::size_t n = 0; n < count; ++n) {
            // Every third plane lies where the one before lies.
            positions.push_back(n % 3 == 2 ? positions.back() : random_vector_in(random, 1));
            normals.push_back(random_vector_in(random, 1).normalized());
            lanes.add(positions.back(), normals.back());
        }
        ASSERT_EQ(lanes.size(), count);
        const Vec3 point = random_vector_in(random, 1), outwards = random_vector_in(random, 1);
        const std::size_t found = lanes.find_nearest(point, outwards);
        std::size_t expected = count;
        double nearest = std::numeric_limits<double>::infinity();
        for (std::size_t n = 0; n < count; ++n) {
            const double square = (positions[n] - point).squaredNorm();
            EXPECT_DOUBLE_EQ(lanes.squared_distances()[n], square);
            if (!(square < nearest) || normals[n].dot(outwards) > 0) continue;
            nearest = square;
            expected = n;
        }
        EXPECT_EQ(found, expected);
        none += expected == count;
    }
    EXPECT_GT(none, 5U);
}

TEST(PlaneLanes, IgnoresWhatIsNotANumber) {
    PlaneLanes lanes;
    lanes.reset(2);
    lanes.add(Vec3::Constant(std::numeric_limits<double>::quiet_NaN()), Vec3::UnitX());
    lanes.add(Vec3::UnitX(), -Vec3::UnitX());
    EXPECT_EQ(lanes.find_nearest(Vec3::Zero(), Vec3::UnitX()), 1U);
    EXPECT_EQ(lanes.find_nearest(Vec3::Constant(std::numeric_limits<double>::quiet_NaN()), Vec3::UnitX()),
              2U);
}

}  // namespace
}  // namespace splitcubes::body
