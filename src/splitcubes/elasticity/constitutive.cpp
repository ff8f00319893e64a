#include <splitcubes/elasticity/constitutive.h>
#include <splitcubes/elasticity/tuning.h>
#include <splitcubes/math/cofactor.h>
#include <splitcubes/math/decompose.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::meshless {

namespace {

Mat3 symmetric(const Mat3& A) {
    return 0.5 * (A + A.transpose());
}

bool is_plastic(const Material& material, const Mat3& plastic_strain) {
    return material.plasticity && !plastic_strain.isZero(0);
}

// Solves T S + S T = 2 e for symmetric T. Since e : dS = (T/2) : d(S^2), F T is the stress
// of an energy whose derivative by S is e.
Mat3 stress_over_stretch(const Mat3& S, const Mat3& e) {
    const SymmetricEigen eigen = eigen_symmetric(S);
    Mat3 T = eigen.vectors.transpose() * e * eigen.vectors;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            T(i, j) *= 2 / std::max(eigen.values[i] + eigen.values[j], tuning::constitutive::min_stretch_sum);
    return symmetric(eigen.vectors * T * eigen.vectors.transpose());
}

Mat3 second_piola(const Material& material, const Mat3& elastic_strain) {
    Mat3 stress = 2 * material.lame_mu() * elastic_strain;
    stress.diagonal().array() += material.lame_lambda() * elastic_strain.trace();
    return stress;
}

// Green's strain of a principal stretch, continued by its tangent below min_green_stretch, and its
// derivative.
double principal_strain(double stretch) {
    constexpr double least = tuning::constitutive::min_green_stretch;
    return stretch < least ? 0.5 * (least * least - 1) + least * (stretch - least)
                           : 0.5 * (stretch * stretch - 1);
}
double principal_strain_slope(double stretch) {
    return std::max(stretch, tuning::constitutive::min_green_stretch);
}

// Returns whether F is not inverted and all its principal stretches are above a limit.
bool is_stretched_above(const Mat3& F, double limit) {
    return F.determinant() > 0 && has_eigenvalues_below(-(F.transpose() * F), -limit * limit);
}

// Returns F with principal stretches of at least min_stretch.
Mat3 raised_stretch(const Mat3& F, const Mat3& R) {
    const SymmetricEigen stretch = eigen_symmetric(symmetric(R.transpose() * F));
    const Vec3 raised = stretch.values.cwiseMax(tuning::constitutive::min_stretch);
    return R * stretch.vectors * raised.asDiagonal() * stretch.vectors.transpose();
}

// Green's strain. If a principal stretch may be below min_green_stretch, also the principal stretches; the
// least is negative where F is inverted.
struct GreenStrain {
    Mat3 strain;
    bool is_crushed = false;
    SymmetricEigen stretch;
};

GreenStrain green_strain(const Mat3& F, const Mat3& R) {
    constexpr double least = tuning::constitutive::min_green_stretch;
    GreenStrain out{0.5 * (F.transpose() * F - Mat3::Identity()), false, {}};
    if (is_stretched_above(F, least)) return out;
    out.stretch = eigen_symmetric(symmetric(R.transpose() * F));
    out.is_crushed = out.stretch.values.minCoeff() < least;
    if (!out.is_crushed) return out;
    Vec3 strains;
    for (int k = 0; k < 3; ++k) strains[k] = principal_strain(out.stretch.values[k]);
    out.strain = out.stretch.vectors * strains.asDiagonal() * out.stretch.vectors.transpose();
    return out;
}

// Returns the first Piola-Kirchhoff stress of the stress T that belongs to the strain. In the axes of the
// stretches s, with strains e, the derivative of the strain has the factors (e_i - e_j) / (s_i^2 - s_j^2).
Mat3 stress_of_crushed(const GreenStrain& green, const Mat3& R, const Mat3& T) {
    const Vec3& s = green.stretch.values;
    const Mat3& V = green.stretch.vectors;
    Mat3 P = V.transpose() * T * V;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            if (i == j) {
                P(i, i) *= principal_strain_slope(s[i]);
                continue;
            }
            const double apart = s[i] - s[j];
            const double slope = std::abs(apart) > 1e-6
                                     ? (principal_strain(s[i]) - principal_strain(s[j])) / apart
                                     : principal_strain_slope(s[i]);
            P(i, j) *= 2 * s[i] * slope / std::max(s[i] + s[j], tuning::constitutive::min_stretch_sum);
        }
    return R * V * P * V.transpose();
}

