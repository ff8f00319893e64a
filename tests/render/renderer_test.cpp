// Properties of pictures that do not depend on the style of the lighting.
#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/gl/objects.h>
#include <splitcubes/render/renderer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "render/shapes.h"

namespace {

using namespace splitcubes;
using namespace splitcubes::render;
using splitcubes::test_shapes::cut_block;
using splitcubes::test_shapes::sphere;

class RendererTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string why_not;
        context = gl::HeadlessContext::create(&why_not);
        if (!context) GTEST_SKIP() << "no OpenGL here: " << why_not;
    }
    Picture draw(const DrawList& list, const Camera& camera, const RenderOptions& options) const {
        return Renderer(*context, options).draw(list, camera);
    }
    std::optional<gl::HeadlessContext> context;
};

int channel(const Picture& picture, int column, int row, int index) {
    return picture.pixel(column, row)[index];
}

double brightness(const Picture& picture, int column, int row) {
    return (channel(picture, column, row, 0) + channel(picture, column, row, 1) +
            channel(picture, column, row, 2)) /
           3.0;
}

/// Returns the number of pixels for which test(red, green, blue) holds.
template <class Test>
int count_pixels(const Picture& picture, const Test& test) {
    int count = 0;
    for (int row = 0; row < picture.height; ++row) {
        for (int column = 0; column < picture.width; ++column) {
            const std::uint8_t* p = picture.pixel(column, row);
            count += test(p[0], p[1], p[2]) ? 1 : 0;
        }
    }
    return count;
}

bool is_red(int r, int g, int b) {
    return r > 40 && r > 2 * g && r > 2 * b;
}
bool is_blue(int r, int g, int b) {
    return b > 40 && b > 2 * r && b > 2 * g;
}

RenderOptions small(int width = 320, int height = 240) {
    RenderOptions options;
    options.width = width;
    options.height = height;
    options.ground = false;
    options.shadow_map_size = 512;
    return options;
}

const Camera from_front{
    .eye = Vec3(0, -5, 0), .target = Vec3::Zero(), .up = Vec3::UnitZ(), .vertical_fov_degrees = 40};

TEST_F(RendererTest, SphereCoversItsDisc) {
    // For various radii and positions the area in the picture follows from the cone tangent to the sphere.
    for (const int samples : {1, 4}) {
        for (const double radius : {0.3, 1.0, 1.5}) {
            DrawList list;
            add_mesh(list, sphere(Vec3::Zero(), radius, 96), Color(0.1, 0.1, 0.9));
            RenderOptions options = small(400, 300);
            options.samples = samples;
            const Picture picture = draw(list, from_front, options);
            const double tan_half = std::tan(20 * std::numbers::pi / 180);
            const double disc = radius / std::sqrt(25 - radius * radius) / tan_half * 150;  // pixels
            const int covered = count_pixels(picture, [](int r, int, int b) { return b > r + 20; });
            const double area = std::numbers::pi * disc * disc;
            // The rim is off by at most half a pixel on either side.
            EXPECT_NEAR(covered, area, 0.01 * area + (radius < 1 ? 0.02 * area : 0))
                << radius << " " << samples;
        }
    }
}

TEST_F(RendererTest, PositionInThePictureFollowsTheCamera) {
    // Right, up and nearer in the world is right, up and larger in the picture.
    DrawList list;
    add_mesh(list, sphere(Vec3(0.8, 0, 0.5), 0.2), Color(0.9, 0.1, 0.1));
    add_mesh(list, sphere(Vec3(-0.8, 0, -0.5), 0.2), Color(0.1, 0.1, 0.9));
    const Picture picture = draw(list, from_front, small());
    const double scale = 120 / (5 * std::tan(20 * std::numbers::pi / 180));  // pixels a metre
    const std::uint8_t* red =
        picture.pixel(160 + static_cast<int>(0.8 * scale), 120 - static_cast<int>(0.5 * scale));
    const std::uint8_t* blue =
        picture.pixel(160 - static_cast<int>(0.8 * scale), 120 + static_cast<int>(0.5 * scale));
    EXPECT_TRUE(is_red(red[0], red[1], red[2]));
    EXPECT_TRUE(is_blue(blue[0], blue[1], blue[2]));
}

TEST_F(RendererTest, FarFromTheWorldOriginThePictureIsTheSame) {
    const Vec3 far_away(3e5, -2e5, 1e5);
    DrawList here;
    add_mesh(here, sphere(Vec3::Zero(), 1), Color(0.8, 0.5, 0.3));
    DrawList there;
    add_mesh(there, sphere(far_away, 1), Color(0.8, 0.5, 0.3));
    Camera moved = from_front;
    moved.eye += far_away;
    moved.target += far_away;
    const Picture a = draw(here, from_front, small());
    const Picture b = draw(there, moved, small());
    int differing = 0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) differing += std::abs(a.rgb[i] - b.rgb[i]) > 2 ? 1 : 0;
    EXPECT_LT(differing, static_cast<int>(a.rgb.size() / 500));
}

