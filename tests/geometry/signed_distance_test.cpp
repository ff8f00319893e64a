#include <splitcubes/core/random.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/geometry/signed_distance.h>

#include <gtest/gtest.h>

#include <cmath>

namespace splitcubes::geometry {
namespace {

TEST(SignedDistance, IsLipschitzWithItsSteepness) {
    const Parallel parallel(1);
    const std::shared_ptr<const SignedDistance> solids[] = {
        make_plane_distance({1, 2, 3}, 0.1), make_sphere_distance(0.7),
        make_box_distance({1, 0.5, 0.2}, 0.05), make_mesh_distance(make_box({1, 0.6, 0.1}), 24, parallel),
        make_mesh_distance(make_box({0.3, 0.3, 1}), 9, parallel)};
    for (const auto& solid : solids) {
        Random random(3);
        const auto random_point = [&] {
            return Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        };
        double steepest = 0;
        for (int k = 0; k < 40000; ++k) {
            const Vec3 from = random_point();
            // Point pairs far apart and close together.
            const Vec3 to = from + std::pow(10.0, random.uniform(-5, 0)) * random_point();
            const double change = std::abs(solid->at(to).distance - solid->at(from).distance);
            const double distance = (to - from).norm();
            ASSERT_LE(change, solid->lipschitz_constant() * distance + 1e-12);
            if (distance > 1e-6) steepest = std::max(steepest, change / distance);
        }
        EXPECT_GT(steepest, 0.9);
    }
}

}  // namespace
}  // namespace splitcubes::geometry
