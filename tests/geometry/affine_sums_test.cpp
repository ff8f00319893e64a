// Vectorised sums of motions give the same bits as scalar ones.
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/affine_sums.h>

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <vector>

namespace splitcubes::geometry {
namespace {

Vec3 coefficients(Random& random, double half) {
    const double x = random.uniform(-half, half), y = random.uniform(-half, half);
    return {x, y, random.uniform(-half, half)};
}

AffineDisplacement random_motion(Random& random) {
    Mat3 jacobian = Mat3::Identity();
    for (int k = 0; k < 3; ++k) jacobian.col(k) += coefficients(random, 0.8);
    return {coefficients(random, 1), coefficients(random, 3), jacobian};
}

template <class Check>
void for_each_instruction_set(const Check& check) {
    const std::int64_t all = hwy::SupportedTargets();
    int tried = 0;
    for (std::int64_t rest = all; rest != 0; rest &= rest - 1) {
        const std::int64_t target = rest & -rest;
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        check(hwy::TargetName(target));
        ++tried;
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    EXPECT_GT(tried, 1);
}

bool same(const AffineDisplacement& a, const AffineDisplacement& b) {
    return std::equal(a.entries(), a.entries() + AffineDisplacement::entry_count, b.entries());
}

TEST(AffineSums, EqualSequentialSums) {
    Random random(3);
    std::vector<AffineDisplacement> motions;
    for (int k = 0; k < 40; ++k) motions.push_back(random_motion(random));
    std::vector<AffineRow> rows;
    std::vector<std::uint32_t> index;
    std::vector<double> weight;
    std::vector<AffineDisplacement> expected;
    for (int r = 0; r < 203; ++r) {
        const auto begin = static_cast<std::uint32_t>(index.size());
        AffineDisplacement sum;
        for (std::uint32_t k = random.below(9); k > 0; --k) {
            index.push_back(random.below(40));
            weight.push_back(random.uniform(-1, 2));
            sum.add(weight.back(), motions[index.back()]);
        }
        rows.push_back({begin, static_cast<std::uint32_t>(index.size()) - begin});
        expected.push_back(sum);
    }
    for_each_instruction_set([&](const char* name) {
        std::vector<AffineDisplacement> out(rows.size(), motions[0]);
        sum_affine(rows, index.data(), weight.data(), motions.data(), out.data());
        for (std::size_t r = 0; r < rows.size(); ++r)
            EXPECT_TRUE(same(out[r], expected[r])) << name << ' ' << r;
    });
}

// Reference transformation of a point and its normal by Eigen.
struct Moved {
    Vec3 point, normal;
};

Moved image_of(AffineDisplacement motion, double factor, const Vec3& point, const Vec3& normal) {
    motion.scale(factor);
    const Mat3 jacobian = motion.jacobian();
    Mat3 cofactor;
    for (int k = 0; k < 3; ++k) cofactor.col(k) = jacobian.col((k + 1) % 3).cross(jacobian.col((k + 2) % 3));
    const Vec3 turned = cofactor * normal;
    const double length = turned.norm();
    return {motion.image(point), length > 1e-9 ? Vec3(turned / length) : normal};
}

TEST(AffineSums, TransformPointsAndNormalsLikeSingleMotions) {
    Random random(4);
    constexpr std::size_t max_count = 4 * transform_width;
    std::vector<AffineDisplacement> motions(max_count);
    std::array<std::vector<double>, 3> point, normal;
    for (auto* lists : {&point, &normal})
        for (std::vector<double>& list : *lists) list.resize(max_count);
    std::vector<double> factor(max_count, 1);
    for (std::size_t count = 0; count + 2 < max_count; ++count) {
        std::vector<Moved> expected;
        for (std::size_t k = 0; k < count; ++k) {
            motions[k] = random_motion(random);
            // A motion under which every normal vanishes.
            if (k % 5 == 3) motions[k] = {Vec3::Zero(), Vec3::Ones(), Mat3::Zero()};
            factor[k] = k % 5 == 3 ? 1 : random.uniform(0.9, 1.1);
            const Vec3 p = coefficients(random, 1), n = coefficients(random, 1).normalized();
            for (std::size_t axis = 0; axis < 3; ++axis) {
                point[axis][k] = p[static_cast<Eigen::Index>(axis)];
                normal[axis][k] = n[static_cast<Eigen::Index>(axis)];
            }
            expected.push_back(image_of(motions[k], factor[k], p, n));
        }
        for_each_instruction_set([&](const char* name) {
            const Vec3 untouched(7, 8, 9);
            std::vector<Vec3> positions(count + 1, untouched), normals(count + 1, untouched);
            transform_points(count, motions.data(),
                             {{point[0].data(), point[1].data(), point[2].data()},
                              {normal[0].data(), normal[1].data(), normal[2].data()},
                              factor.data()},
                             positions.data(), normals.data());
            for (std::size_t k = 0; k < count; ++k) {
                EXPECT_EQ(positions[k], expected[k].point) << name << ' ' << k << " of " << count;
                EXPECT_EQ(normals[k], expected[k].normal) << name << ' ' << k << " of " << count;
            }
            EXPECT_EQ(positions[count], untouched);
            EXPECT_EQ(normals[count], untouched);
        });
    }
}

}  // namespace
}  // namespace splitcubes::geometry
