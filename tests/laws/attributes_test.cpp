// Attributes of a mesh's surface survive resampling and cutting.
#include "laws/solids.h"

#include <gtest/gtest.h>
#include <splitcubes/geometry/attribute_transfer.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/read_surface.h>
#include <splitcubes/io/write_mesh.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/solidify.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace splitcubes::laws {
namespace {

using geometry::MeshAttributes;
using geometry::Origin;
using geometry::SurfaceMesh;
using geometry::Triangle;
using geometry::TriangleMesh;
using geometry::Uv;

struct Cut {
    SurfaceMesh surface;
    std::size_t piece_count = 0;
};

/// Returns the mesh on a grid of that cell size, cut by the sheets, with its attributes.
Cut cut_up(const TriangleMesh& mesh, const MeshAttributes& attributes, double cell,
           const std::vector<TriangleMesh>& sheets) {
    const Parallel parallel;
    splitting::SolidifyReport report;
    splitting::NodeGrid grid =
        splitting::solidify(mesh, geometry::grid_around(mesh.bounds(), cell), report, parallel);
    splitting::Surface surface(grid);
    for (std::size_t k = 0; k < sheets.size(); ++k)
        surface.retessellate(grid, splitting::cut_with_sheet(grid, sheets[k], static_cast<std::int32_t>(k)));
    const splitting::Pieces pieces(grid);
    Cut out{splitting::extract(grid, surface, pieces), pieces.count()};
    out.surface.attributes =
        geometry::AttributeTransfer(mesh, attributes, cell / 2).onto(out.surface, parallel);
    return out;
}

/// Returns the side of the cube from -0.5 to 0.5 with this outward normal: 2 * axis + (0 low, 1 high).
int side_of(const Vec3& normal) {
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    return 2 * axis + (normal[axis] > 0 ? 1 : 0);
}

/// Returns texture coordinates of a point of a side: each side has one of 3 x 2 tiles, with a margin.
std::array<double, 2> texture_position(int side, const Vec3& p) {
    const int axis = side / 2;
    const double u = std::clamp(p[(axis + 1) % 3], -0.5, 0.5), v = std::clamp(p[(axis + 2) % 3], -0.5, 0.5);
    return {(axis + 0.1 + 0.8 * (u + 0.5)) / 3, (side % 2 + 0.1 + 0.8 * (v + 0.5)) / 2};
}

/// Returns the tile that contains the texture coordinates, or -1 for the margins between tiles.
int side_at(const Uv& uv) {
    const double u = 3 * static_cast<double>(uv[0]), v = 2 * static_cast<double>(uv[1]);
    const auto in_tile = [](double x) { return x - std::floor(x) > 0.0999 && x - std::floor(x) < 0.9001; };
    if (u < 0 || u > 3 || v < 0 || v > 2 || !in_tile(u) || !in_tile(v)) return -1;
    return 2 * static_cast<int>(u) + static_cast<int>(v);
}

MeshAttributes tiled(const TriangleMesh& cube) {
    MeshAttributes out;
    for (const Triangle& t : cube.triangles) {
        const Vec3& a = cube.positions[t[0]];
        const int side = side_of((cube.positions[t[1]] - a).cross(cube.positions[t[2]] - a));
        auto& uv = out.corner_uv.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            const auto position = texture_position(side, cube.positions[t[k]]);
            uv[k] = {static_cast<float>(position[0]), static_cast<float>(position[1])};
        }
        out.triangle_material.push_back(side % 2);
    }
    out.materials = {{.name = "low", .colour = {1, 0, 0, 1}, .texture = {}, .image = {}},
                     {.name = "high", .colour = {0, 0, 1, 1}, .texture = {}, .image = {}}};
    return out;
}

const TriangleMesh cube = box_between(Vec3::Constant(-0.5), Vec3::Constant(0.5));

TriangleMesh slanted_sheet() {
    return geometry::make_plane_sheet(Vec3(0.05, 0.02, 0), Vec3(1, 0.3, 0.2), 2);
}

geometry::Rgba colour_at(const Vec3& p) {
    return {static_cast<float>(0.5 + 0.4 * p[0]), static_cast<float>(0.5 + 0.4 * p[1] * p[2]),
            static_cast<float>(0.5 + 0.3 * std::sin(3 * p[2])), 1};
}

}  // namespace

