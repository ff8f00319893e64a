// Linear elasticity on meshes of tetrahedra: matrices, equilibrium, vibration. Three unknowns a node.
#pragma once

#include "mesh.h"

#include <Eigen/SparseCore>
#include <optional>

namespace splitcubes::tetrahedra {

struct Material {
    double youngs_modulus = 1e6;  // Pa
    double poisson_ratio = 0.3;
    double density = 1000;  // kg/m^3
};

using Matrix = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;

/// Stiffness of the mesh at rest, N/m.
Matrix stiffness_matrix(const Mesh& mesh, const Material& material);

/// Consistent mass of the mesh, kg. Its product with accelerations of the nodes is their load.
Matrix mass_matrix(const Mesh& mesh, const Material& material);

/// Displacements of the nodes that are prescribed, m; none: free.
using Held = std::vector<std::optional<Vec3>>;

/// Returns the displacements at which forces on the nodes, N, are in balance.
Vector solve(const Matrix& stiffness, const Vector& forces, const Held& held);

/// Returns the frequency, Hz, of the vibration in which most of a displacement lies. guess: about that
/// frequency, > 0; only the speed of convergence depends on it.
double dominant_frequency(const Matrix& stiffness, const Matrix& mass, const Vector& displacement,
                          double guess);

/// Returns the weights of the nodes in the mean over the surface whose nodes satisfy a condition; elements
/// are flat there.
std::vector<double> surface_weights(const Mesh& mesh, const std::function<bool(const Vec3&)>& lies_on);

/// The three entries of a node.
inline auto entries_of(Vector& vector, std::size_t node) {
    return vector.segment<3>(3 * static_cast<Eigen::Index>(node));
}
inline auto entries_of(const Vector& vector, std::size_t node) {
    return vector.segment<3>(3 * static_cast<Eigen::Index>(node));
}

}  // namespace splitcubes::tetrahedra
