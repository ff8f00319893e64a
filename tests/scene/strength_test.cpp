// Invariants of painted strength.
#include <splitcubes/core/error.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/scene/strength.h>

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace splitcubes::scene {
namespace {

class PaintedStrength : public testing::Test {
  protected:
    PaintedStrength() : model_{geometry::make_box(Vec3(2, 1, 1)), {}} {
        file_ = std::filesystem::temp_directory_path() /
                ("splitcubes-strength-" + std::to_string(reinterpret_cast<std::uintptr_t>(this)) + ".pgm");
        // Black, grey 0.6, white from left to right.
        std::ofstream(file_, std::ios::binary) << std::string("P5 3 1 255\n") + std::string("\0\x99\xff", 3);
        tearing_.strength = 1000;
    }
    ~PaintedStrength() override {
        std::error_code ignored;
        std::filesystem::remove(file_, ignored);
    }
    // Maps the picture along the x axis, its sides at x = -1 and 1.
    void lay_on() {
        for (const geometry::Triangle& t : model_.mesh.triangles) {
            std::array<geometry::Uv, 3> corners;
            for (std::size_t k = 0; k < 3; ++k)
                corners[k] = {static_cast<float>(0.5 + 0.5 * model_.mesh.positions[t[k]].x()), 0.5F};
            model_.attributes.corner_uv.push_back(corners);
        }
    }
    double factor(const Vec3& rest) const { return tear_settings(tearing_, model_).strength_factor(rest); }

    io::Model model_;
    std::filesystem::path file_;
    TearingDescription tearing_;
};

TEST_F(PaintedStrength, PictureIsSampledAtTheNearestSurfacePoint) {
    lay_on();
    tearing_.strength_map = {StrengthPaint{0.5, 1.5, file_}};
    for (const double depth : {0.0, 0.2}) {
        EXPECT_NEAR(factor(Vec3(-2.0 / 3, 0, 0.5 - depth)), 0.5, 1e-6);
        EXPECT_NEAR(factor(Vec3(0, 0.1, 0.5 - depth)), 1.1, 1e-6);
        EXPECT_NEAR(factor(Vec3(2.0 / 3, 0, 0.5 - depth)), 1.5, 1e-6);
        EXPECT_NEAR(factor(Vec3(-1.0 / 3, 0, 0.5 - depth)), 0.8, 1e-6);
    }
}

TEST_F(PaintedStrength, LayersMultiply) {
    lay_on();
    tearing_.strength_map = {StrengthPaint{0.5, 1.5, file_},
                             StrengthPatch{BoxRegion{Vec3(-1, -1, -1), Vec3(1, 1, 1)}, 0.25}};
    EXPECT_NEAR(factor(Vec3(2.0 / 3, 0, 0.5)), 0.375, 1e-6);
    EXPECT_NEAR(factor(Vec3(2.0 / 3, 0, 1.5)), 1.5, 1e-6);
}

TEST_F(PaintedStrength, RequiresColoursOrTextureCoordinates) {
    tearing_.strength_map = {StrengthPaint{0.5, 1.5, file_}};
    EXPECT_THROW(factor(Vec3::Zero()), InputError) << "no texture coordinates";
    tearing_.strength_map = {StrengthPaint{0.5, 1.5, {}}};
    EXPECT_THROW(factor(Vec3::Zero()), InputError) << "no colours";
    lay_on();
    tearing_.strength_map = {StrengthPaint{0.5, 1.5, "/nowhere.png"}};
    EXPECT_THROW(factor(Vec3::Zero()), InputError);
}

}  // namespace
}  // namespace splitcubes::scene
