// Finishes: what they say is what pictures show, whatever the light.
#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/render/renderer.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>

#include "render/shapes.h"

namespace {

using namespace splitcubes;
using namespace splitcubes::render;
using geometry::Finish;
using geometry::Origin;
using splitcubes::test_shapes::block;
using splitcubes::test_shapes::cut_block;

class FinishTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string why_not;
        context = gl::HeadlessContext::create(&why_not);
        if (!context) GTEST_SKIP() << "no OpenGL here: " << why_not;
        options.width = 160;
        options.height = 160;
        options.ground = false;
        options.shadows = options.ambient_occlusion = false;
        camera = {Vec3(0, -6, 0), Vec3::Zero(), Vec3::UnitZ(), 30};
    }
    // The front of a block of edge 2, as the finish says.
    Picture draw_block(const Finish& finish) {
        DrawList list;
        const geometry::TriangleMesh mesh = block(Vec3(-1, -1, -1), Vec3(1, 1, 1));
        add_mesh(list, mesh, finish, mesh.positions);
        return draw(list);
    }
    Picture draw(const DrawList& list) const { return Renderer(*context, options).draw(list, camera); }

    std::optional<gl::HeadlessContext> context;
    RenderOptions options;
    Camera camera;
};

/// Share of red in a pixel.
double redness(const Picture& picture, int column, int row) {
    const std::uint8_t* p = picture.pixel(column, row);
    return static_cast<double>(p[0]) / (p[0] + p[1] + p[2]);
}

Finish of_colour(const Vec3& colour) {
    Finish out;
    out.colour = colour;
    out.roughness = 1;
    return out;
}

const Vec3 red(0.8, 0.1, 0.1), blue(0.1, 0.1, 0.8);

TEST_F(FinishTest, ColoursShow) {
    EXPECT_GT(redness(draw_block(of_colour(red)), 80, 80), 0.6);
    EXPECT_LT(redness(draw_block(of_colour(blue)), 80, 80), 0.25);
}

TEST_F(FinishTest, StripesBeginWhereTheySay) {
    Finish finish = of_colour(red);
    finish.stripes = {{0, blue}, {0.5, red}};
    const Picture picture = draw_block(finish);
    // Row 80 is z = 0; the block's edge of 2 takes 160 / (2 tan 15) 2 / 5 pixels in front.
    const double pixels = 80 / std::tan(15 * 3.14159265 / 180) / 5;
    const auto row = [&](double z) { return static_cast<int>(80 - pixels * z); };
    EXPECT_GT(redness(picture, 80, row(-0.1)), 0.6);
    EXPECT_LT(redness(picture, 80, row(0.1)), 0.25);
    EXPECT_LT(redness(picture, 80, row(0.4)), 0.25);
    EXPECT_GT(redness(picture, 80, row(0.6)), 0.6);
}

TEST_F(FinishTest, LayersReachDownToTheirDepth) {
    Finish finish = of_colour(red);
    finish.layers = {{0.5, blue}};
    DrawList list;
    const geometry::TriangleMesh mesh = block(Vec3(-1, -1, -1), Vec3(1, 1, 1));
    add_mesh(list, mesh, finish, mesh.positions);
    // Deeper from left to right.
    for (const Vec3& p : mesh.positions)
        list.meshes[0].depth.push_back(static_cast<float>(0.5 * (p.x() + 1)));
    const Picture picture = draw(list);
    EXPECT_LT(redness(picture, 60, 80), 0.25);
    EXPECT_GT(redness(picture, 100, 80), 0.6);
}

TEST_F(FinishTest, SpecklesTakeTheirShareAndMoveWithTheMaterial) {
    for (const double share : {0.1, 0.3, 0.5}) {
        Finish finish = of_colour(red);
        finish.speckles = {{0.25, share, blue}};
        DrawList list;
        const geometry::TriangleMesh mesh = block(Vec3(-1, -1, -1), Vec3(1, 1, 1));
        add_mesh(list, mesh, finish, mesh.positions);
        const Picture at_rest = draw(list);
        int inside = 0, covered = 0;
        for (int row = 25; row < 135; ++row)
            for (int column = 25; column < 135; ++column) {
                ++inside;
                covered += redness(at_rest, column, row) < 0.42;
            }
        EXPECT_NEAR(static_cast<double>(covered) / inside, share, 0.1);
        // Moved, with the same rest positions: the same pattern, which is elsewhere without them.
        DrawList moved = list;
        for (Vec3& p : moved.meshes[0].positions) p += Vec3(0, 0, 30);
        camera.eye += Vec3(0, 0, 30);
        camera.target += Vec3(0, 0, 30);
        const auto differing = [&](const Picture& a) {
            int count = 0;
            for (std::size_t k = 0; k < a.rgb.size(); ++k) count += std::abs(a.rgb[k] - at_rest.rgb[k]) > 40;
            return count;
        };
        EXPECT_LT(differing(draw(moved)), 200);
        moved.meshes[0].rest.clear();
        EXPECT_GT(differing(draw(moved)), 1000);
        camera.eye -= Vec3(0, 0, 30);
        camera.target -= Vec3(0, 0, 30);
    }
}

