#include "elasticity.h"

#include <splitcubes/core/error.h>

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <numbers>

namespace splitcubes::tetrahedra {

namespace {

using Shapes = Eigen::Matrix<double, 10, 1>;
using Gradients = Eigen::Matrix<double, 10, 3>;  // a row per node
using ElementMatrix = Eigen::Matrix<double, 30, 30>;

struct QuadraturePoint {
    Vec3 at;  // in the unit tetrahedron
    double weight = 0;
};

// Four Gauss points a direction of a cube whose one end is collapsed: exact for polynomials of degree 5, as
// many as the mass of quadratic elements with straight edges needs.
std::vector<QuadraturePoint> quadrature() {
    std::vector<std::pair<double, double>> gauss;  // position in (0, 1), weight
    for (const double sign : {-1.0, 1.0}) {
        const double root = std::sqrt(1.2), far = std::sqrt((3 + 2 * root) / 7),
                     near = std::sqrt((3 - 2 * root) / 7);
        gauss.emplace_back(0.5 + 0.5 * sign * far, (18 - std::sqrt(30)) / 72);
        gauss.emplace_back(0.5 + 0.5 * sign * near, (18 + std::sqrt(30)) / 72);
    }
    std::vector<QuadraturePoint> points;
    for (const auto& [u, u_weight] : gauss)
        for (const auto& [v, v_weight] : gauss)
            for (const auto& [w, w_weight] : gauss)
                points.push_back({Vec3(u, v * (1 - u), w * (1 - u) * (1 - v)),
                                  u_weight * v_weight * w_weight * (1 - u) * (1 - u) * (1 - v)});
    return points;
}

// Shape functions at a point of the unit tetrahedron and their derivatives there.
struct Basis {
    Basis(Order order, const QuadraturePoint& point) : weight(point.weight) {
        const Eigen::Vector4d share(1 - point.at.sum(), point.at[0], point.at[1], point.at[2]);
        Eigen::Matrix<double, 4, 3> slope;
        slope << -Eigen::RowVector3d::Ones(), Mat3::Identity();
        if (order == Order::linear) {
            shapes.head<4>() = share;
            derivatives.topRows<4>() = slope;
            return;
        }
        for (int a = 0; a < 4; ++a) {
            shapes[a] = share[a] * (2 * share[a] - 1);
            derivatives.row(a) = (4 * share[a] - 1) * slope.row(a);
        }
        for (int e = 0; e < 6; ++e) {
            const auto [a, b] = edge_corners[e];
            shapes[4 + e] = 4 * share[a] * share[b];
            derivatives.row(4 + e) = 4 * (share[a] * slope.row(b) + share[b] * slope.row(a));
        }
    }
    Shapes shapes = Shapes::Zero();
    Gradients derivatives = Gradients::Zero();
    double weight;
};

// An element at one of its quadrature points, m.
struct AtPoint {
    const Shapes& shapes;
    Gradients gradients;
    double volume;
};

template <class Add>
Matrix assemble(const Mesh& mesh, const Add& add) {
    std::vector<Basis> bases;
    for (const QuadraturePoint& point : quadrature()) bases.emplace_back(mesh.order, point);
    const int count = mesh.nodes_per_element();
    std::vector<Eigen::Triplet<double>> triplets;
    triplets.reserve(mesh.elements.size() * static_cast<std::size_t>(9 * count * count));
    for (const std::array<int, 10>& element : mesh.elements) {
        Gradients nodes = Gradients::Zero();
        for (int a = 0; a < count; ++a)
            nodes.row(a) = mesh.nodes[static_cast<std::size_t>(element[static_cast<std::size_t>(a)])];
        ElementMatrix sum = ElementMatrix::Zero();
        for (const Basis& basis : bases) {
            const Mat3 jacobian = nodes.transpose() * basis.derivatives;  // d position / d unit position
            const double determinant = jacobian.determinant();
            if (determinant <= 0) throw JobError("an element is inverted");
            add(AtPoint{basis.shapes, basis.derivatives * jacobian.inverse(), basis.weight * determinant},
                count, sum);
        }
        for (int a = 0; a < 3 * count; ++a)
            for (int b = 0; b < 3 * count; ++b)
                triplets.emplace_back(3 * element[static_cast<std::size_t>(a / 3)] + a % 3,
                                      3 * element[static_cast<std::size_t>(b / 3)] + b % 3, sum(a, b));
    }
    const auto size = static_cast<Eigen::Index>(3 * mesh.nodes.size());
    Matrix matrix(size, size);
    matrix.setFromTriplets(triplets.begin(), triplets.end());
    return matrix;
}

// Cholesky factors of a matrix, LDL^T.
class Factors {
  public:
    explicit Factors(const Matrix& matrix) : factors_(matrix) {
        if (factors_.info() != Eigen::Success)
            throw JobError("the stiffness is singular: too little is held");
    }
    Vector solve(const Vector& right) const { return factors_.solve(right); }

