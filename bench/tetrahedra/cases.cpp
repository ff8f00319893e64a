#include "cases.h"

#include "elasticity.h"

#include <validation_theory.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace splitcubes::tetrahedra {

namespace {

namespace theory = app::theory;

constexpr double near = 1e-9;  // m
constexpr int finest = 12000;  // nodes

// Breaks of the finest meshes around an edge of a slit, between two ends: there stresses are singular.
std::vector<double> graded(double low, double edge, double high) {
    std::vector<double> breaks;
    for (const double distance : {-0.009, -0.003, -0.001, 0.0, 0.001, 0.003, 0.009})
        if (edge + distance > low + near && edge + distance < high - near) breaks.push_back(edge + distance);
    return breaks;
}

Material material_with(double ratio = theory::poisson) {
    return {theory::stiffness, ratio, theory::density};
}

// A vector for every node, from its position.
Vector at_nodes(const Mesh& mesh, const std::function<Vec3(const Vec3&)>& value) {
    Vector out(static_cast<Eigen::Index>(3 * mesh.nodes.size()));
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) entries_of(out, i) = value(mesh.nodes[i]);
    return out;
}

Outcome outcome_of(const Mesh& mesh, const Held& held, double measured, double expected) {
    const auto free = std::count(held.begin(), held.end(), std::nullopt);
    return {mesh.elements.size(), mesh.nodes.size(), static_cast<std::size_t>(free), measured, expected};
}

// The free part of the bar. breaks: heights at which the mesh has faces.
struct BarMesh {
    double length = theory::bar_length;
    std::vector<double> breaks_along{};   // between the ends, from the root
    std::vector<double> breaks_upward{};  // between the lower and the upper side
    int held_planes = 1;
};

Mesh make_bar(const BarMesh& bar, Order order, int free_nodes) {
    const double half = 0.5 * theory::bar_side;
    std::vector<double> along{0}, upward{-half};
    along.insert(along.end(), bar.breaks_along.begin(), bar.breaks_along.end());
    upward.insert(upward.end(), bar.breaks_upward.begin(), bar.breaks_upward.end());
    along.push_back(bar.length);
    upward.push_back(half);
    Extent extent{.lengths = {bar.length, theory::bar_side, theory::bar_side},
                  .held_planes = bar.held_planes,
                  .square = true};
    extent.least = {static_cast<int>(along.size()) - 1, 1, static_cast<int>(upward.size()) - 1};
    const Vec3i cells = choose_cells(extent, order, free_nodes);
    return make_box({divide(along, cells[0]), divide({-half, half}, cells[1]), divide(upward, cells[2])},
                    order);
}

Held held_at_root(const Mesh& mesh) {
    Held held(mesh.nodes.size());
    for (std::size_t i = 0; i < held.size(); ++i)
        if (mesh.nodes[i].x() < near) held[i] = Vec3::Zero();
    return held;
}

// The mean displacement of the bar's end under an acceleration.
double displacement_of_end(const Mesh& mesh, const Held& held, const Mat3& frame, const Vec3& acceleration,
                           double ratio) {
    const std::vector<double> weights =
        surface_weights(mesh, [](const Vec3& p) { return p.x() > theory::bar_length - near; });
    Mesh turned = mesh;
    for (Vec3& p : turned.nodes) p = frame * p;
    const Material material = material_with(ratio);
    const Vector load =
        mass_matrix(turned, material) * at_nodes(turned, [&](const Vec3&) { return frame * acceleration; });
    const Vector displacement = solve(stiffness_matrix(turned, material), load, held);
    Vec3 mean = Vec3::Zero();
    for (std::size_t i = 0; i < weights.size(); ++i) mean += weights[i] * entries_of(displacement, i);
    return mean.dot(frame * acceleration.normalized());
}

Outcome sagging_bar(Order order, int free_nodes, double ratio, const Mat3& frame) {
    const Mesh mesh = make_bar({}, order, free_nodes);
    const Held held = held_at_root(mesh);
    return outcome_of(mesh, held, displacement_of_end(mesh, held, frame, {0, 0, -theory::bar_gravity}, ratio),
                      theory::sag(theory::bar_length, theory::bar_length, ratio));
}

Outcome cantilever(Order order, int free_nodes) {
    return sagging_bar(order, free_nodes, theory::poisson, Mat3::Identity());
}

// The mesh is rotated with the bar.
Outcome rotated_cantilever(Order order, int free_nodes) {
    const Vec3 axis = Vec3(1, 2, 3).normalized();
    return sagging_bar(order, free_nodes, theory::poisson,
                       Eigen::AngleAxisd(33 * std::numbers::pi / 180, axis).toRotationMatrix());
}

Outcome tension(Order order, int free_nodes) {
    const Mesh mesh = make_bar({}, order, free_nodes);
    const Held held = held_at_root(mesh);
    return outcome_of(
        mesh, held,
        displacement_of_end(mesh, held, Mat3::Identity(), {theory::bar_pull, 0, 0}, theory::poisson),
        theory::stretch(theory::bar_length, theory::bar_length));
}

