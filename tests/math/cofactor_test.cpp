#include "random_matrix.h"

#include <gtest/gtest.h>
#include <splitcubes/math/cofactor.h>

#include <Eigen/LU>

namespace {

using namespace splitcubes;
using fixtures::random_matrix;

// cof(F)^T F = det(F) I, which is zero for a singular matrix.
TEST(CofactorOf, TransposedTimesTheMatrixIsTheDeterminant) {
    Random random(1);
    for (int trial = 0; trial < 200; ++trial) {
        Mat3 F = random_matrix(random);
        if (trial % 2 == 1) F.col(2) = random.uniform(-1, 1) * F.col(0) + random.uniform(-1, 1) * F.col(1);
        const Mat3 product = cofactor_of(F).transpose() * F;
        EXPECT_LT((product - F.determinant() * Mat3::Identity()).norm(), 1e-14);
    }
}

// Nanson's formula: the image of the area spanned by two vectors.
TEST(CofactorOf, TakesAreasToTheirImages) {
    Random random(2);
    for (int trial = 0; trial < 200; ++trial) {
        const Mat3 F = random_matrix(random), sides = random_matrix(random);
        const Vec3 image = (F * sides.col(0)).cross(F * sides.col(1));
        EXPECT_LT((cofactor_of(F) * Vec3(sides.col(0)).cross(Vec3(sides.col(1))) - image).norm(), 1e-14);
    }
}

}  // namespace
