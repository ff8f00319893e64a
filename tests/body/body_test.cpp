// One body at rest: its samples, surface and pieces stay consistent under any cuts.
#include <splitcubes/body/body.h>

#include "laws/solids.h"
#include "laws/worlds.h"

#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/splitting/extract.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace splitcubes::body {
namespace {

using namespace laws;
using geometry::TriangleMesh;

const std::vector<std::string> nothing_wrong;

const Parallel& two_threads() {
    static const Parallel parallel(2);
    return parallel;
}

Body block(int phyxels = 200) {
    return {geometry::make_box(Vec3(0.2, 0.16, 0.14)), soft(0.2 / 14, phyxels), two_threads()};
}

// Checks that no link transmits force between two pieces, by the phyxels' own positions.
void expect_no_link_across(const Body& body) {
    const meshless::Neighbourhoods& links = body.neighbourhoods();
    const meshless::Phyxels& phyxels = body.phyxels();
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        for (std::uint32_t k = links.links_begin(i); k < links.links_end(i); ++k)
            if (phyxels.piece[links.neighbour()[k]] != phyxels.piece[i]) {
                ASSERT_EQ(links.weight()[k], 0);
                ASSERT_EQ(links.gradient()[k], Vec3::Zero());
            }
    for (std::size_t k = 0; k < body.pairs().size(); ++k)
        if (phyxels.piece[body.pairs().a[k]] != phyxels.piece[body.pairs().b[k]]) {
            ASSERT_EQ(body.pairs().visibility[k], 0);
        }
}

TEST(Body, HasTheRequestedSamplesAndTheMassOfItsVolume) {
    for (const int count : {50, 200, 1000}) {
        const Body body = block(count);
        EXPECT_EQ(body.validate(), nothing_wrong);
        EXPECT_NEAR(static_cast<double>(body.phyxels().size()), count, 0.35 * count);
        const double volume = body.surface_mesh().mesh.volume();
        EXPECT_NEAR(total_mass(body.phyxels()), 1000 * volume, 1e-9 * total_mass(body.phyxels()));
        EXPECT_NEAR(volume, 0.2 * 0.16 * 0.14, 1e-3 * volume);
        EXPECT_GT(*std::min_element(body.phyxels().mass.begin(), body.phyxels().mass.end()), 0);
    }
}

TEST(Body, StartsWhereItIsPlaced) {
    const Body body = block();
    EXPECT_EQ(body.phyxels().position, body.phyxels().rest_position);
    const auto& vertices = body.surface().vertices();
    for (std::size_t v = 0; v < vertices.size(); ++v)
        ASSERT_LT((body.vertex_positions()[v] - vertices[v].rest).norm(), 1e-7);
    EXPECT_TRUE(geometry::check_mesh(body.surface_mesh().mesh).valid());
}

TEST(Body, APlaneLeavesNoLinkAcross) {
    Random random(1);
    const TriangleMesh shapes[] = {geometry::make_box(Vec3(0.2, 0.16, 0.14)), geometry::make_sphere(0.1, 4),
                                   geometry::make_capsule(0.06, 0.1)};
    for (const TriangleMesh& shape : shapes)
        for (int trial = 0; trial < 5; ++trial) {
            const Vec3 center = random_vector(random, 0.02), normal = random_direction(random);
            SCOPED_TRACE(testing::Message() << "shape " << &shape - shapes << ", plane through "
                                            << center.transpose() << " across " << normal.transpose());
            Body body(shape, soft(shape.bounds().size().maxCoeff() / 16, 250), two_threads());
            const double mass = total_mass(body.phyxels());
            ASSERT_GT(body.cut_with_sheet(geometry::make_plane_sheet(center, normal, 1), 0, two_threads()),
                      0U);
            ASSERT_EQ(body.pieces().count(), 2U);
            ASSERT_EQ(body.validate(), nothing_wrong);
            expect_no_link_across(body);
            EXPECT_NEAR(total_mass(body.phyxels()), mass, 1e-12 * mass);
            // The phyxels' pieces are the sides of the plane. Within a cell of its rim, where cut and
            // boundary share cells, the surface decides.
            std::array<double, 2> height{0, 0};
            for (std::size_t i = 0; i < body.phyxels().size(); ++i)
                height[static_cast<std::size_t>(body.phyxels().piece[i])] +=
                    normal.dot(body.phyxels().rest_position[i] - center);
            const double up = height[0] > 0 ? 1 : -1;
            const splitting::NodeGrid& grid = body.grid();
            for (std::size_t i = 0; i < body.phyxels().size(); ++i) {
                const Vec3& rest = body.phyxels().rest_position[i];
                const double side = normal.dot(rest - center) * (body.phyxels().piece[i] == 0 ? up : -up);
                const Vec3i cell = grid.rest().to_grid(rest).array().floor().cast<int>();
                const bool deep = grid.cell_inside(cell) == 255;
                ASSERT_GT(side, (deep ? -0.03 : -1) * grid.rest().cell_size);
            }
            // The same sheet cuts nothing a second time.
            EXPECT_EQ(body.cut_with_sheet(geometry::make_plane_sheet(center, normal, 1), 1, two_threads()),
                      0U);
            EXPECT_EQ(body.validate(), nothing_wrong);
        }
}

TEST(Body, StaysValidUnderManySheetCuts) {
    Random random(2);
    Body body = block(300);
    const double mass = total_mass(body.phyxels());
    std::size_t pieces = 1, edges = 0;
    for (int k = 0; k < 15; ++k) {
        edges +=
            body.cut_with_sheet(geometry::make_plane_sheet(random_vector(random, 0.08),
                                                           random_direction(random), k % 3 == 0 ? 1 : 0.04),
                                k, two_threads());
        ASSERT_EQ(body.validate(), nothing_wrong) << "after sheet " << k;
        expect_no_link_across(body);
        ASSERT_NEAR(total_mass(body.phyxels()), mass, 1e-12 * mass) << "after sheet " << k;
        ASSERT_GE(body.pieces().count(), pieces);
        pieces = body.pieces().count();
    }
    EXPECT_EQ(body.cut_edge_count(), edges);
    EXPECT_GT(pieces, 8U);
    // Each piece is a valid closed mesh.
    const geometry::SurfaceMesh whole = body.surface_mesh();
    for (std::size_t piece = 0; piece < pieces; ++piece)
        EXPECT_TRUE(
            geometry::check_mesh(splitting::extract_piece(whole, static_cast<std::int32_t>(piece)).mesh)
                .valid());
}

TEST(Body, ASlitBlocksTheVisibilityOfPairsAcross) {
    Body body = block(400);
    std::size_t before = 0, after = 0;
    for (const float v : body.pairs().visibility) before += v > 0;
    body.cut_with_sheet(geometry::make_plane_sheet(Vec3::Zero(), Vec3(1, 0.1, 0.05), 0.05), 0, two_threads());
    for (const float v : body.pairs().visibility) after += v > 0;
    EXPECT_EQ(body.pieces().count(), 1U);
    EXPECT_LT(after, before);
    EXPECT_EQ(body.validate(), nothing_wrong);
}

TEST(Body, StartsWithTheGivenMotion) {
    BodySettings settings = soft(0.02, 150);
    settings.velocity = Vec3(1, 2, 3);
    settings.angular_velocity = Vec3(-4, 0, 2);
    const Body body(moved(geometry::make_box(Vec3(0.2, 0.16, 0.14)), Vec3(0.3, -1, 2)), settings,
                    two_threads());
    const meshless::Momenta momenta = meshless::total_momenta(body.phyxels());
    EXPECT_LT((momenta.linear - momenta.mass * settings.velocity).norm(), 1e-12 * momenta.linear.norm());
    const Vec3 rotation_rate = meshless::angular_velocity(momenta.inertia, momenta.angular_momentum);
    EXPECT_LT((rotation_rate - settings.angular_velocity).norm(), 1e-9);
}

TEST(Body, RefusesSettingsThatAreNotPhysical) {
    const TriangleMesh mesh = geometry::make_box(Vec3::Ones());
    const auto refuses = [&](const auto& change) {
        BodySettings settings = soft(0.2, 50);
        change(settings);
        EXPECT_THROW(Body(mesh, settings, two_threads()), InputError);
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NO_THROW(Body(mesh, soft(0.2, 50), two_threads()));
    refuses([](BodySettings& s) { s.cell_size = 0; });
    refuses([&](BodySettings& s) { s.cell_size = nan; });
    refuses([](BodySettings& s) { s.cell_size = 1e-9; });
    refuses([](BodySettings& s) { s.phyxel_count = 0; });
    refuses([](BodySettings& s) { s.phyxel_spacing = -1; });
    refuses([&](BodySettings& s) { s.phyxel_spacing = nan; });
    refuses([](BodySettings& s) { s.material.density = 0; });
    refuses([](BodySettings& s) { s.material.youngs_modulus = -1; });
    refuses([](BodySettings& s) { s.material.poisson_ratio = 0.5; });
    refuses([&](BodySettings& s) { s.velocity[1] = nan; });
    EXPECT_THROW(Body({}, soft(0.2, 50), two_threads()), InputError);
    EXPECT_THROW(
        Body(geometry::make_plane_sheet(Vec3::Zero(), Vec3::UnitZ(), 1), soft(0.2, 50), two_threads()),
        InputError);
}

TEST(Body, ABodyOfOneCellWorks) {
    // So coarse that there is one node and one phyxel.
    Body body(box_between(Vec3::Zero(), Vec3::Ones()), soft(1, 5), two_threads());
    EXPECT_EQ(body.validate(), nothing_wrong);
    EXPECT_GE(body.phyxels().size(), 1U);
    body.cut_with_sheet(geometry::make_plane_sheet(Vec3::Constant(0.5), Vec3(1, 2, 3), 2), 0, two_threads());
    EXPECT_EQ(body.validate(), nothing_wrong);
}

}  // namespace
}  // namespace splitcubes::body
