#include "random_matrix.h"

#include <gtest/gtest.h>
#include <splitcubes/math/decompose.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace {

using namespace splitcubes;
using fixtures::random_matrix;

Mat3 random_rotation(Random& random) {
    const Vec3 axis(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    return Eigen::AngleAxisd(random.uniform(0, std::numbers::pi), axis.normalized()).toRotationMatrix();
}

// Returns the rotation by Eigen's singular values, of which the smallest takes the sign: a slow reference.
Mat3 rotation_by_svd(const Mat3& F) {
    const Eigen::JacobiSVD<Mat3> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    return svd.matrixU() * Vec3(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
}

void expect_rotation(const Mat3& R, double tolerance = 1e-13) {
    EXPECT_LT((R.transpose() * R - Mat3::Identity()).norm(), tolerance);
    EXPECT_GT(R.determinant(), 0);
}

TEST(EigenSymmetric, RebuildsTheMatrix) {
    Random random(1);
    for (int trial = 0; trial < 500; ++trial) {
        const Mat3 half = random_matrix(random) * std::pow(10.0, random.uniform(-12, 12));
        const Mat3 matrix = half + half.transpose();
        const SymmetricEigen eigen = eigen_symmetric(matrix);
        const Mat3 rebuilt = eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose();
        EXPECT_LT((rebuilt - matrix).norm(), 1e-14 * matrix.norm());
        expect_rotation(eigen.vectors);
        EXPECT_GE(eigen.values[0], eigen.values[1]);
        EXPECT_GE(eigen.values[1], eigen.values[2]);
    }
}

// Eigenvalues of all magnitudes, some equal, in random frames.
Mat3 random_symmetric(Random& random, Vec3& values) {
    for (int k = 0; k < 3; ++k) values[k] = random.uniform(-1, 1) * std::pow(10.0, random.uniform(-8, 0));
    if (random.uniform(0, 1) < 0.3) values[1] = values[0];
    if (random.uniform(0, 1) < 0.3) values[2] = values[1];
    const Mat3 R = random_rotation(random);
    const Mat3 matrix = R * values.asDiagonal() * R.transpose();
    return 0.5 * (matrix + matrix.transpose());
}

TEST(EigenSymmetric, ValuesAreBelowALimitOrNot) {
    Random random(11);
    for (int trial = 0; trial < 5000; ++trial) {
        Vec3 values;
        const Mat3 matrix = random_symmetric(random, values);
        const double off = 1e-13 * (matrix.norm() + std::abs(values.maxCoeff()));
        EXPECT_TRUE(has_eigenvalues_below(matrix, values.maxCoeff() + off));
        EXPECT_FALSE(has_eigenvalues_below(matrix, values.maxCoeff() - off));
        EXPECT_FALSE(has_eigenvalues_below(matrix, values.minCoeff() - off));
    }
    Mat3 broken = Mat3::Identity();
    EXPECT_FALSE(has_eigenvalues_below(broken, 1));
    broken(2, 1) = broken(1, 2) = std::nan("");
    EXPECT_FALSE(has_eigenvalues_below(broken, 2));
}

TEST(EigenSymmetric, PositivePartIsThatOfTheDecomposition) {
    Random random(13);
    const auto check = [](const Mat3& matrix) {
        const SymmetricEigen eigen = eigen_symmetric(matrix);
        const Mat3 expected =
            eigen.vectors * eigen.values.cwiseMax(0).asDiagonal() * eigen.vectors.transpose();
        EXPECT_LE((positive_part(matrix) - expected).norm(), 1e-14 * matrix.norm()) << matrix;
    };
    for (int trial = 0; trial < 1000; ++trial) {
        Vec3 values;
        check(random_symmetric(random, values));
        const Mat3 R = random_rotation(random);
        // Values that are equal, zero, or nearly so.
        for (const double small : {0.0, 1e-17, 1e-12, 1e-6})
            for (const Vec3& other : {Vec3(1, 1, -1), Vec3(1, 0, -1), Vec3(0, 0, -1), Vec3(1, 0, 0),
                                      Vec3(-1, -1, 1), Vec3(0, 0, 0), Vec3(1, 1, 1), Vec3(-1, -1, -1)}) {
                const Vec3 near = other + small * Vec3(random.uniform(-1, 1), random.uniform(-1, 1), 1);
                const Mat3 turned = R * near.asDiagonal() * R.transpose();
                check(0.5 * (turned + turned.transpose()));
                check(near.asDiagonal());
            }
    }
}

TEST(EigenSymmetric, TheBoundIsSlightlyAboveTheLargestValue) {
    Random random(12);
    for (int trial = 0; trial < 5000; ++trial) {
        Vec3 values;
        const Mat3 matrix = random_symmetric(random, values);
        EXPECT_GE(largest_eigenvalue_bound(matrix), values.maxCoeff());
        EXPECT_LE(largest_eigenvalue_bound(matrix), values.maxCoeff() + 2e-7 * values.norm());
    }
    EXPECT_EQ(largest_eigenvalue_bound(Mat3::Zero()), 0);
}

TEST(EigenSymmetric, EqualAndZeroValues) {
    EXPECT_EQ(eigen_symmetric(Mat3::Identity()).vectors, Mat3::Identity());
    EXPECT_EQ(eigen_symmetric(Mat3::Zero()).values, Vec3::Zero());
    Random random(2);
    const Mat3 R = random_rotation(random);
    const SymmetricEigen eigen = eigen_symmetric(R * Vec3(2, 2, 0).asDiagonal() * R.transpose());
    EXPECT_NEAR(eigen.values[0], 2, 1e-14);
    EXPECT_NEAR(eigen.values[1], 2, 1e-14);
    EXPECT_NEAR(eigen.values[2], 0, 1e-14);
    expect_rotation(eigen.vectors);
}

TEST(RotationOf, EqualsSingularValueDecomposition) {
    Random random(3);
    for (int trial = 0; trial < 1000; ++trial) {
        const double spread = random.uniform(0, 1);
        const Mat3 F = random_rotation(random) * (Mat3::Identity() + spread * random_matrix(random));
        const Eigen::JacobiSVD<Mat3> svd(F);
        const double gap = svd.singularValues()[1] + (F.determinant() < 0 ? -1 : 1) * svd.singularValues()[2];
        if (gap < 1e-3) continue;  // the rotation is not determined there
        const Mat3 R = rotation_of(F);
        expect_rotation(R);
        EXPECT_LT((R - rotation_by_svd(F)).norm(), 1e-13 / gap) << F;
    }
}

TEST(RotationOf, KeepsRotations) {
    EXPECT_EQ(rotation_of(Mat3::Identity()), Mat3::Identity());
    Random random(4);
    for (int trial = 0; trial < 100; ++trial) {
        const Mat3 R = random_rotation(random);
        EXPECT_LT((rotation_of(R) - R).norm(), 1e-14);
        EXPECT_LT((rotation_of(1e-200 * R) - R).norm(), 1e-13);
        EXPECT_LT((rotation_of(1e200 * R) - R).norm(), 1e-13);
    }
}

TEST(RotationOf, LostRankFollowsWhatIsLeft) {
    Random random(5);
    for (int trial = 0; trial < 100; ++trial) {
        const Mat3 R = random_rotation(random), basis = random_rotation(random),
                   last = random_rotation(random);
        const Mat3 plane = R * basis * Vec3(1.3, 0.7, 0).asDiagonal() * basis.transpose();
        expect_rotation(rotation_of(plane, last));
        EXPECT_LT((rotation_of(plane, last) - R).norm(), 1e-12);
        const Vec3 line = basis.col(0);
        const Mat3 turned = rotation_of(R * line * line.transpose(), last);
        expect_rotation(turned);
        EXPECT_LT((turned * line - R * line).norm(), 1e-12);
        EXPECT_EQ(rotation_of(Mat3::Zero(), last), last);
    }
}

TEST(MinimalRotation, TakesOneToTheOther) {
    Random random(6);
    for (int trial = 0; trial < 300; ++trial) {
        const Vec3 a(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        Vec3 b(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        if (trial % 3 == 0) b = -2 * a + std::pow(10.0, -trial / 20.0) * b;
        const Mat3 R = minimal_rotation(a, b);
        expect_rotation(R);
        EXPECT_LT((R * a.normalized() - b.normalized()).norm(), 1e-13);
        const double angle = std::acos(std::clamp((R.trace() - 1) / 2, -1.0, 1.0));
        const double between = std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0, 1.0));
        EXPECT_NEAR(angle, between, 1e-6);
    }
    EXPECT_EQ(minimal_rotation(Vec3::UnitX(), Vec3::Zero()), Mat3::Identity());
    EXPECT_EQ(minimal_rotation(Vec3::UnitX(), Vec3::UnitX()), Mat3::Identity());
}

}  // namespace
