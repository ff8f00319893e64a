// Rigid pieces: rotation, flight, contact and rest.
#include "bodies.h"

#include <gtest/gtest.h>
#include <splitcubes/dynamics/rigid_step.h>
#include <splitcubes/dynamics/time_integrator.h>

#include <Eigen/LU>
#include <cmath>
#include <memory>
#include <vector>

namespace splitcubes::meshless {
namespace {

using fixtures::random_vector;

// A rod, plate or block of cubes with 1 cm edges, its corners as contact points.
Phyxels bricks(const Vec3i& count, const Vec3& at) {
    std::vector<Vec3> rest;
    for (int z = 0; z < count.z(); ++z)
        for (int y = 0; y < count.y(); ++y)
            for (int x = 0; x < count.x(); ++x) rest.push_back(0.01 * Vec3(x, y, z));
    const std::vector<double> mass(rest.size(), 0.001);
    Phyxels phyxels;
    RigidPiece body;
    body.piece = 0;
    weigh({rest, mass, 0.01}, body);
    body.centre = at;
    std::vector<Vec3> corners;
    for (int c = 0; c < 8; ++c) {
        const Vec3 sign((c & 1) != 0 ? 1 : -1, (c & 2) != 0 ? 1 : -1, (c & 4) != 0 ? 1 : -1);
        corners.push_back(0.005 * sign.cwiseProduct(count.cast<double>()));
    }
    phyxels.rigid.put(body, corners);
    phyxels.append(rest.front(), 0.005);
    phyxels.mass.back() = body.mass;
    return phyxels;
}

void set_angular_velocity(RigidPiece& body, const Vec3& omega) {
    body.angular_momentum = body.rotation * body.inertia * body.rotation.transpose() * omega;
}

TEST(Rigid, CubesHaveTheMassAndInertiaOfTheBoxTheyFill) {
    const RigidPiece body = bricks({3, 4, 5}, Vec3::Zero()).rigid.bodies[0];
    const double m = 0.06;
    EXPECT_NEAR(body.mass, m, 1e-15);
    EXPECT_LT((body.rest_centre - Vec3(0.01, 0.015, 0.02)).norm(), 1e-15);
    Mat3 expected = Mat3::Zero();
    expected.diagonal() << m / 12 * 1e-4 * (16 + 25), m / 12 * 1e-4 * (9 + 25), m / 12 * 1e-4 * (9 + 16);
    EXPECT_LT((body.inertia - expected).norm(), 1e-12 * expected.norm());
}

// Reference: Euler's equations with a quaternion, by the classic Runge-Kutta method.
struct Top {
    Quat q;
    Vec3 own;  // angular momentum in its own frame
};
Top derivative(const Top& top, const Mat3& inertia) {
    const Vec3 omega = inertia.inverse() * top.own;
    const Quat half = top.q * Quat(0, omega.x() / 2, omega.y() / 2, omega.z() / 2);
    return {half, top.own.cross(omega)};
}
Top advanced_top(const Top& top, const Top& rate, double h) {
    Top out;
    out.q.coeffs() = top.q.coeffs() + h * rate.q.coeffs();
    out.own = top.own + h * rate.own;
    return out;
}

TEST(Rigid, AsymmetricBodyFollowsEulersEquations) {
    Phyxels phyxels = bricks({2, 3, 5}, Vec3::Zero());
    RigidPiece& body = phyxels.rigid.bodies[0];
    set_angular_velocity(body, Vec3(0.05, 3, 0.05));  // about the middle axis, which is unstable
    Top top{Quat(body.rotation), body.rotation.transpose() * body.angular_momentum};
    for (int step = 0; step < 4000; ++step) turn_freely(body, 1e-3);
    const double h = 2e-4;
    for (int step = 0; step < 20000; ++step) {
        const Top k1 = derivative(top, body.inertia);
        const Top k2 = derivative(advanced_top(top, k1, h / 2), body.inertia);
        const Top k3 = derivative(advanced_top(top, k2, h / 2), body.inertia);
        const Top k4 = derivative(advanced_top(top, k3, h), body.inertia);
        top.q.coeffs() += h / 6 * (k1.q.coeffs() + 2 * k2.q.coeffs() + 2 * k3.q.coeffs() + k4.q.coeffs());
        top.own += h / 6 * (k1.own + 2 * k2.own + 2 * k3.own + k4.own);
        top.q.normalize();
    }
    EXPECT_LT((body.rotation - top.q.toRotationMatrix()).norm(), 1e-3);
    EXPECT_LT((body.rotation - Mat3::Identity()).norm(), 3);
    EXPECT_LT((body.rotation.transpose() * body.angular_momentum - top.own).norm(), 1e-3 * top.own.norm());
}

TEST(Rigid, AngularMomentumAndEnergyAreConservedAtAnyRate) {
    Random random(1);
    for (const double rate : {0.1, 5.0, 60.0, 400.0, 3e4, 1e9}) {
        Phyxels phyxels = bricks({1, 2, 6}, Vec3::Zero());
        RigidPiece& body = phyxels.rigid.bodies[0];
        set_angular_velocity(body, rate * random_vector(random, 1));
        const Vec3 angular_momentum = body.angular_momentum;
        const double energy = body.kinetic_energy();
        for (int step = 0; step < 500; ++step) {
            turn_freely(body, 1.0 / 30);
            ASSERT_NEAR(body.kinetic_energy(), energy, 1e-9 * energy) << rate << " rad/s, step " << step;
        }
        EXPECT_EQ(body.angular_momentum, angular_momentum);
        EXPECT_LT((body.rotation.transpose() * body.rotation - Mat3::Identity()).norm(), 1e-12);
    }
}

TEST(Rigid, FollowsItsParabola) {
    Phyxels phyxels = bricks({1, 1, 1}, Vec3(1, 2, 3));
    RigidPiece& body = phyxels.rigid.bodies[0];
    body.momentum = body.mass * Vec3(1, -2, 4);
    set_angular_velocity(body, Vec3(3, 4, 5));
    const Vec3 omega = body.angular_velocity();
    StepInput input;
    input.gravity = Vec3(0, 0.5, -9.81);
    for (int step = 1; step <= 120; ++step) {
        step_rigid(phyxels, input, 0);
        const double t = step * input.dt;
        const Vec3 expected = Vec3(1, 2, 3) + t * Vec3(1, -2, 4) + 0.5 * t * t * input.gravity;
        ASSERT_LT((body.centre - expected).norm(), 1e-12 * (1 + expected.norm()));
        ASSERT_LT((body.angular_velocity() - omega).norm(), 1e-12 * omega.norm()) << "a cube turns evenly";
    }
}

double rigid_energy_of(const RigidPiece& body, const Vec3& gravity) {
    return body.kinetic_energy() - body.mass * gravity.dot(body.centre);
}

// A static plane through the origin.
struct Plane {
    std::shared_ptr<const geometry::SignedDistance> solid;
    Obstacle obstacle;

