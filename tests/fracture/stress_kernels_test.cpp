// SIMD stresses of many phyxels against the scalar computation.
#include <splitcubes/core/random.h>
#include <splitcubes/elasticity/constitutive.h>
#include <splitcubes/fracture/stress_kernels.h>
#include <splitcubes/math/decompose.h>

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <limits>
#include <utility>
#include <vector>

namespace splitcubes::body {
namespace {

constexpr double min_volume = 0.05, limit = 4e3, slack = 1e-6;

struct Phyxels {
    std::vector<Mat3> deformation, rotation;
    std::vector<double> given;  // input of StressTask::size; negative: excluded
};

Mat3 random_matrix(Random& random, double half) {
    Mat3 out;
    for (int k = 0; k < 9; ++k) out(k % 3, k / 3) = random.uniform(-half, half);
    return out;
}

// Returns phyxels of which some are excluded, inverted, huge or not a number.
Phyxels random_phyxels(std::size_t count) {
    Random random(11);
    Phyxels out;
    for (std::size_t i = 0; i < count; ++i) {
        out.deformation.push_back(Mat3::Identity() + random_matrix(random, i % 3 == 0 ? 1.5 : 0.05));
        if (i % 29 == 7) out.deformation.back()(1, 2) = std::numeric_limits<double>::quiet_NaN();
        if (i % 31 == 9) out.deformation.back()(0, 0) = 1e200;
        if (i % 37 == 3) out.deformation.back() = Mat3::Identity();
        out.rotation.push_back(rotation_of(out.deformation.back()));
        out.given.push_back(i % 17 == 5 ? -2 : i % 19 == 4 ? -1 : 0);
    }
    return out;
}

struct Stresses {
    std::vector<Mat3> stress;
    std::vector<double> size;
    std::vector<std::uint8_t> is_above;
};

Stresses stresses_of(const Phyxels& phyxels, const meshless::Material& material, std::size_t begin,
                     std::size_t end) {
    const std::size_t count = phyxels.given.size();
    Stresses out{std::vector<Mat3>(count, Mat3::Constant(7)), phyxels.given,
                 std::vector<std::uint8_t>(count, 9)};
    find_corotated_stresses({phyxels.deformation.data(), phyxels.rotation.data(), begin, end,
                             material.lame_mu(), material.lame_lambda(), min_volume, limit, slack,
                             out.stress.data(), out.size.data(), out.is_above.data()});
    return out;
}

// Compares one phyxel with the scalar computation. Returns whether it is included.
bool expect_scalar_stress(const Phyxels& phyxels, const meshless::Material& material, const Stresses& found,
                          std::size_t i) {
    const Mat3& F = phyxels.deformation[i];
    const double volume = F.determinant();
    const Mat3 cauchy =
        meshless::piola_stress(material, F, phyxels.rotation[i], Mat3::Zero()) * F.transpose() / volume;
    if (phyxels.given[i] < 0 || !(volume > min_volume) || !cauchy.allFinite()) {
        EXPECT_EQ(found.stress[i], Mat3::Zero()) << i;
        EXPECT_EQ(found.size[i], phyxels.given[i] < 0 ? phyxels.given[i] : -1) << i;
        EXPECT_EQ(found.is_above[i], 0) << i;
        return false;
    }
    const Mat3 expected = 0.5 * (cauchy + cauchy.transpose());
    // Scaled by the largest of the cancelling terms: strains are differences of numbers near 1.
    const double rounding = 1e-13 * material.youngs_modulus * (1 + F.squaredNorm() * F.norm()) / volume;
    EXPECT_LT((found.stress[i] - expected).norm(), rounding) << i;
    EXPECT_EQ(found.stress[i], found.stress[i].transpose()) << i;
    EXPECT_NEAR(found.size[i], expected.norm(), rounding) << i;
    const double size = found.size[i];
    const bool is_low = size < limit || has_eigenvalues_below(found.stress[i], limit - slack * size);
    EXPECT_EQ(found.is_above[i], !is_low) << i;
    return true;
}

TEST(StressKernels, EqualTheScalarComputation) {
    const Phyxels phyxels = random_phyxels(500);
    const meshless::Material material;
    const Stresses found = stresses_of(phyxels, material, 0, phyxels.given.size());
    int included = 0, are_above = 0;
    for (std::size_t i = 0; i < phyxels.given.size(); ++i) {
        included += expect_scalar_stress(phyxels, material, found, i);
        are_above += found.is_above[i];
    }
    EXPECT_GT(included, are_above + 10);
    EXPECT_GT(are_above, 10);
}

TEST(StressKernels, SameBitsForEveryInstructionSetAndRange) {
    const Phyxels phyxels = random_phyxels(100);
    const meshless::Material material;
    const Stresses all = stresses_of(phyxels, material, 0, phyxels.given.size());
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        for (const auto& [begin, end] : {std::pair{0U, 100U}, {3U, 10U}, {17U, 18U}, {40U, 73U}}) {
            const Stresses found = stresses_of(phyxels, material, begin, end);
            for (std::size_t i = 0; i < phyxels.given.size(); ++i) {
                const bool is_in_range = i >= begin && i < end;
                EXPECT_EQ(found.stress[i], is_in_range ? all.stress[i] : Mat3::Constant(7)) << i;
                EXPECT_EQ(found.size[i], is_in_range ? all.size[i] : phyxels.given[i]) << i;
                EXPECT_EQ(found.is_above[i], is_in_range ? all.is_above[i] : 9) << i;
            }
        }
    }
    hwy::SetSupportedTargetsForTest(0);
}

}  // namespace
}  // namespace splitcubes::body
