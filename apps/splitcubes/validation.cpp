#include "validation.h"

#include "validation_theory.h"

#include <splitcubes/body/body.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/geometry/signed_distance.h>
#include <splitcubes/world/world.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

namespace splitcubes::app {

namespace {

using theory::bar_length, theory::bar_root, theory::bar_side, theory::poisson;

using Space = std::shared_ptr<const Parallel>;

body::BodySettings settings_of(double spacing, double ratio = poisson) {
    body::BodySettings s;
    s.cell_size = 0.5 * spacing;
    s.phyxel_spacing = spacing;
    s.material.density = theory::density;
    s.material.youngs_modulus = theory::stiffness;
    s.material.poisson_ratio = ratio;
    return s;
}

body::HoldConstraint moved(const Vec3& point, const Vec3& normal, const Isometry& to) {
    body::HoldConstraint hold;
    hold.region = [point, normal](const Vec3& rest) { return normal.dot(rest - point) >= 0; };
    hold.motion = [to](double) { return to; };
    return hold;
}

// Steps until the body is at rest; constraints may move it at the start.
body::StepReport settle(body::World& world) {
    body::StepReport report = world.step();
    for (int k = 0; k < 600; ++k) {
        report = world.step();
        if (k > 20 && report.totals.top_speed < 1e-7) break;
    }
    return report;
}

body::WorldSettings still(const Vec3& gravity) {
    body::WorldSettings settings;
    settings.gravity = gravity;
    settings.solver.tolerance = 1e-7;
    settings.solver.scheme = meshless::TimeScheme::backward_euler;  // comes to rest sooner
    settings.validate_each_step = false;
    return settings;
}

// The bar, held up to the first phyxels beyond x = 0.
struct Bar {
    /// gravity: in the frame of the bar; frame: rotation of the mesh against its own axes; follows_shape: of
    /// the grid, against which the bar is rotated otherwise.
    Bar(int across, const Vec3& gravity, const Space& parallel, const Mat3& frame = Mat3::Identity(),
        double ratio = poisson, bool follows_shape = true,
        occlusion::CriterionKind criterion = occlusion::CriterionKind::occlusion_disk)
        : world(still(frame * gravity), parallel), spacing(bar_side / across), axes(frame) {
        geometry::TriangleMesh box = geometry::make_box(Vec3(bar_length + bar_root, bar_side, bar_side));
        for (Vec3& p : box.positions) p = axes * (p + Vec3(0.5 * (bar_length - bar_root), 0, 0));
        body::BodySettings settings = settings_of(spacing, ratio);
        settings.follows_shape = follows_shape;
        settings.criterion = criterion;
        body = &world.add_body(box, settings);
        for (const Vec3& rest : body->phyxels().rest_position) start.push_back(body->pose() * rest);
        body->add_constraint(moved(Vec3::Zero(), axes * -Vec3::UnitX(), Isometry::Identity()));
    }
    double along(const Vec3& at) const { return axes.col(0).dot(at); }
    // Mean of a component of the displacement of the last phyxels, and their mean distance from the root.
    struct End {
        double displacement = 0, position = 0;
    };
    End end(int axis) const {
        const meshless::Phyxels& p = body->phyxels();
        double far = 0, count = 0;
        for (const Vec3& at : start) far = std::max(far, along(at));
        End sum;
        for (std::size_t i = 0; i < start.size(); ++i) {
            if (along(start[i]) < far - 0.6 * spacing) continue;
            sum.displacement += axes.col(axis).dot(p.position[i] - start[i]);
            sum.position += along(start[i]);
            ++count;
        }
        return {sum.displacement / count, sum.position / count};
    }
    // Phyxels that are not held, where also those beyond `to` are.
    std::size_t free(double to = std::numeric_limits<double>::infinity()) const {
        return static_cast<std::size_t>(std::count_if(
            start.begin(), start.end(), [&](const Vec3& p) { return along(p) > 0 && along(p) < to; }));
    }
    double held_up_to() const {
        double last = -1;
        for (const Vec3& at : start)
            if (along(at) <= 0) last = std::max(last, along(at));
        return last;
    }
    body::World world;
    double spacing;
    Mat3 axes;
    body::Body* body = nullptr;
    std::vector<Vec3> start;  // m, of the phyxels at time 0
};

// Returns the share of a bent bar's energy that the gradients resolve, for the displacement of pure bending u
// = (-x z, 0, (x^2 + nu (z^2 - y^2)) / 2) with uniaxial stress E z.
double bending_seen(const body::Body& body) {
    const meshless::Neighbourhoods& n = body.neighbourhoods();
    const meshless::Phyxels& p = body.phyxels();
    double seen = 0, all = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
        const Vec3& X = p.rest_position[i];
        if (X.x() < 0.08 || X.x() > 0.17) continue;
        double strain = 0;
        for (std::uint32_t l = n.links_begin(i); l < n.links_end(i); ++l) {
            const Vec3& Y = p.rest_position[n.neighbour()[l]];
            strain += (Y.x() * Y.z() - X.x() * X.z()) * n.gradient()[l].x();
        }
        seen += p.volume[i] * strain * strain;
        all += p.volume[i] * bar_side * bar_side / 12;
    }
    return seen / all;
}

// The bar under its weight. sees_bending: also finds the share of the bending stiffness that the gradients
// resolve, for a bar along x.
ValidationPoint sagging_bar(const char* test, int across, const Space& parallel, const Mat3& frame,
                            double ratio = poisson, bool sees_bending = false, bool follows_shape = true) {
    Bar bar(across, Vec3(0, 0, -theory::bar_gravity), parallel, frame, ratio, follows_shape);
    settle(bar.world);
    const double root = bar.held_up_to();
    const Bar::End end = bar.end(2);
    return {test,
            across,
            bar.body->phyxels().size(),
            -end.displacement,
            theory::sag(bar_length - root, end.position - root, ratio),
            "m",
            sees_bending ? bending_seen(*bar.body) : 0,
            bar.free()};
}

ValidationPoint cantilever(int across, const Space& parallel) {
    return sagging_bar("cantilever", across, parallel, Mat3::Identity(), poisson, true);
}

// The worst of three bars whose mesh is rotated against its own axes, and with them, unless the grid follows
// the shape, against grid and phyxels.
ValidationPoint worst_rotated(const char* test, int across, const Space& parallel, bool follows_shape) {
    ValidationPoint worst;
    for (const double degrees : {15.0, 33.0, 58.0}) {
        const Mat3 frame = Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vec3(1, 2, 3).normalized())
                               .toRotationMatrix();
        const ValidationPoint point =
            sagging_bar(test, across, parallel, frame, poisson, false, follows_shape);
        if (worst.count == 0 || std::abs(point.error()) > std::abs(worst.error())) worst = point;
    }
    return worst;
}