  private:
    Eigen::SimplicialLDLT<Matrix> factors_;
};

}  // namespace

Matrix stiffness_matrix(const Mesh& mesh, const Material& material) {
    const double nu = material.poisson_ratio;
    const double mu = material.youngs_modulus / (2 * (1 + nu));
    const double lambda = 2 * mu * nu / (1 - 2 * nu);
    return assemble(mesh, [&](const AtPoint& at, int count, ElementMatrix& sum) {
        for (int a = 0; a < count; ++a)
            for (int b = 0; b < count; ++b) {
                const Vec3 ga = at.gradients.row(a), gb = at.gradients.row(b);
                sum.block<3, 3>(3 * a, 3 * b) +=
                    at.volume * (lambda * ga * gb.transpose() + mu * gb * ga.transpose() +
                                 mu * ga.dot(gb) * Mat3::Identity());
            }
    });
}

Matrix mass_matrix(const Mesh& mesh, const Material& material) {
    return assemble(mesh, [&](const AtPoint& at, int count, ElementMatrix& sum) {
        for (int a = 0; a < count; ++a)
            for (int b = 0; b < count; ++b)
                sum.block<3, 3>(3 * a, 3 * b).diagonal().array() +=
                    material.density * at.volume * at.shapes[a] * at.shapes[b];
    });
}

Vector solve(const Matrix& stiffness, const Vector& forces, const Held& held) {
    Vector displacement = Vector::Zero(forces.size());
    std::vector<Eigen::Index> row_of(static_cast<std::size_t>(forces.size()), -1);
    Eigen::Index free = 0;
    for (std::size_t i = 0; i < held.size(); ++i) {
        if (held[i]) entries_of(displacement, i) = *held[i];
        for (std::size_t k = 0; k < 3 && !held[i]; ++k) row_of[3 * i + k] = free++;
    }
    const Vector rest = forces - stiffness * displacement;
    Vector load(free);
    std::vector<Eigen::Triplet<double>> triplets;
    for (Eigen::Index column = 0; column < stiffness.outerSize(); ++column) {
        const Eigen::Index to = row_of[static_cast<std::size_t>(column)];
        if (to < 0) continue;
        load[to] = rest[column];
        for (Matrix::InnerIterator entry(stiffness, column); entry; ++entry) {
            const Eigen::Index row = row_of[static_cast<std::size_t>(entry.row())];
            if (row >= 0) triplets.emplace_back(static_cast<int>(row), static_cast<int>(to), entry.value());
        }
    }
    Matrix reduced(free, free);
    reduced.setFromTriplets(triplets.begin(), triplets.end());
    const Vector moved = Factors(reduced).solve(load);
    for (std::size_t k = 0; k < row_of.size(); ++k)
        if (row_of[k] >= 0) displacement[static_cast<Eigen::Index>(k)] = moved[row_of[k]];
    return displacement;
}

// Lanczos with the inverse of stiffness + shift * mass, which is definite for free bodies too. The first
// entry of an eigenvector of the tridiagonal matrix is that vibration's share of the start.
double dominant_frequency(const Matrix& stiffness, const Matrix& mass, const Vector& displacement,
                          double guess) {
    constexpr int steps = 40;
    const double shift = std::pow(2 * std::numbers::pi * guess, 2);
    const Factors factors(stiffness + shift * mass);
    Eigen::MatrixXd basis(displacement.size(), steps);
    Vector diagonal(steps), beside(steps - 1);
    basis.col(0) = displacement / std::sqrt(displacement.dot(mass * displacement));
    for (int k = 0; k < steps; ++k) {
        Vector next = factors.solve(mass * basis.col(k));
        diagonal[k] = next.dot(mass * basis.col(k));
        if (k + 1 == steps) break;
        for (int pass = 0; pass < 2; ++pass)  // a second pass removes the rounding of the first
            next -= basis.leftCols(k + 1) * (basis.leftCols(k + 1).transpose() * (mass * next));
        beside[k] = std::sqrt(next.dot(mass * next));
        basis.col(k + 1) = next / beside[k];
    }
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen;
    eigen.computeFromTridiagonal(diagonal, beside);
    Eigen::Index largest = 0;
    eigen.eigenvectors().row(0).cwiseAbs().maxCoeff(&largest);
    return std::sqrt(1 / eigen.eigenvalues()[largest] - shift) / (2 * std::numbers::pi);
}

std::vector<double> surface_weights(const Mesh& mesh, const std::function<bool(const Vec3&)>& lies_on) {
    std::vector<double> weights(mesh.nodes.size(), 0);
    double whole = 0;
    const auto add = [&](int node, double weight) { weights[static_cast<std::size_t>(node)] += weight; };
    for (const std::array<int, 10>& element : mesh.elements)
        for (std::size_t opposite = 0; opposite < 4; ++opposite) {
            std::vector<std::size_t> face;
            for (std::size_t k = 0; k < 4; ++k)
                if (k != opposite && lies_on(mesh.nodes[static_cast<std::size_t>(element[k])]))
                    face.push_back(k);
            if (face.size() < 3) continue;
            const auto corner = [&](std::size_t k) {
                return mesh.nodes[static_cast<std::size_t>(element[face[k]])];
            };
            const double area = 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
            whole += area;
            if (mesh.order == Order::linear)
                for (const std::size_t k : face) add(element[k], area / 3);
            else  // quadratic functions: the middles of the edges have all weight
                for (std::size_t e = 0; e < 6; ++e)
                    if (edge_corners[e][0] != static_cast<int>(opposite) &&
                        edge_corners[e][1] != static_cast<int>(opposite))
                        add(element[4 + e], area / 3);
        }
    for (double& weight : weights) weight /= whole;
    return weights;
}

}  // namespace splitcubes::tetrahedra
