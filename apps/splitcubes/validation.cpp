#include "validation.h"

#include <splitcubes/body/body.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/world/world.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace splitcubes::app {

namespace {

constexpr double density = 1000;   // kg/m^3
constexpr double stiffness = 1e6;  // Pa
constexpr double poisson = 0.3;

using Space = std::shared_ptr<const Parallel>;

body::BodySettings settings_of(double spacing, double ratio = poisson) {
    body::BodySettings s;
    s.cell_size = 0.5 * spacing;
    s.phyxel_spacing = spacing;
    s.material.density = density;
    s.material.youngs_modulus = stiffness;
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

// A square bar along x, held at its low end up to the first phyxels beyond x = 0.
constexpr double bar_side = 0.05, bar_length = 0.25, bar_root = 0.05;

struct Bar {
    /// gravity: in the frame of the bar; frame: rotation of the bar against the grid.
    Bar(int across, const Vec3& gravity, const Space& parallel, const Mat3& frame = Mat3::Identity(),
        double ratio = poisson)
        : world(still(frame * gravity), parallel), spacing(bar_side / across), axes(frame) {
        geometry::TriangleMesh box = geometry::make_box(Vec3(bar_length + bar_root, bar_side, bar_side));
        for (Vec3& p : box.positions) p = axes * (p + Vec3(0.5 * (bar_length - bar_root), 0, 0));
        body = &world.add_body(box, settings_of(spacing, ratio));
        body->add_constraint(moved(Vec3::Zero(), axes * -Vec3::UnitX(), Isometry::Identity()));
    }
    double along(const Vec3& rest) const { return axes.col(0).dot(rest); }
    // Mean of a component of the displacement of the last phyxels, and their mean distance from the root.
    struct End {
        double displacement = 0, position = 0;
    };
    End end(int axis) const {
        const meshless::Phyxels& p = body->phyxels();
        double far = 0, count = 0;
        for (const Vec3& rest : p.rest_position) far = std::max(far, along(rest));
        End sum;
        for (std::size_t i = 0; i < p.size(); ++i) {
            if (along(p.rest_position[i]) < far - 0.6 * spacing) continue;
            sum.displacement += axes.col(axis).dot(p.position[i] - p.rest_position[i]);
            sum.position += along(p.rest_position[i]);
            ++count;
        }
        return {sum.displacement / count, sum.position / count};
    }
    double held_up_to() const {
        double last = -1;
        for (const Vec3& rest : body->phyxels().rest_position)
            if (along(rest) <= 0) last = std::max(last, along(rest));
        return last;
    }
    body::World world;
    double spacing;
    Mat3 axes;
    body::Body* body = nullptr;
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
        for (std::uint32_t l = n.offsets()[i]; l < n.offsets()[i + 1]; ++l) {
            const Vec3& Y = p.rest_position[n.neighbour()[l]];
            strain += (Y.x() * Y.z() - X.x() * X.z()) * n.gradient()[l].x();
        }
        seen += p.volume[i] * strain * strain;
        all += p.volume[i] * bar_side * bar_side / 12;
    }
    return seen / all;
}

// Timoshenko's beam under its own weight: the sag at a distance from the root, m.
double theoretical_sag(double length, double at, double ratio = poisson) {
    const double load = density * 0.5 * bar_side * bar_side;  // N/m
    const double bending = stiffness * std::pow(bar_side, 4) / 12;
    const double shear = 5.0 / 6 * stiffness / (2 * (1 + ratio)) * bar_side * bar_side;
    return load / (24 * bending) *
               (std::pow(at, 4) - 4 * length * std::pow(at, 3) + 6 * length * length * at * at) +
           load / shear * (length * at - 0.5 * at * at);
}

// The bar under its weight. sees_bending: also finds the share of the bending stiffness that the gradients
// resolve, for a bar along x.
ValidationPoint sagging_bar(const char* test, int across, const Space& parallel, const Mat3& frame,
                            double ratio = poisson, bool sees_bending = false) {
    Bar bar(across, Vec3(0, 0, -0.5), parallel, frame, ratio);
    settle(bar.world);
    const double root = bar.held_up_to();
    const Bar::End end = bar.end(2);
    return {test,
            across,
            bar.body->phyxels().size(),
            -end.displacement,
            theoretical_sag(bar_length - root, end.position - root, ratio),
            "m",
            sees_bending ? bending_seen(*bar.body) : 0};
}

ValidationPoint cantilever(int across, const Space& parallel) {
    return sagging_bar("cantilever", across, parallel, Mat3::Identity(), poisson, true);
}

// The worst of three bars that are rotated against the grid of samples and of the surface.
ValidationPoint rotated_cantilever(int across, const Space& parallel) {
    ValidationPoint worst;
    for (const double degrees : {15.0, 33.0, 58.0}) {
        const Mat3 frame = Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vec3(1, 2, 3).normalized())
                               .toRotationMatrix();
        const ValidationPoint point = sagging_bar("rotated cantilever", across, parallel, frame);
        if (worst.count == 0 || std::abs(point.error()) > std::abs(worst.error())) worst = point;
    }
    return worst;
}

