// Constitutive laws at one phyxel: strain, energy, stress, tangent, plastic flow.
//
// Corotated, F = R S:       psi = mu |e|^2 + lambda/2 tr(e)^2, e = S - I - e_pl
// St. Venant-Kirchhoff:     psi = mu |E|^2 + lambda/2 tr(E)^2, E = (F^T F - I)/2 - e_pl
// either, with k > 0:       + k/2 (det F - 1)^2
// A principal stretch s has Green's strain (s^2 - 1)/2. Below s = 0.6 it is continued by its tangent, down to
// negative s of an inverted F: St. Venant-Kirchhoff would resist less and less, and rest inside out (as
// Irving, Teran and Fedkiw 2004 continue stresses). (Mueller et al. 2004, sections 3.2 and 3.4; plastic
// strain e_pl after Mueller and Gross 2004.) Mueller et al. print Green's strain without the factor 1/2. It
// is used here so that small strains are those of linear elasticity.
#pragma once

#include <splitcubes/math/types.h>
#include <splitcubes/samples/material.h>

namespace splitcubes::meshless {

/// Returns the total strain in the model's measure, symmetric, rest space. R is the rotation of F.
Mat3 strain(const Material& material, const Mat3& F, const Mat3& R);

/// Returns psi, J/m^3. Plastic strain is read only if the material has plasticity.
double energy_density(const Material& material, const Mat3& F, const Mat3& R,
                      const Mat3& plastic_strain = Mat3::Zero());

/// Returns the first Piola-Kirchhoff stress P = d psi / d F, Pa. P F^T is symmetric, so
/// the forces cause no torque. (For a corotated plastic material the derivative is bounded
/// where two principal stretches sum to less than 0.2: F is nearly flat or inverted there.)
Mat3 piola_stress(const Material& material, const Mat3& F, const Mat3& R,
                  const Mat3& plastic_strain = Mat3::Zero());

/// Tangent of the stress as implicit steps use it, symmetric and positive semi-definite:
/// dP = f (2 mu sym(f^T dF) + lambda tr(f^T dF) I) + dF p + k (c : dF) c.
///
/// Corotated: f = R, p = 0, plus the twist f [T w], w the axial vector of skew(f^T dF). The
/// exact T has the axes of S and, for the twist between the principal stretches s_i and
/// s_j, the value 2 mu + (lambda tr(S - I) - 2 mu) 2 / (s_i + s_j) (Smith, de Goes and Kim
/// 2019). It is zero at F = R, positive under tension, where it holds a taut bar straight,
/// and negative under compression, where zero takes its place. So the tangent is exact
/// where no twist is negative, and a body at rest that pivots meets no resistance.
/// Where F is distorted and not taut, T = 2 mu I (the energy's
/// majorizer, with constant R): otherwise a fragment that a contact flips within a step, or
/// that starts in an impossible shape, would rotate so far that the linearised motion tears
/// it apart.
/// Corotated with plasticity, where a stress-free F can be far from R: the exact dS
/// replaces sym(R^T dF), so the tangent is exact at zero stress. In the axes Q of S,
/// f = F Q, dS = w o sym(f^T (dF Q)) with w_ij = 2 / (s_i + s_j), o element-wise,
/// and dP = f (w o (2 mu dS + lambda tr(dS) I)) Q^T; stretches s are at least 0.1.
/// St. Venant-Kirchhoff: f = F with stretches of at least 0.7; p is the tensile part of
/// the second Piola-Kirchhoff stress. The tangent is exact where nothing is compressed.
/// Elsewhere it is bounded from below: the true tangent is indefinite and vanishes with
/// F, so a step would overshoot far beyond rest.
/// k: c is the cofactor matrix; the indefinite derivative of the cofactor is left out.
struct Tangent {
    Mat3 twist = Mat3::Zero();        // T, Pa, for corotated without plasticity
    bool is_majorizer = false;        // T = 2 mu I of the majorizer
    Mat3 frame = Mat3::Identity();    // f
    Mat3 prestress = Mat3::Zero();    // p, Pa, for St. Venant-Kirchhoff
    Mat3 cofactor = Mat3::Zero();     // c, where k > 0
    Mat3 axes = Mat3::Identity();     // Q, for corotated with plasticity
    Mat3 weights = Mat3::Identity();  // w, for corotated with plasticity
};
Tangent tangent(const Material& material, const Mat3& F, const Mat3& R,
                const Mat3& plastic_strain = Mat3::Zero());

/// Returns whether `frame` and `twist` alone define the tangents of a material.
inline bool is_frame_sufficient(const Material& material) {
    return material.model == MaterialModel::corotated && !material.plasticity &&
           !(material.volume_stiffness > 0);
}

/// Returns whether F is far from rest, and from any lasting state of the corotated material that is not taut.
bool is_distorted(const Mat3& F, const Mat3& R);

/// Tangent::twist without the majorizer, and its trace with and without the negative values.
struct Twist {
    Mat3 stiffness = Mat3::Zero();   // Pa
    double exact = 0, positive = 0;  // Pa
};
/// Returns the twist of the corotated material at F = R S, in the axes of the rest space.
Twist twist_of(const Material& material, const Mat3& F, const Mat3& R);

/// Returns whether the material is so taut that no distortion calls for the majorizer.
bool is_taut(const Material& material, const Twist& twist);
/// Returns the majorizer's twist.
Mat3 majorizer_twist(const Material& material);

/// Returns dP of dF by frame and twist alone. share: factor on the twist.
inline Mat3 stress_change(const Material& material, const Mat3& frame, const Mat3& twist, const Mat3& dF,
                          double share = 1) {
    const Mat3 S = frame.transpose() * dF;
    Mat3 stress = material.lame_mu() * (S + S.transpose());
    stress.diagonal().array() += material.lame_lambda() * S.trace();
    const Vec3 turned = 0.5 * share * (twist * Vec3(S(2, 1) - S(1, 2), S(0, 2) - S(2, 0), S(1, 0) - S(0, 1)));
    stress(2, 1) += turned[0];
    stress(1, 2) -= turned[0];
    stress(0, 2) += turned[1];
    stress(2, 0) -= turned[1];
    stress(1, 0) += turned[2];
    stress(0, 1) -= turned[2];
    return frame * stress;
}

/// Returns dP of dF by the full tangent. twist_share: factor on the twist, except on the majorizer's.
Mat3 stress_change(const Material& material, const Tangent& tangent, const Mat3& dF, double twist_share = 1);

/// Returns the plastic strain after dt seconds at constant total strain e. If |e - e_pl|
/// exceeds the yield, e_pl grows by dt creep (e - e_pl), at most until the elastic strain
/// is at the yield; its norm is bounded by `maximum`.
Mat3 flow(const Plasticity& plasticity, const Mat3& total_strain, const Mat3& plastic_strain, double dt);

/// Returns the symmetric stretch with this strain; for a plastic strain it is the
/// stress-free shape.
Mat3 stretch_of(const Material& material, const Mat3& strain);

}  // namespace splitcubes::meshless
