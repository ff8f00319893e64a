#include "validation_theory.h"

#include <cmath>
#include <numbers>

namespace splitcubes::app::theory {

namespace {

constexpr double lambda_2mu = stiffness * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson));

}  // namespace

double sag(double length, double at, double ratio) {
    const double load = density * bar_gravity * bar_side * bar_side;  // N/m
    const double bending = stiffness * std::pow(bar_side, 4) / 12;
    const double shear = 5.0 / 6 * stiffness / (2 * (1 + ratio)) * bar_side * bar_side;
    return load / (24 * bending) *
               (std::pow(at, 4) - 4 * length * std::pow(at, 3) + 6 * length * length * at * at) +
           load / shear * (length * at - 0.5 * at * at);
}

double notch_sag(double share, double length, double from, double at) {
    const double moment =
        0.5 * density * bar_gravity * bar_side * bar_side * (length - from) * (length - from);
    const double sigma = 6 * moment / std::pow(bar_side, 3);
    const double v =
        std::pow(share / (1 - share), 2) * (5.93 - 19.69 * share + 37.14 * std::pow(share, 2) -
                                            35.84 * std::pow(share, 3) + 13.12 * std::pow(share, 4));
    return 4 * sigma / stiffness * v * (at - from);
}

double stretch(double length, double at) {
    return density * bar_pull / stiffness * (length * at - 0.5 * at * at);
}

double twist_energy(double length) {
    const double shear = stiffness / (2 * (1 + poisson)), angle = twist_degrees * std::numbers::pi / 180;
    return shear * 0.1406 * std::pow(bar_side, 4) * angle * angle / (2 * length);
}

double breathing_frequency() {
    const double k2 = (1 - 2 * poisson) / (2 * (1 - poisson));
    double low = 0.1, high = 3.1;  // brackets the first root for any k
    for (int k = 0; k < 60; ++k) {
        const double x = 0.5 * (low + high);
        (x / std::tan(x) - 1 + x * x / (4 * k2) > 0 ? low : high) = x;
    }
    return low * std::sqrt(lambda_2mu / density) / ball_radius / (2 * std::numbers::pi);
}

double shrinkage(double radius) {
    const double share = radius / ball_radius;
    return density * ball_gravity * ball_radius * radius / (10 * lambda_2mu) *
           ((3 - poisson) / (1 + poisson) - share * share);
}

double compressing_force() {
    const double one = 1 - poisson * poisson, depth = compression * ball_radius;
    const auto approach = [&](double force) {
        const double radius =
            std::cbrt(3 * one * ball_radius * force / (4 * stiffness));  // of the contact, m
        const double far = radius * radius + 4 * ball_radius * ball_radius;
        const double opposite =
            2 * (1 + poisson) * ball_radius * ball_radius / std::pow(far, 1.5) + one / std::sqrt(far);
        return 3 * one * force / (4 * radius * stiffness) - force * opposite / (std::numbers::pi * stiffness);
    };
    const double hertz =
        4.0 / 3 * stiffness / one * std::sqrt(ball_radius) * std::pow(depth, 1.5);  // a lower bound
    double low = hertz, high = 2 * hertz;
    for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (low + high);
        (approach(middle) < depth ? low : high) = middle;
    }
    return low;
}

double slit_opening() {
    return 4 * plate_strain * slit_half_length;
}

}  // namespace splitcubes::app::theory
