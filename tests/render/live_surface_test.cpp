// Surfaces that are updated in parts look like those that are made anew.
#include <gtest/gtest.h>
#include <splitcubes/render/renderer.h>

#include <cmath>
#include <string>

#include "render/shapes.h"

namespace {

using namespace splitcubes;
using namespace splitcubes::render;

/// Arrays of a mesh, which a test changes.
struct Slots {
    std::vector<float> positions, normals;
    std::vector<std::uint32_t> triangles;
    std::vector<std::int32_t> materials, pieces;

    explicit Slots(const geometry::TriangleMesh& mesh) {
        for (const Vec3& p : mesh.positions) {
            const Vec3 n = p.normalized();
            for (int k = 0; k < 3; ++k) {
                positions.push_back(static_cast<float>(p[k]));
                normals.push_back(static_cast<float>(n[k]));
            }
        }
        for (const auto& t : mesh.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
        materials.assign(mesh.triangles.size(), 0);
        pieces.assign(mesh.positions.size(), 0);
    }
    SurfaceSlots view() const { return {triangles, materials, pieces}; }
};

class LiveSurfaceTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string why_not;
        context = gl::HeadlessContext::create(&why_not);
        if (!context) GTEST_SKIP() << "no OpenGL here: " << why_not;
        options.width = 160;
        options.height = 120;
        options.ground = false;
        options.samples = 1;
        camera = {Vec3(0, -5, 0), Vec3::Zero(), Vec3::UnitZ(), 40};
        slots = Slots(test_shapes::sphere(Vec3::Zero(), 1, 24));
    }
    LiveSurface made() const {
        LiveSurface out;
        out.style.palette.fill(Vec3(0.2, 0.3, 0.8));
        out.style.palette[1] = Vec3(0.9, 0.1, 0.1);
        out.set_topology(slots.view());
        out.set_vertices(slots.positions, slots.normals, {});
        return out;
    }
    Picture draw(const LiveSurface& surface, const ClipPlane& clip = {}) const {
        DrawList list;
        list.surfaces = {&surface};
        list.clip = clip;
        return Renderer(*context, options).draw(list, camera);
    }
    // Red less blue.
    static int redness(const Picture& picture, int column, int row) {
        return picture.pixel(column, row)[0] - picture.pixel(column, row)[2];
    }

    std::optional<gl::HeadlessContext> context;
    RenderOptions options;
    Camera camera;
    Slots slots{geometry::TriangleMesh{}};
};

TEST_F(LiveSurfaceTest, ShowsItsMaterial) {
    const Picture picture = draw(made());
    EXPECT_LT(redness(picture, 80, 60), -40);
    EXPECT_GT(redness(picture, 2, 2), -10) << "background";
}

TEST_F(LiveSurfaceTest, LiesWhereAMeshOfTheSameShapeDoes) {
    DrawList list;
    add_mesh(list, test_shapes::sphere(Vec3::Zero(), 1, 24), Color(0.2, 0.3, 0.8));
    const Picture mesh = Renderer(*context, options).draw(list, camera), live = draw(made());
    int differing = 0;
    for (std::size_t k = 0; k < mesh.rgb.size(); ++k) differing += std::abs(mesh.rgb[k] - live.rgb[k]) > 24;
    EXPECT_LT(differing, static_cast<int>(mesh.rgb.size() / 100));
}

TEST_F(LiveSurfaceTest, PatchesLookLikeTheWhole) {
    LiveSurface patched = made();
    const std::size_t before = patched.bytes_copied();
    // The half that faces the camera changes its material, and a triangle appears at the end.
    std::vector<SlotRange> ranges;
    for (std::size_t t = 0; t < slots.materials.size(); ++t)
        if (slots.positions[3 * slots.triangles[3 * t] + 1] < -0.5F) {
            slots.materials[t] = 1;
            ranges.push_back({t, 1});
        }
    for (int k = 0; k < 300; ++k) {
        for (const std::uint32_t v : {0U, 1U, 2U}) slots.triangles.push_back(v);
        slots.materials.push_back(1);
    }
    patched.patch_topology(slots.view(), ranges, {});
    EXPECT_GT(redness(draw(patched), 80, 60), 60);
    EXPECT_EQ(draw(patched).rgb, draw(made()).rgb);
    EXPECT_LT(patched.bytes_copied() - before, slots.triangles.size() * 4);
}

