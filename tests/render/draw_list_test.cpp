// Normals, colours and framing: preparation before drawing.
#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/render/camera.h>
#include <splitcubes/render/draw_list.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "render/shapes.h"

namespace {

using namespace splitcubes;
using namespace splitcubes::render;
using splitcubes::test_shapes::block;
using splitcubes::test_shapes::cut_block;
using splitcubes::test_shapes::sphere;

Vec3 face_normal(const geometry::TriangleMesh& mesh, std::size_t t) {
    const geometry::Triangle& v = mesh.triangles[t];
    return (mesh.positions[v[1]] - mesh.positions[v[0]])
        .cross(mesh.positions[v[2]] - mesh.positions[v[0]])
        .normalized();
}

TEST(CornerNormals, SmoothSurfaceGetsItsTrueNormals) {
    const Vec3 center(1, 2, 3);
    const auto mesh = sphere(center, 2, 48);
    const auto normals = creased_corner_normals(mesh, {}, 35);
    ASSERT_EQ(normals.size(), 3 * mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 truth = (mesh.positions[mesh.triangles[t][k]] - center) / 2;
            EXPECT_GT(normals[3 * t + k].dot(truth), std::cos(0.04));
        }
    }
}

TEST(CornerNormals, SharpEdgesStaySharpUntilTheCreaseAngleAllows) {
    const auto mesh = block(Vec3::Zero(), Vec3(1, 2, 3));
    const auto sharp = creased_corner_normals(mesh, {}, 35);
    const auto soft = creased_corner_normals(mesh, {}, 100);
    double max_difference = 0;
    for (std::size_t i = 0; i < sharp.size(); ++i) {
        EXPECT_LT((sharp[i] - face_normal(mesh, i / 3)).norm(), 1e-12);
        EXPECT_NEAR(soft[i].norm(), 1, 1e-12);
        max_difference = std::max(max_difference, (soft[i] - face_normal(mesh, i / 3)).norm());
    }
    EXPECT_GT(max_difference, 0.5);
}

TEST(CornerNormals, GroupsAreNeverAveraged) {
    // A nearly flat roof whose two halves share the ridge's vertices.
    geometry::TriangleMesh roof;
    roof.positions = {{0, 0, 0.2}, {0, 1, 0.2}, {1, 0, 0}, {-1, 0, 0}};
    roof.triangles = {{0, 2, 1}, {0, 1, 3}};
    const std::array<std::uint8_t, 2> apart = {0, 1};
    const auto joined = creased_corner_normals(roof, {}, 35);
    const auto separate = creased_corner_normals(roof, apart, 35);
    EXPECT_LT((joined[0] - joined[3]).norm(), 1e-12);
    for (std::size_t i = 0; i < 6; ++i) EXPECT_LT((separate[i] - face_normal(roof, i / 3)).norm(), 1e-12);
}

TEST(CornerNormals, TurnWithTheMeshAndSurviveTrianglesWithoutArea) {
    auto mesh = sphere(Vec3::Zero(), 1, 12);
    Random random(7);
    for (Vec3& p : mesh.positions) p *= random.uniform(0.9, 1.1);
    mesh.triangles.push_back({0, 0, 1});
    mesh.triangles.push_back({5, 5, 5});
    const auto normals = creased_corner_normals(mesh, {}, 35);
    const Mat3 turn = (Quat(0.3, -0.5, 0.7, 0.2).normalized()).toRotationMatrix();
    auto turned_mesh = mesh;
    for (Vec3& p : turned_mesh.positions) p = turn * p + Vec3(3, 4, 5);
    const auto turned = creased_corner_normals(turned_mesh, {}, 35);
    const std::size_t solid = 3 * (mesh.triangles.size() - 2);
    for (std::size_t i = 0; i < normals.size(); ++i) {
        EXPECT_NEAR(normals[i].norm(), 1, 1e-9);
        if (i < solid) {
            EXPECT_LT((turned[i] - turn * normals[i]).norm(), 1e-9);
        }
    }
}

TEST(AddSurface, ColorsAndRimFollowOriginAndPiece) {
    DrawList list;
    const SurfacePalette palette;
    auto surface = cut_block(1, 0.2);
    add_surface(list, surface, palette);
    ASSERT_EQ(list.meshes.size(), 2U);
    EXPECT_EQ(list.meshes[0].triangles.size(), 20U);
    EXPECT_EQ(list.meshes[1].triangles.size(), 4U);
    EXPECT_EQ(list.meshes[1].positions.size(), 8U);
    EXPECT_FALSE(list.meshes[0].recessed);
    EXPECT_TRUE(list.meshes[1].recessed);
    for (const Color& color : list.meshes[1].triangle_colors) EXPECT_EQ(color, palette.cut);
    // Piece 0 has the palette's own colour, piece 1 a hue near it, of equal value.
    EXPECT_EQ(list.meshes[0].triangle_colors.front(), palette.boundary);
    const Color other = list.meshes[0].triangle_colors.back();
    EXPECT_NE(other, palette.boundary);
    EXPECT_LT((other - palette.boundary).norm(), 0.2);
    EXPECT_NEAR(other.maxCoeff(), palette.boundary.maxCoeff(), 1e-12);
    EXPECT_NEAR(other.minCoeff(), palette.boundary.minCoeff(), 1e-12);
    // The rim: the four sides of either cut face, each once.
    ASSERT_EQ(list.lines.size(), 1U);
    const auto& segments = list.lines[0].segments;
    EXPECT_EQ(segments.size(), 8U);
    EXPECT_EQ(std::set(segments.begin(), segments.end()).size(), 8U);
    for (const auto& segment : segments) {
        for (const std::uint32_t v : segment) EXPECT_NEAR(std::abs(list.lines[0].points[v].x()), 0.1, 1e-12);
    }
    surface.triangle_origin.clear();
    surface.vertex_piece.clear();
    DrawList plain;
    add_surface(plain, surface, palette);
    EXPECT_EQ(plain.meshes.size(), 1U);
    EXPECT_TRUE(plain.lines.empty());
}

