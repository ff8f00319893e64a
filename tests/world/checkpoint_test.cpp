// Checkpoints: a restored world continues exactly like one that was never interrupted.
#include <splitcubes/body/body.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/world/checkpoint.h>

#include "laws/solids.h"
#include "laws/worlds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace splitcubes::body {
namespace {

using namespace laws;

constexpr int last_step = 40;

// A rotating block that falls on the ground while three blades cut it, the last into rigid fragments, and a
// ball rolls into it; and a bar that is bent past yield and pulled at its end.
std::unique_ptr<World> eventful_world(meshless::SolverKind solver, int thread_count) {
    WorldSettings settings = free_space();
    settings.validate_each_step = false;
    settings.gravity = Vec3(0, 0, -9.81);
    settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.4};
    settings.contact.restitution = 0.6;
    settings.solver.kind = solver;
    auto world = std::make_unique<World>(settings, threads(thread_count));
    BodySettings block = soft(0.02, 120);
    block.angular_velocity = Vec3(0.5, 0.3, -0.4);
    geometry::TriangleMesh box = geometry::make_box(Vec3(0.2, 0.16, 0.14));
    for (Vec3& p : box.positions) p.z() += 0.12;
    world->add_body(box, block);
    BodySettings bar = soft(0.02, 60);
    bar.material.plasticity = meshless::Plasticity{};
    bar.material.plasticity->yield = 0.01;
    geometry::TriangleMesh long_box = geometry::make_box(Vec3(0.3, 0.06, 0.06));
    for (Vec3& p : long_box.positions) p += Vec3(0, 0.5, 0.3);
    Body& held = world->add_body(long_box, bar);
    held.add_constraint(hold_beyond(Vec3(0.1, 0, 0), Vec3::UnitX()));
    Handle handle;
    handle.region = [](const Vec3& p) { return p.x() < -0.1; };
    handle.motion = [](double time) { return Isometry(Eigen::Translation3d(0.02 * time, 0, 0.1 * time)); };
    handle.stiffness = 200;
    handle.limit = 2;
    held.add_handle(handle);
    Collider ball;
    ball.solid = geometry::make_sphere_distance(0.05);
    ball.motion = [](double time) {
        return Isometry(Eigen::Translation3d(0.3 - 0.5 * time, 0, 0.05) *
                        Eigen::AngleAxisd(-10 * time, Vec3::UnitY()));
    };
    world->add_collider(ball);
    world->add_tool(moving_blade(Vec3(0.01, -0.2, 0), Vec3(-0.01, 0.2, 0.02), Vec3(0.003, 0, 0.3),
                                 Vec3(0.02, 0, -0.1), 0.02, 0.5));
    world->add_tool(moving_blade(Vec3(-0.2, 0, 0), Vec3(0.2, 0.01, 0), Vec3(0, -0.2, 0.1), Vec3(0, 0.2, 0.08),
                                 0.1, 0.4, 2));
    world->add_tool(moving_blade(Vec3(-0.2, -0.1, 0), Vec3(0.2, 0.1, 0), Vec3(0, -0.05, 0.3),
                                 Vec3(0, -0.04, -0.05), 0.2, 0.6));
    return world;
}

std::string surface_hash(const World& world) {
    StateHash hash;
    const geometry::SurfaceMesh surface = world.surface_mesh();
    for (const Vec3& p : surface.mesh.positions)
        for (int k = 0; k < 3; ++k) hash.add(p[k]);
    for (const geometry::Triangle& t : surface.mesh.triangles)
        for (const std::uint32_t v : t) hash.add(v);
    return world.state_hash().text() + " " + hash.text();
}

class CheckpointBy : public testing::TestWithParam<meshless::SolverKind> {};