TEST_F(LiveSurfaceTest, MovesWithItsVertices) {
    LiveSurface surface = made();
    for (std::size_t v = 0; v < slots.positions.size(); v += 3) slots.positions[v] += 3;
    surface.set_vertices(slots.positions, slots.normals, {});
    EXPECT_NEAR(surface.bounds().center().x(), 3, 1e-5);
    slots.pieces.assign(slots.pieces.size(), -1);
    surface.set_topology(slots.view());
    surface.set_vertices(slots.positions, slots.normals, {});
    EXPECT_TRUE(surface.bounds().empty()) << "free vertices";
}

TEST_F(LiveSurfaceTest, ClipPlaneHidesItsSide) {
    const Picture whole = draw(made()), half = draw(made(), {Vec3::UnitX(), 0});
    EXPECT_EQ(redness(half, 95, 60) < -40, false);
    EXPECT_LT(redness(whole, 95, 60), -40);
    EXPECT_LT(redness(half, 65, 60), -40);
}

TEST_F(LiveSurfaceTest, ClosedOnesLookTheSameFromOutsideAndAreSeenFromInside) {
    LiveSurface surface = made();
    const Picture open = draw(surface);
    surface.style.is_closed = true;
    EXPECT_EQ(draw(surface).rgb, open.rgb);
    camera.eye = Vec3(0.1, 0, 0);
    EXPECT_GT(std::abs(redness(draw(surface), 80, 60)), 3) << "not the background";
    EXPECT_LT(redness(draw(surface, {Vec3::UnitX(), 0}), 80, 60), 40);
}

TEST_F(LiveSurfaceTest, FieldsAndPiecesHaveTheirColours) {
    LiveSurface surface = made();
    surface.style.colouring = SurfaceColouring::field;
    const std::vector<float> low(slots.pieces.size(), 0.0F), high(slots.pieces.size(), 5.0F);
    surface.style.field_high = 5;
    surface.set_vertices(slots.positions, slots.normals, high);
    EXPECT_GT(redness(draw(surface), 80, 60), 40);
    surface.set_vertices(slots.positions, slots.normals, low);
    EXPECT_LT(redness(draw(surface), 80, 60), -30);
    surface.style.colouring = SurfaceColouring::piece;
    const Picture first = draw(surface);
    slots.pieces.assign(slots.pieces.size(), 1);
    surface.set_topology(slots.view());
    const Picture second = draw(surface);
    int difference = 0;
    for (int k = 0; k < 3; ++k) difference += std::abs(first.pixel(80, 60)[k] - second.pixel(80, 60)[k]);
    EXPECT_GT(difference, 80);
}

TEST_F(LiveSurfaceTest, PointsOnTopAreSeenThroughTheSurface) {
    const LiveSurface surface = made();
    DrawList list;
    list.surfaces = {&surface};
    list.points = {{.positions = {0, 0, 0}, .colours = {1, 0, 0}, .radius = 0.2}};
    EXPECT_LT(redness(Renderer(*context, options).draw(list, camera), 80, 60), -40);
    list.points_on_top = true;
    EXPECT_GT(redness(Renderer(*context, options).draw(list, camera), 80, 60), 60);
}

TEST(ColourScale, GoesFromBlueToRed) {
    EXPECT_GT(scale_colour(0).z(), 2 * scale_colour(0).x());
    EXPECT_GT(scale_colour(1).x(), 2 * scale_colour(1).z());
    EXPECT_EQ(scale_colour(-1), scale_colour(0));
    EXPECT_EQ(scale_colour(2), scale_colour(1));
}

TEST(PieceColour, DiffersFromNumberToNumber) {
    for (int a = 0; a < 8; ++a)
        for (int b = 0; b < a; ++b)
            EXPECT_GT((piece_colour(a) - piece_colour(b)).norm(), 0.1) << a << ' ' << b;
}

}  // namespace