Outcome torsion(Order order, int free_nodes) {
    const Mesh mesh = make_bar({.length = theory::twisted_length, .held_planes = 2}, order, free_nodes);
    Held held = held_at_root(mesh);
    const Vec3 rotation(theory::twist_degrees * std::numbers::pi / 180, 0, 0);
    for (std::size_t i = 0; i < held.size(); ++i)
        if (mesh.nodes[i].x() > theory::twisted_length - near) held[i] = rotation.cross(mesh.nodes[i]);
    const Matrix stiffness = stiffness_matrix(mesh, material_with());
    const Vector displacement = solve(stiffness, Vector::Zero(stiffness.rows()), held);
    return outcome_of(mesh, held, 0.5 * displacement.dot(stiffness * displacement),
                      theory::twist_energy(theory::twisted_length));
}

// The same mesh with and without the notch, whose faces are element faces with nodes of their own.
Outcome notch(Order order, int free_nodes, int percent) {
    const double share = percent / 100.0, bottom = (0.5 - share) * theory::bar_side;
    BarMesh bar{.breaks_along = {theory::notch_at}, .breaks_upward = {bottom}};
    if (free_nodes == finest) {
        bar.breaks_along = graded(0, theory::notch_at, theory::bar_length);
        bar.breaks_upward = graded(-0.5 * theory::bar_side, bottom, 0.5 * theory::bar_side);
    }
    Mesh mesh = make_bar(bar, order, free_nodes);
    const auto sag = [&] {
        return displacement_of_end(mesh, held_at_root(mesh), Mat3::Identity(), {0, 0, -theory::bar_gravity},
                                   0);
    };
    const double whole = sag();
    open_slit(mesh, theory::notch_at, [&](const Vec3& p) { return p.z() > bottom + near; });
    return outcome_of(mesh, held_at_root(mesh), sag() - whole,
                      theory::notch_sag(share, theory::bar_length, theory::notch_at, theory::bar_length));
}

Mesh ball_mesh(Order order, int free_nodes) {
    return make_ball(theory::ball_radius, choose_cells({.least = {2, 2, 2}}, order, free_nodes), order);
}

Outcome sphere(Order order, int free_nodes) {
    const Mesh mesh = ball_mesh(order, free_nodes);
    const Vector swelling = at_nodes(mesh, [](const Vec3& p) { return p; });
    const double expected = theory::breathing_frequency();
    const double measured = dominant_frequency(stiffness_matrix(mesh, material_with()),
                                               mass_matrix(mesh, material_with()), swelling, expected);
    return outcome_of(mesh, Held(mesh.nodes.size()), measured, expected);
}

// The pull follows the body: its gradient adds to the stiffness, and keeps the ball in its position.
Outcome gravity_of_sphere(Order order, int free_nodes) {
    const Mesh mesh = ball_mesh(order, free_nodes);
    const Held held(mesh.nodes.size());
    const Matrix mass = mass_matrix(mesh, material_with());
    const double gradient = theory::ball_gravity / theory::ball_radius;
    const Vector displacement =
        solve(stiffness_matrix(mesh, material_with()) + gradient * mass,
              mass * at_nodes(mesh, [&](const Vec3& p) { return Vec3(-gradient * p); }), held);
    const Vector lumped = mass * Vector::Ones(mass.cols());
    double measured = 0, expected = 0;
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
        const double r = mesh.nodes[i].norm(), weight = entries_of(lumped, i).x();
        if (r > 0) measured -= weight * entries_of(displacement, i).dot(mesh.nodes[i]) / r;
        expected += weight * theory::shrinkage(r);
    }
    const double whole = lumped.sum() / 3;
    return outcome_of(mesh, held, measured / whole, expected / whole);
}

// The plate is pulled along x, the slit lies along y.
Outcome crack(Order order, int free_nodes, double thickness) {
    const double half = 0.5 * theory::plate_side, slit = theory::slit_half_length;
    std::vector<double> across{-half, 0, half}, along{-half, -slit, 0, slit, half};
    if (free_nodes == finest) {
        across = graded(-half, 0, half);
        along = graded(-half, -slit, 0);
        const std::vector<double> other = graded(0, slit, half);
        along.push_back(0);
        along.insert(along.end(), other.begin(), other.end());
        for (std::vector<double>* breaks : {&across, &along}) {
            breaks->insert(breaks->begin(), -half);
            breaks->push_back(half);
        }
    }
    const Extent extent{.lengths = {theory::plate_side, theory::plate_side, thickness},
                        .least = {static_cast<int>(across.size()) - 1, static_cast<int>(along.size()) - 1, 1},
                        .step = {2, 2, 1},
                        .held_planes = 2};
    const Vec3i cells = choose_cells(extent, order, free_nodes);
    Mesh mesh = make_box({divide(across, cells[0]), divide(along, cells[1]),
                          divide({-0.5 * thickness, 0.5 * thickness}, cells[2])},
                         order);
    const std::size_t before = mesh.nodes.size();
    open_slit(mesh, 0, [&](const Vec3& p) { return std::abs(p.y()) < slit - near; });
    Held held(mesh.nodes.size());
    for (std::size_t i = 0; i < held.size(); ++i)
        if (std::abs(mesh.nodes[i].x()) > half - near)
            held[i] = Vec3(theory::plate_strain * mesh.nodes[i].x(), 0, 0);
    const Matrix stiffness = stiffness_matrix(mesh, material_with());
    const Vector displacement = solve(stiffness, Vector::Zero(stiffness.rows()), held);
    double upper = -1, lower = 1;  // in the slit's middle
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
        if (std::abs(mesh.nodes[i].x()) > near || std::abs(mesh.nodes[i].y()) > near) continue;
        (i < before ? lower : upper) = entries_of(displacement, i).x();
    }
    return outcome_of(mesh, held, upper - lower, theory::slit_opening());
}

