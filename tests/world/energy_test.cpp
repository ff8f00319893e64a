// Bodies that are cut gain no energy beyond the work put in, for any material and time step.
#include "laws/solids.h"
#include "laws/worlds.h"

#include <splitcubes/body/body.h>
#include <splitcubes/world/world.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace splitcubes::laws {
namespace {

using meshless::MaterialModel;
using meshless::SolverKind;

/// Adds straight edges that pass completely through everything within `size` of the origin.
void add_random_blades(body::World& world, int count, double size, double from, double until,
                       std::uint64_t seed) {
    Random random(seed);
    for (int k = 0; k < count; ++k) {
        const Vec3 along = random_direction(random);
        const Vec3 across = along.cross(random_direction(random)).normalized();
        const Vec3 through = random_vector(random, 0.5 * size);
        const double start = from + (until - from) * k / count;
        world.add_tool(moving_blade(-3 * size * along, 3 * size * along, through - 2.5 * size * across,
                                    through + 2.5 * size * across, start,
                                    start + random.uniform(0.03, 0.15)));
    }
}

double gravity_energy(const body::World& world) {
    double sum = 0;
    for (const auto& body : world.bodies()) {
        const meshless::Momenta momenta = meshless::total_momenta(body->phyxels());
        sum -= momenta.mass * world.settings().gravity.dot(momenta.centre);
    }
    return sum;
}

struct Course {
    double first = 0;            // J, kinetic, elastic and potential, when the last work was put in
    double max_energy = -1e300;  // J, maximum of later steps
    double max_kinetic = 0;
    double max_elastic = 0;
    double top_speed = 0;  // m/s
    double removed = 0;    // J, removed by the passivity controller
};

/// quiet: s, time after which nothing does work on the body.
Course run_course(body::World& world, double seconds, double quiet) {
    Course course;
    const double dt = world.settings().time_step;
    for (const auto& body : world.bodies()) {
        const meshless::Momenta now = meshless::total_momenta(body->phyxels());
        course.first +=
            now.linear.squaredNorm() / (2 * now.mass) +
            0.5 * now.angular_momentum.dot(meshless::angular_velocity(now.inertia, now.angular_momentum));
    }
    course.first += gravity_energy(world);
    for (int step = 0; step < static_cast<int>(std::lround(seconds / dt)); ++step) {
        const body::StepReport report = world.step();
        const double energy =
            report.totals.kinetic_energy + report.totals.elastic_energy + gravity_energy(world);
        EXPECT_TRUE(std::isfinite(energy)) << "step " << step;
        EXPECT_NEAR(report.totals.potential_energy, gravity_energy(world),
                    1e-10 * (1 + std::abs(gravity_energy(world))));
        if (world.time() <= quiet) {
            course.first = energy;
            continue;
        }
        course.max_energy = std::max(course.max_energy, energy);
        course.max_kinetic = std::max(course.max_kinetic, report.totals.kinetic_energy);
        course.max_elastic = std::max(course.max_elastic, report.totals.elastic_energy);
        course.top_speed = std::max(course.top_speed, report.totals.top_speed);
        course.removed += report.solver.energy_removed;
        if (step % 16 == 15)
            for (const std::string& line : world.bodies()[0]->validate()) ADD_FAILURE() << line;
    }
    return course;
}

body::WorldSettings settings_of(SolverKind kind, double time_step) {
    body::WorldSettings settings = free_space(time_step);
    settings.validate_each_step = false;
    settings.solver.kind = kind;
    return settings;
}

// A sphere held at the top and pulled at the bottom; stiffness grows with the stretch.
TEST(Energy, AStretchedSphereWithVolumeStiffnessIsCutByExplicitSteps) {
    for (const std::uint64_t seed : {1, 3}) {
        SCOPED_TRACE(seed);
        body::WorldSettings settings = settings_of(SolverKind::explicit_steps, 1.0 / 30);
        // Pressed by contacts, this material turns inside out in explicit steps, which adds energy.
        settings.contact.pieces = false;
        body::World world(settings, threads(2));
        body::BodySettings ball = soft(0.012, 300);
        ball.material.model = MaterialModel::st_venant_kirchhoff;
        ball.material.youngs_modulus = 1.4e4;
        ball.material.poisson_ratio = 0.3;
        ball.material.volume_stiffness = 1.4e4;
        body::Body& body = world.add_body(geometry::make_sphere(0.1), ball);
        body.add_constraint(hold_beyond({0, 0, 0.06}, Vec3::UnitZ()));
        body::HoldConstraint moved_end = hold_beyond({0, 0, -0.06}, -Vec3::UnitZ());
        moved_end.motion = [](double time) {
            Isometry motion = Isometry::Identity();
            motion.translation().z() = -0.08 * std::min(time / 0.4, 1.0);
            return motion;
        };
        body.add_constraint(moved_end);
        add_random_blades(world, 20, 0.1, 0.5, 1.1, seed);
        const Course course = run_course(world, 1.4, 0.4 + 1e-9);
        // A cut may increase the strain, but must not cause motion.
        EXPECT_LT(course.max_kinetic, course.first);
        // Speed if all of its energy moved 5 thousandths of its mass, those of a few fragments. Over most
        // sets of cuts the fastest one has 0.3 to 0.9 of it; in two of 16 a fragment gains energy.
        EXPECT_LT(course.top_speed, std::sqrt(2 * course.first / (0.005 * total_mass(body.phyxels()))));
    }
}

// Stiff, plastic and rotating fast: linear solves stop before convergence.
TEST(Energy, ASpinningPlasticTorusIsShredded) {
    body::WorldSettings settings = settings_of(SolverKind::implicit_steps, 1.0 / 60);
    // Of cuts alone: hits of stiff splinters add energy (docs/contact.md, limits).
    settings.contact.pieces = false;
    body::World world(settings, threads(2));
    body::BodySettings torus = soft(0.01, 350);
    torus.material.model = MaterialModel::st_venant_kirchhoff;
    torus.material.youngs_modulus = 1.5e7;
    torus.material.poisson_ratio = 0.3;
    torus.material.plasticity = meshless::Plasticity{.yield = 0.02, .maximum = 0.3};
    torus.angular_velocity = Vec3(3, -5, 8);
    world.add_body(geometry::make_torus(0.1, 0.04), torus);
    add_random_blades(world, 50, 0.14, 0.05, 0.9, 2);
    const Course course = run_course(world, 1, 0);
    EXPECT_LT(course.max_energy, 1.15 * course.first);
}

// Nearly incompressible, and rotating by a radian a step.
TEST(Energy, AFastWedgeThatHardlyCompressesSpinsOn) {
    body::World world(settings_of(SolverKind::implicit_steps, 1.0 / 30), threads(2));
    body::BodySettings wedge = soft(0.02, 300);
    wedge.material.youngs_modulus = 1e5;
    wedge.material.poisson_ratio = 0.49;
    wedge.angular_velocity = Vec3(18, 14, 17);
    geometry::TriangleMesh mesh = geometry::make_box(Vec3(0.3, 0.24, 0.16));
    for (Vec3& p : mesh.positions) p.z() *= p.x() > 0 ? 0.2 : 1;
    world.add_body(mesh, wedge);
    const Course course = run_course(world, 1.5, 0);
    EXPECT_LT(course.max_energy, 1.02 * course.first);
}

// Stiff, nearly incompressible, hanging by its top; its pieces fall.
TEST(Energy, AHangingBodyOfThinPartsIsCutByExplicitSteps) {
    body::WorldSettings settings = settings_of(SolverKind::explicit_steps, 1.0 / 60);
    settings.gravity = Vec3(0, 0, -9.81);
    body::World world(settings, threads(2));
    body::BodySettings puppet = soft(0.012, 300);
    puppet.material.youngs_modulus = 5e4;
    puppet.material.poisson_ratio = 0.45;
    geometry::TriangleMesh mesh = geometry::make_sphere(0.08);
    mesh.append(moved(geometry::make_box(Vec3(0.04, 0.04, 0.2)), {0.05, 0, 0.03}));
    mesh.append(moved(geometry::make_box(Vec3(0.3, 0.03, 0.03)), {0, 0, -0.02}));
    body::Body& body = world.add_body(mesh, puppet);
    body.add_constraint(hold_beyond({0, 0, 0.1}, Vec3::UnitZ()));
    add_random_blades(world, 20, 0.1, 0.1, 0.7, 3);
    const Course course = run_course(world, 0.8, 0);
    const double fallen = total_mass(body.phyxels()) * 9.81 * 0.5 * 9.81 * 0.8 * 0.8;  // m g h, J
    EXPECT_LT(course.max_energy, course.first + 0.02 * fallen);
    EXPECT_LT(course.top_speed, 9.81 * 0.8 + 2);
}

/// Largest rise of the energy over its lowest value so far, as a share of the largest motion and strain.
double largest_gain(body::World& world, int steps) {
    double lowest = std::numeric_limits<double>::infinity(), gain = 0, most = 0;
    for (int step = 0; step < steps; ++step) {
        const body::StepTotals totals = world.step().totals;
        const double inner = totals.kinetic_energy + totals.elastic_energy + totals.contact_energy;
        most = std::max(most, inner);
        lowest = std::min(lowest, inner + totals.potential_energy);
        gain = std::max(gain, inner + totals.potential_energy - lowest);
    }
    return gain / most;
}

body::BodySettings sagging(double modulus) {
    body::BodySettings block = soft(0.012, 260);
    block.material.youngs_modulus = modulus;
    block.material.poisson_ratio = 0.4;
    return block;
}

// Material behind the edge of a hold is not strained; it is once the hold lets go.
TEST(Energy, HoldsThatLetGoAddNone) {
    Random random(5);
    for (int trial = 0; trial < 12; ++trial) {
        const SolverKind kind = trial % 2 == 0 ? SolverKind::explicit_steps : SolverKind::implicit_steps;
        body::World world(settings_of(kind, 1.0 / 100), threads(2));
        body::BodySettings settings = soft(0.012, 260);
        settings.material.youngs_modulus = std::pow(10, random.uniform(3.5, 5));
        settings.material.poisson_ratio = random.uniform(0, 0.45);
        body::Body& body = world.add_body(
            trial % 3 == 0 ? geometry::make_sphere(0.1) : geometry::make_box(Vec3(0.1, 0.12, 0.26)),
            settings);
        const double edge = random.uniform(0.05, 0.1), pull = random.uniform(0.02, 0.1);
        const Vec3 axis = random_direction(random);
        for (const double side : {1, -1}) {
            body::HoldConstraint hold = hold_beyond({0, 0, side * edge}, side * Vec3::UnitZ());
            hold.motion = [=](double time) {
                const double share = side * std::min(time / 0.2, 1.0);
                Isometry motion(Eigen::AngleAxisd(0.3 * share, axis));
                motion.translation() = pull * share * Vec3::UnitZ();
                return motion;
            };
            // The upper one lets go, the lower one a little later.
            hold.until = side > 0 ? 0.4 : 0.45;
            body.add_constraint(hold);
        }
        double before = 0;
        for (int step = 0; step < 60; ++step) {
            const body::StepTotals totals = world.step().totals;
            const double energy = totals.kinetic_energy + totals.elastic_energy;
            if (world.time() < 0.4 + 1e-9)
                before = energy;
            else
                ASSERT_LT(energy, 1.005 * before) << "trial " << trial << ", step " << step;
        }
    }
}

/// Largest rise of the energy less the work of holds and handles over its lowest value so far, as a share of
/// what was put in.
double largest_gain_beside_work(body::World& world, int steps) {
    double lowest = gravity_energy(world), gain = 0, work = 0, put_in = 0, before = lowest;
    for (int step = 0; step < steps; ++step) {
        const body::StepReport report = world.step();
        const body::StepTotals& totals = report.totals;
        work += report.work.holds + report.work.handles;
        put_in += std::max(report.work.holds, 0.0) + std::max(report.work.handles, 0.0) +
                  std::max(before - totals.potential_energy, 0.0);
        before = totals.potential_energy;
        const double level = totals.kinetic_energy + totals.elastic_energy + totals.contact_energy +
                             totals.potential_energy - work;
        lowest = std::min(lowest, level);
        gain = std::max(gain, (level - lowest) / put_in);
    }
    return gain;
}

TEST(Energy, RisesByNoMoreThanTheWorkOfHoldsAndHandles) {
    Random random(8);
    for (int trial = 0; trial < 12; ++trial) {
        const SolverKind kind = trial % 4 == 0 ? SolverKind::explicit_steps : SolverKind::implicit_steps;
        body::WorldSettings world_settings = settings_of(kind, 1 / random.uniform(60, 240));
        world_settings.gravity = Vec3(0, 0, trial % 3 == 0 ? 0 : -9.81);
        body::World world(world_settings, threads(2));
        body::BodySettings settings = soft(0.012, 260);
        settings.material.youngs_modulus = std::pow(10, random.uniform(4, 6));
        body::Body& body = world.add_body(geometry::make_box(Vec3(0.1, 0.12, 0.26)), settings);
        body::HoldConstraint hold = hold_beyond({0, 0, 0.1}, Vec3::UnitZ());
        const Vec3 shake = random_vector(random, 0.03), axis = random_direction(random);
        const double turn = trial % 2 == 0 ? 0 : 0.3, rate = random.uniform(5, 20);
        hold.motion = [=](double time) {
            Isometry motion(Eigen::AngleAxisd(turn * std::sin(rate * time), axis));
            motion.translation() = (1 - std::cos(rate * time)) * shake;
            return motion;
        };
        body.add_constraint(hold);
        body::Handle handle;
        handle.region = [](const Vec3& point) { return point.z() < -0.08; };
        const Vec3 pull = random_vector(random, 0.2);
        handle.motion = [=](double time) { return Isometry(Eigen::Translation3d(time * pull)); };
        handle.stiffness = std::pow(10, random.uniform(2, 4));
        handle.limit = trial % 3 == 1 ? random.uniform(1, 20) : 1e300;
        if (trial % 3 != 2) body.add_handle(handle);
        if (trial % 2 == 0) add_random_blades(world, 6, 0.08, 0.1, 0.3, 20 + trial);
        EXPECT_LT(largest_gain_beside_work(world, 60), 0.02) << "trial " << trial;
    }
}

// A hold does not take back material of its region that was pulled away with the rest of its piece, where
// cuts give that phyxels of its own.
TEST(Energy, HoldsDoNotCatchWhatHandlesPulledAway) {
    body::WorldSettings settings = settings_of(SolverKind::implicit_steps, 1.0 / 100);
    settings.contact.pieces = false;
    body::World world(settings, threads(2));
    body::Body& body = world.add_body(geometry::make_box(Vec3(0.12, 0.12, 0.24)), soft(0.012, 260));
    body.add_constraint(hold_beyond({0, 0, 0.02}, Vec3::UnitZ()));
    body::Handle handle;
    handle.region = [](const Vec3&) { return true; };
    handle.motion = [](double time) { return Isometry(Eigen::Translation3d(0.1 * time, 0, -0.3 * time)); };
    handle.stiffness = 500;
    body.add_handle(handle);
    add_random_blades(world, 150, 0.1, 0, 0.5, 5);
    const meshless::Phyxels& phyxels = body.phyxels();
    double jump = 0;
    for (int step = 0; step < 60; ++step) {
        world.step();
        for (std::size_t i = 0; i < phyxels.size(); ++i)
            if (phyxels.held[i] != 0 && phyxels.rigid.index(phyxels.piece[i]) < 0)
                jump = std::max(jump, (phyxels.position[i] - phyxels.previous_position[i]).norm());
    }
    EXPECT_LT(jump, 1e-3 * body.phyxel_spacing());
    EXPECT_GT(body.pieces().count(), 1000U);
}

// Their own weight strains them unevenly, by a fifth and more.
TEST(Energy, CutsOfHangingBodiesAddNone) {
    for (const SolverKind kind : {SolverKind::explicit_steps, SolverKind::implicit_steps})
        for (std::uint64_t seed = 1; seed <= 4; ++seed) {
            body::WorldSettings settings = settings_of(kind, 1.0 / 60);
            settings.gravity = Vec3(0, 0, -9.81);
            settings.contact.pieces = false;
            body::World world(settings, threads(2));
            body::Body& body = world.add_body(geometry::make_box(Vec3(0.12, 0.08, 0.16)), sagging(2e3));
            body.add_constraint(hold_beyond({0, 0, 0.06}, Vec3::UnitZ()));
            add_random_blades(world, 24, 0.08, 0.2, 0.9, seed);
            EXPECT_LT(largest_gain(world, 60), 0.02) << "seed " << seed << ", kind " << int(kind);
        }
}

TEST(Energy, CutsOfBodiesOnTheGroundAddNone) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        body::WorldSettings settings = settings_of(SolverKind::implicit_steps, 1.0 / 60);
        settings.gravity = Vec3(0, 0, -9.81);
        settings.contact.pieces = false;
        settings.ground = meshless::GroundPlane{Vec3::UnitZ(), -0.085, 0.5};
        body::World world(settings, threads(2));
        world.add_body(geometry::make_box(Vec3(0.12, 0.12, 0.16)), sagging(1e4));
        add_random_blades(world, 8, 0.08, 0.3, 0.8, seed);
        // Contact forces still lift what a cut moved into the ground.
        EXPECT_LT(largest_gain(world, 60), 0.05) << "seed " << seed;
    }
}

}  // namespace
}  // namespace splitcubes::laws