// The elastic part of Green's strain.
Mat3 elastic_part(const Material& material, const GreenStrain& green, const Mat3& plastic_strain) {
    return material.plasticity ? Mat3(green.strain - plastic_strain) : green.strain;
}

// Returns A with each eigenvalue replaced by change(eigenvalue).
template <class Change>
Mat3 with_eigenvalues(const Mat3& A, const Change& change) {
    const SymmetricEigen eigen = eigen_symmetric(A);
    Vec3 values;
    for (int k = 0; k < 3; ++k) values[k] = change(eigen.values[k]);
    return eigen.vectors * values.asDiagonal() * eigen.vectors.transpose();
}

}  // namespace

Mat3 strain(const Material& material, const Mat3& F, const Mat3& R) {
    if (material.model == MaterialModel::st_venant_kirchhoff) return green_strain(F, R).strain;
    return symmetric(R.transpose() * F) - Mat3::Identity();
}

double energy_density(const Material& material, const Mat3& F, const Mat3& R, const Mat3& plastic_strain) {
    const double mu = material.lame_mu();
    const double lambda = material.lame_lambda();
    double density = 0;
    if (material.model == MaterialModel::st_venant_kirchhoff) {
        const Mat3 E = elastic_part(material, green_strain(F, R), plastic_strain);
        density = mu * E.squaredNorm() + 0.5 * lambda * E.trace() * E.trace();
    } else if (is_plastic(material, plastic_strain)) {
        const Mat3 e = strain(material, F, R) - plastic_strain;
        density = mu * e.squaredNorm() + 0.5 * lambda * e.trace() * e.trace();
    } else {
        const double stretch = R.cwiseProduct(F).sum() - 3;
        density = mu * (F - R).squaredNorm() + 0.5 * lambda * stretch * stretch;
    }
    if (material.volume_stiffness > 0) {
        const double change = F.determinant() - 1;
        density += 0.5 * material.volume_stiffness * change * change;
    }
    return density;
}

Mat3 piola_stress(const Material& material, const Mat3& F, const Mat3& R, const Mat3& plastic_strain) {
    Mat3 stress;
    if (material.model == MaterialModel::st_venant_kirchhoff) {
        const GreenStrain green = green_strain(F, R);
        const Mat3 second = second_piola(material, elastic_part(material, green, plastic_strain));
        stress = green.is_crushed ? stress_of_crushed(green, R, second) : Mat3(F * second);
    } else {
        const double stretch = R.cwiseProduct(F).sum() - 3;
        stress = 2 * material.lame_mu() * (F - R) + material.lame_lambda() * stretch * R;
        if (is_plastic(material, plastic_strain)) {
            const Mat3 S = symmetric(R.transpose() * F);
            stress -= F * stress_over_stretch(S, 2 * material.lame_mu() * plastic_strain);
            stress -= material.lame_lambda() * plastic_strain.trace() * R;
        }
    }
    if (material.volume_stiffness > 0)
        stress += material.volume_stiffness * (F.determinant() - 1) * cofactor_of(F);
    return stress;
}

bool is_distorted(const Mat3& F, const Mat3& R) {
    return (F - R).squaredNorm() > tuning::constitutive::far_from_rest;
}