TEST(Attributes, NoTriangleOfACutCubeSpansASeam) {
    for (const double cell : {0.13, 0.04}) {
        const SurfaceMesh s = cut_up(cube, tiled(cube), cell, {slanted_sheet()}).surface;
        std::array<std::size_t, 6> count{};
        for (std::size_t t = 0; t < s.mesh.triangles.size(); ++t) {
            if (s.triangle_origin[t] == Origin::cut) {
                EXPECT_EQ(
                    s.attributes.materials[static_cast<std::size_t>(s.attributes.triangle_material[t])].name,
                    "cut");
                continue;
            }
            const auto& uv = s.attributes.corner_uv[t];
            const int side = side_at(uv[0]);
            ASSERT_GE(side, 0);
            ++count[static_cast<std::size_t>(side)];
            EXPECT_EQ(s.attributes.triangle_material[t], side % 2);
            for (std::size_t k = 0; k < 3; ++k) {
                ASSERT_EQ(side_at(uv[k]), side);
                const Vec3& p = s.rest[s.mesh.triangles[t][k]];
                const auto wanted = texture_position(side, p);
                EXPECT_NEAR(uv[k][0], wanted[0], 1e-5);
                EXPECT_NEAR(uv[k][1], wanted[1], 1e-5);
                // A corner beyond its side's edge is at most a cell away.
                const double height = (side % 2 ? 1 : -1) * p[side / 2];
                EXPECT_NEAR(height, 0.5, cell);
            }
        }
        for (const std::size_t n : count) EXPECT_GT(n, 2 * std::pow(0.5 / cell, 2));
    }
}

TEST(Attributes, ColoursOfABallFollowItsCells) {
    const TriangleMesh ball = geometry::make_sphere(0.5, 6);
    MeshAttributes attributes;
    for (const Triangle& t : ball.triangles)
        attributes.corner_colour.push_back({colour_at(ball.positions[t[0]]), colour_at(ball.positions[t[1]]),
                                            colour_at(ball.positions[t[2]])});
    double before = 1;
    for (const double cell : {0.2, 0.1, 0.05}) {
        const SurfaceMesh s = cut_up(ball, attributes, cell, {slanted_sheet()}).surface;
        double worst = 0, sum = 0;
        std::size_t count = 0;
        for (std::size_t t = 0; t < s.mesh.triangles.size(); ++t) {
            if (s.triangle_origin[t] == Origin::cut) continue;
            for (std::size_t k = 0; k < 3; ++k) {
                const auto wanted = colour_at(s.rest[s.mesh.triangles[t][k]]);
                double error = 0;
                for (std::size_t i = 0; i < 4; ++i)
                    error = std::max(error, static_cast<double>(
                                                std::abs(s.attributes.corner_colour[t][k][i] - wanted[i])));
                worst = std::max(worst, error);
                sum += error;
                ++count;
            }
        }
        // The colours change by less than 1 per metre.
        EXPECT_LT(worst, 0.2 * cell);
        const double mean = sum / static_cast<double>(count);
        EXPECT_LT(mean, 0.5 * before);
        EXPECT_LT(mean, 0.02 * cell);
        before = mean;
    }
}

TEST(Attributes, AWallTwoCellsThickKeepsBothItsColours) {
    for (const double thickness : {1.6, 2.3, 3.1}) {
        const double cell = 0.05;
        const double half = thickness * cell / 2;
        const Quat turn(Eigen::AngleAxisd(0.4, Vec3(1, 2, 0.5).normalized()));
        const TriangleMesh wall = turned(box_between(Vec3(-0.5, -0.5, -half), Vec3(0.5, 0.5, half)), turn);
        const Vec3 up = turn * Vec3::UnitZ();
        MeshAttributes attributes;
        for (const Triangle& t : wall.triangles) {
            const Vec3& a = wall.positions[t[0]];
            const double facing =
                (wall.positions[t[1]] - a).cross(wall.positions[t[2]] - a).normalized().dot(up);
            attributes.triangle_material.push_back(facing > 0.5 ? 0 : facing < -0.5 ? 1 : 2);
        }
        attributes.materials.resize(3);
        const SurfaceMesh s = cut_up(wall, attributes, cell, {}).surface;
        std::size_t checked = 0;
        for (std::size_t t = 0; t < s.mesh.triangles.size(); ++t) {
            const Triangle& tri = s.mesh.triangles[t];
            const Vec3& a = s.rest[tri[0]];
            const Vec3 normal = (s.rest[tri[1]] - a).cross(s.rest[tri[2]] - a);
            const double facing = normal.normalized().dot(up);
            if (std::abs(facing) < 0.8) continue;
            // Not around the rim, where the nearest side is ambiguous.
            const Vec3 own = turn.conjugate() * a;
            if (std::max(std::abs(own[0]), std::abs(own[1])) > 0.5 - 2 * cell) continue;
            ++checked;
            EXPECT_EQ(s.attributes.triangle_material[t], facing > 0 ? 0 : 1) << thickness;
        }
        EXPECT_GT(checked, 1000U);
    }
}

