// Pressure of the phyxels.
#pragma once

#include <splitcubes/samples/neighbourhoods.h>

#include <span>

namespace splitcubes::meshless {

/// Replaces a value of each phyxel, such as its pressure, by the mean over its neighbourhood, itself
/// included, by volume and weight; some rounds. Pressures of nearly incompressible material scatter from
/// phyxel to phyxel about those of the body, as each has its own constraint on volume; the means do not.
/// Values across a cut do not mix.
void average_over_neighbourhoods(const Neighbourhoods& neighbourhoods, std::span<const double> support_radius,
                                 std::span<double> values);

}  // namespace splitcubes::meshless