double mismatch(double a, double b) {
    return std::abs(std::log(a / b));
}

void add_bars(std::vector<Case>& cases, const std::string& test, const std::string& unit,
              const std::vector<int>& across, double length, const std::function<Outcome(Order, int)>& run) {
    for (const int n : across)
        cases.push_back(
            {test, unit, n, static_cast<int>(std::lround(length / theory::bar_side)) * n * n * n, run});
    cases.push_back({test, unit, 0, finest, run});
}

void add_balls(std::vector<Case>& cases, const std::string& test, const std::string& unit,
               const std::function<Outcome(Order, int)>& run) {
    for (const auto& [across, phyxels] : {std::pair{6, 141}, {8, 273}, {12, 901}, {16, 2049}})
        cases.push_back({test, unit, across, phyxels, run});
    cases.push_back({test, unit, 0, finest, run});
}

void add_cracks(std::vector<Case>& cases) {
    for (const int n : {3, 4, 6, 8, 0}) {
        const double thickness = 2 * theory::slit_half_length / (n > 0 ? n : 8);
        cases.push_back({"crack", "m", n, n > 0 ? 16 * n * (8 * n - 2) : finest,
                         [=](Order order, int nodes) { return crack(order, nodes, thickness); }});
    }
}

}  // namespace

Vec3i choose_cells(const Extent& extent, Order order, int free_nodes) {
    const int nodes_per_cell = static_cast<int>(order);
    Vec3i best = extent.least, cells;
    double lowest = std::numeric_limits<double>::infinity();
    const auto nodes_along = [&](int axis) { return nodes_per_cell * cells[axis] + 1; };
    for (cells[2] = extent.least[2]; nodes_along(2) <= free_nodes; cells[2] += extent.step[2])
        for (cells[1] = extent.least[1]; nodes_along(1) * nodes_along(2) <= free_nodes;
             cells[1] += extent.step[1]) {
            if (extent.square && cells[1] != cells[2]) continue;
            for (cells[0] = extent.least[0];; cells[0] += extent.step[0]) {
                const int free = (nodes_along(0) - extent.held_planes) * nodes_along(1) * nodes_along(2);
                const Vec3 size = extent.lengths.cwiseQuotient(cells.cast<double>());
                // A tenth more or fewer nodes weigh as much as cells half as long again as wide.
                const double cost =
                    4 * mismatch(free, free_nodes) + mismatch(size.maxCoeff(), size.minCoeff());
                if (free > 0 && cost < lowest) {
                    lowest = cost;
                    best = cells;
                }
                if (free > free_nodes) break;
            }
        }
    return best;
}

std::vector<Case> validation_cases() {
    std::vector<Case> cases;
    const double length = theory::bar_length;
    add_bars(cases, "cantilever", "m", {2, 3, 4, 6, 8}, length, cantilever);
    add_bars(cases, "tension", "m", {2, 3, 4, 6, 8}, length, tension);
    add_bars(cases, "torsion", "J", {2, 3, 4, 6, 8}, theory::twisted_length, torsion);
    for (const char* test : {"rotated cantilever", "oblique lattice"})
        add_bars(cases, test, "m", {3, 4, 6}, length, rotated_cantilever);
    for (const auto& [test, ratio] : {std::pair{"cantilever nu 0.49", 0.49}, {"cantilever nu 0.499", 0.499}})
        add_bars(cases, test, "m", {4, 6, 8}, length, [ratio = ratio](Order order, int nodes) {
            return sagging_bar(order, nodes, ratio, Mat3::Identity());
        });
    for (const int percent : {25, 50, 75})
        add_bars(cases, "notch " + std::to_string(percent) + " %", "m", {4, 6, 8}, length,
                 [percent](Order order, int nodes) { return notch(order, nodes, percent); });
    add_balls(cases, "gravity", "m", gravity_of_sphere);
    add_balls(cases, "sphere", "Hz", sphere);
    add_cracks(cases);
    return cases;
}

}  // namespace splitcubes::tetrahedra