// A nearly incompressible bar.
ValidationPoint incompressible_cantilever(int across, const Space& parallel) {
    return sagging_bar("cantilever nu 0.49", across, parallel, Mat3::Identity(), 0.49);
}

// A bar is cut from above to a share of its height, ten centimetres from its root: the cut adds a rotation of
// 4 sigma / E V(share) there (Tada, Paris and Irwin, The stress analysis of cracks: edge crack in pure
// bending). Poisson's ratio is zero, so that plane stress and plane strain agree.
ValidationPoint notch(int percent, int across, const Space& parallel) {
    const double at = 0.1, share = percent / 100.0;
    double sag[2] = {0, 0}, length = 0, end = 0;
    std::size_t count = 0;
    for (const bool is_cut : {false, true}) {
        Bar bar(across, Vec3(0, 0, -0.5), parallel, Mat3::Identity(), 0);
        if (is_cut) {
            const double bottom = (0.5 - share) * bar_side;
            geometry::TriangleMesh sheet;
            sheet.positions = {{at, -1, bottom}, {at, 1, bottom}, {at, 1, 1}, {at, -1, 1}};
            sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
            bar.body->cut_with_sheet(sheet, 0, *parallel);
        }
        settle(bar.world);
        length = bar_length - bar.held_up_to();
        sag[is_cut] = -bar.end(2).displacement;
        end = bar.end(2).position - bar.held_up_to();
        count = bar.body->phyxels().size();
    }
    const double from = length - (bar_length - at);  // of the cut, from the root
    const double moment = 0.5 * density * 0.5 * bar_side * bar_side * (length - from) * (length - from);
    const double sigma = 6 * moment / std::pow(bar_side, 3);
    const double v =
        std::pow(share / (1 - share), 2) * (5.93 - 19.69 * share + 37.14 * std::pow(share, 2) -
                                            35.84 * std::pow(share, 3) + 13.12 * std::pow(share, 4));
    return {"notch " + std::to_string(percent) + " %", across, count, sag[1] - sag[0],
            4 * sigma / stiffness * v * (end - from),  "m"};
}

ValidationPoint tension(int across, const Space& parallel) {
    Bar bar(across, Vec3(50, 0, 0), parallel);
    settle(bar.world);
    const double root = bar.held_up_to();
    const Bar::End end = bar.end(0);
    const double length = bar_length - root, at = end.position - root;
    const double stretch = density * 50 / stiffness * (length * at - 0.5 * at * at);
    return {"tension", across, bar.body->phyxels().size(), end.displacement, stretch, "m"};
}

// The end is rotated by three degrees: the energy is G J angle^2 / 2 L, J = 0.1406 a^4 for a square
// (Timoshenko and Goodier, Theory of Elasticity, section 109).
ValidationPoint torsion(int across, const Space& parallel) {
    Bar bar(across, Vec3::Zero(), parallel);
    const double angle = 3 * std::numbers::pi / 180;
    Isometry turn = Isometry::Identity();
    turn.linear() = Eigen::AngleAxisd(angle, Vec3::UnitX()).toRotationMatrix();
    const double from = bar_length - bar_root;
    bar.body->add_constraint(moved(Vec3(from, 0, 0), Vec3::UnitX(), turn));
    const body::StepReport report = settle(bar.world);
    double first = 1;
    for (const Vec3& rest : bar.body->phyxels().rest_position)
        if (rest.x() >= from) first = std::min(first, rest.x());
    const double length = first - bar.held_up_to();
    const double shear = stiffness / (2 * (1 + poisson));
    const double energy = shear * 0.1406 * std::pow(bar_side, 4) * angle * angle / (2 * length);
    return {"torsion", across, bar.body->phyxels().size(), report.totals.elastic_energy, energy, "J"};
}

