#include <splitcubes/api/internal/convert.h>
#include <splitcubes/api/internal/sample_state.h>
#include <splitcubes/body/body.h>
#include <splitcubes/elasticity/constitutive.h>
#include <splitcubes/elasticity/pressure.h>

#include <cmath>

#include <Eigen/Eigenvalues>

namespace splitcubes::api {

namespace {

// Zero for an inverted sample, whose stress is not defined.
Mat3 cauchy_stress(const meshless::Material& material, const meshless::Phyxels& phyxels, std::size_t i) {
    const Mat3& F = phyxels.deformation[i];
    const double volume = F.determinant();
    if (!(volume > 0)) return Mat3::Zero();
    const Mat3 out = meshless::piola_stress(material, F, phyxels.rotation[i], phyxels.plastic_strain[i]) *
                     F.transpose() / volume;
    return out.allFinite() ? Mat3(0.5 * (out + out.transpose())) : Mat3(Mat3::Zero());
}

double largest_eigenvalue(const Mat3& symmetric) {
    Eigen::SelfAdjointEigenSolver<Mat3> solver;
    solver.computeDirect(symmetric, Eigen::EigenvaluesOnly);
    return solver.eigenvalues()[2];
}

double von_mises(const Mat3& stress) {
    const Mat3 deviator = stress - stress.trace() / 3 * Mat3::Identity();
    return std::sqrt(1.5) * deviator.norm();
}

}  // namespace

SampleState sample_state_of(const body::Body& body) {
    const meshless::Phyxels& phyxels = body.phyxels();
    const meshless::Material& material = body.settings().material;
    std::vector<Mat3> stress(phyxels.size());
    std::vector<double> pressure(phyxels.size());
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        stress[i] = cauchy_stress(material, phyxels, i);
        pressure[i] = -stress[i].trace() / 3;
    }
    const std::vector<double> own_pressure = pressure;
    meshless::average_over_neighbourhoods(body.neighbourhoods(), phyxels.support_radius, pressure);
    SampleState out;
    out.spacing = body.phyxel_spacing();
    out.pieces = phyxels.piece;
    out.masses = phyxels.mass;
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        out.rest_positions.push_back(public_vector(body.pose() * phyxels.rest_position[i]));
        out.positions.push_back(public_vector(phyxels.position[i]));
        out.velocities.push_back(public_vector(phyxels.velocity[i]));
        out.von_mises_stress.push_back(static_cast<float>(von_mises(stress[i])));
        out.principal_stress.push_back(
            static_cast<float>(largest_eigenvalue(stress[i]) + own_pressure[i] - pressure[i]));
        out.pressure.push_back(static_cast<float>(pressure[i]));
        const Mat3& F = phyxels.deformation[i];
        const double square = largest_eigenvalue(F.transpose() * F);
        out.principal_strain.push_back(
            std::isfinite(square) ? static_cast<float>(std::sqrt(std::max(square, 0.0)) - 1) : 0.0F);
    }
    return out;
}

std::vector<SampleLink> sample_links_of(const body::Body& body) {
    const meshless::Pairs& pairs = body.pairs();
    const std::vector<std::int32_t>& pieces = body.phyxels().piece;
    std::vector<SampleLink> out;
    for (std::size_t k = 0; k < pairs.size(); ++k)
        if (pieces[pairs.a[k]] == pieces[pairs.b[k]])
            out.push_back({pairs.a[k], pairs.b[k], static_cast<float>(pairs.visibility[k])});
    return out;
}

}  // namespace splitcubes::api