ValidationPoint rotated_cantilever(int across, const Space& parallel) {
    return worst_rotated("rotated cantilever", across, parallel, true);
}

ValidationPoint oblique_lattice(int across, const Space& parallel) {
    return worst_rotated("oblique lattice", across, parallel, false);
}

// A nearly incompressible bar.
ValidationPoint incompressible_cantilever(const char* test, double ratio, int across, const Space& parallel) {
    return sagging_bar(test, across, parallel, Mat3::Identity(), ratio);
}

// Returns the bar at rest under its weight, cut from above to a share of its height.
std::unique_ptr<const Bar> resting_bar(double share, int across, occlusion::CriterionKind criterion,
                                       const Space& parallel) {
    auto bar = std::make_unique<Bar>(across, Vec3(0, 0, -theory::bar_gravity), parallel, Mat3::Identity(), 0,
                                     true, criterion);
    if (share > 0) {
        const double at = theory::notch_at, bottom = (0.5 - share) * bar_side;
        geometry::TriangleMesh sheet;
        sheet.positions = {{at, -1, bottom}, {at, 1, bottom}, {at, 1, 1}, {at, -1, 1}};
        sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
        bar->body->cut_with_sheet(sheet, 0, *parallel);
    }
    settle(bar->world);
    return bar;
}

// Bars that are cut to a quarter, a half and three quarters of their height.
std::vector<ValidationPoint> notches(int across, const Space& parallel) {
    std::vector<ValidationPoint> out =
        notched_bars(std::array{0.25, 0.5, 0.75}, across, occlusion::CriterionKind::occlusion_disk, parallel);
    for (std::size_t k = 0; k < out.size(); ++k) out[k].test += ' ' + std::to_string(25 * (k + 1)) + " %";
    return out;
}

ValidationPoint tension(int across, const Space& parallel) {
    Bar bar(across, Vec3(theory::bar_pull, 0, 0), parallel);
    settle(bar.world);
    const double root = bar.held_up_to();
    const Bar::End end = bar.end(0);
    return {"tension",
            across,
            bar.body->phyxels().size(),
            end.displacement,
            theory::stretch(bar_length - root, end.position - root),
            "m",
            0,
            bar.free()};
}