// Radial vibration of a free sphere: w R / c_L is the first root of x cot x = 1 - x^2 / (4 k^2), k = c_T /
// c_L (Lamb 1882). Explicit steps.
ValidationPoint sphere(int across, const Space& parallel) {
    const double radius = 0.05;
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
    const double lambda_2mu = stiffness * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson));
    const double k2 = (1 - 2 * poisson) / (2 * (1 - poisson));
    double low = 0.1, high = 3.1;  // brackets the first root for any k
    for (int k = 0; k < 60; ++k) {
        const double x = 0.5 * (low + high);
        (x / std::tan(x) - 1 + x * x / (4 * k2) > 0 ? low : high) = x;
    }
    const double expected = low * std::sqrt(lambda_2mu / density) / radius / (2 * std::numbers::pi);
    const double half_periods = static_cast<double>(crossings.size()) - 1;
    const double measured = half_periods / (2 * (crossings.back() - crossings.front()));
    return {"sphere", across, p.size(), measured, expected, "Hz"};
}

// A free sphere under its own gravity, g r / R towards the centre, shrinks by u = rho g R r / (10 (lambda + 2
// mu)) ((3 - nu) / (1 + nu) - r^2 / R^2) (Love, A treatise on the mathematical theory of elasticity, section
// 98). The mass-weighted mean is compared.
ValidationPoint gravity_of_sphere(int across, const Space& parallel) {
    const double radius = 0.05, gravity = 500;
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
    const double lambda_2mu = stiffness * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson));
    double measured = 0, expected = 0, mass = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
        const double r = p.rest_position[i].norm(), share = r / radius;
        if (r > 0) measured -= p.mass[i] * (p.position[i] - p.rest_position[i]).dot(p.rest_position[i]) / r;
        expected += p.mass[i] * density * gravity * radius * r / (10 * lambda_2mu) *
                    ((3 - poisson) / (1 + poisson) - share * share);
        mass += p.mass[i];
    }
    return {"gravity", across, p.size(), measured / mass, expected / mass, "m"};
}

// A plate with a slit in its middle is pulled: the slit opens by 4 strain a (Tada, Paris and Irwin, The
// stress analysis of cracks: an infinite plate under plane stress), a being half its length, a tenth of the
// plate's width.
ValidationPoint crack(int across, const Space& parallel) {
    const double width = 0.4, height = 0.4, half = 0.05, strain = 0.01;
    const double spacing = half / across;
    body::World world(still(Vec3::Zero()), parallel);
    body::Body& plate =
        world.add_body(geometry::make_box(Vec3(width, height, 2 * spacing)), settings_of(spacing));
    geometry::TriangleMesh slit;
    slit.positions = {{-half, 1e-4, -1}, {half, 1e-4, -1}, {half, 1e-4, 1}, {-half, 1e-4, 1}};
    slit.triangles = {{0, 1, 2}, {0, 2, 3}};
    plate.cut_with_sheet(slit, 0, *parallel);
    double top = 0;
    for (const Vec3& rest : plate.phyxels().rest_position) top = std::max(top, rest.y());
    for (const double side : {1.0, -1.0}) {
        Isometry displacement = Isometry::Identity();
        displacement.translation() = side * strain * top * Vec3::UnitY();
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
    return {"crack", across, plate.phyxels().size(), upper - lower, 4 * strain * half, "m"};
}

}  // namespace

std::vector<ValidationPoint> validate_mechanics(const Space& parallel) {
    std::vector<ValidationPoint> out;
    for (const auto test : {cantilever, tension, torsion})
        for (const int across : {2, 3, 4, 6, 8}) out.push_back(test(across, parallel));
    for (const int across : {3, 4, 6}) out.push_back(rotated_cantilever(across, parallel));
    for (const int across : {4, 6, 8}) out.push_back(incompressible_cantilever(across, parallel));
    for (const int percent : {25, 50, 75})
        for (const int across : {4, 6, 8}) out.push_back(notch(percent, across, parallel));
    for (const auto test : {gravity_of_sphere, sphere})
        for (const int across : {6, 8, 12, 16}) out.push_back(test(across, parallel));
    for (const int across : {3, 4, 6, 8}) out.push_back(crack(across, parallel));
    return out;
}

}  // namespace splitcubes::app
