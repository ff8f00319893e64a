#pragma once

/// Tuning constants of lattices that deform without phyxels.

#include <cstddef>

namespace splitcubes::deformation::tuning {

/// Mass-spring lattice (mass_spring.cpp).
namespace mass_spring {

/// Share of the stability limit of symplectic Euler that a substep takes, 0 to 1. Larger is faster and less
/// damped; near 1 large strains become unstable.
inline constexpr double stability_share = 0.5;
/// Springs or nodes per chunk of a parallel loop, 64 to 4096. Affects time only.
inline constexpr std::size_t spring_grain = 256;

}  // namespace mass_spring

/// Free-form lattice (free_form.cpp).
namespace free_form {

/// Points per chunk of a parallel loop, 64 to 4096. Affects time only.
inline constexpr std::size_t point_grain = 256;

}  // namespace free_form

}  // namespace splitcubes::deformation::tuning
