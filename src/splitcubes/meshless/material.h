// What the body is made of.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

namespace splitcubes::meshless {

/// How stress follows from strain.
enum class MaterialModel : std::uint8_t {
    corotated,            // linear in the stretch F = R S: resists compression to nothing
    st_venant_kirchhoff,  // quadratic in F; gives way below half the length
};

/// Strain that stays (Mueller and Gross 2004). Strains are measured as the model
/// measures them: S - I of F = R S for the corotated one, (F^T F - I)/2 for St.
/// Venant-Kirchhoff; norms are Frobenius norms.
struct Plasticity {
    double yield = 0.02;  // |elastic strain| above which it flows, > 0
    /// Rate of flow, 1/s; infinite: at once, so that no elastic strain is ever above `yield`.
    double creep = std::numeric_limits<double>::infinity();
    double maximum = 0.4;  // of |plastic strain|, > 0
    bool operator==(const Plasticity&) const = default;
};

/// Elastic material, its damping and its plastic flow.
struct Material {
    MaterialModel model = MaterialModel::corotated;
    double density = 1000;        // kg/m^3
    double youngs_modulus = 1e5;  // Pa
    double poisson_ratio = 0.3;
    /// Pa, k of the further energy k/2 (det F - 1)^2 (Mueller et al. 2004, section 3.4):
    /// keeps St. Venant-Kirchhoff from turning inside out.
    double volume_stiffness = 0;
    double mass_damping = 0;       // 1/s, force -mass_damping * m * v
    double stiffness_damping = 0;  // s, stress stiffness_damping * rate of the elastic stress
    /// Stiffness against the modes that the gradients do not see, as a share of
    /// the shear modulus; 0.05 to 0.2, 0 switches it off.
    double zero_energy = 0.1;
    std::optional<Plasticity> plasticity;  // none: elastic
    double cutting_resistance = 0;         // J/m^2, work of a blade for each area at rest that it cuts

    double lame_lambda() const {
        return youngs_modulus * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio));
    }
    double lame_mu() const { return youngs_modulus / (2 * (1 + poisson_ratio)); }
};

/// Largest plasticity.maximum of a model: of more, a compressive strain would have
/// no stretch that belongs to it.
double largest_plastic_strain(MaterialModel model);

/// Throws InputError(where + ".density", ...) and so on for what is not finite
/// or not physical: density, youngs_modulus > 0, 0 <= poisson_ratio < 0.5 and the
/// volume stiffness, the dampings and zero_energy >= 0; yield, creep > 0 (creep may
/// be infinite), 0 < maximum <= largest_plastic_strain.
void check_material(const Material& material, const std::string& where);

}  // namespace splitcubes::meshless
