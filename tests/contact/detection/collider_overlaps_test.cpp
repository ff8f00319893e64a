// Drawn surfaces and colliders: nothing that is drawn lies in a collider, whatever is cut and however it
// hits.
#include "body/rubber.h"

#include <splitcubes/body/body.h>
#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/collider_overlaps.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/world/world.h>

#include <gtest/gtest.h>

#include <cmath>

namespace splitcubes::body {
namespace {

using fixtures::box_at;
using fixtures::rubber;

struct Sums {
    double kinetic = 0;
    Vec3 momentum = Vec3::Zero(), angular = Vec3::Zero();
};

Sums sums_of(const Body& body) {
    Sums out;
    const meshless::Phyxels& phyxels = body.phyxels();
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (phyxels.rigid.index(phyxels.piece[i]) >= 0) continue;
        const Vec3 linear = phyxels.mass[i] * phyxels.velocity[i];
        out.kinetic += 0.5 * linear.dot(phyxels.velocity[i]);
        out.momentum += linear;
        out.angular += phyxels.position[i].cross(linear);
    }
    for (const meshless::RigidPiece& piece : phyxels.rigid.bodies) {
        out.kinetic += piece.kinetic_energy();
        out.momentum += piece.momentum;
        out.angular += piece.centre.cross(piece.momentum) + piece.angular_momentum;
    }
    return out;
}

double depth_in(const Collider& collider, const Vec3& point, double time) {
    return -collider.solid->at(collider.at(time).inverse() * point).distance;
}

class Draw {
  public:
    explicit Draw(std::uint64_t seed) : random_(seed) {}
    double between(double low, double high) { return random_.uniform(low, high); }
    Vec3 direction() {
        Vec3 out;
        do out = Vec3(between(-1, 1), between(-1, 1), between(-1, 1));
        while (!(out.norm() > 0.1 && out.norm() < 1));
        return out.normalized();
    }

  private:
    Random random_;
};

// A block with random cuts, moving at random, half of it in a ball: it is lifted out and loses energy, and
// the sums that are reported are those that changed.
TEST(ColliderOverlaps, LiftsPiecesAndTakesTheirApproach) {
    std::size_t lifted = 0;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
        Draw draw(seed);
        WorldSettings settings;
        settings.validate_each_step = false;
        World world(settings, std::make_shared<const Parallel>(2));
        Body& body = world.add_body(geometry::make_box(Vec3(0.06, 0.06, 0.06)), rubber(0.015));
        for (std::int32_t cut = 0; cut < static_cast<std::int32_t>(seed % 4); ++cut)
            body.cut_with_sheet(geometry::make_plane_sheet(0.01 * draw.direction(), draw.direction(), 0.3),
                                cut, world.parallel());
        meshless::Phyxels& phyxels = body.phyxels();
        const Vec3 velocity = draw.direction(), spin = 10 * draw.direction();
        for (std::size_t i = 0; i < phyxels.size(); ++i)
            phyxels.velocity[i] = velocity + spin.cross(phyxels.position[i]);
        for (meshless::RigidPiece& piece : phyxels.rigid.bodies)
            piece.momentum = piece.mass * (velocity + spin.cross(piece.centre));
        const std::vector<Vec3> before = phyxels.position;
        const Sums start = sums_of(body);
        Collider ball{"ball", geometry::make_sphere_distance(0.05), {}, draw.between(0, 1)};
        const Vec3 place = 0.06 * draw.direction();
        ball.motion = [place](double) { return Isometry(Eigen::Translation3d(place)); };
        ColliderOverlaps overlaps;
        const std::vector<BodyView> views = {body.view()};
        const std::vector<Collider> colliders = {ball};
        const ColliderOverlaps::Outcome outcome =
            overlaps.undo({views, colliders, 0, 1.0 / 60}, world.parallel());
        const Sums end = sums_of(body);
        lifted += outcome.pieces;
        EXPECT_EQ(overlaps.moved(0), outcome.pieces > 0);
        EXPECT_LE(outcome.kinetic_energy, 0);
        EXPECT_NEAR(end.kinetic - start.kinetic, outcome.kinetic_energy, 1e-9 * start.kinetic);
        EXPECT_LT((end.momentum - start.momentum - outcome.momentum).norm(), 1e-9 * start.momentum.norm());
        EXPECT_LT((end.angular - start.angular - outcome.angular_momentum).norm(),
                  1e-9 * (start.angular.norm() + 0.1 * start.momentum.norm()));
        // Each piece moves as a whole.
        for (std::size_t i = 0; i < phyxels.size(); ++i)
            for (std::size_t k = 0; k < i; ++k)
                if (phyxels.piece[i] == phyxels.piece[k]) {
                    EXPECT_LT((phyxels.position[i] - before[i] - phyxels.position[k] + before[k]).norm(),
                              1e-12);
                }
    }
    EXPECT_GE(lifted, 12U);
}