TEST(AddSurface, RejectsArraysThatDoNotFit) {
    DrawList list;
    auto surface = cut_block(1, 0);
    surface.triangle_origin.pop_back();
    EXPECT_THROW(add_surface(list, surface), InputError);
    surface = cut_block(1, 0);
    surface.vertex_piece.push_back(0);
    EXPECT_THROW(add_surface(list, surface), InputError);
    surface = cut_block(1, 0);
    surface.mesh.triangles[3][0] = 99;
    EXPECT_THROW(add_surface(list, surface), InputError);
    EXPECT_TRUE(list.meshes.empty());
    EXPECT_THROW(add_polyline(list, {}, Color::Zero(), 1), InputError);
    add_surface(list, {});
    EXPECT_TRUE(list.meshes.empty());
}

TEST(FrameCamera, HasTheBoxInViewAndNoNearerCameraHas) {
    Random random(11);
    const auto random_point = [&] {
        return Vec3(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3));
    };
    for (int round = 0; round < 50; ++round) {
        geometry::Box box;
        box.add(random_point());
        box.add(random_point());
        const Vec3 direction = random_point();
        const double fov = random.uniform(10, 100);
        const double aspect = random.uniform(0.4, 2.5);
        const Camera camera = frame_camera(box, direction, fov, aspect, Vec3::UnitZ(), 1.0);
        const Vec3 back = (camera.eye - camera.target).normalized();
        EXPECT_GT(back.dot(direction.normalized()), 1 - 1e-9);
        const Vec3 right = camera.up.cross(back).normalized();
        const Vec3 top = back.cross(right);
        const double tan_v = std::tan(fov * std::numbers::pi / 360);
        double max_coordinate = 0;  // 1: on the edge of the picture
        for (int i = 0; i < 8; ++i) {
            const Vec3 corner((i & 1) != 0 ? box.max.x() : box.min.x(),
                              (i & 2) != 0 ? box.max.y() : box.min.y(),
                              (i & 4) != 0 ? box.max.z() : box.min.z());
            const Vec3 v = corner - camera.eye;
            const double depth = -v.dot(back);
            EXPECT_GE(depth, -1e-9);
            max_coordinate = std::max({max_coordinate, std::abs(v.dot(top)) / depth / tan_v,
                                       std::abs(v.dot(right)) / depth / tan_v / aspect});
        }
        EXPECT_NEAR(max_coordinate, 1, 1e-9);
    }
}

TEST(FrameCamera, StraightDownAndBadInput) {
    geometry::Box box;
    EXPECT_THROW(frame_camera(box, Vec3::UnitX(), 30, 1), InputError);
    box.add(Vec3::Zero());
    const Camera point = frame_camera(box, Vec3::UnitZ(), 30, 1);
    EXPECT_TRUE(point.eye.allFinite());
    EXPECT_GT((point.eye - point.target).norm(), 0);
    EXPECT_THROW(frame_camera(box, Vec3::Zero(), 30, 1), InputError);
    EXPECT_THROW(frame_camera(box, Vec3::UnitX(), 180, 1), InputError);
    EXPECT_THROW(frame_camera(box, Vec3::UnitX(), 30, 0), InputError);
}

TEST(AddSurface, VertexAndMaterialColoursAreUsedIfPresent) {
    geometry::SurfaceMesh surface = cut_block(0.02, 0.5);
    const std::size_t count = surface.mesh.triangles.size();
    const auto boundary_colors = [&] {
        DrawList list;
        add_surface(list, surface);
        return list.meshes.at(0).corner_colors;
    };
    EXPECT_TRUE(boundary_colors().empty());
    const Color boundary = SurfacePalette{}.boundary;
    surface.attributes.triangle_material.assign(count, 0);
    surface.attributes.materials = {
        {.name = "a", .colour = {1, 0.2140411F, 0, 1}, .texture = {}, .image = {}}};
    for (const Color& color : boundary_colors()) EXPECT_LT((color - Color(1, 0.5, 0)).norm(), 1e-5);
    surface.attributes.materials[0].texture = "a.png";
    EXPECT_EQ(boundary_colors().front(), boundary);
    surface.attributes.materials[0].texture.clear();
    const geometry::Rgba green{0.25F, 1, 0.5F, 1};
    surface.attributes.corner_colour.assign(count, {green, green, green});
    for (const Color& color : boundary_colors()) EXPECT_LT((color - Color(0.25, 0.5, 0)).norm(), 1e-5);
    surface.attributes.corner_colour.pop_back();
    EXPECT_THROW(boundary_colors(), InputError);
    surface.attributes.corner_colour.clear();
    surface.attributes.triangle_material[2] = 1;
    EXPECT_THROW(boundary_colors(), InputError);
}

}  // namespace
