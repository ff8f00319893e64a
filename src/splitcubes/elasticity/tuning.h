#pragma once

/// Tuning constants of elasticity: limits and iteration counts that decide about behaviour, accuracy or time,
/// grouped by subject. Each comment gives the unit (none for pure numbers), the sensible range and the effect
/// of larger and smaller values.

#include <cstddef>

namespace splitcubes::meshless::tuning {

/// Strongly compressed material (constitutive.cpp).
namespace constitutive {

/// Lower bound of the principal stretches in a tangent's frame, 0.6 to 0.9: the compressive force of St.
/// Venant-Kirchhoff is largest at a stretch of 0.58 and falls below it. Larger makes the tangent stiffer than
/// the material, smaller indefinite.
inline constexpr double min_stretch = 0.7;
/// Principal stretch, 0.58 to 0.7, below which Green's strain is continued by its tangent: the compressive
/// force of St. Venant-Kirchhoff falls below 0.58, and inside out it rests. Larger changes more of the law;
/// smaller lets crushed material collapse.
inline constexpr double min_green_stretch = 0.6;
/// Lower bound of the sum of two principal stretches in a plastic stress, above 0 and far below 2. Smaller
/// lets the stress of crushed material grow without bound; larger softens compressed material.
inline constexpr double min_stretch_sum = 0.2;
/// |F - R|^2, 1, above which a neighbourhood is far from any lasting state, unless it is taut. Lower:
/// material that stretches far converges more slowly; higher: fragments that a contact flips may grow.
inline constexpr double far_from_rest = 0.5;
/// Sum of the three twists over mu, 1, above which a neighbourhood is taut.
inline constexpr double taut_twist = 0.25;

}  // namespace constitutive

/// Pressures that are shown (pressure.cpp).
namespace pressure {

/// Means over neighbourhoods, one after the other, 1 to 3. More smooth the pressure at the surface away;
/// fewer leave the scatter of nearly incompressible material.
inline constexpr int rounds = 2;

}  // namespace pressure

/// Elasticity in single precision over slices of links (simd/slice_kernels.cpp, simd/sliced_elasticity.cpp).
namespace links {

/// m, clamp of displacement components: squares of larger ones would overflow in single precision.
inline constexpr double max_displacement = 1e15;
/// |X^T X - I|^2 above which Newton-Schulz is not used, below 1, where it stops converging. Smaller leaves
/// more rotations to the polar decomposition, which costs time.
inline constexpr float far_from_rotation = 0.5F;
/// |X^T X - I|^2 below which one more step is exact in single precision. Larger leaves errors; smaller costs
/// steps.
inline constexpr float near_rotation = 8e-8F;
/// Maximum number of Newton-Schulz steps, 4 to 12; what does not converge is left to the polar decomposition.
inline constexpr int max_rotation_steps = 8;
/// Sweeps of Jacobi's method for the axes of a strain: a symmetric 3x3 matrix needs four for single
/// precision.
inline constexpr int jacobi_sweeps = 4;
/// Floats, at least a page (1024), as hardware prefetchers stop at page boundaries. Affects time only.
inline constexpr std::size_t prefetch_distance = 2048;
/// Phyxels of which the mean rotation is taken, 16 to 256: more cost time, fewer follow a bent body less
/// well.
inline constexpr std::size_t frame_samples = 64;

}  // namespace links

}  // namespace splitcubes::meshless::tuning
