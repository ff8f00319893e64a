// Elastic and plastic material parameters.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

namespace splitcubes::meshless {

/// Constitutive model.
enum class MaterialModel : std::uint8_t {
    corotated,            // linear in the stretch S of F = R S; resists compression down to zero length
    st_venant_kirchhoff,  // Green strain, linear in stretches below 0.6
};

/// Plastic flow (Mueller and Gross 2004). Strain is the model's own measure: S - I with
/// F = R S for corotated, (F^T F - I)/2 for St. Venant-Kirchhoff; norms are Frobenius
/// norms.
struct Plasticity {
    double yield = 0.02;  // |elastic strain| above which it flows, > 0
    /// Rate of flow, 1/s; infinite: instantaneous, elastic strain never exceeds `yield`.
    double creep = std::numeric_limits<double>::infinity();
    double maximum = 0.4;  // bound of |plastic strain|, > 0
    bool operator==(const Plasticity&) const = default;
};

/// Elastic material, its damping and its plastic flow.
struct Material {
    MaterialModel model = MaterialModel::corotated;
    double density = 1000;        // kg/m^3
    double youngs_modulus = 1e5;  // Pa
    double poisson_ratio = 0.3;
    /// Pa, k of the additional energy k/2 (det F - 1)^2 (Mueller et al. 2004, section 3.4):
    /// keeps St. Venant-Kirchhoff from inverting.
    double volume_stiffness = 0;
    double mass_damping = 0;       // 1/s, force -mass_damping * m * v
    double stiffness_damping = 0;  // s, stress stiffness_damping * rate of the elastic stress
    /// Stiffness of zero-energy modes as a fraction of the shear modulus; 0.1 to 0.5,
    /// 0 disables it.
    double zero_energy = 0.35;
    std::optional<Plasticity> plasticity;  // none: elastic
    double cutting_resistance = 0;         // J/m^2, fracture toughness: work of a blade per rest area

    double lame_lambda() const {
        return youngs_modulus * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio));
    }
    double lame_mu() const { return youngs_modulus / (2 * (1 + poisson_ratio)); }
};

/// Returns the largest plasticity.maximum that a model allows: beyond it, a compressive strain would have
/// no corresponding stretch.
double max_plastic_strain(MaterialModel model);

/// Throws InputError(where + ".density", ...) and so on unless all parameters are finite
/// and physical: density, youngs_modulus > 0, 0 <= poisson_ratio < 0.5; volume_stiffness,
/// dampings and zero_energy >= 0; yield, creep > 0 (creep may be infinite),
/// 0 < maximum <= max_plastic_strain.
void check_material(const Material& material, const std::string& where);

}  // namespace splitcubes::meshless
