// Parts of the input that are too small for a phyxel of the lattice move with their body.
#include "laws/solids.h"
#include "laws/worlds.h"

#include <gtest/gtest.h>
#include <splitcubes/body/body.h>
#include <splitcubes/world/world.h>

namespace splitcubes::body {
namespace {

using namespace laws;

// Returns a block with crumbs beside it, one cell and more of its size each.
geometry::TriangleMesh block_with_crumbs(Random& random, const Vec3& at) {
    geometry::TriangleMesh mesh = box_between(at, at + Vec3(0.2, 0.2, 0.2));
    for (int k = 0; k < 4; ++k) {
        // The first ones are within a cell of the block, or of each other.
        const double from = k < 2 ? 0.2 + random.uniform(0.001, 0.01) : 0.2 + 0.05 * k;
        const Vec3 low = at + Vec3(from, random.uniform(0, 0.07) + 0.1 * (k % 2), random.uniform(0, 0.15));
        mesh = joined(mesh, box_between(low, low + Vec3::Constant(random.uniform(0.004, 0.03))));
    }
    return mesh;
}

TEST(SmallParts, StartWhereTheyAreAndFallWithTheirBody) {
    Random random(9);
    for (int trial = 0; trial < 12; ++trial) {
        const Vec3 at = random_vector(random, 4);
        WorldSettings settings = free_space();
        if (trial % 2 == 1) settings.solver.kind = meshless::SolverKind::explicit_steps;
        settings.gravity = Vec3(0, 0, -9.81);
        World world(settings, threads(2));
        // Some crumbs have a phyxel of the lattice, which is linked to no other.
        BodySettings body_settings = soft(0.01, trial % 4 < 2 ? 200 : 600);
        body_settings.material.youngs_modulus = std::pow(10.0, random.uniform(4, 5));
        body_settings.velocity = random_vector(random, 1);
        Body& body = world.add_body(block_with_crumbs(random, at), body_settings);
        ASSERT_GE(body.pieces().count(), 2U);
        const geometry::SurfaceMesh rest = body.surface_mesh();
        double t = 0;
        for (int step = 0; step < 10; ++step) world.step();
        t = world.time();
        const geometry::SurfaceMesh now = body.surface_mesh();
        // Steps of second order in time place a free fall to within dt^2 g.
        const Vec3 fall = t * body_settings.velocity + 0.5 * t * t * settings.gravity;
        double worst = 0;
        for (std::size_t v = 0; v < now.mesh.positions.size(); ++v)
            worst = std::max(worst, (now.mesh.positions[v] - rest.mesh.positions[v] - fall).norm());
        EXPECT_LT(worst, 2e-3) << "m, after " << t << " s";
    }
}

}  // namespace
}  // namespace splitcubes::body
