#include <gtest/gtest.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/attribute_transfer.h>
#include <splitcubes/geometry/shapes.h>

#include <algorithm>
#include <cmath>
#include <set>

using namespace splitcubes;
using namespace splitcubes::geometry;

namespace {

/// A box whose sides are mapped to separate squares of the picture, 3 x 2 of them.
/// Vertices are shared, so only the texture coordinates separate the sides.
TriangleMesh box_with_sides(MeshAttributes& attributes) {
    const TriangleMesh box = make_box(Vec3(1, 1, 1));
    for (const Triangle& t : box.triangles) {
        const Vec3 a = box.positions[t[0]];
        const Vec3 n = (box.positions[t[1]] - a).cross(box.positions[t[2]] - a).normalized();
        int axis = 0;
        n.cwiseAbs().maxCoeff(&axis);
        auto& uv = attributes.corner_uv.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3& p = box.positions[t[k]];
            uv[k] = {static_cast<float>((axis + 0.1 + 0.8 * (p[(axis + 1) % 3] + 0.5)) / 3),
                     static_cast<float>(((n[axis] > 0 ? 1 : 0) + 0.1 + 0.8 * (p[(axis + 2) % 3] + 0.5)) / 2)};
        }
    }
    return box;
}

std::size_t chart_count(const std::vector<std::int32_t>& charts) {
    return charts.empty() ? 0 : static_cast<std::size_t>(*std::max_element(charts.begin(), charts.end())) + 1;
}

Rgba colour_at(const Vec3& p) {
    return {static_cast<float>(0.5 + 0.4 * p[0]), static_cast<float>(0.5 + 0.4 * p[1] * p[2]),
            static_cast<float>(0.5 + 0.3 * std::sin(2 * p[2])), 1};
}

MeshAttributes coloured(const TriangleMesh& mesh) {
    MeshAttributes out;
    for (const Triangle& t : mesh.triangles)
        out.corner_colour.push_back({colour_at(mesh.positions[t[0]]), colour_at(mesh.positions[t[1]]),
                                     colour_at(mesh.positions[t[2]])});
    return out;
}

}  // namespace

TEST(AttributeCharts, AreTheSidesOfABox) {
    MeshAttributes attributes;
    const TriangleMesh box = box_with_sides(attributes);
    const auto charts = attribute_charts(box, attributes);
    EXPECT_EQ(chart_count(charts), 6U);
    for (std::size_t t = 0; t < charts.size(); ++t)
        for (std::size_t s = 0; s < t; ++s) {
            const auto side = [&](std::size_t i) {
                const Triangle& tri = box.triangles[i];
                return (box.positions[tri[1]] - box.positions[tri[0]])
                    .cross(box.positions[tri[2]] - box.positions[tri[0]])
                    .normalized();
            };
            EXPECT_EQ(charts[s] == charts[t], side(s).dot(side(t)) > 0.5);
        }
    // Vertices that a format has split are not seams.
    TriangleMesh split;
    for (const Triangle& t : box.triangles) {
        const auto first = static_cast<std::uint32_t>(split.positions.size());
        for (const std::uint32_t v : t) split.positions.push_back(box.positions[v]);
        split.triangles.push_back({first, first + 1, first + 2});
    }
    EXPECT_EQ(attribute_charts(split, attributes), charts);
}

TEST(AttributeCharts, AreSeparatedByMaterialsAndColours) {
    const TriangleMesh ball = make_sphere(1, 2);
    EXPECT_EQ(chart_count(attribute_charts(ball, coloured(ball))), 1U);
    MeshAttributes attributes = coloured(ball);
    for (const Triangle& t : ball.triangles) {
        const double height = ball.positions[t[0]][2] + ball.positions[t[1]][2] + ball.positions[t[2]][2];
        attributes.triangle_material.push_back(height > 0 ? 1 : 0);
    }
    attributes.materials.resize(2);
    EXPECT_EQ(chart_count(attribute_charts(ball, attributes)), 2U);
    attributes.triangle_material.clear();
    attributes.corner_colour[7] = {};  // one triangle of another colour
    EXPECT_EQ(chart_count(attribute_charts(ball, attributes)), 2U);
    attributes.corner_uv.assign(ball.triangles.size(), {});
    for (std::size_t t = 0; t < ball.triangles.size(); ++t)
        attributes.corner_uv[t].fill({static_cast<float>(t), 0});  // an atlas of single triangles
    EXPECT_EQ(chart_count(attribute_charts(ball, attributes)), ball.triangles.size());
}