// The end is rotated; elastic energy.
ValidationPoint torsion(int across, const Space& parallel) {
    Bar bar(across, Vec3::Zero(), parallel);
    const double angle = theory::twist_degrees * std::numbers::pi / 180;
    Isometry turn = Isometry::Identity();
    turn.linear() = Eigen::AngleAxisd(angle, Vec3::UnitX()).toRotationMatrix();
    const double from = theory::twisted_length;
    bar.body->add_constraint(moved(Vec3(from, 0, 0), Vec3::UnitX(), turn));
    const body::StepReport report = settle(bar.world);
    double first = 1;
    for (const Vec3& rest : bar.body->phyxels().rest_position)
        if (rest.x() >= from) first = std::min(first, rest.x());
    return {"torsion",
            across,
            bar.body->phyxels().size(),
            report.totals.elastic_energy,
            theory::twist_energy(first - bar.held_up_to()),
            "J",
            0,
            bar.free(from)};
}

// Radial vibration of a free sphere, from a swelling velocity. Explicit steps.
ValidationPoint sphere(int across, const Space& parallel) {
    const double radius = theory::ball_radius;
    body::WorldSettings settings = still(Vec3::Zero());
    settings.solver.kind = meshless::SolverKind::explicit_steps;
    settings.time_step = 1e-4;
    body::World world(settings, parallel);
    body::Body& ball = world.add_body(geometry::make_sphere(radius, 4), settings_of(2 * radius / across));
    meshless::Phyxels& p = ball.phyxels();
    for (std::size_t i = 0; i < p.size(); ++i) p.velocity[i] = 0.1 * p.rest_position[i];
    const auto swelling = [&] {
        double sum = 0;
        for (std::size_t i = 0; i < p.size(); ++i)
            sum += p.mass[i] * p.rest_position[i].dot(p.position[i] - p.rest_position[i]);
        return sum;
    };
    std::vector<double> crossings;
    double last = 0;
    for (int k = 0; k < 2000 && crossings.size() < 9; ++k) {
        world.step();
        const double now = swelling();
        if (k > 0 && (now > 0) != (last > 0)) crossings.push_back(world.time() - 1e-4 * now / (now - last));
        last = now;
    }
    const double half_periods = static_cast<double>(crossings.size()) - 1;
    const double measured = half_periods / (2 * (crossings.back() - crossings.front()));
    return {"sphere", across, p.size(), measured, theory::breathing_frequency(), "Hz", 0, p.size()};
}

// A free sphere shrinks under its own gravity. The mass-weighted mean displacement is compared.
ValidationPoint gravity_of_sphere(int across, const Space& parallel) {
    const double radius = theory::ball_radius, gravity = theory::ball_gravity;
    body::WorldSettings settings = still(Vec3::Zero());
    settings.time_step = 5e-4;  // the free fall in a step must be far less than the radius
    body::World world(settings, parallel);
    body::Body& ball = world.add_body(geometry::make_sphere(radius, 4), settings_of(2 * radius / across));
    meshless::Phyxels& p = ball.phyxels();
    const double dt = world.settings().time_step;
    for (int k = 0; k < 600; ++k) {
        for (std::size_t i = 0; i < p.size(); ++i) p.velocity[i] -= dt * gravity / radius * p.position[i];
        if (world.step().totals.top_speed < 1e-7 && k > 20) break;
    }
    double measured = 0, expected = 0, mass = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
        const double r = p.rest_position[i].norm();
        if (r > 0) measured -= p.mass[i] * (p.position[i] - p.rest_position[i]).dot(p.rest_position[i]) / r;
        expected += p.mass[i] * theory::shrinkage(r);
        mass += p.mass[i];
    }
    return {"gravity", across, p.size(), measured / mass, expected / mass, "m", 0, p.size()};
}

// A plate that approaches the centre of the ball within half a second. side: 1 from above, -1 from below.
body::Collider approaching_plate(double side) {
    body::Collider plate;
    plate.solid = geometry::make_plane_distance(Vec3(0, 0, -side), 0);
    plate.friction = 0;
    plate.motion = [side](double time) {
        Isometry motion = Isometry::Identity();
        const double depth = theory::compression * theory::ball_radius * std::min(1.0, 2 * time);
        motion.translation() = Vec3(0, 0, side * (theory::ball_radius - depth));
        return motion;
    };
    return plate;
}

// Two plates compress a sphere: force of the lower one.
ValidationPoint compressed_sphere(int across, const Space& parallel) {
    const double radius = theory::ball_radius;
    body::World world(still(Vec3::Zero()), parallel);
    body::Body& ball = world.add_body(geometry::make_sphere(radius, 5), settings_of(2 * radius / across));
    for (const double side : {1.0, -1.0}) world.add_collider(approaching_plate(side));
    for (int k = 0; k < 120; ++k)
        if (world.step().totals.top_speed < 1e-5 && world.time() > 0.6) break;
    double force = 0;
    for (const meshless::CachedContact& contact : world.active_contacts())
        force += std::max(contact.force.z(), 0.0);
    const std::size_t count = ball.phyxels().size();
    return {"compressed sphere", across, count, force, theory::compressing_force(), "N", 0, count};
}

