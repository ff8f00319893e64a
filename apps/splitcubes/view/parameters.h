// Quantities that the user changes while the simulation runs, and materials that set several at once.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace splitcubes::view {

/// A quantity with a slider.
struct Parameter {
    std::string_view name;   // in recordings
    std::string_view label;  // for people
    std::string_view unit;
    double low, high;  // of the slider
    bool logarithmic;
    bool restarts;  // takes effect when the scene starts again
    std::string_view help;
};

/// Indices of parameter_list().
enum ParameterIndex : std::size_t {
    youngs_modulus,
    poisson_ratio,
    mass_damping,
    stiffness_damping,
    density,
    cutting_resistance,
    strength,
    gravity,
    friction,
    time_step,
    cell_size,
    phyxel_spacing,
    parameter_count,
};

std::span<const Parameter> parameter_list();
/// Throws InputError(where, ...) for an unknown name.
std::size_t parameter_index(const std::string& name, const std::string& where);

/// A material out of the literature.
struct Preset {
    std::string_view name;
    double youngs_modulus;  // Pa
    double poisson_ratio;
    double density;             // kg/m^3
    double mass_damping;        // 1/s
    double stiffness_damping;   // s
    double cutting_resistance;  // J/m^2
    double strength;            // Pa; 0: does not tear
    std::string_view source;

    /// Returns the values of the parameters up to strength, in the order of ParameterIndex.
    std::array<double, ParameterIndex::strength + 1> values() const {
        return {youngs_modulus, poisson_ratio,      mass_damping, stiffness_damping,
                density,        cutting_resistance, strength};
    }
};

std::span<const Preset> preset_list();
/// Returns the material that has these values of parameter_list(), within a millionth; null: none.
const Preset* preset_like(std::span<const double> parameters);
/// Throws InputError(where, ...) for an unknown name.
const Preset& preset_of(const std::string& name, const std::string& where);

}  // namespace splitcubes::view