TEST_F(RendererTest, LightSideIsBrighter) {
    DrawList list;
    add_mesh(list, sphere(Vec3::Zero(), 1), Color(0.7, 0.7, 0.7));
    const int offset = static_cast<int>(0.7 * 120 / (5 * std::tan(20 * std::numbers::pi / 180)));
    for (const double side : {-1.0, 1.0}) {
        RenderOptions options = small();
        options.to_light = Vec3(side, -0.3, 0);
        const Picture picture = draw(list, from_front, options);
        const int sign = side > 0 ? 1 : -1;
        EXPECT_GT(brightness(picture, 160 + sign * offset, 120),
                  40 + brightness(picture, 160 - sign * offset, 120));
    }
    RenderOptions options = small();
    options.to_light = Vec3(0, -0.3, 1);
    const Picture picture = draw(list, from_front, options);
    EXPECT_GT(brightness(picture, 160, 120 - offset), 40 + brightness(picture, 160, 120 + offset));
}

TEST_F(RendererTest, CutShowsInItsColorWhereItFacesTheCamera) {
    const Camera camera{
        .eye = Vec3(2.5, -5, 2.5), .target = Vec3::Zero(), .up = Vec3::UnitZ(), .vertical_fov_degrees = 40};
    int open_pixels = 0;
    for (const double gap : {0.0, 0.5, 1.0}) {
        DrawList list;
        add_surface(list, cut_block(1.0, gap), {.line_width = 0});
        const int red = count_pixels(draw(list, camera, small()), is_red);
        if (gap == 0.0) {
            EXPECT_EQ(red, 0) << "a closed cut must not flicker through the surface";
        } else {
            EXPECT_GT(red, open_pixels + 300) << gap;
            open_pixels = red;
        }
    }
    // The same faces as boundary do not have the cut's colour.
    geometry::SurfaceMesh whole = cut_block(1.0, 1.0);
    whole.triangle_origin.clear();
    DrawList list;
    add_surface(list, whole);
    EXPECT_EQ(count_pixels(draw(list, camera, small()), is_red), 0);
}

TEST_F(RendererTest, ClosedCutShowsAThinLine) {
    DrawList list;
    SurfacePalette palette;
    palette.line = Color(0, 0, 0.9);
    palette.line_width = 6;  // 2 pixels here
    palette.piece_hue_step = 0;
    add_surface(list, cut_block(1.0, 0.0), palette);
    const Picture picture = draw(list, from_front, small());
    for (const int row : {80, 100, 120, 140, 160}) {
        int first = 320;
        int last = -1;
        for (int column = 0; column < 320; ++column) {
            const std::uint8_t* p = picture.pixel(column, row);
            if (!is_blue(p[0], p[1], p[2])) continue;
            first = std::min(first, column);
            last = std::max(last, column);
        }
        EXPECT_GE(first, 158) << row;
        EXPECT_LE(last, 161) << row;
        EXPECT_LE(first, last) << row;
    }
}

TEST_F(RendererTest, GroundIsDarkerInTheShadow) {
    DrawList list;
    add_mesh(list, sphere(Vec3(0, 0, 1.5), 1), Color(0.8, 0.8, 0.8));
    RenderOptions options = small(480, 360);
    options.ground = true;
    options.to_light = Vec3(-1, 0, 1);
    const Camera camera{
        .eye = Vec3(0, -4, 9), .target = Vec3(0, 0, 0), .up = Vec3::UnitZ(), .vertical_fov_degrees = 60};
    const Picture picture = draw(list, camera, options);
    // Returns the brightness at a ground point: the shadow's middle is at x = 1.5, its mirror image is lit.
    const auto seen = [&](const Vec3& point) {
        const Vec3 back = camera.eye.normalized();
        const Vec3 top = back.cross(Vec3::UnitX());
        const double scale = 180 / std::tan(30 * std::numbers::pi / 180) / (camera.eye - point).dot(back);
        return brightness(picture, 240 + static_cast<int>(scale * point.x()),
                          180 - static_cast<int>(scale * point.dot(top)));
    };
    EXPECT_LT(seen(Vec3(1.7, -0.3, 0)), seen(Vec3(-2.2, -0.3, 0)) - 30);
    options.shadows = false;
    const Picture without = draw(list, camera, options);
    EXPECT_GT(count_pixels(without, [](int r, int, int) { return r > 150; }),
              count_pixels(picture, [](int r, int, int) { return r > 150; }) + 500);
}

