#include "torture.h"

#include "laws/solids.h"
#include "laws/worlds.h"

#include <splitcubes/body/body.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/world/world.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace splitcubes::laws {

namespace {

constexpr double shake_amplitude = 0.02, shake_frequency = 5;  // m, Hz

Vec3 shake(double time) {
    const double phase = 2 * 3.14159265358979 * shake_frequency * time;
    return shake_amplitude * Vec3(std::sin(phase), 0.5 * (std::cos(phase) - 1), 0.25 * std::sin(2 * phase));
}

// Adds straight edges that cross the block: all the way, half way, along an earlier path, and edges shorter
// than a cell through one node.
void add_blades(const Torture& torture, const Vec3& center, body::World& world) {
    Random random(torture.seed);
    struct Path {
        Vec3 along, from, to;
        double half, duration;
    };
    std::vector<Path> paths;
    for (int k = 0; k < torture.blades; ++k) {
        const double start = 0.02 + (torture.seconds - 0.25) * k / torture.blades;
        Path path;
        if (k % 6 == 3 && !paths.empty()) {
            path = paths[static_cast<std::size_t>(random.uniform(0, 1) * 0.999 *
                                                  static_cast<double>(paths.size()))];
        } else {
            path.along = random_direction(random);
            const Vec3 across = path.along.cross(random_direction(random)).normalized();
            const Vec3 through = center + random_vector(random, 0.08);
            const bool one_node = k % 6 == 5;
            path.half = one_node ? 0.6 * torture.cell_size : k % 6 == 4 ? 0.05 : 0.3;
            const double reach = one_node ? 1.2 * torture.cell_size : 0.2;
            path.from = through - reach * across;
            path.to = k % 6 == 2 ? through : Vec3(through + reach * across);
            path.duration = random.uniform(0.02, 0.15);
        }
        paths.push_back(path);
        world.add_tool(moving_blade(-path.half * path.along, path.half * path.along, path.from, path.to,
                                    start, start + path.duration));
    }
}

std::unique_ptr<body::World> make_world(const Torture& torture) {
    body::WorldSettings settings = free_space(torture.time_step);
    // Each piece is compared with its free flight.
    settings.contact.pieces = false;
    settings.validate_each_step = false;
    settings.solver.kind = torture.solver;
    if (torture.load != Load::spinning) settings.gravity = Vec3(0, 0, -9.81);
    if (torture.load == Load::standing) settings.ground = meshless::GroundPlane{Vec3::UnitZ(), 0, 0.5};
    auto world = std::make_unique<body::World>(settings, threads(2));
    body::BodySettings block = soft(torture.cell_size, torture.phyxels);
    block.material.youngs_modulus = torture.youngs_modulus;
    block.material.model = torture.model;
    block.material.volume_stiffness = torture.volume_stiffness * torture.youngs_modulus;
    if (torture.load == Load::spinning) block.angular_velocity = Vec3(2, -4, 1);
    const Vec3 center(0, 0, torture.load == Load::standing ? 0.075 : 0);
    body::Body& body = world->add_body(moved(geometry::make_box(Vec3(0.2, 0.16, 0.14)), center), block);
    if (torture.load == Load::shaken) {
        body::HoldConstraint hold = hold_beyond({0, 0, 0.045}, Vec3::UnitZ());
        hold.motion = [](double time) {
            Isometry motion = Isometry::Identity();
            motion.translation() = shake(time);
            return motion;
        };
        body.add_constraint(hold);
    }
    add_blades(torture, center, *world);
    return world;
}

double potential_energy(const std::vector<meshless::Momenta>& pieces, const Vec3& gravity) {
    double energy = 0;
    for (const meshless::Momenta& piece : pieces) energy -= piece.mass * gravity.dot(piece.centre);
    return energy;
}

// Returns flags of the pieces that are neither held nor touched.
std::vector<std::uint8_t> free_pieces(const body::Body& body, const Torture& torture) {
    std::vector<std::uint8_t> free(body.pieces().count(), 1);
    const meshless::Phyxels& phyxels = body.phyxels();
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const bool held = torture.load == Load::shaken && phyxels.rest_position[i].z() >= 0.045;
        const bool low = torture.load == Load::standing;
        if (held || low || phyxels.touching[i] != 0) free[static_cast<std::size_t>(phyxels.piece[i])] = 0;
    }
    return free;
}

}  // namespace

