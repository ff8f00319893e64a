// Weighting kernel of the moving least squares fit.
#pragma once

namespace splitcubes::meshless {

/// Returns the polynomial kernel w(r, h) = 315 / (64 pi h^9) (h^2 - r^2)^3 for r < h,
/// else 0, in 1/m^3, from the squared distance (Mueller et al. 2004, eq. 7).
inline double kernel(double distance_squared, double support_radius) {
    const double h2 = support_radius * support_radius;
    if (distance_squared >= h2) return 0;
    const double rest = 1 - distance_squared / h2;
    return 315 / (64 * 3.14159265358979323846) * rest * rest * rest / (h2 * support_radius);
}

}  // namespace splitcubes::meshless
