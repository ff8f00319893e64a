// The bodies of the validation and what theory says about them; SI units.
#pragma once

namespace splitcubes::app::theory {

inline constexpr double density = 1000;   // kg/m^3
inline constexpr double stiffness = 1e6;  // Pa
inline constexpr double poisson = 0.3;

/// A square bar along x, held at x <= 0.
inline constexpr double bar_side = 0.05, bar_length = 0.25, bar_root = 0.05;
inline constexpr double bar_gravity = 0.5, bar_pull = 50;  // m/s^2, across and along the bar
/// The bar of torsion is held again beyond this length and rotated there.
inline constexpr double twisted_length = bar_length - bar_root, twist_degrees = 3;
/// Distance of a notch from the root.
inline constexpr double notch_at = 0.1;

inline constexpr double ball_radius = 0.05, ball_gravity = 500;  // gravity at the surface
/// A compressed ball: each of two plates is nearer to its centre than the radius by this share of it.
inline constexpr double compression = 0.05;

/// A square plate with a slit in its middle; the ends across the slit move apart by a strain.
inline constexpr double plate_side = 0.4, slit_half_length = 0.05, plate_strain = 0.01;

/// Sag of a bar under its weight at a distance from its root, m: Timoshenko's beam.
double sag(double length, double at, double ratio = poisson);

/// Sag that a notch adds at a distance from the root, m: the bar is cut from above to a share of its height,
/// `from` away from its root. The cut adds a rotation of 4 sigma / E V(share) there (Tada, Paris and Irwin,
/// The stress analysis of cracks: edge crack in pure bending). Poisson's ratio is zero, so that plane stress
/// and plane strain agree.
double notch_sag(double share, double length, double from, double at);

/// Displacement along a bar that is pulled by its weight, at a distance from its root, m.
double stretch(double length, double at);

/// Energy of a bar with one end rotated, J: G J angle^2 / 2 L, J = 0.1406 a^4 for a square (Timoshenko and
/// Goodier, Theory of Elasticity, section 109).
double twist_energy(double length);

/// Radial vibration of a free ball, Hz: w R / c_L is the first root of x cot x = 1 - x^2 / (4 k^2), k = c_T /
/// c_L (Lamb 1882).
double breathing_frequency();

/// Displacement towards the centre of a free ball under its own gravity, g r / R, at a radius r, m: rho g R r
/// / (10 (lambda + 2 mu)) ((3 - nu) / (1 + nu) - r^2 / R^2) (Love, A treatise on the mathematical theory of
/// elasticity, section 98).
double shrinkage(double radius);

/// Force of each of two rigid plates without friction on the ball between them, N. The plates approach its
/// centre by d = compression R, where d = 3 (1 - nu^2) F / (4 a E) - F f / (pi E), f = 2 (1 + nu) R^2 / (a^2
/// + 4 R^2)^(3/2) + (1 - nu^2) / (a^2 + 4 R^2)^(1/2), and a^3 = 3 (1 - nu^2) R F / (4 E). The first term is
/// that of Hertz, for a ball as large as its distance from the plate; the second is what the opposite plate
/// adds (Tatara 1991, On compression of rubber elastic sphere over a large range of displacements, part 1).
double compressing_force();

/// Opening of a slit's middle, m: 4 strain a, a being half its length (Tada, Paris and Irwin, The stress
/// analysis of cracks: an infinite plate under plane stress).
double slit_opening();

}  // namespace splitcubes::app::theory
