// Compares the mechanics with linear elasticity for several phyxel spacings.
#pragma once

#include <splitcubes/core/parallel.h>

#include <memory>
#include <string>
#include <vector>

namespace splitcubes::app {

/// A measured value and that of linear elasticity.
struct ValidationPoint {
    std::string test;       // name of the case
    int across = 0;         // phyxels across the thickness
    std::size_t count = 0;  // phyxels
    double measured = 0, expected = 0;
    std::string unit;
    double seen = 0;  // of beams: share of the bending stiffness that the gradients resolve; else 0
    double error() const { return measured / expected - 1; }
};

/// Runs all cases, coarse to fine; about a minute.
std::vector<ValidationPoint> validate_mechanics(const std::shared_ptr<const Parallel>& parallel);

/// Plots |error| over the number of phyxels across, both logarithmic, as SVG.
std::string error_plot(const std::vector<ValidationPoint>& points);

}  // namespace splitcubes::app