TEST_F(RendererTest, GroundHidesWhatIsBelowIt) {
    DrawList list;
    add_mesh(list, sphere(Vec3(0, 0, -1), 0.5), Color(0.9, 0.1, 0.1));
    RenderOptions options = small();
    const Camera camera{
        .eye = Vec3(0, -4, 3), .target = Vec3(0, 0, -1), .up = Vec3::UnitZ(), .vertical_fov_degrees = 40};
    EXPECT_GT(count_pixels(draw(list, camera, options), is_red), 500);
    options.ground = true;
    EXPECT_EQ(count_pixels(draw(list, camera, options), is_red), 0);
    options.ground_height = -2;
    EXPECT_GT(count_pixels(draw(list, camera, options), is_red), 500);
}

TEST_F(RendererTest, CrevicesSeeLessSky) {
    // Two balls almost touching: occlusion darkens the gap between them and leaves the outer flanks
    // unchanged.
    DrawList list;
    add_mesh(list, sphere(Vec3(-0.8, 0, 0), 0.8), Color(0.8, 0.8, 0.8));
    add_mesh(list, sphere(Vec3(0.8, 0, 0), 0.8), Color(0.8, 0.8, 0.8));
    RenderOptions options = small();
    options.shadows = false;
    const Picture with = draw(list, from_front, options);
    options.ambient_occlusion = false;
    const Picture without = draw(list, from_front, options);
    EXPECT_LT(brightness(with, 157, 120), brightness(without, 157, 120) - 15);
    EXPECT_NEAR(brightness(with, 107, 120), brightness(without, 107, 120), 4);
}

TEST_F(RendererTest, LinesHaveTheirWidthAndAreHiddenBehindMeshes) {
    RenderOptions options = small(360, 720);
    DrawList list;
    const std::array<Vec3, 3> points = {Vec3(-2, 1, -0.5), Vec3(0, 1, -0.5), Vec3(2, 1, -0.5)};
    add_polyline(list, points, Color(0.9, 0.05, 0.05), 8);
    const auto red_rows = [](const Picture& picture, int column) {
        int rows = 0;
        for (int row = 0; row < picture.height; ++row) {
            const std::uint8_t* p = picture.pixel(column, row);
            rows += is_red(p[0], p[1], p[2]) ? 1 : 0;
        }
        return rows;
    };
    const Picture alone = draw(list, from_front, options);
    for (const int column : {50, 179, 180, 300}) EXPECT_NEAR(red_rows(alone, column), 8, 1) << column;
    add_mesh(list, sphere(Vec3::Zero(), 0.7), Color(0.2, 0.2, 0.8));
    const Picture hidden = draw(list, from_front, options);
    EXPECT_EQ(red_rows(hidden, 180), 0);
    EXPECT_NEAR(red_rows(hidden, 5), 8, 1);
    // A line that passes the camera is clipped there, not projected over the picture.
    for (const bool backwards : {false, true}) {
        std::array<Vec3, 2> through = {Vec3(0, 3, -0.5), Vec3(0, -50, -0.5)};
        if (backwards) std::swap(through[0], through[1]);
        DrawList passing;
        add_polyline(passing, through, Color(0.9, 0.05, 0.05), 8);
        const Picture cut_off = draw(passing, from_front, options);
        const auto red_at = [&](int row) {
            const std::uint8_t* p = cut_off.pixel(180, row);
            return is_red(p[0], p[1], p[2]);
        };
        for (int row = 0; row < 400; ++row) EXPECT_FALSE(red_at(row)) << row;
        for (int row = 500; row < 720; ++row) EXPECT_TRUE(red_at(row)) << row;
    }
}

TEST_F(RendererTest, ColorsComeOutAsTheyWentIn) {
    // The background has exactly its colour slightly above the middle; lines are not lit.
    RenderOptions options = small();
    options.background = Color(0.5, 0.25, 0.75);
    DrawList list;
    const std::array<Vec3, 2> points = {Vec3(-1, 0, -1), Vec3(1, 0, -1)};
    add_polyline(list, points, Color(0.6, 0.3, 0.1), 30);
    const Picture picture = draw(list, Camera{.eye = Vec3(0, -5, 0), .target = Vec3::Zero()}, options);
    const std::array<double, 3> behind = {0.5, 0.25, 0.75};
    const std::array<double, 3> line = {0.6, 0.3, 0.1};
    int line_row = 0;
    while (line_row < 239 && channel(picture, 160, line_row, 2) > 60) ++line_row;
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(picture.pixel(160, 108)[i], 255 * behind[i], 2);
        EXPECT_NEAR(picture.pixel(160, line_row + 3)[i], 255 * line[i], 1);
    }
}