TEST(ColliderOverlaps, HeldPiecesStay) {
    WorldSettings settings;
    settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.6};
    World world(settings, std::make_shared<const Parallel>(1));
    Body& body = world.add_body(box_at(Vec3(0.06, 0.06, 0.06), Vec3(0, 0, 0.01)), rubber(0.015));
    HoldConstraint top;
    top.region = [](const Vec3& rest) { return rest.z() > 0.03; };
    top.motion = [](double) { return Isometry::Identity(); };
    body.add_constraint(top);
    const Vec3 before = body.phyxels().position.back();
    ASSERT_GT(before.z(), 0.03);
    for (int step = 0; step < 5; ++step) world.step();
    EXPECT_EQ(body.phyxels().position.back(), before);
}

// Random blocks of any stiffness and either solver, cut while they hit a slope and a ball at random speed.
TEST(ColliderOverlaps, NothingDrawnLiesInACollider) {
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
        Draw draw(100 + seed);
        WorldSettings settings;
        settings.contact.pieces = seed % 2 == 0;
        settings.time_step = seed % 3 == 0 ? 1.0 / 240 : 1.0 / 60;
        settings.solver.kind =
            seed % 3 == 0 ? meshless::SolverKind::explicit_steps : meshless::SolverKind::implicit_steps;
        settings.validate_each_step = false;
        World world(settings, std::make_shared<const Parallel>(2));
        BodySettings rubbery = rubber(0.02, std::pow(10.0, draw.between(3.5, seed % 3 == 0 ? 5 : 8)), 0);
        rubbery.material.model =
            seed % 4 < 2 ? meshless::MaterialModel::corotated : meshless::MaterialModel::st_venant_kirchhoff;
        Body& body = world.add_body(box_at(Vec3(0.08, 0.07, 0.06), Vec3(0, 0, 0.09)), rubbery);
        const Vec3 velocity(0, 0, -draw.between(0, 3));
        for (Vec3& v : body.phyxels().velocity) v = velocity;
        const Vec3 slope = (Vec3(0, 0, 2) + draw.direction()).normalized();
        world.add_collider({"slope", geometry::make_plane_distance(slope, 0), {}, draw.between(0, 1)});
        const Vec3 place = 0.03 * draw.direction();
        world.add_collider({"ball", geometry::make_sphere_distance(0.04),
                            [place](double) { return Isometry(Eigen::Translation3d(place)); }, 0.3});
        double deepest = 0;
        for (int step = 0; step < 45; ++step) {
            if (step % 6 == 5)
                body.cut_with_sheet(geometry::make_plane_sheet(Vec3(0, 0, 0.09) + 0.02 * draw.direction(),
                                                               draw.direction(), 0.3),
                                    step, world.parallel());
            world.step();
            for (const Vec3& point : body.surface_mesh().mesh.positions)
                for (const Collider& collider : world.colliders())
                    deepest = std::max(deepest, depth_in(collider, point, world.time()));
        }
        EXPECT_GT(body.pieces().count(), 4U);
        // 0.2 cells.
        EXPECT_LT(deepest, 0.002) << "seed " << seed << ", " << rubbery.material.youngs_modulus << " Pa";
    }
}