TEST_P(CheckpointBy, ContinuesBitIdentically) {
    const auto uninterrupted = eventful_world(GetParam(), 2);
    std::vector<std::string> checkpoints, hashes;
    for (int step = 0; step <= last_step; ++step) {
        hashes.push_back(surface_hash(*uninterrupted));
        if (step % 5 == 0)
            checkpoints.push_back(
                encode_checkpoint(*uninterrupted, "a scene", "page " + std::to_string(step)));
        uninterrupted->step();
    }
    EXPECT_GE(uninterrupted->bodies()[0]->pieces().count(), 4U);
    for (std::size_t k = 0; k < checkpoints.size(); k += 2) {
        const auto resumed = eventful_world(GetParam(), 1);
        EXPECT_EQ(restore_checkpoint(*resumed, checkpoints[k], "a scene", "x"),
                  "page " + std::to_string(5 * k));
        EXPECT_EQ(resumed->step_count(), static_cast<std::int64_t>(5 * k));
        for (std::size_t step = 5 * k; step < hashes.size(); ++step) {
            ASSERT_EQ(surface_hash(*resumed), hashes[step]) << "from " << 5 * k << ", step " << step;
            ASSERT_EQ(resumed->bodies()[0]->validate(), std::vector<std::string>{});
            resumed->step();
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Solvers, CheckpointBy,
                         testing::Values(meshless::SolverKind::implicit_steps,
                                         meshless::SolverKind::explicit_steps));

// Held bodies that tear under the motion of their holds while blades cut them; some holds end.
std::unique_ptr<World> breaking_world(std::uint64_t seed) {
    Random random(seed);
    WorldSettings settings = free_space(0.01);
    settings.validate_each_step = false;
    settings.gravity = Vec3(0, 0, -9.81);
    settings.contact.pieces = true;
    auto world = std::make_unique<World>(settings, threads(2));
    for (int k = 0; k < 2; ++k) {
        BodySettings brittle = soft(0.02, 150);
        brittle.tearing = TearSettings{};
        brittle.tearing->strength = random.uniform(3e3, 2e4);
        const Vec3 size(random.uniform(0.2, 0.4), random.uniform(0.08, 0.2), random.uniform(0.05, 0.1));
        geometry::TriangleMesh box = geometry::make_box(size);
        for (Vec3& p : box.positions) p.y() += 0.5 * k;
        Body& body = world->add_body(box, brittle);
        for (const double side : {-1.0, 1.0}) {
            HoldConstraint hold =
                hold_beyond(Vec3(side * random.uniform(0.3, 0.45) * size.x(), 0, 0), side * Vec3::UnitX());
            const Vec3 velocity = random_vector(random, 0.6);
            hold.motion = [=](double time) { return Isometry(Eigen::Translation3d(velocity * time)); };
            if (random.below(2) == 0) hold.until = random.uniform(0.1, 0.4);
            body.add_constraint(hold);
        }
    }
    for (int k = 0; k < 5; ++k) {
        const Vec3 along = random_direction(random);
        const Vec3 across = along.cross(random_direction(random)).normalized();
        const Vec3 through = random_vector(random, 0.1) + Vec3(0, 0.5 * (k % 2), 0);
        const double start = random.uniform(0, 0.3);
        world->add_tool(moving_blade(-0.4 * along, 0.4 * along, through - 0.4 * across,
                                     through + 0.4 * across, start, start + random.uniform(0.04, 0.1)));
    }
    return world;
}

TEST(Checkpoint, ContinuesBitIdenticallyWhereHeldBodiesBreak) {
    std::size_t pieces = 0;
    // In the last two ligaments break in a step in which cracks grow, and a cut reuses the number of a vertex
    // at which contacts are searched for.
    for (const std::uint64_t seed : {1, 2, 3, 4, 11, 14}) {
        const auto uninterrupted = breaking_world(seed);
        std::vector<std::string> checkpoints, hashes;
        for (int step = 0; step <= last_step; ++step) {
            hashes.push_back(surface_hash(*uninterrupted));
            checkpoints.push_back(encode_checkpoint(*uninterrupted, "a scene"));
            uninterrupted->step();
        }
        for (const auto& body : uninterrupted->bodies()) pieces += body->pieces().count() - 1;
        // A step reads the state after the one before alone.
        for (std::size_t from = 0; from + 2 < hashes.size(); ++from) {
            const auto resumed = breaking_world(seed);
            restore_checkpoint(*resumed, checkpoints[from], "a scene", "x");
            for (std::size_t step = from; step <= from + 2; ++step) {
                ASSERT_EQ(surface_hash(*resumed), hashes[step])
                    << "seed " << seed << ", from " << from << ", step " << step;
                resumed->step();
            }
        }
    }
    EXPECT_GT(pieces, 20U);
}

TEST(CheckpointErrors, HaveDistinctMessages) {
    const auto world = eventful_world(meshless::SolverKind::implicit_steps, 1);
    const std::string good = encode_checkpoint(*world, "a scene");
    const auto error_of = [&](const std::string& bytes, const std::string& identity) -> std::string {
        try {
            restore_checkpoint(*eventful_world(meshless::SolverKind::implicit_steps, 1), bytes, identity,
                               "x.bin");
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_EQ(error_of(good, "a scene"), "");
    EXPECT_THAT(error_of(good, "another"), testing::HasSubstr("x.bin: is a checkpoint of another scene"));
    EXPECT_THAT(error_of("", "a scene"), testing::HasSubstr("is not a checkpoint"));
    EXPECT_THAT(error_of("ply\nformat", "a scene"), testing::HasSubstr("is not a checkpoint"));
    for (const std::size_t length : {good.size() - 1, good.size() / 2, std::size_t{30}})
        EXPECT_THAT(error_of(good.substr(0, length), "a scene"), testing::HasSubstr("damaged or cut off"));
    Random random(3);
    for (int trial = 0; trial < 20; ++trial) {
        std::string damaged = good;
        damaged[48 + random.below(static_cast<std::uint32_t>(good.size() - 48))] ^= 4;
        EXPECT_THAT(error_of(damaged, "a scene"), testing::HasSubstr("damaged or cut off"));
    }
}

}  // namespace
}  // namespace splitcubes::body