TEST(AttributeTransfer, OntoTheMeshItselfChangesNothing) {
    const Parallel parallel;
    MeshAttributes attributes;
    SurfaceMesh surface;
    surface.mesh = box_with_sides(attributes);
    attributes.triangle_material.assign(12, 0);
    attributes.triangle_material[4] = 1;
    attributes.materials = {{.name = "a", .texture = {}, .image = {}},
                            {.name = "b", .texture = {}, .image = {}}};
    const MeshAttributes out = AttributeTransfer(surface.mesh, attributes, 0.01).onto(surface, parallel);
    EXPECT_EQ(out.triangle_material, attributes.triangle_material);
    EXPECT_EQ(out.materials, attributes.materials);
    for (std::size_t t = 0; t < 12; ++t)
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t i = 0; i < 2; ++i)
                EXPECT_NEAR(out.corner_uv[t][k][i], attributes.corner_uv[t][k][i], 1e-6);
}

TEST(AttributeTransfer, ErrorsDecreaseWithTheTriangleSize) {
    const Parallel parallel;
    double before = 1;
    // From a mesh twice as fine onto a rotated one.
    for (int level = 2; level < 5; ++level) {
        const TriangleMesh fine = make_sphere(1, level + 1);
        SurfaceMesh surface;
        surface.mesh = make_sphere(1, level);
        const Mat3 turn = Quat(Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized())).toRotationMatrix();
        for (Vec3& p : surface.mesh.positions) p = turn * p;
        const MeshAttributes out = AttributeTransfer(fine, coloured(fine), 0.1).onto(surface, parallel);
        double worst = 0;
        for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t)
            for (std::size_t k = 0; k < 3; ++k) {
                const Rgba wanted = colour_at(surface.mesh.positions[surface.mesh.triangles[t][k]]);
                for (std::size_t i = 0; i < 4; ++i)
                    worst = std::max(worst,
                                     static_cast<double>(std::abs(out.corner_colour[t][k][i] - wanted[i])));
            }
        EXPECT_LT(worst, 0.3 * before);
        before = worst;
    }
    EXPECT_LT(before, 1e-3);
}

TEST(AttributeTransfer, AThinWallKeepsItsTwoColours) {
    const Parallel parallel;
    // Red above, blue below, 0.01 m apart; the surface lies between and around them.
    const TriangleMesh wall = make_box(Vec3(1, 1, 0.01));
    MeshAttributes attributes;
    for (const Triangle& t : wall.triangles) {
        const double height = wall.positions[t[0]][2] + wall.positions[t[1]][2] + wall.positions[t[2]][2];
        attributes.triangle_material.push_back(height > 0.012 ? 0 : height < -0.012 ? 1 : 2);
    }
    attributes.materials.resize(3);
    Random random(9);
    for (const bool inside_out : {false, true}) {
        TriangleMesh input = wall;
        if (inside_out)
            for (Triangle& t : input.triangles) std::swap(t[1], t[2]);
        const AttributeTransfer transfer(input, attributes, 0.02);
        SurfaceMesh surface;
        std::vector<std::int32_t> wanted;
        for (std::uint32_t i = 0; i < 200; ++i) {
            const bool up = random.below(2) == 1;
            const Vec3 at(random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4),
                          random.uniform(-0.008, 0.008));
            const Vec3 along(0.01, 0, 0.001), across(0, 0.01, -0.001);
            for (const Vec3& p : {at, Vec3(at + (up ? along : across)), Vec3(at + (up ? across : along))})
                surface.mesh.positions.push_back(p);
            surface.mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
            wanted.push_back(up ? 0 : 1);
        }
        EXPECT_EQ(transfer.onto(surface, parallel).triangle_material, wanted);
    }
}

