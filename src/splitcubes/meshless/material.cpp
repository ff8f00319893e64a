#include <splitcubes/core/error.h>
#include <splitcubes/meshless/material.h>

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
    not_negative(material.mass_damping, "mass_damping");
    not_negative(material.stiffness_damping, "stiffness_damping");
    not_negative(material.zero_energy, "zero_energy");
}

}  // namespace splitcubes::meshless
