// What the material does at one phyxel: strain, energy, stress, its change, flow.
//
// Corotated, F = R S:       psi = mu |e|^2 + lambda/2 tr(e)^2, e = S - I - e_pl
// St. Venant-Kirchhoff:     psi = mu |E|^2 + lambda/2 tr(E)^2, E = (F^T F - I)/2 - e_pl
// either, with k > 0:       + k/2 (det F - 1)^2
// (Mueller et al. 2004, sections 3.2 and 3.4; plastic strain e_pl after Mueller and
// Gross 2004.) Mueller et al. print Green's strain without the factor 1/2; here it
// has it, so that small strains are those of linear elasticity.
#pragma once

#include <splitcubes/math/types.h>
#include <splitcubes/meshless/material.h>

namespace splitcubes::meshless {

/// The material's measure of strain, symmetric, rest space. R is the rotation of F.
Mat3 strain(const Material& material, const Mat3& F, const Mat3& R);

/// psi, J/m^3. Plastic strain is read only of a material with plasticity.
double energy_density(const Material& material, const Mat3& F, const Mat3& R,
                      const Mat3& plastic_strain = Mat3::Zero());

/// First Piola-Kirchhoff stress d psi / d F, Pa. P F^T is symmetric, so that the
/// forces make no torque. (Of a corotated plastic material where two principal
/// stretches sum to less than 0.2, the derivative is bounded: F is nearly flat or
/// inverted there.)
Mat3 piola_stress(const Material& material, const Mat3& F, const Mat3& R,
                  const Mat3& plastic_strain = Mat3::Zero());

/// The linear map from a change of F to that of the stress that implicit steps use,
/// symmetric and positive semi-definite:
/// dP = f (2 mu sym(f^T dF) + lambda tr(f^T dF) I) + dF p + k (c : dF) c.
///
/// Corotated: f = R, p = 0. The derivative of the rotation is left out, so it is d P
/// where F = R and does not resist turning. (With R held, dP = 2 mu dF + ..., the
/// energy's majorizer, one solve a step keeps what pivots on a support from turning: a
/// stiff bar would hang in the air.)
/// Where |F - R| is above 0.7, far from any state that lasts, it is that majorizer all
/// the same: a crumb that a contact flips over within a step, or that was dealt an
/// impossible shape, would be turned by so much that the linear motion tears it apart.
/// Corotated with plasticity, where F is far from R without stress: the exact d S in
/// place of sym(R^T dF), so that it is d P wherever there is no stress. In the axes Q
/// of S, f = F Q, dS = w o sym(f^T (dF Q)) with w_ij = 2 / (s_i + s_j), o by elements,
/// and dP = f (w o (2 mu dS + lambda tr(dS) I)) Q^T; stretches s are raised to 0.1.
/// St. Venant-Kirchhoff: f = F, its stretches raised to at least 0.7, p the second
/// Piola-Kirchhoff stress without its compression: d P itself where nothing is
/// compressed; elsewhere it is bounded from below, since the true one is indefinite
/// and vanishes with F, and a step would be thrown far beyond rest.
/// k: c is the cofactor matrix; the change of the cofactor, indefinite, is left out.
struct Tangent {
    double majorizer = 0;             // 1: the majorizer
    Mat3 frame = Mat3::Identity();    // f
    Mat3 prestress = Mat3::Zero();    // p, Pa, of St. Venant-Kirchhoff
    Mat3 cofactor = Mat3::Zero();     // c, where k > 0
    Mat3 axes = Mat3::Identity();     // Q, of a corotated plastic material
    Mat3 weights = Mat3::Identity();  // w, of a corotated plastic material
};
Tangent tangent(const Material& material, const Mat3& F, const Mat3& R,
                const Mat3& plastic_strain = Mat3::Zero());

/// Whether a material's tangents are their frame and turning alone.
inline bool is_frame_sufficient(const Material& material) {
    return material.model == MaterialModel::corotated && !material.plasticity &&
           !(material.volume_stiffness > 0);
}

/// Tangent::turning of the corotated material.
inline double majorizer_share(const Mat3& F, const Mat3& R) {
    return (F - R).squaredNorm() > 0.5 ? 1 : 0;
}

/// dP of dF by frame and turning alone.
inline Mat3 stress_change(const Material& material, const Mat3& frame, double majorizer, const Mat3& dF) {
    const Mat3 S = frame.transpose() * dF;
    Mat3 stress = material.lame_mu() * ((1 + majorizer) * S + (1 - majorizer) * S.transpose());
    stress.diagonal().array() += material.lame_lambda() * S.trace();
    return frame * stress;
}

/// dP of dF by the whole tangent.
Mat3 stress_change(const Material& material, const Tangent& tangent, const Mat3& dF);

/// The plastic strain after dt seconds at F. Where |e - e_pl| is above the yield, e_pl
/// goes on by dt creep (e - e_pl), but never past where the elastic strain is at the
/// yield; its norm is bounded by `maximum`.
Mat3 flow(const Plasticity& plasticity, const Mat3& total_strain, const Mat3& plastic_strain, double dt);

/// The symmetric stretch that has this strain: of a plastic strain, the shape that is
/// without stress.
Mat3 stretch_of(const Material& material, const Mat3& strain);

}  // namespace splitcubes::meshless