// A plate with a slit in its middle is pulled: opening of the slit.
ValidationPoint crack(int across, const Space& parallel) {
    const double half = theory::slit_half_length, side_length = theory::plate_side;
    const double spacing = half / across;
    body::World world(still(Vec3::Zero()), parallel);
    body::Body& plate =
        world.add_body(geometry::make_box(Vec3(side_length, side_length, 2 * spacing)), settings_of(spacing));
    geometry::TriangleMesh slit;
    slit.positions = {{-half, 1e-4, -1}, {half, 1e-4, -1}, {half, 1e-4, 1}, {-half, 1e-4, 1}};
    slit.triangles = {{0, 1, 2}, {0, 2, 3}};
    plate.cut_with_sheet(slit, 0, *parallel);
    const std::vector<Vec3>& rest = plate.phyxels().rest_position;
    double top = 0;
    for (const Vec3& p : rest) top = std::max(top, p.y());
    const auto free =
        std::count_if(rest.begin(), rest.end(), [&](const Vec3& p) { return std::abs(p.y()) < top - 1e-4; });
    for (const double side : {1.0, -1.0}) {
        Isometry displacement = Isometry::Identity();
        displacement.translation() = side * theory::plate_strain * top * Vec3::UnitY();
        plate.add_constraint(moved(Vec3(0, side * (top - 1e-4), 0), side * Vec3::UnitY(), displacement));
    }
    settle(world);
    const geometry::SurfaceMesh mesh = plate.surface_mesh();
    double upper = -1, lower = 1;
    for (std::size_t t = 0; t < mesh.mesh.triangles.size(); ++t) {
        if (mesh.triangle_origin[t] == geometry::Origin::boundary) continue;
        for (const auto v : mesh.mesh.triangles[t]) {
            const Vec3& p = mesh.mesh.positions[static_cast<std::size_t>(v)];
            if (std::abs(p.x()) > 0.1 * half) continue;
            upper = std::max(upper, p.y());
            lower = std::min(lower, p.y());
        }
    }
    return {"crack",
            across,
            rest.size(),
            upper - lower,
            theory::slit_opening(),
            "m",
            0,
            static_cast<std::size_t>(free)};
}

}  // namespace

std::vector<ValidationPoint> notched_bars(std::span<const double> shares, int across,
                                          occlusion::CriterionKind criterion, const Space& parallel) {
    const double uncut = resting_bar(0, across, criterion, parallel)->end(2).displacement;
    std::vector<ValidationPoint> out;
    for (const double share : shares) {
        const std::unique_ptr<const Bar> bar = resting_bar(share, across, criterion, parallel);
        const double length = bar_length - bar->held_up_to();
        const double from = length - (bar_length - theory::notch_at);  // of the cut, from the root
        const Bar::End end = bar->end(2);
        out.push_back({"notch", across, bar->body->phyxels().size(), uncut - end.displacement,
                       theory::notch_sag(share, length, from, end.position - bar->held_up_to()), "m", 0,
                       bar->free()});
    }
    return out;
}

std::vector<ValidationPoint> validate_mechanics(const Space& parallel) {
    std::vector<ValidationPoint> out;
    for (const auto test : {cantilever, tension, torsion})
        for (const int across : {2, 3, 4, 6, 8}) out.push_back(test(across, parallel));
    for (const auto test : {rotated_cantilever, oblique_lattice})
        for (const int across : {3, 4, 6}) out.push_back(test(across, parallel));
    for (const auto& [test, ratio] : {std::pair{"cantilever nu 0.49", 0.49}, {"cantilever nu 0.499", 0.499}})
        for (const int across : {4, 6, 8})
            out.push_back(incompressible_cantilever(test, ratio, across, parallel));
    std::vector<std::vector<ValidationPoint>> by_number;  // notches per number of phyxels across
    for (const int across : {4, 6, 8}) by_number.push_back(notches(across, parallel));
    for (std::size_t depth = 0; depth < by_number.front().size(); ++depth)
        for (const std::vector<ValidationPoint>& bars : by_number) out.push_back(bars[depth]);
    for (const auto test : {gravity_of_sphere, sphere})
        for (const int across : {6, 8, 12, 16}) out.push_back(test(across, parallel));
    for (const int across : {8, 12, 16, 17}) out.push_back(compressed_sphere(across, parallel));
    for (const int across : {3, 4, 6, 8}) out.push_back(crack(across, parallel));
    return out;
}

}  // namespace splitcubes::app
