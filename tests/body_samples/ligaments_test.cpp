// Parts of a body that uncut edges connect stay together, however little material is left between them.
#include "laws/solids.h"
#include "laws/worlds.h"

#include <gtest/gtest.h>
#include <splitcubes/body/body.h>
#include <splitcubes/world/world.h>

namespace splitcubes::body {
namespace {

using namespace laws;

// Returns the number of groups into which links divide the elastic pieces, less that of these pieces. A link
// acts on both its ends, also where only one of them has it in reach.
std::size_t separate_group_count(const Body& body) {
    const meshless::Phyxels& phyxels = body.phyxels();
    const meshless::Neighbourhoods& links = body.neighbourhoods();
    std::vector<std::uint8_t> seen(phyxels.size(), 0), has_group(body.pieces().count(), 0);
    std::size_t count = 0;
    for (std::uint32_t first = 0; first < phyxels.size(); ++first) {
        const std::int32_t piece = phyxels.piece[first];
        if (seen[first] != 0 || phyxels.rigid.index(piece) >= 0) continue;
        count += has_group[static_cast<std::size_t>(piece)];
        has_group[static_cast<std::size_t>(piece)] = 1;
        std::vector<std::uint32_t> group{first};
        seen[first] = 1;
        for (std::size_t k = 0; k < group.size(); ++k)
            for (std::uint32_t l = links.links_begin(group[k]); l < links.links_end(group[k]); ++l) {
                const std::uint32_t j = links.neighbour()[l];
                const std::uint32_t back = links.find_link(j, group[k]);
                if (seen[j] != 0 || !(links.weight()[l] + links.weight()[back] > 0)) continue;
                seen[j] = 1;
                group.push_back(j);
            }
    }
    return count;
}

// Returns a sheet across the plane x = at that leaves a square of the material uncut.
geometry::TriangleMesh sheet_around(double at, double y, double z, double half) {
    geometry::TriangleMesh sheet;
    for (const auto& [dy, dz] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
        sheet.positions.emplace_back(at, y + dy * half, z + dz * half);
        sheet.positions.emplace_back(at, dy * 1.0, dz * 1.0);
    }
    for (std::uint32_t k = 0; k < 8; k += 2) {
        const std::uint32_t next = (k + 2) % 8;
        sheet.triangles.push_back({k, k + 1, next + 1});
        sheet.triangles.push_back({k, next + 1, next});
    }
    return sheet;
}

// Returns the distance of the centres of mass of both sides of the plane x = 0, m.
double distance_of_sides(const meshless::Phyxels& phyxels) {
    Vec3 centre[2] = {Vec3::Zero(), Vec3::Zero()};
    double mass[2] = {0, 0};
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const bool right = phyxels.rest_position[i].x() > 0;
        centre[right] += phyxels.mass[i] * phyxels.position[i];
        mass[right] += phyxels.mass[i];
    }
    return (centre[1] / mass[1] - centre[0] / mass[0]).norm();
}

// Rotates a block whose sides hang together by some ligaments, and expects that they stay together.
void expect_together(const std::vector<geometry::TriangleMesh>& sheets, int phyxels) {
    World world(free_space(), threads(2));
    BodySettings settings = soft(0.01, phyxels);
    settings.material.youngs_modulus = 1e6;
    settings.angular_velocity = Vec3(0, 0, 1);
    Body& body = world.add_body(box_between({-0.1, -0.06, -0.06}, {0.1, 0.06, 0.06}), settings);
    for (std::size_t k = 0; k < sheets.size(); ++k)
        body.cut_with_sheet(sheets[k], static_cast<std::int32_t>(k), world.parallel());
    ASSERT_EQ(body.pieces().count(), 1U);
    EXPECT_EQ(separate_group_count(body), 0U);
    const double before = distance_of_sides(body.phyxels());
    for (int step = 0; step < 60; ++step) world.step();
    EXPECT_NEAR(distance_of_sides(body.phyxels()), before, 0.02 * before);
}

TEST(Ligaments, HoldTheSidesOfACutTogether) {
    Random random(3);
    for (const int phyxels : {100, 700})
        for (int trial = 0; trial < 2; ++trial) {
            SCOPED_TRACE(std::to_string(phyxels) + " phyxels, trial " + std::to_string(trial));
            const double y = random.uniform(-0.04, 0.04), z = random.uniform(-0.04, 0.04);
            expect_together({sheet_around(random.uniform(-0.002, 0.002), y, z, 0.0055)}, phyxels);
        }
}

// The only way leads through a layer that is too thin for a phyxel.
TEST(Ligaments, HoldAlsoAlongDetours) {
    for (const int phyxels : {100, 600}) {
        SCOPED_TRACE(std::to_string(phyxels) + " phyxels");
        expect_together({sheet_around(-0.004, -0.035, 0, 0.0055), sheet_around(0.016, 0.035, 0, 0.0055)},
                        phyxels);
    }
}

// Random sheets through bodies at rest.
TEST(Ligaments, ConnectThePhyxelsOfEachPiece) {
    Random random(8);
    for (int trial = 0; trial < 4; ++trial) {
        SCOPED_TRACE("trial " + std::to_string(trial));
        World world(free_space(), threads(2));
        Body& body = world.add_body(turned(geometry::make_box(Vec3(0.3, 0.2, 0.15)), random_rotation(random)),
                                    soft(random.uniform(0.009, 0.016), trial % 2 == 0 ? 120 : 500));
        for (int cut = 0; cut < 40; ++cut) {
            geometry::TriangleMesh sheet;
            const Vec3 at = random_vector(random, 0.1), u = random_direction(random),
                       v = random_direction(random);
            for (const Vec3& offset : {Vec3(u), Vec3(v), Vec3(-u), Vec3(-v)})
                sheet.positions.push_back(at + random.uniform(0.03, 0.12) * offset);
            sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
            body.cut_with_sheet(sheet, cut, world.parallel());
            ASSERT_EQ(separate_group_count(body), 0U);
            ASSERT_EQ(body.validate(), std::vector<std::string>{});
        }
    }
}

}  // namespace
}  // namespace splitcubes::body
