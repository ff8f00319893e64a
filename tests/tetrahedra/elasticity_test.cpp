#include "fields.h"

#include <gtest/gtest.h>
#include <splitcubes/core/random.h>

#include <cmath>
#include <numbers>

namespace {

using namespace splitcubes;
using namespace splitcubes::tetrahedra;
using fixtures::at_nodes_of, fixtures::box_of, fixtures::held_where;

constexpr Material soft{.youngs_modulus = 1e6, .poisson_ratio = 0.3, .density = 1000};

// Moves the inner nodes about; the middles of edges stay in the middle.
void distort(Mesh& mesh, double amount, const std::function<bool(const Vec3&)>& is_inside) {
    Random random(7);
    std::vector<bool> moved(mesh.nodes.size(), false);
    for (const std::array<int, 10>& element : mesh.elements)
        for (std::size_t k = 0; k < 4; ++k) {
            const auto node = static_cast<std::size_t>(element[k]);
            if (moved[node] || !is_inside(mesh.nodes[node])) continue;
            moved[node] = true;
            for (int axis = 0; axis < 3; ++axis) mesh.nodes[node][axis] += amount * random.uniform(-1, 1);
        }
    if (mesh.order == Order::linear) return;
    for (const std::array<int, 10>& element : mesh.elements)
        for (std::size_t e = 0; e < 6; ++e) {
            const auto corner = [&](int k) {
                return mesh.nodes[static_cast<std::size_t>(element[static_cast<std::size_t>(k)])];
            };
            mesh.nodes[static_cast<std::size_t>(element[4 + e])] =
                0.5 * (corner(edge_corners[e][0]) + corner(edge_corners[e][1]));
        }
}

class BothOrders : public testing::TestWithParam<Order> {};
INSTANTIATE_TEST_SUITE_P(Tetrahedra, BothOrders, testing::Values(Order::linear, Order::quadratic));

// A patch of distorted elements whose surface moves by a linear field.
TEST_P(BothOrders, PatchTest) {
    const Vec3 size(1, 0.8, 0.6);
    const auto is_inside = [&](const Vec3& p) {
        return (p.array() > 1e-9).all() && (p.array() < size.array() - 1e-9).all();
    };
    Mesh mesh = box_of(size, {3, 3, 3}, GetParam());
    const Mesh regular = mesh;
    distort(mesh, 0.05, is_inside);
    Mat3 gradient;
    gradient << 0.02, 0.01, -0.03, 0.015, -0.01, 0.02, 0.01, 0.005, 0.03;
    const auto field = [&](const Vec3& p) { return Vec3(gradient * p + Vec3(0.1, 0.2, 0.3)); };
    const Held held = held_where(
        mesh, [&](const Vec3& p) { return !is_inside(p); }, field);
    const Matrix stiffness = stiffness_matrix(mesh, soft);
    const Vector expected = at_nodes_of(mesh, field);
    const Vector found = solve(stiffness, Vector::Zero(expected.size()), held);
    double moved = 0;
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
        moved = std::max(moved, (mesh.nodes[i] - regular.nodes[i]).norm());
    EXPECT_GT(moved, 0.03);
    EXPECT_LT((found - expected).lpNorm<Eigen::Infinity>(), 1e-13);
    const Mat3 strain = 0.5 * (gradient + gradient.transpose());
    const double mu = 1e6 / 2.6, lambda = 2 * mu * 0.3 / 0.4;
    const double energy =
        size.prod() * (0.5 * lambda * strain.trace() * strain.trace() + mu * strain.squaredNorm());
    EXPECT_NEAR(0.5 * found.dot(stiffness * found), energy, 1e-11 * energy);
}

// One element with legs of 1 m along the axes. Moving the node on the x axis along x is uniaxial strain of 1
// in a volume of 1/6 m^3, moving it along y simple shear.
TEST(Tetrahedra, StiffnessAndMassOfOneLinearElement) {
    const Mesh mesh{Order::linear, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2, 3}}};
    const Eigen::MatrixXd stiffness = stiffness_matrix(mesh, soft), mass = mass_matrix(mesh, soft);
    const double mu = 1e6 / 2.6, lambda = 2 * mu * 0.3 / 0.4;
    EXPECT_NEAR(stiffness(3, 3), (lambda + 2 * mu) / 6, 1e-8);
    EXPECT_NEAR(stiffness(4, 4), mu / 6, 1e-8);
    EXPECT_NEAR(stiffness(3, 7), lambda / 6, 1e-8);
    EXPECT_NEAR(mass(0, 0), 1000.0 / 6 / 10, 1e-11);
    EXPECT_NEAR(mass(0, 3), 1000.0 / 6 / 20, 1e-11);
}

