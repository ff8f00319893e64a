#include <splitcubes/core/compensated_sum.h>

#include <gtest/gtest.h>

namespace splitcubes {
namespace {

TEST(CompensatedSum, KeepsWhatAPlainSumLoses) {
    CompensatedSum sum;
    double plain = 0;
    for (int k = 0; k < 100000; ++k)
        for (const double term : {1e10, 0.1, -1e10}) {
            sum.add(term);
            plain += term;
        }
    EXPECT_NEAR(sum.value(), 10000, 1e-9);
    EXPECT_GT(std::abs(plain - 10000), 1e-3) << "nothing to keep";
    // A term larger than the sum so far.
    CompensatedSum other;
    for (const double term : {1.0, 1e100, 1.0, -1e100}) other.add(term);
    EXPECT_EQ(other.value(), 2);
}

}  // namespace
}  // namespace splitcubes
