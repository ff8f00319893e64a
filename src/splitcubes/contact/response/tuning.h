#pragma once

/// Tuning constants of contact forces: tolerances, shares, limits and iteration counts that decide about
/// behaviour, accuracy or time, grouped by subject. Each comment gives the unit (none for pure numbers;
/// spacings: mean distances of phyxels), the sensible range and the effect of larger and smaller values.

#include <cstddef>

namespace splitcubes::meshless::tuning {

/// Elements per chunk of parallel loops, 64 to 1024, about ten microseconds of work. Chunks are summed, so
/// rounding follows them, never the number of threads. Larger ones leave threads idle, smaller ones cost
/// scheduling.
namespace grains {

/// Springs or touched phyxels.
inline constexpr std::size_t contact_products = 256;
/// Contact springs.
inline constexpr std::size_t contact_springs = 128;

}  // namespace grains

/// Contact springs of implicit steps (contact_forces.cpp; decision 007). Depenetrations are shares of
/// Contact::max_depenetration.
namespace contact {

/// Ratio of contact stiffness to the stiffness of the touched phyxels, 1 to 10. Larger reduces penetration
/// and slows convergence; smaller lets bodies sink in.
inline constexpr double stiffness_ratio = 2.5;
/// Largest ratio of contact stiffness to the inertia of the pieces that touch, 10 to 1000, unless a load
/// needs more. Larger needs more solves in piles of stiff pieces; smaller lets them sink in.
inline constexpr double inertia_ratio = 50;
/// Overlap of a loaded spring, in depenetrations, 0.25 to 2, above which it is stiffened. Larger lets pieces
/// sink in; smaller stiffens springs for hits.
inline constexpr double stiffening_overlap = 1;
/// Factor of that, above max_stiffness_change. Larger finds the stiffness for a load in fewer steps; smaller
/// nearer.
inline constexpr double stiffening = 5;
/// Factor, above 1: a spring keeps its stiffness unless that of the touched phyxels changes by more. Larger
/// keeps springs that no longer fit; smaller changes loaded springs often, which costs convergence.
inline constexpr double max_stiffness_change = 4;
/// Share of the summed contact force that may violate the contact law at the end of a step, 0.01 to 0.1.
/// Larger leaves wrong forces; smaller costs solves.
inline constexpr double force_slack = 0.03;
/// Share of the summed contact force by which the friction of all sliding contacts together may miss
/// Coulomb's law at the end of a step, 1e-4 to 0.01. Larger stops sliding bodies too soon, as the error has
/// one sign in all steps; smaller costs solves.
inline constexpr double sliding_slack = 0.003;
/// Share of the weight of all that may touch with which deviations of forces are compared at least, 0.01 to
/// 1. Larger leaves wrong forces on what hardly touches; smaller repeats solves for grazing contacts.
inline constexpr double least_weight_share = 0.1;
/// Share of the summed contact force that may violate the laws while offsets of impacts change, force_slack
/// to 1. Larger moves what a solve aims at before the set of contacts is known; smaller costs solves.
inline constexpr double settled_share = 0.3;
/// Penetration in a step, in depenetrations, above which a hit on a collider is solved again with an offset;
/// 0 to 1. Larger lets bodies sink in; smaller solves more often (docs/contact.md, hits).
inline constexpr double impact_share_of_colliders = 0.02;
/// The same between deformable surfaces, where gaps are measured against other faces in each step while
/// bodies roll. Smaller pushes such jumps back: bodies yield in alternate steps and gain energy.
inline constexpr double impact_share_between_bodies = 1;
/// Share of the tolerated penetration that the correction of an impact leaves, 0 to 1. Larger leaves more;
/// near 0 a correction overshoots and is undone in the next solve.
inline constexpr double remaining_share = 0.5;
/// In depenetrations, 0 to 1: maximum overlap that a loaded spring removes in a step. Larger removes overlaps
/// sooner and adds more energy.
inline constexpr double depenetration_share = 0.25;
/// In depenetrations, 0 to 2: overlap with a collider that is not undone. Larger shows, smaller lifts bodies,
/// which adds energy.
inline constexpr double kept_overlap = 1.25;
/// Stretch of the friction spring in the guess, as a multiple of the friction limit, above 1, from which a
/// contact starts out as sliding. Larger starts more sliders as sticking, smaller more sticking contacts as
/// sliding; both cost solves.
inline constexpr double sliding_stretch = 2;
/// Tangent stiffness of a slider over its secant stiffness, 0 to 1. The law says 0, but without any stiffness
/// bodies that slide on all contacts oscillate from solve to solve; larger converges more slowly (decision
/// 007).
inline constexpr double sliding_stiffness_share = 0.5;
/// Approach in a step, in depenetrations, 0 to 1, below which a new contact is resting contact and not an
/// impact. Larger leaves more hits to BDF2, which then adds energy; smaller takes more steps by backward
/// Euler, which damps.
inline constexpr double approach_share = 0.5;
/// Mobility of a contact as a share of that of free sides without shared phyxels, 0.01 to 0.3, below which it
/// does not act. Larger lets surfaces pass each other beside holds and at the end of slits; smaller throws
/// what is pressed on them.
inline constexpr double least_mobility = 0.1;

}  // namespace contact

/// Impulses of explicit steps (contact_impulses.cpp).
namespace impulses {

/// Ratio of contact stiffness to that of the touched phyxels, 0.05 to 0.5. Larger lets undamped bodies
/// vibrate on their support, as stiff springs reflect waves; smaller lets bodies sink in.
inline constexpr double stiffness_ratio = 0.2;
/// Damping of a contact over the critical one of its phyxels' mass on its spring, 0.5 to 2. Values off 1
/// reflect more of the waves that reach a support.
inline constexpr double damping_ratio = 1;
/// In depenetrations, 1 to 5: overlap at which a contact yields no more. Larger lets bodies sink in; smaller
/// lets loaded supports vibrate.
inline constexpr double max_overlap = 2.5;
/// Share of that overlap by which rounding and the end of the iterations miss it, 1e-6 to 0.01.
inline constexpr double limit_slack = 1e-3;
/// Maximum number of Gauss-Seidel iterations in a substep, 10 to 200. Fewer leave approach where many
/// contacts lie on each other, which the next substeps remove; more cost time.
inline constexpr int max_iterations = 50;
/// Share of the impulses of a substep, 1e-5 to 0.01: iterations end when all of their changes together are
/// smaller. Larger lets sticking contacts creep; smaller costs time.
inline constexpr double converged_share = 1e-3;

}  // namespace impulses

/// Polynomial part of the preconditioner of the linear solve (contact_products.cpp; decision 009).
namespace preconditioner {

/// Lower end of the range of eigenvalues of D^-1 (E + C) for which the Chebyshev polynomial of phyxels held
/// by springs is made, 0 to 1. The true bound was 0.09 to 0.11; 0.1 with three iterations saves at most 4 %
/// of the iterations of conjugate gradients.
inline constexpr double min_eigenvalue = 0.2;
/// Its upper end. It must bound the eigenvalues, which D does; with less the polynomial may be indefinite.
inline constexpr double max_eigenvalue = 1;
/// Iterations of that polynomial, 1 to 4. More cost more per iteration of conjugate gradients and need fewer
/// of those.
inline constexpr int chebyshev_iterations = 2;

}  // namespace preconditioner

}  // namespace splitcubes::meshless::tuning