Twist twist_of(const Material& material, const Mat3& F, const Mat3& R) {
    const double mu = material.lame_mu(), lambda = material.lame_lambda();
    const SymmetricEigen eigen = eigen_symmetric(symmetric(R.transpose() * (F - R)));
    const double trace = eigen.values.sum();
    Vec3 twist;
    for (int k = 0; k < 3; ++k) {
        // The sum of the other two stretches; this form has no cancellation near rest.
        const double sum = std::max(2 + trace - eigen.values[k], tuning::constitutive::min_stretch_sum);
        twist[k] = 2 * (mu * (trace - eigen.values[k]) + lambda * trace) / sum;
    }
    const Vec3 positive = twist.cwiseMax(0.0);
    return {eigen.vectors * positive.asDiagonal() * eigen.vectors.transpose(), twist.sum(), positive.sum()};
}

bool is_taut(const Material& material, const Twist& twist) {
    return twist.exact > tuning::constitutive::taut_twist * material.lame_mu();
}

Mat3 majorizer_twist(const Material& material) {
    return 2 * material.lame_mu() * Mat3::Identity();
}

Tangent tangent(const Material& material, const Mat3& F, const Mat3& R, const Mat3& plastic_strain) {
    Tangent out;
    out.frame = R;
    if (material.model == MaterialModel::corotated && !material.plasticity) {
        const Twist twist = twist_of(material, F, R);
        out.is_majorizer = is_distorted(F, R) && !is_taut(material, twist);
        out.twist = out.is_majorizer ? majorizer_twist(material) : twist.stiffness;
    }
    if (material.volume_stiffness > 0) out.cofactor = cofactor_of(F);
    if (material.model == MaterialModel::corotated && !material.plasticity) return out;
    if (material.model == MaterialModel::corotated) {
        const SymmetricEigen stretch = eigen_symmetric(symmetric(R.transpose() * F));
        const Vec3 s = stretch.values.cwiseMax(0.5 * tuning::constitutive::min_stretch_sum);
        out.axes = stretch.vectors;
        out.frame = R * stretch.vectors * s.asDiagonal();
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) out.weights(i, j) = 2 / (s[i] + s[j]);
        return out;
    }
    out.frame = is_stretched_above(F, tuning::constitutive::min_stretch) ? F : raised_stretch(F, R);
    out.prestress =
        positive_part(second_piola(material, elastic_part(material, green_strain(F, R), plastic_strain)));
    return out;
}

Mat3 stress_change(const Material& material, const Tangent& t, const Mat3& dF, double twist_share) {
    Mat3 change;
    if (material.model == MaterialModel::corotated && material.plasticity) {
        const Mat3 dS = t.weights.cwiseProduct(symmetric(t.frame.transpose() * dF * t.axes));
        Mat3 stress = 2 * material.lame_mu() * dS;
        stress.diagonal().array() += material.lame_lambda() * dS.trace();
        change = t.frame * t.weights.cwiseProduct(stress) * t.axes.transpose();
    } else {
        change = stress_change(material, t.frame, t.twist, dF, t.is_majorizer ? 1 : twist_share) +
                 dF * t.prestress;
    }
    if (material.volume_stiffness > 0)
        change += material.volume_stiffness * t.cofactor.cwiseProduct(dF).sum() * t.cofactor;
    return change;
}

Mat3 flow(const Plasticity& plasticity, const Mat3& total_strain, const Mat3& plastic_strain, double dt) {
    const Mat3 elastic = total_strain - plastic_strain;
    const double size = elastic.norm();
    if (!(size > plasticity.yield) || !std::isfinite(size)) return plastic_strain;
    const double share = std::min(dt * plasticity.creep, 1 - plasticity.yield / size);
    Mat3 out = plastic_strain + share * elastic;
    const double norm = out.norm();
    if (norm > plasticity.maximum) out *= plasticity.maximum / norm;
    return out;
}

Mat3 stretch_of(const Material& material, const Mat3& strain) {
    if (strain.isZero(0)) return Mat3::Identity();
    if (material.model == MaterialModel::corotated) return Mat3::Identity() + strain;
    // The inverse of principal_strain.
    constexpr double least = tuning::constitutive::min_green_stretch;
    return with_eigenvalues(strain, [](double value) {
        const double below = value - principal_strain(least);
        return below < 0 ? std::max(least + below / least, 0.0) : std::sqrt(1 + 2 * value);
    });
}

}  // namespace splitcubes::meshless
