// Contact sides reproduce the motion of the point that they represent.
#include <splitcubes/contact/detection/contact_sides.h>
#include <splitcubes/core/random.h>
#include <splitcubes/math/decompose.h>

#include <gtest/gtest.h>

#include <numeric>

namespace splitcubes::body {
namespace {

using meshless::ContactSide;

constexpr double spacing = 0.02;

Vec3 random_in(Random& random, double half) {
    return {random.uniform(-half, half), random.uniform(-half, half), random.uniform(-half, half)};
}

// Returns phyxels around a point; `thickness` scales their spread along y.
std::vector<Vec3> around(Random& random, const Vec3& point, double thickness) {
    std::vector<Vec3> out;
    for (std::size_t k = 0; k < ContactSide::max_phyxels; ++k)
        out.push_back(point + random_in(random, spacing).cwiseProduct(Vec3(1, thickness, 1)));
    return out;
}

ContactSide random_side(Random& random, std::uint32_t count) {
    ContactSide side;
    side.count = count;
    std::iota(side.phyxel.begin(), side.phyxel.end(), 0U);
    double total = 0;
    for (std::uint32_t k = 0; k < count; ++k) total += side.weight[k] = 0.1 + random.unit();
    for (std::uint32_t k = 0; k < count; ++k) side.weight[k] /= total;
    return side;
}

Vec3 mean(const ContactSide& side, const std::vector<Vec3>& of) {
    Vec3 out = Vec3::Zero();
    for (std::uint32_t k = 0; k < side.count; ++k) out += side.weight[k] * of[side.phyxel[k]];
    return out;
}

// Reference: works along the eigenvectors of the phyxels' covariance.
void reproduce_along_axes(const std::vector<Vec3>& rest, const Vec3& point, ContactSide& side) {
    const Vec3 centre = mean(side, rest);
    Mat3 spread = Mat3::Zero();
    for (std::uint32_t k = 0; k < side.count; ++k) {
        const Vec3 arm = rest[side.phyxel[k]] - centre;
        spread += side.weight[k] * arm * arm.transpose();
    }
    const SymmetricEigen axes = eigen_symmetric(spread);
    const double min_spread = 0.005 * spacing * spacing;
    Vec3 slope = Vec3::Zero();
    for (int a = 0; a < 3; ++a) {
        const Vec3 axis = axes.vectors.col(a);
        slope += axes.values[a] / (axes.values[a] * axes.values[a] + min_spread * min_spread) *
                 axis.dot(point - centre) * axis;
    }
    for (std::uint32_t k = 0; k < side.count; ++k)
        side.weight[k] *= 1 + slope.dot(rest[side.phyxel[k]] - centre);
}

TEST(ContactSides, EqualTheReferenceAlongEigenvectors) {
    Random random(3);
    for (int trial = 0; trial < 500; ++trial) {
        const Vec3 point = random_in(random, 1);
        // Includes few phyxels, in a plane, on a line and all at one point.
        const double thickness = trial % 3 == 0 ? 1 : trial % 3 == 1 ? 0.05 : 0;
        // In a plane the damped matrix has a condition number of 1e4, and the part off the plane loses
        // digits.
        const std::vector<Vec3> rest = around(random, point, thickness);
        ContactSide side = random_side(random, 1 + static_cast<std::uint32_t>(random.below(8)));
        ContactSide reference = side;
        const Vec3 target = point + random_in(random, 0.5 * spacing);
        reproduce_affine_motion(rest, target, spacing, side);
        reproduce_along_axes(rest, target, reference);
        for (std::uint32_t k = 0; k < side.count; ++k) EXPECT_NEAR(side.weight[k], reference.weight[k], 1e-8);
    }
}

TEST(ContactSides, ReproduceAffineMotion) {
    Random random(4);
    for (int trial = 0; trial < 200; ++trial) {
        const Vec3 point = random_in(random, 1);
        const std::vector<Vec3> rest = around(random, point, 1);
        ContactSide side = random_side(random, 8);
        reproduce_affine_motion(rest, point, spacing, side);
        EXPECT_NEAR(std::accumulate(side.weight.begin(), side.weight.end(), 0.0), 1, 1e-12);
        // The regularisation shifts the point slightly, less for phyxels that are spread wider.
        EXPECT_LT((mean(side, rest) - point).norm(), 0.1 * spacing);
        Mat3 linear;
        linear << 0.8, -0.5, 0.1, 0.4, 1.1, 0.2, -0.1, 0.3, 0.9;
        std::vector<Vec3> moved;
        for (const Vec3& p : rest) moved.emplace_back(linear * p + Vec3(3, 2, 1));
        EXPECT_LT((mean(side, moved) - (linear * mean(side, rest) + Vec3(3, 2, 1))).norm(), 1e-12);
    }
}

}  // namespace
}  // namespace splitcubes::body