// A bar without lateral contraction under its weight: its displacement is quadratic in x, so quadratic
// elements find it to rounding; linear ones at the nodes of their layers.
TEST_P(BothOrders, BarUnderItsWeight) {
    const Mesh mesh = box_of({1, 0.3, 0.2}, {4, 2, 1}, GetParam());
    const Material material{.youngs_modulus = 1e6, .poisson_ratio = 0, .density = 1000};
    const auto fixed = [](const Vec3&) { return Vec3(Vec3::Zero()); };
    const Held held = held_where(
        mesh, [](const Vec3& p) { return p.x() < 1e-9; }, fixed);
    const Vector load =
        mass_matrix(mesh, material) * at_nodes_of(mesh, [](const Vec3&) { return Vec3(10, 0, 0); });
    EXPECT_NEAR(load.sum(), 1000 * 0.06 * 10, 1e-9);
    const Vector found = solve(stiffness_matrix(mesh, material), load, held);
    const Vector expected =
        at_nodes_of(mesh, [](const Vec3& p) { return Vec3(0.01 * (p.x() - 0.5 * p.x() * p.x()), 0, 0); });
    const double tolerance = GetParam() == Order::quadratic ? 1e-14 : 5e-4;
    EXPECT_LT((found - expected).lpNorm<Eigen::Infinity>(), tolerance);
}

// A cantilever with parabolic shear and Poisson's ratio zero: the exact displacement is cubic, and the ends
// have it. The error of the energy falls with the square of the error of strain: h^2 and h^4.
TEST_P(BothOrders, EnergyOfACantileverConverges) {
    constexpr double length = 1, half = 0.2, width = 0.3;
    const auto field = [&](const Vec3& p) {
        const double x = p.x(), z = p.z() - half;
        const double rotation = x * length - 0.5 * x * x;  // the slope of the sag
        return Vec3(-z * rotation - (z * z * z - 3 * half * half * z) / 3, 0,
                    0.5 * length * x * x - x * x * x / 6);
    };
    const auto at_end = [&](const Vec3& p) { return p.x() < 1e-9 || p.x() > length - 1e-9; };
    const Material material{.youngs_modulus = 1, .poisson_ratio = 0, .density = 1};
    // Half the integral of stress times strain: -z (L - x) along x, and shear -(z^2 - c^2) of modulus 1/2.
    const double area_moment = width * 2 * std::pow(half, 3) / 3;
    const double exact =
        0.5 * area_moment * std::pow(length, 3) / 3 + 0.25 * width * length * 16 * std::pow(half, 5) / 15;
    std::vector<double> errors;
    const int finest = GetParam() == Order::linear ? 8 : 4;
    for (int n = finest / 2; n <= finest; n *= 2) {
        const Mesh mesh = box_of({length, width, 2 * half}, {n, n, n}, GetParam());
        const Matrix stiffness = stiffness_matrix(mesh, material);
        const Vector found =
            solve(stiffness, Vector::Zero(stiffness.rows()), held_where(mesh, at_end, field));
        errors.push_back(0.5 * found.dot(stiffness * found) / exact - 1);
    }
    EXPECT_GT(errors.back(), 0);
    EXPECT_LT(errors.back(), GetParam() == Order::linear ? 0.2 : 2e-3);
    const double order = std::log2(errors.front() / errors.back());
    EXPECT_NEAR(order, GetParam() == Order::linear ? 2 : 4, 0.4);
}

// A free bar whose ends swing against each other: the lowest longitudinal vibration has the frequency c / 2
// L.
TEST_P(BothOrders, LongitudinalVibrationOfAFreeBar) {
    const Mesh mesh = box_of({1, 0.1, 0.1}, {16, 1, 1}, GetParam());
    const Material material{.youngs_modulus = 1e6, .poisson_ratio = 0, .density = 1000};
    const Vector start =
        at_nodes_of(mesh, [](const Vec3& p) { return Vec3(std::cos(std::numbers::pi * p.x()), 0, 0); });
    const double frequency =
        dominant_frequency(stiffness_matrix(mesh, material), mass_matrix(mesh, material), start, 10);
    const double exact = 0.5 * std::sqrt(1e6 / 1000);
    EXPECT_NEAR(frequency / exact, 1, GetParam() == Order::linear ? 3e-3 : 1e-5);
}

TEST_P(BothOrders, MeanOverASurface) {
    const Mesh mesh = box_of({1, 0.3, 0.2}, {3, 2, 2}, GetParam());
    const std::vector<double> weights = surface_weights(mesh, [](const Vec3& p) { return p.x() > 1 - 1e-9; });
    double one = 0, y = 0, z_squared = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        one += weights[i];
        y += weights[i] * mesh.nodes[i].y();
        z_squared += weights[i] * mesh.nodes[i].z() * mesh.nodes[i].z();
    }
    EXPECT_NEAR(one, 1, 1e-14);
    EXPECT_NEAR(y, 0.15, 1e-14);
    // Linear interpolation of z^2 between two cells' ends is too large by a sixth of their height squared.
    EXPECT_NEAR(z_squared, 0.04 / 3 + (GetParam() == Order::linear ? 0.01 / 6 : 0), 1e-15);
}

}  // namespace
