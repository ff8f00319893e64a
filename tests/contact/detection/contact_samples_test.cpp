// The contact samples equal those of a reference implementation.
#include <splitcubes/body/body.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/splitting/surface.h>
#include <splitcubes/world/world.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <vector>

namespace splitcubes::body {
namespace {

// Reference: the first centre vertex of each piece and direction in each box of half a phyxel spacing; none
// in cells that a cut entered without separating them.
std::vector<std::pair<std::uint32_t, std::int32_t>> reference_list(const Body& body) {
    const int side = static_cast<int>(std::floor(0.5 * body.phyxel_spacing() / body.grid().rest().cell_size));
    std::set<std::tuple<int, int, int, std::int32_t, int>> seen;
    std::vector<std::pair<std::uint32_t, std::int32_t>> out;
    const auto& vertices = body.surface().vertices();
    for (std::uint32_t v = 0; v < vertices.size(); ++v) {
        const splitting::SurfaceVertex& vertex = vertices[v];
        if (!vertex.alive() || vertex.kind != splitting::VertexKind::centre || vertex.corners == 0xff)
            continue;
        const std::int32_t piece = body.pieces().piece_of(body.grid(), body.surface().influence(vertex));
        int axis = 0;
        vertex.normal.cwiseAbs().maxCoeff(&axis);
        const int direction = 2 * axis + (vertex.normal[axis] < 0);
        const Vec3i box = vertex.lowest_node / std::max(side, 1);
        if (seen.insert({box[0], box[1], box[2], piece, direction}).second) out.emplace_back(v, piece);
    }
    return out;
}

std::vector<std::pair<std::uint32_t, std::int32_t>> list_of(const Body& body) {
    std::vector<std::pair<std::uint32_t, std::int32_t>> out;
    for (const ContactSample& point : body.contact_samples()) out.emplace_back(point.vertex, point.piece);
    return out;
}

geometry::TriangleMesh sheet(const Vec3& a, const Vec3& b, const Vec3& c) {
    return {{a, b, c}, {{0, 1, 2}}};
}

TEST(ContactSamples, EqualTheReferenceList) {
    for (const double spacing : {0.02, 0.045}) {
        const Parallel parallel(3);
        BodySettings settings;
        settings.cell_size = 0.01;
        settings.phyxel_spacing = spacing;
        Body body(geometry::make_box(Vec3(0.2, 0.2, 0.2)), settings, parallel);
        EXPECT_EQ(list_of(body), reference_list(body));
        body.cut_with_sheet(sheet({0.011, -1, -1}, {0.012, 1, -1}, {0.013, 0, 2}), 0, parallel);
        EXPECT_EQ(list_of(body), reference_list(body));
        const std::size_t before = body.contact_samples().size();
        body.cut_with_sheet(sheet({-1, -1, 0.031}, {1, -1, 0.012}, {0, 2, 0.017}), 1, parallel);
        EXPECT_EQ(list_of(body), reference_list(body));
        EXPECT_EQ(body.pieces().count(), 4U);
        EXPECT_GT(body.contact_samples().size(), before + 20);
        // A cut that ends within the body.
        body.cut_with_sheet(sheet({-0.2, -0.061, -0.05}, {-0.03, -0.058, 0}, {-0.2, -0.062, 0.06}), 2,
                            parallel);
        EXPECT_EQ(list_of(body), reference_list(body));
    }
}

TEST(ContactSamples, PushOncePerSpacingOnFlatFacesAndPerNormalElsewhere) {
    const Parallel parallel(2);
    BodySettings settings;
    settings.cell_size = 0.01;
    settings.phyxel_spacing = 0.03;
    Body body(geometry::make_box(Vec3(0.3, 0.3, 0.3)), settings, parallel);
    body.cut_with_sheet(sheet({0.011, -1, -1}, {0.012, 1, -1}, {0.013, 0, 2}), 0, parallel);
    const auto& vertices = body.surface().vertices();
    // Normals of the pushing samples, per box of a spacing, piece and direction.
    std::map<std::tuple<int, int, int, std::int32_t, int>, std::vector<Vec3f>> pushing;
    const auto box_of = [&](const ContactSample& point) {
        const splitting::SurfaceVertex& vertex = vertices[point.vertex];
        int axis = 0;
        vertex.normal.cwiseAbs().maxCoeff(&axis);
        const Vec3i box = vertex.lowest_node / 3;
        return std::tuple{box[0], box[1], box[2], point.piece, 2 * axis + (vertex.normal[axis] < 0)};
    };
    for (const ContactSample& point : body.contact_samples())
        if (point.pushes()) pushing[box_of(point)].push_back(vertices[point.vertex].normal.normalized());
    std::size_t others = 0, pushed = 0;
    for (const ContactSample& point : body.contact_samples()) {
        pushed += point.pushes();
        if (point.pushes()) continue;
        ++others;
        const std::vector<Vec3f>& normals = pushing[box_of(point)];
        EXPECT_TRUE(std::any_of(normals.begin(), normals.end(), [&](const Vec3f& normal) {
            return normal.dot(vertices[point.vertex].normal.normalized()) > 0.99F;
        })) << "a sample with the same normal pushes for it";
    }
    for (const auto& [box, normals] : pushing)
        for (std::size_t a = 0; a < normals.size(); ++a)
            for (std::size_t b = 0; b < a; ++b) EXPECT_LT(normals[a].dot(normals[b]), 0.9999F);
    EXPECT_GT(others, 4 * pushed);
    std::set<std::int32_t> cut_faces;
    for (const ContactSample& point : body.contact_samples())
        if (point.pushes() && std::abs(vertices[point.vertex].rest.x() - 0.012) < 0.01)
            cut_faces.insert(point.piece);
    EXPECT_EQ(cut_faces.size(), 2U) << "both cut faces push";
}

// Returns a wavy sheet across x with the amplitude `height`.
geometry::TriangleMesh waves(double height) {
    geometry::TriangleMesh mesh;
    constexpr std::uint32_t across = 60;
    for (std::uint32_t k = 0; k <= across; ++k)
        for (std::uint32_t l = 0; l <= across; ++l) {
            const double y = -0.2 + 0.4 * k / across, z = -0.2 + 0.4 * l / across;
            mesh.positions.emplace_back(0.0013 + height * std::sin(90 * y) * std::cos(80 * z), y, z);
        }
    for (std::uint32_t k = 0; k < across; ++k)
        for (std::uint32_t l = 0; l < across; ++l) {
            const std::uint32_t a = k * (across + 1) + l, b = a + across + 1;
            mesh.triangles.push_back({a, b, b + 1});
            mesh.triangles.push_back({a, b + 1, a + 1});
        }
    return mesh;
}

TEST(ContactSamples, OneSamplePerSpacingSearchesOnRoughCutFaces) {
    const Parallel parallel(2);
    BodySettings settings;
    settings.cell_size = 0.01;
    settings.phyxel_spacing = 0.03;
    Body body(geometry::make_box(Vec3(0.3, 0.3, 0.3)), settings, parallel);
    body.cut_with_sheet(waves(0.02), 0, parallel);
    ASSERT_EQ(body.pieces().count(), 2U);
    const auto& vertices = body.surface().vertices();
    std::map<std::uint32_t, ContactSample> sample_of;
    for (const ContactSample& point : body.contact_samples()) sample_of.emplace(point.vertex, point);
    std::size_t pushed = 0, searching = 0, opposite_count = 0;
    for (const ContactSample& point : body.contact_samples()) {
        const splitting::SurfaceVertex& vertex = vertices[point.vertex];
        const bool is_cut_face = vertex.rest.cwiseAbs().maxCoeff() < 0.14;
        if (!point.pushes()) {
            EXPECT_EQ(point.face_delegate, point.vertex) << "it is represented already";
            continue;
        }
        const ContactSample& delegate = sample_of.at(point.face_delegate);
        EXPECT_TRUE(delegate.pushes() && delegate.face_delegate == delegate.vertex &&
                    delegate.piece == point.piece);
        EXPECT_EQ(vertices[delegate.vertex].lowest_node / 3, vertex.lowest_node / 3) << "in the same box";
        EXPECT_GT(vertices[delegate.vertex].normal.normalized().dot(vertex.normal.normalized()), 0);
        pushed += is_cut_face;
        searching += is_cut_face && point.face_delegate == point.vertex && point.opposite == point.vertex;
        if (point.opposite == point.vertex) continue;
        ++opposite_count;
        const ContactSample& opposite = sample_of.at(point.opposite);
        EXPECT_EQ(opposite.opposite, opposite.vertex);
        EXPECT_TRUE(point.face_delegate == point.vertex && opposite.face_delegate == opposite.vertex);
        EXPECT_EQ(vertices[opposite.vertex].lowest_node, vertex.lowest_node);
        EXPECT_EQ(vertices[opposite.vertex].corners & vertex.corners, 0) << "on the opposite cut face";
    }
    EXPECT_GT(pushed, 800U);
    EXPECT_LT(searching, pushed / 3);
    EXPECT_GT(opposite_count, 30U);
}

TEST(ContactSamples, AreRebuiltOnlyIfContactsAreEnabled) {
    const auto parallel = std::make_shared<const Parallel>(2);
    for (const bool contacts : {false, true}) {
        WorldSettings world_settings;
        world_settings.contact.pieces = contacts;
        World world(world_settings, parallel);
        BodySettings settings;
        settings.cell_size = 0.02;
        settings.phyxel_spacing = 0.04;
        Body& body = world.add_body(geometry::make_box(Vec3::Constant(0.2)), settings);
        world.step();
        body.cut_with_sheet(sheet({0.011, -1, -1}, {0.012, 1, -1}, {0.013, 0, 2}), 0, *parallel);
        const std::uint64_t listed = body.sample_revision();
        EXPECT_EQ(listed, body.surface().revision());  // a cut at rest lists them in any case
        world.add_tool(cutting::Blade(
            "blade", cutting::make_straight_blade({0, -0.3, 0}, {0, 0.3, 0}),
            {{0, {-0.03, 0, 0.2}, Quat::Identity()}, {0.1, {-0.03, 0, -0.2}, Quat::Identity()}}));
        for (int step = 0; step < 4; ++step) world.step();
        EXPECT_GT(body.surface().revision(), listed);
        EXPECT_EQ(body.sample_revision() == body.surface().revision(), contacts);
    }
}

}  // namespace
}  // namespace splitcubes::body