    Plane(const Vec3& normal, double friction) : solid(geometry::make_plane_distance(normal, 0)) {
        obstacle.solid = solid.get();
        obstacle.friction = friction;
    }
};

TEST(Rigid, ComesToRestOnTheGroundAndStays) {
    Random random(2);
    for (const double dt : {1.0 / 30, 1.0 / 60, 1.0 / 240})
        for (const Vec3i& count : {Vec3i(1, 1, 1), Vec3i(1, 1, 4), Vec3i(3, 2, 1)}) {
            Phyxels phyxels = bricks(count, Vec3(0, 0, 0.2));
            RigidPiece& body = phyxels.rigid.bodies[0];
            body.rotation = Quat(1, 0.3, -0.2, 0.5).normalized().toRotationMatrix();
            body.momentum = body.mass * Vec3(0.3, 0.1, 0);
            set_angular_velocity(body, random_vector(random, 8));
            StepInput input;
            input.dt = dt;
            input.gravity = Vec3(0, 0, -9.81);
            const Plane ground(Vec3::UnitZ(), 0.5);
            input.obstacles = {&ground.obstacle, 1};
            double energy = rigid_energy_of(body, input.gravity);
            const double slack = 1e-3 * energy;
            for (double t = 0; t < 3; t += dt) {
                step_rigid(phyxels, input, 0);
                const double now = rigid_energy_of(body, input.gravity);
                ASSERT_LT(now, energy + slack) << t << " s";
                energy = std::min(energy, now);
            }
            const Vec3 centre = body.centre;
            const Mat3 rotation = body.rotation;
            for (double t = 0; t < 10; t += dt) step_rigid(phyxels, input, 0);
            EXPECT_LT((body.centre - centre).norm(), 1e-9) << "creeps";
            EXPECT_LT((body.rotation - rotation).norm(), 1e-9);
            double lowest = 1;
            for (const Vec3& point : phyxels.rigid.points_of(body))
                lowest = std::min(lowest, body.world_point(point).z());
            EXPECT_NEAR(lowest, 0, 1e-4) << "floats or sinks";
        }
}

TEST(Rigid, SlidesOnASlopeByCoulombFriction) {
    const double angle = 0.5;  // rad, tan 0.546
    const Vec3 normal(std::sin(angle), 0, std::cos(angle));
    const Vec3 down(std::cos(angle), 0, -std::sin(angle));
    for (const double friction : {0.3, 0.7}) {
        Phyxels phyxels = bricks({4, 4, 1}, 0.005 * normal);
        RigidPiece& body = phyxels.rigid.bodies[0];
        body.rotation.col(0) = down;
        body.rotation.col(1) = Vec3::UnitY();
        body.rotation.col(2) = normal;
        StepInput input;
        input.gravity = Vec3(0, 0, -9.81);
        const Plane ground(normal, friction);
        input.obstacles = {&ground.obstacle, 1};
        for (int step = 0; step < 60; ++step) step_rigid(phyxels, input, 0);
        const double expected =
            friction < std::tan(angle) ? 9.81 * (std::sin(angle) - friction * std::cos(angle)) : 0.0;
        EXPECT_NEAR(body.velocity().dot(down), expected, 0.02 * 9.81) << "friction " << friction;
        EXPECT_LT(std::abs(body.velocity().dot(normal)), 1e-6);
    }
}

// A piece follows a tray that accelerates sideways within the friction limit, and slips on a tray that
// accelerates faster.
TEST(Rigid, FollowsAMovingTrayWithinFriction) {
    const auto tray = geometry::make_box_distance({1, 1, 0.1}, 0);
    for (const double acceleration : {2.0, 20.0}) {
        Phyxels phyxels = bricks({2, 2, 1}, Vec3(0.1, 0, 0.3));
        RigidPiece& body = phyxels.rigid.bodies[0];
        StepInput input;
        input.gravity = Vec3(0, 0, -9.81);
        const auto tray_motion = [&](double time) {
            Isometry out = Isometry::Identity();
            const double t = std::max(0.0, time - 1);
            out.translation() = Vec3(0.5 * acceleration * t * t, 0, 0);
            return out;
        };
        const auto step_to = [&](int step) {
            const Obstacle obstacle{tray.get(), tray_motion(step * input.dt),
                                    tray_motion((step + 1) * input.dt), 0.5};
            input.obstacles = {&obstacle, 1};
            step_rigid(phyxels, input, 0);
        };
        int step = 0;
        for (; step < 60; ++step) step_to(step);
        const Vec3 resting = body.centre;
        EXPECT_LT(body.kinetic_energy(), 1e-20);
        for (; step < 75; ++step) step_to(step);
        const double tray_displacement = tray_motion(step * input.dt).translation().x();
        const double t = 0.25;
        const double expected = std::min(tray_displacement, 0.5 * 0.5 * 9.81 * t * t);
        EXPECT_NEAR((body.centre - resting).x(), expected, 0.1 * expected + 0.01) << acceleration;
        EXPECT_NEAR(body.centre.z(), resting.z(), 1e-3) << acceleration;
        EXPECT_TRUE(body.touching);
    }
}

// A fast piece does not pass through a plate that is thinner than its displacement in a step.
TEST(Rigid, DoesNotGoThroughThinPlates) {
    const auto plate = geometry::make_box_distance({1, 1, 0.02}, 0.005);
    Phyxels phyxels = bricks({1, 2, 1}, Vec3(0, 0, 0.5));
    RigidPiece& body = phyxels.rigid.bodies[0];
    body.momentum = body.mass * Vec3(0, 0, -20);
    StepInput input;
    input.gravity = Vec3(0, 0, -9.81);
    const Obstacle obstacle{plate.get(), Isometry::Identity(), Isometry::Identity(), 0.5};
    input.obstacles = {&obstacle, 1};
    for (int step = 0; step < 120; ++step) step_rigid(phyxels, input, 0);
    EXPECT_GT(body.centre.z(), 0.01);
    EXPECT_LT(body.kinetic_energy(), 1e-20);
}

TEST(Rigid, HeldPiecesFollowTheirMotion) {
    Phyxels phyxels = bricks({1, 2, 3}, Vec3(0.1, 0, 0));
    RigidPiece& body = phyxels.rigid.bodies[0];
    RigidKinematicTarget hold;
    hold.motion = Isometry(Eigen::Translation3d(0, 0, 0.002) * Eigen::AngleAxisd(0.05, Vec3::UnitZ()));
    StepInput input;
    input.gravity = Vec3(0, 0, -9.81);
    input.kinematic_rigid_pieces = {&hold, 1};
    for (int step = 0; step < 30; ++step) step_rigid(phyxels, input, 0);
    EXPECT_LT((body.centre - Vec3(0.1 * std::cos(1.5), 0.1 * std::sin(1.5), 0.06)).norm(), 1e-12);
    EXPECT_LT((body.angular_velocity() - 3 * Vec3::UnitZ()).norm(), 1e-9);
    // Released, it flies off along the tangent.
    input.kinematic_rigid_pieces = {};
    input.gravity.setZero();
    const Vec3 velocity = body.velocity();
    EXPECT_NEAR(velocity.norm(), std::hypot(0.12, 0.3), 1e-3);
    step_rigid(phyxels, input, 0);
    EXPECT_EQ(body.velocity(), velocity);
}

TEST(Rigid, ElasticSolversDoNotMoveRigidPhyxels) {
    for (const SolverKind kind : {SolverKind::implicit_steps, SolverKind::explicit_steps}) {
        Phyxels phyxels = bricks({2, 2, 2}, Vec3(0, 0, 1));
        set_angular_velocity(phyxels.rigid.bodies[0], Vec3(5, 0, 3));
        phyxels.append(Vec3(0.01, 0.01, 0.01), 0.005);
        write_phyxels(phyxels);
        for (double& h : phyxels.support_radius) h = 0.03;
        Neighbourhoods links;
        const Parallel parallel(1);
        Pairs none;
        links.rebuild(phyxels, none, Material{}, parallel);
        TimeIntegrator solver;
        StepInput input;
        input.gravity = Vec3(0, 0, -9.81);
        SolverOptions options;
        options.kind = kind;
        for (int step = 0; step < 30; ++step)
            solver.step(phyxels, links, Material{}, input, options, parallel);
        const RigidPiece& body = phyxels.rigid.bodies[0];
        EXPECT_NEAR(body.centre.z(), 1 - 0.5 * 9.81 * 0.25, 1e-12);
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            EXPECT_LT((phyxels.position[i] - body.world_point_of_rest(phyxels.rest_position[i])).norm(),
                      1e-15);
            EXPECT_EQ(phyxels.deformation[i], body.rotation * body.shape);
        }
    }
}

}  // namespace
}  // namespace splitcubes::meshless