TortureResult run(const Torture& torture) {
    const std::unique_ptr<body::World> world = make_world(torture);
    const body::Body& body = *world->bodies()[0];
    const Vec3 gravity = world->settings().gravity;
    const double dt = torture.time_step;
    TortureResult out;
    std::vector<meshless::Momenta> before, now;
    meshless::momenta_of_pieces(body.phyxels(), 1, before);
    meshless::Momenta total = meshless::total_momenta(body.phyxels());
    out.mass = total.mass;
    out.initial_angular_momentum = total.angular_momentum.norm();
    const Stopwatch watch;
    double put_in =
        before[0].linear.squaredNorm() / (2 * total.mass) + potential_energy(before, gravity) +
        0.5 * total.angular_momentum.dot(meshless::angular_velocity(total.inertia, total.angular_momentum));
    const double floor = torture.load == Load::spinning ? 0 : -total.mass * 9.81 * 0.07;
    const auto fail = [&](const std::string& what) {
        if (out.violated.empty()) out.violated = what + " at " + std::to_string(world->time()) + " s";
    };
    const auto steps = static_cast<int>(std::lround(torture.seconds / dt));
    for (int step = 0; step < steps && out.violated.empty(); ++step) {
        const body::StepReport report = world->step();
        out.new_phyxels += report.counts.new_phyxels;
        const int count = static_cast<int>(body.pieces().count());
        meshless::momenta_of_pieces(body.phyxels(), count, now);
        if (!std::isfinite(report.totals.kinetic_energy) || !std::isfinite(report.totals.elastic_energy))
            fail("not finite");
        if (step % 16 == 15 || step + 1 == steps)
            for (const std::string& line : body.validate()) fail(line);
        if (std::abs(report.totals.mass - out.mass) > 1e-9 * out.mass) fail("mass");
        // Work of the support: its force times its displacement, as all held points move alike.
        if (torture.load == Load::shaken) {
            const Vec3 displacement = shake(world->time()) - shake(world->time() - dt);
            put_in +=
                (report.totals.momentum - total.linear - dt * total.mass * gravity).dot(displacement) / dt;
        }
        if (torture.load == Load::spinning) {
            const meshless::Momenta after = meshless::total_momenta(body.phyxels());
            out.worst_momentum = std::max(out.worst_momentum, (after.linear - total.linear).norm());
            out.worst_angular_momentum = std::max(out.worst_angular_momentum,
                                                  (after.angular_momentum - total.angular_momentum).norm());
            total.angular_momentum = after.angular_momentum;
        }
        total.linear = report.totals.momentum;
        const double energy =
            report.totals.kinetic_energy + report.totals.elastic_energy + potential_energy(now, gravity);
        out.max_gain = std::max(out.max_gain, energy - put_in);
        out.max_motion_gain = std::max(out.max_motion_gain, energy - report.totals.elastic_energy - put_in);
        out.energy_put_in = std::max(out.energy_put_in, put_in - floor);
        out.top_speed = std::max(out.top_speed, report.totals.top_speed);
        const std::vector<std::uint8_t> free = free_pieces(body, torture);
        for (std::size_t k = 0; k < now.size(); ++k) {
            const Vec3 velocity = now[k].linear / now[k].mass;
            out.top_piece_speed = std::max(out.top_piece_speed, velocity.norm());
            if (k >= before.size() || now[k].mass != before[k].mass || free[k] == 0) continue;
            const Vec3 old = before[k].linear / before[k].mass;
            out.worst_speed = std::max(out.worst_speed, (velocity - old - dt * gravity).norm());
            out.worst_flight = std::max(
                out.worst_flight, (now[k].centre - before[k].centre - 0.5 * dt * (old + velocity)).norm());
        }
        if (torture.load == Load::standing)
            for (const meshless::RigidPiece& piece : body.phyxels().rigid.bodies)
                out.lowest = std::min(out.lowest, piece.centre.z());
        std::swap(before, now);
    }
    out.pieces = body.pieces().count();
    out.rigid = body.phyxels().rigid.bodies.size();
    out.cut_edges = body.cut_edge_count();
    out.seconds = watch.seconds();
    return out;
}

}  // namespace splitcubes::laws
