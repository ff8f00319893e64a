#include <splitcubes/core/random.h>
#include <splitcubes/geometry/distance_transform.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace splitcubes::geometry {
namespace {

TEST(DistanceTransform, IsTheDistanceToTheNearestMarkedPoint) {
    Random random(3);
    for (int trial = 0; trial < 60; ++trial) {
        const Vec3i count(1 + static_cast<int>(random.below(9)), 1 + static_cast<int>(random.below(7)),
                          1 + static_cast<int>(random.below(11)));
        const auto all = static_cast<std::size_t>(count.prod());
        std::vector<std::uint8_t> marked(all);
        const double share = trial % 3 == 0 ? 0.02 : 0.3;
        for (auto& is : marked) is = random.unit() < share;
        const auto position = [&](std::size_t k) {
            const int i = static_cast<int>(k);
            return Vec3i(i % count[0], i / count[0] % count[1], i / count[0] / count[1]);
        };
        const std::vector<float> found = squared_distances(count, marked);
        for (std::size_t k = 0; k < all; ++k) {
            float min = std::numeric_limits<float>::infinity();
            for (std::size_t m = 0; m < all; ++m)
                if (marked[m])
                    min = std::min(min, static_cast<float>((position(k) - position(m)).squaredNorm()));
            ASSERT_EQ(found[k], min) << count.transpose() << ": " << position(k).transpose();
        }
    }
}

}  // namespace
}  // namespace splitcubes::geometry
