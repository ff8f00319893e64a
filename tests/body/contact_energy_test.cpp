// No energy comes out of a contact: what falls, bounces, tips over and rolls only loses.
#include <splitcubes/body/world.h>
#include <splitcubes/geometry/shapes.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

namespace splitcubes::body {
namespace {

std::shared_ptr<const Parallel> one_thread() {
    return std::make_shared<const Parallel>(1);
}

geometry::TriangleMesh at(geometry::TriangleMesh mesh, const Vec3& place) {
    for (Vec3& p : mesh.positions) p += place;
    return mesh;
}

BodySettings rubber(double spacing, double youngs_modulus = 2e5) {
    BodySettings out;
    out.cell_size = 0.5 * spacing;
    out.phyxel_spacing = spacing;
    out.material.youngs_modulus = youngs_modulus;
    out.material.poisson_ratio = 0.3;
    out.material.stiffness_damping = 0.002;
    return out;
}

WorldSettings world_settings() {
    WorldSettings out;
    out.validate_each_step = false;
    return out;
}

double potential(const World& world) {
    double sum = 0;
    for (const auto& body : world.bodies())
        for (std::size_t i = 0; i < body->phyxels().size(); ++i)
            sum -= body->phyxels().mass[i] * world.settings().gravity.dot(body->phyxels().position[i]);
    return sum;
}

// Steps and holds the energy (kinetic, elastic and of height) against the least that there has been:
// it may rise by `share` of what it has lost by then, which springs of contacts and the linear
// solve of a turning body account for. `least`: J, of which nobody speaks. Returns the last report.
StepReport expect_only_losses(World& world, int steps, double share, double least) {
    double first = 0, lowest = 0;
    StepReport report;
    for (int step = 0; step < steps; ++step) {
        report = world.step();
        const double now = report.kinetic_energy + report.elastic_energy + potential(world);
        if (step == 0) first = lowest = now;
        EXPECT_LT(now - lowest, least + share * (first - lowest)) << "step " << step;
        lowest = std::min(lowest, now);
    }
    return report;
}

using Solid = std::shared_ptr<const geometry::SignedDistance>;

TEST(ContactEnergy, ABallBouncesLowerEachTime) {
    const std::vector<std::pair<const char*, Solid>> solids = {
        {"plane", geometry::make_plane_distance(Vec3::UnitZ(), 0)},
        {"box", geometry::make_box_distance(Vec3(0.3, 0.3, 0.04), 0.002)},
        {"mesh", geometry::make_mesh_distance(geometry::make_box(Vec3(0.3, 0.3, 0.04)), 40, Parallel(1))}};
    for (const auto& [name, solid] : solids) {
        SCOPED_TRACE(name);
        World world(world_settings(), one_thread());
        world.add_body(at(geometry::make_sphere(0.03, 3), Vec3(0, 0, 0.13)), rubber(0.012));
        world.add_collider({"solid", solid, {}, 0.6});
        const StepReport last = expect_only_losses(world, 150, 0.01, 1e-6);
        EXPECT_LT(last.kinetic_energy, 1e-4);
        EXPECT_GT(last.contacts, 0U);
    }
}

// A pear without a foot stands on a bottom rounder than its centre of mass is high: it tips over, falls, and
// rolls and rocks on its side. With weights that are not those of the skin's own motion it sped up as it
// rolled.
TEST(ContactEnergy, ATopplingPearRollsWithoutSpeedingUp) {
    for (const double friction : {0.0, 0.6}) {
        SCOPED_TRACE(friction);
        WorldSettings settings = world_settings();
        settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, friction};
        World world(settings, one_thread());
        BodySettings pear = rubber(0.018);
        pear.angular_velocity = Vec3(1, 0, 0);
        world.add_body(at(geometry::make_pear(0.2), Vec3(0, 0, 0.1001)), pear);
        // Its weight rests on a handful of springs by turns; what they hold is not in the sum.
        expect_only_losses(world, 240, 0.02, 2e-3);
    }
}

TEST(ContactEnergy, BodiesThatCollideOffCentreKeepTheirMomenta) {
    WorldSettings settings = world_settings();
    settings.gravity = Vec3::Zero();
    settings.contact.pieces = true;
    World world(settings, one_thread());
    BodySettings thrown = rubber(0.015), still = rubber(0.0125, 4e5);
    thrown.velocity = Vec3(0.2, 0, -1);
    thrown.angular_velocity = Vec3(0, 3, 0);
    world.add_body(at(geometry::make_sphere(0.035, 3), Vec3(0.005, 0.012, 0.07)), thrown);
    world.add_body(geometry::make_box(Vec3::Constant(0.05)), still);
    StepReport report = world.step();
    const Vec3 momentum = report.momentum, spin = report.angular_momentum;
    double energy = report.kinetic_energy + report.elastic_energy;
    std::size_t contacts = 0;
    for (int step = 0; step < 60; ++step) {
        report = world.step();
        contacts = std::max(contacts, report.contacts);
        ASSERT_LT((report.momentum - momentum).norm(), 1e-9 * momentum.norm()) << "step " << step;
        ASSERT_LT((report.angular_momentum - spin).norm(), 1e-5 * spin.norm()) << "step " << step;
        const double now = report.kinetic_energy + report.elastic_energy;
        ASSERT_LT(now, (1 + 2e-3) * energy) << "step " << step;
        energy = std::min(energy, now);
    }
    EXPECT_GT(contacts, 2U);
}

}  // namespace
}  // namespace splitcubes::body