TEST_F(FinishTest, MetalMirrorsItsSurroundingsInItsColour) {
    Finish metal = of_colour(Vec3(0.9, 0.6, 0.2));
    metal.metalness = 1;
    metal.roughness = 0.2;
    DrawList list;
    const geometry::TriangleMesh ball = test_shapes::sphere(Vec3::Zero(), 1, 48);
    add_mesh(list, ball, metal, ball.positions);
    const Picture picture = draw(list);
    const auto sum = [&](int row) {
        const std::uint8_t* p = picture.pixel(80, row);
        return p[0] + p[1] + p[2];
    };
    // The upper part of a ball mirrors the sky, the lower one the floor.
    EXPECT_GT(sum(62), sum(98) + 100);
    EXPECT_GT(redness(picture, 80, 98), 0.4);
}

TEST_F(FinishTest, EachMaterialOfASurfaceHasItsOwn) {
    geometry::SurfaceMesh surface = cut_block(1.0, 1.0);
    surface.attributes.materials.resize(2);
    for (const Origin origin : surface.triangle_origin)
        surface.attributes.triangle_material.push_back(origin == Origin::cut ? 1 : 0);
    SurfaceLooks looks;
    looks.finishes = {std::make_shared<const Finish>(of_colour(blue)),
                      std::make_shared<const Finish>(of_colour(red))};
    DrawList list;
    add_surface(list, surface, {}, looks);
    camera.eye = Vec3(-3, -6, 0);
    const Picture picture = draw(list);
    bool has_red = false, has_blue = false;
    for (int column = 0; column < 160; ++column) {
        has_red = has_red || redness(picture, column, 80) > 0.6;
        has_blue = has_blue || redness(picture, column, 80) < 0.2;
    }
    EXPECT_TRUE(has_red && has_blue);
    looks.depth = {1, 2};
    EXPECT_THROW(add_surface(list, surface, {}, looks), InputError);
}

TEST_F(FinishTest, PicturesLieByTheirCoordinates) {
    geometry::SurfaceMesh surface;
    surface.mesh.positions = {{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}};
    surface.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    surface.attributes.materials.resize(1);
    surface.attributes.materials[0].texture = "a.png";
    surface.attributes.materials[0].colour = {1, 1, 1, 1};
    surface.attributes.triangle_material = {0, 0};
    surface.attributes.corner_uv = {{geometry::Uv{0, 0}, {1, 0}, {1, 1}},
                                    {geometry::Uv{0, 0}, {1, 1}, {0, 1}}};
    // Red above, blue below; where they meet and at the rims, where the picture repeats, they mix over a row.
    Picture half{2, 16, {}};
    for (int row = 0; row < 16; ++row)
        for (int column = 0; column < 2; ++column)
            for (const int value : {row < 8 ? 200 : 20, 20, row < 8 ? 20 : 200})
                half.rgb.push_back(static_cast<std::uint8_t>(value));
    SurfaceLooks looks;
    looks.pictures = {std::make_shared<const Picture>(half)};
    DrawList list;
    add_surface(list, surface, {}, looks);
    const Picture picture = draw(list);
    EXPECT_GT(redness(picture, 80, 40), 0.6);
    EXPECT_LT(redness(picture, 80, 120), 0.25);
}

TEST_F(FinishTest, MarkedRegionsAreHatched) {
    DrawList list;
    const geometry::TriangleMesh mesh = block(Vec3(-1, -1, -1), Vec3(1, 1, 1));
    add_mesh(list, mesh, of_colour(Vec3(0.9, 0.9, 0.9)), mesh.positions);
    list.meshes[0].mark.assign(mesh.positions.size(), held_region);
    const auto dark_pixels = [&] {
        const Picture picture = draw(list);
        int count = 0;
        for (int row = 25; row < 135; ++row) count += picture.pixel(80, row)[0] < 110;
        return count;
    };
    EXPECT_EQ(dark_pixels(), 0) << "without a period";
    list.hatch_period = 0.3;
    EXPECT_GT(dark_pixels(), 15);
    EXPECT_LT(dark_pixels(), 80);
}

TEST_F(FinishTest, ArraysOfTheWrongLengthAreRefused) {
    DrawList list;
    const geometry::TriangleMesh mesh = block(Vec3(-1, -1, -1), Vec3(1, 1, 1));
    add_mesh(list, mesh, of_colour(red), {Vec3::Zero()});
    EXPECT_THROW(draw(list), InputError);
}

}  // namespace