// A block lies up to a spacing deep in two planes that meet at a random angle: its vertices are drawn outside
// both.
TEST(ColliderOverlaps, VerticesBetweenTwoCollidersAreDrawnOutsideBoth) {
    std::size_t in_both = 0;
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        Draw draw(seed);
        WorldSettings settings;
        World world(settings, std::make_shared<const Parallel>(2));
        Body& body = world.add_body(geometry::make_box(Vec3(0.06, 0.06, 0.06)), rubber(0.015));
        const std::vector<Vec3> positions = body.surface_mesh().mesh.positions;
        std::vector<Collider> colliders;
        for (const char* name : {"one", "other"}) {
            // Their normals lie within 60 degrees of the vertical.
            const Vec3 normal = (Vec3(0, 0, 1.2) + draw.direction()).normalized();
            double lowest = 1e300;
            for (const Vec3& x : positions) lowest = std::min(lowest, normal.dot(x));
            const double offset = lowest + draw.between(0.2, 0.9) * 0.015;
            colliders.push_back({name, geometry::make_plane_distance(normal, offset), {}, 0.5});
        }
        const auto depth = [&](const Vec3& x) {
            return std::max(depth_in(colliders[0], x, 0), depth_in(colliders[1], x, 0));
        };
        ColliderOverlaps overlaps;
        const std::vector<BodyView> views = {body.view()};
        for (const auto& drawn : overlaps.drawn({views, colliders, 0, 1.0 / 60}, 0, world.parallel()))
            EXPECT_LT(depth(drawn.position), 0.05 * 0.015) << "seed " << seed;
        for (const Vec3& x : positions)
            in_both += depth_in(colliders[0], x, 0) > 0.001 && depth_in(colliders[1], x, 0) > 0.001;
    }
    EXPECT_GT(in_both, 20U);
}

// Soft bodies are held at the top, cut into flaps, and stretch until these lie on the ground.
TEST(ColliderOverlaps, FlapsOfHeldBodiesAreDrawnOutside) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        Draw draw(seed);
        WorldSettings settings;
        settings.contact.pieces = false;
        settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, draw.between(0, 0.5)};
        settings.time_step = draw.between(0.008, 0.017);
        settings.validate_each_step = false;
        World world(settings, std::make_shared<const Parallel>(2));
        const double height = draw.between(0.01, 0.03);
        Body& body = world.add_body(box_at(Vec3(0.1, 0.1, 0.2), Vec3(0, 0, 0.1 + height)),
                                    rubber(0.025, draw.between(1500, 4000), 0));
        HoldConstraint top;
        top.region = [height](const Vec3& rest) { return rest.z() > 0.17 + height; };
        top.motion = [](double) { return Isometry::Identity(); };
        body.add_constraint(top);
        double deepest = 0;
        for (int step = 0; step < 50; ++step) {
            if (step % 3 == 0 && step < 30)
                body.cut_with_sheet(
                    geometry::make_plane_sheet(Vec3(0, 0, 0.06 + height) + 0.05 * draw.direction(),
                                               draw.direction(), 0.12),
                    step, world.parallel());
            world.step();
            for (const Vec3& point : body.surface_mesh().mesh.positions)
                deepest = std::max(deepest, -point.z());
        }
        EXPECT_LT(deepest, 0.2 * 0.0125) << "seed " << seed;
    }
}

// Pieces of any shape come to rest on the ground, without an overlap that can be seen.
TEST(ColliderOverlaps, ObliqueWedgesComeToRest) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        Draw draw(200 + seed);
        WorldSettings settings;
        settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.8};
        settings.validate_each_step = false;
        World world(settings, std::make_shared<const Parallel>(2));
        Body& body = world.add_body(box_at(Vec3(0.08, 0.07, 0.06), Vec3(0, 0, 0.034)),
                                    rubber(0.02, std::pow(10.0, draw.between(4, 6))));
        for (std::int32_t cut = 0; cut < 3; ++cut)
            body.cut_with_sheet(geometry::make_plane_sheet(Vec3(0, 0, 0.034) + 0.01 * draw.direction(),
                                                           draw.direction(), 0.3),
                                cut, world.parallel());
        StepReport report;
        for (int step = 0; step < 150; ++step) report = world.step();
        double deepest = 0;
        for (const Vec3& point : body.surface_mesh().mesh.positions) deepest = std::max(deepest, -point.z());
        EXPECT_LT(deepest, 0.001) << "0.1 cells, seed " << seed;
        EXPECT_LT(report.totals.kinetic_energy, 1e-4) << "seed " << seed;
    }
}

}  // namespace
}  // namespace splitcubes::body