TEST(Attributes, ACutTexturedSolidIsValidInEveryFormatAndComesBack) {
    const Cut cut = cut_up(cube, tiled(cube), 0.06, {slanted_sheet()});
    std::string name = (std::filesystem::temp_directory_path() / "splitcubes-laws-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    const std::filesystem::path folder = name;
    for (const char* extension : {".ply", ".obj", ".glb"})
        for (std::size_t k = 0; k < cut.piece_count; ++k) {
            const SurfaceMesh piece = splitting::extract_piece(cut.surface, static_cast<std::int32_t>(k));
            const auto file = folder / (std::string("piece") + extension);
            io::write_mesh(file, piece);
            const io::Model again = io::read_model(file);
            const bool split = std::string(extension) == ".glb";
            EXPECT_TRUE(
                geometry::check_mesh(split ? geometry::weld_equal_vertices(again.mesh) : again.mesh).valid())
                << file;
            EXPECT_EQ(again.attributes.materials, piece.attributes.materials);
            // Compares sums by area, because formats order triangles by material.
            std::array<std::array<double, 2>, 2> sums{};
            const auto add = [](std::array<double, 2>& sum, const TriangleMesh& mesh,
                                const MeshAttributes& a) {
                for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
                    const Vec3& p = mesh.positions[mesh.triangles[t][0]];
                    const double area = (mesh.positions[mesh.triangles[t][1]] - p)
                                            .cross(mesh.positions[mesh.triangles[t][2]] - p)
                                            .norm();
                    for (const Uv& uv : a.corner_uv[t])
                        sum[0] += area * static_cast<double>(uv[0] * (1 + uv[1]));
                    sum[1] += area * (1 + a.triangle_material[t]);
                }
            };
            add(sums[0], again.mesh, again.attributes);
            add(sums[1], piece.mesh, piece.attributes);
            for (std::size_t i = 0; i < 2; ++i)
                EXPECT_NEAR(sums[0][i], sums[1][i], 1e-5 * sums[1][i]) << file;
        }
    std::filesystem::remove_all(folder);
}

TEST(Attributes, CutTwiceThroughAFileTheFirstCutKeepsItsMaterial) {
    const Cut first = cut_up(cube, tiled(cube), 0.06, {slanted_sheet()});
    const SurfaceMesh half = splitting::extract_piece(first.surface, 0);
    const std::string ply = io::encode_mesh(half, io::MeshFormat::ply, "half");
    const io::Model again = io::read_model_from_memory(std::as_bytes(std::span(ply.data(), ply.size())),
                                                       io::MeshFormat::ply, "half");
    const SurfaceMesh s = cut_up(again.mesh, again.attributes, 0.05,
                                 {geometry::make_plane_sheet(Vec3(0, 0, 0.013), Vec3::UnitZ(), 2)})
                              .surface;
    EXPECT_EQ(s.attributes.materials, half.attributes.materials);
    const std::int32_t cut = 2;
    double old_cut = 0, new_cut = 0;
    for (std::size_t t = 0; t < s.mesh.triangles.size(); ++t) {
        if (s.attributes.triangle_material[t] != cut) continue;
        const Vec3& a = s.rest[s.mesh.triangles[t][0]];
        const double area =
            (s.rest[s.mesh.triangles[t][1]] - a).cross(s.rest[s.mesh.triangles[t][2]] - a).norm() / 2;
        (s.triangle_origin[t] == Origin::cut ? new_cut : old_cut) += area;
    }
    // The sheet's plane has normal (1, 0.3, 0.2): its area within the cube is the norm over the largest
    // component.
    EXPECT_NEAR(old_cut, Vec3(1, 0.3, 0.2).norm(), 0.05);
    EXPECT_NEAR(new_cut, 2 * 0.55, 0.2);
}

}  // namespace splitcubes::laws