TEST_F(RendererTest, SameInputGivesTheSameBytes) {
    DrawList list;
    add_surface(list, cut_block(1.0, 0.3));
    add_mesh(list, sphere(Vec3(0, 0, 1.6), 0.5), Color(0.3, 0.6, 0.3));
    RenderOptions options = small();
    options.ground = true;
    options.ground_height = -1;
    const Camera camera = frame_camera(list.bounds(), Vec3(1, -2, 1), 35, 320.0 / 240);
    Renderer renderer(*context, options);
    const Picture first = renderer.draw(list, camera);
    // Other pictures in between have no effect.
    renderer.draw(DrawList{}, from_front);
    EXPECT_EQ(first.rgb, renderer.draw(list, camera).rgb);
    EXPECT_EQ(first.rgb, draw(list, camera, options).rgb);
}

TEST_F(RendererTest, DrawIntoAFramebufferGivesTheSamePixels) {
    DrawList list;
    add_mesh(list, sphere(Vec3::Zero(), 1), Color(0.8, 0.5, 0.3));
    Renderer renderer(*context, small());
    const Picture picture = renderer.draw(list, from_front);
    const gl::Texture texture(GL_RGBA8, 320, 240, GL_NEAREST);
    gl::Framebuffer framebuffer;
    framebuffer.attach(GL_COLOR_ATTACHMENT0, texture);
    renderer.draw_into(list, from_front, framebuffer.id());
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer.id());
    for (const auto& [column, row] : {std::pair{160, 120}, std::pair{130, 90}, std::pair{5, 5}}) {
        std::array<unsigned char, 4> pixel{};
        glReadPixels(column, 239 - row, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixel.data());
        for (int i = 0; i < 3; ++i)
            EXPECT_EQ(pixel[static_cast<std::size_t>(i)], channel(picture, column, row, i));
    }
}

TEST_F(RendererTest, NewOptionsTakeEffect) {
    DrawList list;
    add_mesh(list, sphere(Vec3::Zero(), 1), Color(0.8, 0.5, 0.3));
    Renderer renderer(*context, small());
    renderer.draw(list, from_front);
    const RenderOptions larger = small(333, 251);  // odd sizes too
    renderer.set_options(larger);
    const Picture picture = renderer.draw(list, from_front);
    EXPECT_EQ(picture.width, 333);
    EXPECT_EQ(picture.rgb, draw(list, from_front, larger).rgb);
}

TEST_F(RendererTest, AnAreaIsDrawnAsInTheWholePicture) {
    DrawList list;
    add_mesh(list, sphere(Vec3::Zero(), 1), Color(0.8, 0.5, 0.3));
    for (const bool shadows : {true, false}) {
        RenderOptions options = small();
        options.shadows = options.ambient_occlusion = shadows;
        Renderer renderer(*context, options);
        const Picture whole = renderer.draw(list, from_front);
        options.area = {101, 37, 99, 120};
        renderer.set_options(options);
        const Picture part = renderer.draw(list, from_front);
        for (int row = 240 - 37 - 120; row < 240 - 37; ++row)
            ASSERT_TRUE(std::equal(part.pixel(101, row), part.pixel(199, row) + 3, whole.pixel(101, row)))
                << "row " << row;
    }
}

TEST_F(RendererTest, BadInputIsAnInputError) {
    DrawList good;
    add_mesh(good, sphere(Vec3::Zero(), 1), Color(0.8, 0.5, 0.3));
    for (const int samples : {0, 1000}) {
        RenderOptions options = small();
        options.samples = samples;
        EXPECT_THROW(Renderer(*context, options), InputError);
    }
    EXPECT_THROW(Renderer(*context, small(0, 100)), InputError);
    RenderOptions no_sky = small();
    no_sky.up = Vec3::Zero();
    EXPECT_THROW(Renderer(*context, no_sky), InputError);
    Renderer renderer(*context, small());
    EXPECT_THROW(renderer.draw(good, Camera{.eye = Vec3::Zero(), .target = Vec3::Zero()}), InputError);
    DrawList bad = good;
    bad.meshes[0].triangle_colors.pop_back();
    EXPECT_THROW(renderer.draw(bad, from_front), InputError);
    bad = good;
    bad.meshes[0].positions[3].x() = std::nan("");
    EXPECT_THROW(renderer.draw(bad, from_front), InputError);
    bad = good;
    bad.meshes[0].triangles[0][1] = 1u << 30;
    EXPECT_THROW(renderer.draw(bad, from_front), InputError);
    // The renderer still works.
    EXPECT_EQ(renderer.draw(good, from_front).rgb, draw(good, from_front, small()).rgb);
}

}  // namespace
