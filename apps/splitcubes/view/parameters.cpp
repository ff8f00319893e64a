#include "parameters.h"

#include <splitcubes/core/error.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace splitcubes::view {

namespace {

constexpr std::array<Parameter, parameter_count> parameters = {{
    {"youngs_modulus", "Stiffness", "Pa", 500, 1e8, true, false, "Young's modulus"},
    {"poisson_ratio", "Poisson's ratio", "", 0, 0.499, false, false,
     "0: changes its volume freely; near 0.5: keeps its volume"},
    {"mass_damping", "Motion damping", "1/s", 0, 20, false, false, "Slows all motion, falling too"},
    {"stiffness_damping", "Strain damping", "s", 0, 0.05, false, false, "Slows vibrations"},
    {"density", "Density", "kg/m^3", 50, 5000, true, false, "Mass of a volume at rest"},
    {"cutting_resistance", "Resistance", "J/m^2", 0, 25000, true, false,
     "Fracture toughness: work of a blade for an area that it cuts"},
    {"strength", "Strength", "Pa", 0, 1e7, true, false,
     "Largest principal stress before the material tears; 0: it never tears"},
    {"gravity", "Gravity", "m/s^2", 0, 25, false, false, "Downwards"},
    {"friction", "Friction", "", 0, 1.5, false, false, "Coulomb coefficient of the table and between pieces"},
    {"time_step", "Time step", "s", 1.0 / 480, 1.0 / 24, true, false, "Length of a step"},
    {"cell_size", "Cell size", "m", 0.0005, 0.05, true, true, "Of the grid in which cuts are made"},
    {"phyxel_spacing", "Phyxel spacing", "m", 0.001, 0.1, true, true,
     "Between elastic samples; smaller bends more finely and takes longer"},
}};

// Entries say which quantities a source does not give. Dampings are chosen so that bodies of a decimetre come
// to rest within a second or two.
constexpr std::array<Preset, 5> presets = {{
    {"liver", 1.5e4, 0.45, 1060, 1, 0.006, 164, 2.5e4,
     "Toughness 164 J/m^2 of bovine liver: Gokgol, Basdogan and Canadinc 2012, Med Eng Phys 34:882. "
     "Stiffness, "
     "density and strength: of the usual order for soft organs."},
    {"gelatine", 1.2e4, 0.47, 1030, 0.3, 0.002, 1.1, 6e3,
     "Toughness 1.1 J/m^2 of a 10 % gel cut slowly: Forte et al. 2015, Food Hydrocolloids 46:180. Stiffness "
     "and "
     "strength: of the usual order for such gels."},
    {"bread", 7.5e3, 0.1, 220, 4, 0.01, 20, 3e3,
     "Stiffness 7 to 8 kPa of crumb in tension: review by Scanlon and Zghal 2001, Food Res Int 34:841. "
     "Density, "
     "toughness and strength: of the usual order for white crumb."},
    {"rubber", 2e6, 0.48, 925, 0.5, 0.0005, 2e4, 0,
     "Natural rubber: stiffness 1.5 to 2.5 MPa, density 920 to 930 kg/m^3, toughness from 0.15 to 0.25 MPa "
     "m^1/2: "
     "Ashby, Materials Selection in Mechanical Design, tables of data. It does not tear here."},
    {"cheese", 1.13e5, 0.4, 1080, 2, 0.004, 12, 4.6e4,
     "Mild Cheddar: stiffness 113 kPa and fracture stress 46 kPa in compression: J Nutr Food Sci 2012, "
     "2:136, table "
     "4. Toughness: of the order of wire cutting tests."},
}};

}  // namespace

std::span<const Parameter> parameter_list() {
    return parameters;
}

std::size_t parameter_index(const std::string& name, const std::string& where) {
    for (std::size_t k = 0; k < parameters.size(); ++k)
        if (parameters[k].name == name) return k;
    throw InputError(where, "there is no parameter '" + printable(name) + "'", "see the sliders' names");
}

std::span<const Preset> preset_list() {
    return presets;
}

const Preset* preset_like(std::span<const double> parameters) {
    if (parameters.size() < parameter_count) return nullptr;
    const auto is_near = [](double wanted, double now) {
        return std::abs(now - wanted) <= 1e-6 * std::abs(wanted);
    };
    const auto found = std::find_if(presets.begin(), presets.end(), [&](const Preset& preset) {
        const auto values = preset.values();
        return std::equal(values.begin(), values.end(), parameters.begin(), is_near);
    });
    return found == presets.end() ? nullptr : &*found;
}

const Preset& preset_of(const std::string& name, const std::string& where) {
    std::string all;
    for (const Preset& preset : presets) {
        if (preset.name == name) return preset;
        all += (all.empty() ? "" : ", ") + std::string(preset.name);
    }
    throw InputError(where, "there is no material '" + printable(name) + "'", "use one of: " + all);
}

}  // namespace splitcubes::view
