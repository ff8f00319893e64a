// Contact search and tearing do not allocate after warm-up.
#include "counted_allocations.h"

#include <splitcubes/body/body.h>
#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/contact_finder.h>
#include <splitcubes/fracture/tearing.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/world/world.h>

#include <gtest/gtest.h>

#include <optional>

namespace splitcubes::body {
namespace {

geometry::TriangleMesh level_sheet(double height, double half) {
    return {{{-half, -half, height}, {half, -half, height}, {half, half, height}, {-half, half, height}},
            {{0, 1, 2}, {0, 2, 3}}};
}

// A block on the ground, cut into two slices, one on top of the other.
struct Slices {
    explicit Slices(int threads)
        : parallel(std::make_shared<const Parallel>(threads)), world(settings(), parallel) {
        BodySettings block;
        block.cell_size = 0.01;
        block.phyxel_spacing = 0.02;
        block.material.youngs_modulus = 5e4;
        world.add_body(geometry::make_box(Vec3::Constant(0.12)), block);
        world.add_collider({"ball", geometry::make_sphere_distance(0.05),
                            [](double) { return Isometry(Eigen::Translation3d(0, 0, 0.12)); }, 0.5});
        world.bodies()[0]->cut_with_sheet(level_sheet(0.004, 0.1), 0, *parallel);
        for (int k = 0; k < 30; ++k) world.step();
    }
    static WorldSettings settings() {
        WorldSettings out;
        out.contact.pieces = true;
        out.ground = meshless::GroundPlane{Vec3::UnitZ(), -0.06, 0.6};
        out.validate_each_step = false;
        return out;
    }
    std::shared_ptr<const Parallel> parallel;
    World world;
};

TEST(Contact, IsSearchedWithoutAllocatingOnceItIsWarm) {
    for (const int threads : {1, 2}) {
        Slices slices(threads);
        ContactFinder finder;
        std::vector<ContactIsland> groups;
        const std::vector<BodyView> bodies = views_of(slices.world.bodies());
        const auto find = [&] {
            finder.find(
                {bodies, slices.world.colliders(), slices.world.settings().contact, slices.world.time(),
                 slices.world.settings().time_step, slices.world.settings().gravity},
                *slices.parallel, groups);
        };
        // With several threads the assignment of work to scratch memory varies.
        for (int k = 0; k < 50; ++k) find();
        ASSERT_EQ(groups.size(), 1U);
        EXPECT_GT(groups[0].contacts.size(), 100U);
        const std::size_t before = allocations;
        for (int k = 0; k < 10; ++k) find();
        EXPECT_EQ(allocations, before) << "threads: " << threads;
    }
}

// Tearing of the slices at rest with a strength just above their stress, so that edges are examined in every
// call.
struct NearItsStrength {
    explicit NearItsStrength(Slices& slices)
        : body(*slices.world.bodies()[0]),
          grid(body.grid()),
          locator(body.phyxels().rest_position, 1.6 * body.phyxel_spacing()),
          parallel(*slices.parallel) {
        TearSettings settings;
        settings.propagation_ratio = 1;
        double load = 0;
        for (settings.strength = 4000; load < 0.9 && settings.strength > 1; settings.strength *= 0.97) {
            tearing.emplace(settings, body.settings().material, grid, body.phyxels(), body.neighbourhoods());
            torn += tear();
            load = tearing->top_load();
        }
        EXPECT_GT(load, 0.9);
        EXPECT_LT(load, 1);
    }
    std::size_t tear() {
        return tearing
            ->tear(grid, {body.pieces(),
                          body.occluders(),
                          body.phyxels(),
                          body.neighbourhoods(),
                          locator,
                          body.settings().material,
                          body.nodes(),
                          {},
                          {},
                          body.phyxel_spacing(),
                          1.0 / 60,
                          parallel})
            .size();
    }

    const Body& body;
    splitting::NodeGrid grid;
    meshless::PhyxelLocator locator;
    const Parallel& parallel;
    std::optional<Tearing> tearing;
    std::size_t torn = 0;
};

TEST(Tearing, ChecksWithoutAllocatingOnceItIsWarm) {
    for (const int threads : {1, 2}) {
        Slices slices(threads);
        NearItsStrength near(slices);
        for (int k = 0; k < 30; ++k) near.torn += near.tear();
        EXPECT_EQ(near.torn, 0U);
        const std::size_t before = allocations;
        for (int k = 0; k < 10; ++k) near.tear();
        EXPECT_EQ(allocations, before) << "threads: " << threads;
    }
}

TEST(Allocation, IsCounted) {
    const std::size_t before = allocations;
    const std::vector<int> some(100);
    EXPECT_EQ(allocations, before + 1) << some.size();
}

}  // namespace
}  // namespace splitcubes::body