TEST(AttributeTransfer, CutFacesHaveAMaterialOfTheirOwn) {
    const Parallel parallel;
    MeshAttributes attributes;
    SurfaceMesh surface;
    surface.mesh = box_with_sides(attributes);
    surface.triangle_origin.assign(12, Origin::boundary);
    surface.triangle_origin[3] = Origin::cut;
    const MeshAttributes out = AttributeTransfer(surface.mesh, attributes, 0.01).onto(surface, parallel);
    ASSERT_EQ(out.materials.size(), 2U);
    EXPECT_EQ(out.materials[0].name, "boundary");
    EXPECT_EQ(out.materials[1].name, "cut");
    EXPECT_EQ(out.materials[1].colour, cut_colour);
    for (std::size_t t = 0; t < 12; ++t) {
        EXPECT_EQ(out.triangle_material[t], t == 3 ? 1 : 0);
        EXPECT_EQ(out.corner_uv[t] == (std::array<Uv, 3>{}), t == 3);
    }
    // The input's own cut material is used if it has one.
    attributes.triangle_material.assign(12, 0);
    attributes.materials = {{.name = "cut", .texture = {}, .image = {}}};
    EXPECT_EQ(AttributeTransfer(surface.mesh, attributes, 0.01).onto(surface, parallel).materials,
              attributes.materials);
    // With vertex colours these hold the cut colour.
    const MeshAttributes vivid =
        AttributeTransfer(surface.mesh, coloured(surface.mesh), 0.01).onto(surface, parallel);
    EXPECT_EQ(vivid.materials[1].colour, (Rgba{1, 1, 1, 1}));
    EXPECT_NEAR(vivid.corner_colour[3][0][0], 0.8807, 1e-3);
    EXPECT_TRUE(AttributeTransfer(surface.mesh, {}, 0.01).onto(surface, parallel).empty());
}

TEST(AttributeTransfer, SameBitsForAnyThreadCountAndOtherTriangles) {
    const TriangleMesh fine = make_sphere(1, 4);
    const AttributeTransfer transfer(fine, coloured(fine), 0.1);
    SurfaceMesh surface;
    surface.mesh = make_pear(1.9, 48);
    const MeshAttributes one = transfer.onto(surface, Parallel(1));
    EXPECT_EQ(transfer.onto(surface, Parallel(3)), one);
    // Reuses known results of a part of the surface, in another order, among other triangles.
    SurfaceMesh before;
    before.mesh = make_sphere(0.7, 2);
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); t += 3) {
        const auto first = static_cast<std::uint32_t>(before.mesh.positions.size());
        for (const std::uint32_t v : surface.mesh.triangles[t])
            before.mesh.positions.push_back(surface.mesh.positions[v]);
        before.mesh.triangles.insert(before.mesh.triangles.begin(), {first, first + 1, first + 2});
    }
    EXPECT_EQ(transfer.onto(surface, Parallel(2), before, transfer.onto(before, Parallel(2))), one);
    std::reverse(surface.mesh.triangles.begin(), surface.mesh.triangles.end());
    MeshAttributes turned = transfer.onto(surface, Parallel(2));
    std::reverse(turned.corner_colour.begin(), turned.corner_colour.end());
    EXPECT_EQ(turned.corner_colour, one.corner_colour);
}

TEST(MeshAttributes, AppendedArraysStayComplete) {
    MeshAttributes a;
    a.corner_uv.assign(2, {{{1, 1}, {1, 1}, {1, 1}}});
    MeshAttributes b;
    b.triangle_material = {0, -1, 1};
    b.materials.resize(2);
    a.append(2, b, 3);
    EXPECT_EQ(a.corner_uv.size(), 5U);
    EXPECT_EQ(a.corner_uv[4], (std::array<Uv, 3>{}));
    EXPECT_EQ(a.triangle_material, (std::vector<std::int32_t>{-1, -1, 0, -1, 1}));
    a.append(5, b, 3);
    EXPECT_EQ(a.triangle_material, (std::vector<std::int32_t>{-1, -1, 0, -1, 1, 2, -1, 3}));
    EXPECT_EQ(a.materials.size(), 4U);
    MeshAttributes none;
    none.append(4, {}, 2);
    EXPECT_TRUE(none.empty());
}
