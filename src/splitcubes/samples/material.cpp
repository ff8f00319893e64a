#include <splitcubes/core/error.h>
#include <splitcubes/samples/material.h>

#include <cmath>
#include <sstream>

namespace splitcubes::meshless {

namespace {

void require(bool good, const std::string& where, double value, const std::string& remedy) {
    if (good) return;
    std::ostringstream problem;
    problem << "cannot be " << value;
    throw InputError(where, problem.str(), remedy);
}

}  // namespace

double max_plastic_strain(MaterialModel model) {
    // Below the strain at zero length: 1/2 for Green's strain, 1 for S - I.
    return model == MaterialModel::st_venant_kirchhoff ? 0.45 : 0.9;
}

void check_material(const Material& material, const std::string& where) {
    const auto positive = [&](double value, const char* name) {
        require(std::isfinite(value) && value > 0, where + "." + name, value, "give a positive number");
    };
    const auto not_negative = [&](double value, const char* name) {
        require(std::isfinite(value) && value >= 0, where + "." + name, value, "give zero or more");
    };
    positive(material.density, "density");
    positive(material.youngs_modulus, "youngs_modulus");
    const double nu = material.poisson_ratio;
    require(nu >= 0 && nu < 0.5, where + ".poisson_ratio", nu,
            "give a number from 0 to below 0.5 (0.49 is nearly incompressible)");
    not_negative(material.volume_stiffness, "volume_stiffness");
    not_negative(material.mass_damping, "mass_damping");
    not_negative(material.stiffness_damping, "stiffness_damping");
    not_negative(material.zero_energy, "zero_energy");
    if (!material.plasticity) return;
    const Plasticity& plasticity = *material.plasticity;
    positive(plasticity.yield, "plasticity.yield");
    require(plasticity.creep > 0, where + ".plasticity.creep", plasticity.creep, "give a positive number");
    const double largest = max_plastic_strain(material.model);
    require(plasticity.maximum > 0 && plasticity.maximum <= largest, where + ".plasticity.maximum",
            plasticity.maximum,
            "give a positive number up to " + std::string(largest < 0.9 ? "0.45" : "0.9") +
                ", the most for this material model");
}

}  // namespace splitcubes::meshless
