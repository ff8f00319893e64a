#include <splitcubes/core/plain_number.h>
#include <splitcubes/core/random.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace splitcubes {
namespace {

TEST(PlainNumber, IsWrittenAsPeopleDo) {
    EXPECT_EQ(plain_number(0), "0");
    EXPECT_EQ(plain_number(-0.0), "0");
    EXPECT_EQ(plain_number(1e7), "10000000");
    EXPECT_EQ(plain_number(-1e7), "-10000000");
    EXPECT_EQ(plain_number(0.05), "0.05");
    EXPECT_EQ(plain_number(1e-6), "0.000001");
    EXPECT_EQ(plain_number(1e-12), "1e-12");
    EXPECT_EQ(plain_number(1e18), "1e18");
    EXPECT_EQ(plain_number(2.0 / 3, 3), "0.667");
    EXPECT_EQ(plain_number(123456789, 3), "123000000");
    EXPECT_EQ(plain_number(-0.0, 3), "0");
    EXPECT_EQ(plain_number(9.999, 2), "10");
    EXPECT_EQ(plain_number(std::numeric_limits<double>::infinity(), 3), "inf");
}

TEST(PlainNumber, HasNoExponentWithinItsRangeAndGivesTheNumberBack) {
    Random random(1);
    for (int trial = 0; trial < 20000; ++trial) {
        const double size = std::pow(10.0, random.uniform(-20, 20));
        const double value = random.unit() < 0.5 ? size : -size;
        const std::string text = plain_number(value);
        EXPECT_EQ(std::stod(text), value) << text;
        const bool plain = size >= 1e-6 && size < 1e15;
        EXPECT_EQ(text.find('e') == std::string::npos, plain) << text;
        const std::string rounded = plain_number(value, 3);
        EXPECT_NEAR(std::stod(rounded), value, 0.0051 * size) << rounded;
        EXPECT_LE(rounded.size(), 20U) << rounded;
    }
}

}  // namespace
}  // namespace splitcubes
