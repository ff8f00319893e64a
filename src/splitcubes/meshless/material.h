// What the body is made of.
#pragma once

#include <string>

namespace splitcubes::meshless {

/// Fixed corotated material and its damping.
struct Material {
    double density = 1000;        // kg/m^3
    double youngs_modulus = 1e5;  // Pa
    double poisson_ratio = 0.3;
    double mass_damping = 0;       // 1/s, force -mass_damping * m * v
    double stiffness_damping = 0;  // s, stress stiffness_damping * rate of the elastic stress
    /// Stiffness against the modes that the gradients do not see, as a share of
    /// the shear modulus; 0.05 to 0.2, 0 switches it off.
    double zero_energy = 0.1;

    double lame_lambda() const {
        return youngs_modulus * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio));
    }
    double lame_mu() const { return youngs_modulus / (2 * (1 + poisson_ratio)); }
};

/// Throws InputError(where + ".density", ...) and so on for what is not finite
/// or not physical: density, youngs_modulus > 0, 0 <= poisson_ratio < 0.5 and the
/// dampings and zero_energy >= 0.
void check_material(const Material& material, const std::string& where);

}  // namespace splitcubes::meshless
