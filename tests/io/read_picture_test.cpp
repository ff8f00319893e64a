#include <splitcubes/core/error.h>
#include <splitcubes/io/read_picture.h>

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

namespace splitcubes::io {
namespace {

// Two rows of three grey pixels.
const std::string six_pixels = std::string("P5 3 2 255\n") + std::string("\0\x33\x66\x99\xcc\xff", 6);

class ReadPicture : public testing::Test {
  protected:
    ReadPicture() {
        file_ = std::filesystem::temp_directory_path() /
                ("splitcubes-picture-" + std::to_string(reinterpret_cast<std::uintptr_t>(this)) + ".pgm");
    }
    ~ReadPicture() override {
        std::error_code ignored;
        std::filesystem::remove(file_, ignored);
    }
    BrightnessPicture read(const std::string& bytes) const {
        std::ofstream(file_, std::ios::binary) << bytes;
        return read_brightness(file_);
    }
    std::filesystem::path file_;
};

TEST_F(ReadPicture, IsItsPixelsAtTheirCentres) {
    const BrightnessPicture picture = read(six_pixels);
    ASSERT_EQ(picture.width, 3);
    ASSERT_EQ(picture.height, 2);
    for (int row = 0; row < 2; ++row)
        for (int column = 0; column < 3; ++column)
            EXPECT_NEAR(picture.at((column + 0.5) / 3, 1 - (row + 0.5) / 2), 0.2 * (3 * row + column), 1e-6);
}

TEST_F(ReadPicture, IsLinearBetweenAndRepeats) {
    const BrightnessPicture picture = read(six_pixels);
    EXPECT_NEAR(picture.at(1.0 / 3, 0.75), 0.1, 1e-6);
    EXPECT_NEAR(picture.at(0.5, 0.5), 0.5, 1e-6);
    for (const double u : {-0.9, 0.0, 0.3, 2.77})
        for (const double v : {-1.2, 0.1, 0.99}) {
            EXPECT_NEAR(picture.at(u, v), picture.at(u + 1, v - 2), 1e-6);
            EXPECT_GE(picture.at(u, v), 0);
            EXPECT_LE(picture.at(u, v), 1);
        }
    EXPECT_TRUE(std::isfinite(picture.at(std::numeric_limits<double>::quiet_NaN(), 1e300)));
    EXPECT_TRUE(std::isfinite(picture.at(1e300, -1e300)));
}

TEST_F(ReadPicture, ColoursCountByTheirMean) {
    EXPECT_NEAR(read(std::string("P6 1 1 255\n") + "\xff" + std::string(2, '\0')).at(0.5, 0.5), 1.0 / 3,
                1e-6);
}

TEST_F(ReadPicture, WhatIsNoneIsRefused) {
    EXPECT_THROW(read(""), InputError);
    EXPECT_THROW(read("hello"), InputError);
    EXPECT_THROW(read("P5 100000 100000 255\n"), InputError);
    EXPECT_THROW(read("P5 0 2 255\n"), InputError);
    EXPECT_THROW(read(std::string("\x89PNG\r\n\x1a\n", 8)), InputError);
    EXPECT_THROW(read_brightness("/nowhere/p.png"), InputError);
}

}  // namespace
}  // namespace splitcubes::io
