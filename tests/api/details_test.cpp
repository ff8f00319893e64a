// What pictures show beside the surface: cuts, links between samples, contacts.
#include "api/scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace splitcubes::api_tests {
namespace {

bool is_free(const SurfaceView& s, std::size_t t) {
    return s.triangles[3 * t] == s.triangles[3 * t + 1];
}

TEST(CutNumbers, EachToolHasItsOwnAndEdgesAreInOrderOfTime) {
    Simulation simulation(in_free_space());
    const BodyId block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    const SurfaceView whole = simulation.surface(block);
    for (std::size_t t = 0; t < whole.triangle_slots(); ++t)
        if (!is_free(whole, t)) EXPECT_EQ(whole.cuts[t], -1);
    std::int32_t last = *std::ranges::max_element(whole.edges);
    std::set<std::int32_t> seen = {-1};
    for (const double x : {-0.04, 0.04}) {
        const ToolId knife = simulation.add_tool({edge_along_y}, {.pose = {{x, 0, 0.2}, {}}});
        simulation.lower_tool(knife);
        cut_through(simulation, knife, x, 10);
        simulation.remove_tool(knife);
        const SurfaceView s = simulation.surface(block);
        std::set<std::int32_t> fresh;
        for (std::size_t t = 0; t < s.triangle_slots(); ++t) {
            if (is_free(s, t)) continue;
            EXPECT_EQ(s.cuts[t] >= 0, s.origins[t] == SurfaceOrigin::cut);
            EXPECT_EQ(s.edges[t] > last, !seen.contains(s.cuts[t])) << t;
            if (s.edges[t] > last) fresh.insert(s.cuts[t]);
        }
        ASSERT_EQ(fresh.size(), 1U);
        seen.insert(*fresh.begin());
        last = *std::ranges::max_element(s.edges);
    }
}

TEST(Links, LoseVisibilityAcrossACutAndVanishBetweenPieces) {
    Simulation simulation(in_free_space());
    const BodyId block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    const std::vector<SampleLink> before = simulation.links(block);
    EXPECT_GT(before.size(), simulation.samples(block).size());
    for (const SampleLink& link : before) EXPECT_EQ(link.visibility, 1);
    simulation.cut_with_sheet(block, SheetMesh(0.06, 0.004).view());
    std::size_t hidden = 0;
    for (const SampleLink& link : simulation.links(block)) {
        EXPECT_GE(link.visibility, 0);
        EXPECT_LE(link.visibility, 1);
        hidden += link.visibility < 1;
    }
    EXPECT_GT(hidden, 10U);
    simulation.cut_with_sheet(block, SheetMesh(0.3, 0.004).view());
    const SampleState samples = simulation.samples(block);
    for (const SampleLink& link : simulation.links(block)) {
        ASSERT_LT(std::max(link.a, link.b), samples.size());
        EXPECT_EQ(samples.pieces[link.a], samples.pieces[link.b]);
    }
}

TEST(Contacts, OfABlockAtRestBearItsWeight) {
    SimulationSettings settings = in_free_space();
    settings.gravity = {0, 0, -9.81};
    settings.ground = Ground{.offset = -0.1};
    Simulation simulation(settings);
    BodySettings body = soft_block();
    body.material.mass_damping = 8;
    const BodyId block = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), body);
    EXPECT_TRUE(simulation.contacts().empty());
    for (int k = 0; k < 120; ++k) simulation.step();
    double force = 0;
    for (const ContactPoint& contact : simulation.contacts()) {
        EXPECT_EQ(contact.body, block);
        EXPECT_FALSE(contact.by_a_body);
        EXPECT_NEAR(contact.position.z, -0.1, 0.02);
        force += contact.force.z;
    }
    EXPECT_NEAR(force, 0.008 * 1000 * 9.81, 8);
}

TEST(Contacts, BetweenPiecesAreByABody) {
    SimulationSettings settings = in_free_space();
    settings.gravity = {0, 0, -9.81};
    settings.ground = Ground{.offset = -0.1};
    settings.contact.pieces = true;
    Simulation simulation(settings);
    const BodyId lower = simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), soft_block());
    BodySettings above = soft_block();
    above.placement.position = {0, 0, 0.201};
    simulation.add_body(BoxMesh(0.2, 0.2, 0.2).view(), above);
    for (int k = 0; k < 40; ++k) simulation.step();
    std::size_t between = 0, below = 0;
    for (const ContactPoint& contact : simulation.contacts()) {
        between += contact.by_a_body;
        below += !contact.by_a_body && contact.body == lower;
        EXPECT_TRUE(std::isfinite(contact.force.z));
    }
    EXPECT_GT(between, 3U);
    EXPECT_GT(below, 3U);
}

}  // namespace
}  // namespace splitcubes::api_tests
