#pragma once

/// Tuning constants of time integration: tolerances, shares, limits and iteration counts that decide about
/// behaviour, accuracy or time, grouped by subject. Each comment gives the unit (none for pure numbers;
/// spacings: mean distances of phyxels), the sensible range and the effect of larger and smaller values.

#include <array>
#include <cstddef>
#include <limits>

namespace splitcubes::meshless::tuning {

/// Elements per chunk of parallel loops. Results do not depend on them. Larger ones leave threads idle,
/// smaller ones cost scheduling.
namespace grains {

/// Aggregates, 1 to 64. Few, as coarse aggregates have many phyxels.
inline constexpr std::size_t aggregates = 8;
/// Blocks of BlockJacobi, 1 to 64. Larger balances threads worse; smaller costs scheduling.
inline constexpr std::size_t blocks = 16;

}  // namespace grains

/// Passes of solve and revision of contacts in an implicit step (implicit/contact_step.cpp; decisions
/// 007, 008 and 010).
namespace passes {

/// Maximum number of revisions of the contacts between two linearisations, 6 to 20. More cost time where
/// contacts keep changing; fewer leave wrong contacts.
inline constexpr int max_passes = 14;
/// Last of these revisions, 1 to 4, after which solves go to the full tolerance whatever changes. More cost
/// iterations; fewer leave large residuals where contacts keep changing.
inline constexpr int tight_passes = 4;
/// Maximum number of relinearisations because pieces turned, 3 to 12. More cost solves; fewer leave pieces
/// that are stretched by turning.
inline constexpr int max_turns = 8;
/// Elastic energy of the stretch by turning, as a share of the energy of motion, 1e-4 to 0.01, above which
/// the system is linearised again. Larger adds energy in hits of stiff bodies; smaller costs solves.
inline constexpr double stretch_share = 1e-3;
/// Maximum number of relinearisations of a step that distorts neighbourhoods, 1 to 5. More cost solves; fewer
/// leave neighbourhoods that grew by rotating far.
inline constexpr int max_relinearisations = 3;
/// Relinearisations of a step whose hold jerks material with another tangent than the derivative of its
/// forces, 1 or 2. None leaves spurious strain; more gain nothing.
inline constexpr int solves_after_jerks = 1;
/// Change of the contact force on a piece, as displacement in a step over max_depenetration, above which the
/// piece leaves BDF2 for a step; about 1. Larger keeps BDF2 past changes, which adds energy; smaller damps
/// more by backward Euler (decision 008).
inline constexpr double force_jump = 2;
/// Factor on the tolerance while contacts still change; it undoes solve::contact_tolerance_share. Larger may
/// find wrong contacts; smaller costs iterations.
inline constexpr double early_tolerance_factor = 100;

}  // namespace passes

/// Line search after solves that follow a revision of contacts (implicit/contact_solve.cpp).
namespace search {

/// Power at the end of a solve as a share of that at its start, 0.01 to 0.5, that ends it as it is. Larger
/// keeps solves that contacts would stop; smaller searches in vain.
inline constexpr double enough = 0.1;
/// Maximum number of bisections, 10 to 30.
inline constexpr int bisections = 20;

}  // namespace search

/// Begin and end of conjugate gradients (implicit/linear_solve.cpp, implicit/implicit_solver.cpp;
/// docs/algorithms/elastic-solve.md, decision 010).
namespace solve {

/// Share of the target squared residual that rounding may reach before the residual is computed in double
/// precision, 0 to 1. Larger ends solves on noise; smaller costs products in double precision.
inline constexpr double noise_share = 0.1;
/// Factor on the tolerance of groups with contacts, 0.001 to 1. Larger lets resting bodies rock; smaller
/// costs iterations.
inline constexpr double contact_tolerance_share = 0.01;
/// Share of its largest value at which a residual may end a solve early, 1e-3 to 0.1: when a cut leaves a
/// large one, small rocking does not matter. Larger saves iterations and leaves larger errors (tables of
/// decision 010).
inline constexpr double fall_share = 1e-2;
/// Multiple of the tolerance that such an early end without contacts never exceeds, above 1. Larger saves
/// iterations while cutting; errors grow by about as much.
inline constexpr double max_loose_factor = 10;
/// Share of its initial residual at which the first solve of a step may end while contacts change, 0.01 to
/// 0.5: it only has to find the active contacts. Larger finds wrong ones; smaller costs iterations (decision
/// 010).
inline constexpr double first_early_share = 0.2;
/// The same for later solves of a step.
inline constexpr double early_share = 0.1;
/// Share of the diagonal that is added to the blocks of BlockJacobi, 1e-6 to 1e-4: single precision cannot
/// tell rigid motions of stiff blocks from none; RigidModes solves for them. Larger makes the blocks less
/// exact; smaller loses blocks to rounding.
inline constexpr float block_shift = 1e-5F;
/// Relative change of the spring stiffness, 0 to 1, above which aggregates are weighed again. Larger makes
/// the coarse correction fit less, which costs iterations; smaller costs weighings.
inline constexpr double reweighing_share = 0.1;
/// Iterations with rigid modes in a step, per phyxel in the mean aggregate, 0.1 to 2, after which aggregates
/// are solved exactly. Larger iterates longer in stiff slivers; smaller factorises where few iterations would
/// do.
inline constexpr double iterations_per_block_size = 0.5;
/// Factor by which a squared residual may fall, 1e-13 to 1e-8, before single precision is exhausted and the
/// residual is recomputed in double precision. Smaller iterates on noise; larger recomputes more often.
inline constexpr double single_precision_share = 1e-11;
/// Iterations after which a solve goes on with the rigid modes of the aggregates, 5 to 100. Fewer build modes
/// for systems that hardly need them; more iterate in vain.
inline constexpr int iterations_without_modes = 15;
/// Additional such iterations per aggregate, 0.1 to 1, as the factorisation of more aggregates takes longer.
/// Fewer and more: as above.
inline constexpr double iterations_per_aggregate = 0.25;
/// Steps after a slow one that begin with rigid modes, 10 to 100. Fewer try more often in vain without; more
/// keep to them where nothing is slow any more.
inline constexpr int steps_with_modes = 30;
/// Maximum number of restarts of a solve from a residual in double precision, 1 to 10. More serve tolerances
/// below 1e-10 only.
inline constexpr int max_refinements = 4;
/// Displacement, in support radii, 1e-12 to 1e-8: smaller corrections are rounding errors, and the solve
/// stops there.
inline constexpr double smallest_correction = 1e-10;
/// Relative rounding error of A d in single precision, 1e-7 to 1e-5. Larger computes residuals in double
/// precision more often; smaller trusts noise.
inline constexpr double rounding_share = 1e-6;

}  // namespace solve

/// Guess and linearisation of implicit steps (implicit/implicit_solver.cpp; decision 010).
namespace guess {

/// Displacement in a step, in support radii, 0.05 to 0.5, above which neighbourhoods are checked for
/// distortion: they may have turned too far for the linearisation. Larger misses distortions; smaller costs
/// checks.
inline constexpr double distortion_check_share = 0.2;
/// Acceleration in the guess, in multiples of gravity, above which it is smoothed; 1 to 10. Larger leaves the
/// swing of material that a cut freed, which tears neighbourhoods apart; smaller blurs good guesses.
inline constexpr double smoothing_threshold = 2;
/// rad, rotation of a piece in a step, 1e-3 to 0.05, from which the displacements of its prediction are
/// carried out as a finite rotation. Larger solves for the stretch in place of that; smaller costs time for
/// nothing.
inline constexpr double min_rotation = 0.005;
/// Weight of the phyxel itself in a smoothing pass, 0 to 1; the rest is its neighbours' mean. Larger smooths
/// less.
inline constexpr double smoothing_own_weight = 0.25;

/// Displacement of a hold by a change of its velocity, in support radii, 0.002 to 0.05, above which it jerks
/// what it holds. Larger leaves spurious strain; smaller costs solves.
inline constexpr double jerk_share = 0.01;

}  // namespace guess

/// Aggregates, the coarse part of the preconditioner of the linear solve (implicit/aggregates.cpp; decision
/// 009).
namespace preconditioner {

/// Ratio of the maximum box sizes of consecutive levels of aggregates, 2 to 16. Larger has fewer levels,
/// which miss waves of sizes in between; smaller costs time per iteration. The first level has
/// Aggregates::max_box_size.
inline constexpr std::size_t level_growth = 8;
/// Factor on the corrections of all levels, 0.5 to 1, where it matters little. Levels overlap, so
/// under-relaxation needs fewer iterations.
inline constexpr double relaxation = 0.7;

}  // namespace preconditioner

/// TR-BDF2 (time_integrator.cpp; decision 019).
namespace stages {

/// rad, rotation of a piece in a step, 0.1 to 1, above which its body takes substeps where nothing touches,
/// and BDF2 in place of the trapezoidal rule. Larger strains what rotates and lets its energy drift; smaller
/// costs substeps.
inline constexpr double max_rotation = 0.4;
/// rad, rotation in such a substep, 0.1 to max_rotation. Smaller drifts less and costs substeps.
inline constexpr double substep_rotation = 0.25;
/// Maximum number of these substeps, 2 to 16: a piece that rotates by more loses energy to the guard.
inline constexpr double max_rotation_substeps = 4;

}  // namespace stages

/// Energy budget of a step and the repair of excesses (energy_guard.cpp, time_integrator.cpp).
namespace energy {

/// Strain of a whole piece that single precision cannot tell from zero, 1e-6 to 1e-4; its energy is
/// tolerated. Larger lets that energy in; smaller repeats steps because of rounding.
inline constexpr double noise_strain = 1e-5;
/// Share of the kinetic energy by which rounding and the unfinished solve may exceed the budget, 1e-4 to
/// 1e-2. Larger lets moving pieces gain energy; smaller repeats steps.
inline constexpr double motion_share = 1e-3;
/// Relative change of momentum above which a piece counts as pushed, 1e-8 to 1e-4. Larger takes weak pushes
/// for none, and the work that they did for an error; smaller takes rounding for pushes.
inline constexpr double push_share = 1e-6;
/// Share of the budget by which the elastic energy may exceed it before the step is repeated, 0 to 0.2:
/// unfinished solves leave less, and later steps make up for it. Larger lets energy in; smaller repeats
/// steps.
inline constexpr double excess_strain_share = 0.05;
/// Relative difference of the displacements of held phyxels that counts as rounding, 1e-8 to 1e-4: below it
/// the work of the hold follows from momentum.
inline constexpr double same_displacement_share = 1e-6;
/// Maximum number of halvings of the deformation of a step, 1 to 10; then all of it is removed. More keep
/// more of the deformation and cost time.
inline constexpr int max_halvings = 4;
/// Elastic energy that a piece may always keep, as a share above that before the step, 0 to 0.2. Larger lets
/// energy in; smaller repeats steps where a cut added energy that finer steps do not remove.
inline constexpr double strain_slack = 0.05;
/// Relative uncertainty of a contact's work when computed from its force at the end of the step, 0 to 0.1.
/// Larger lets contacts add energy; smaller repeats steps with contacts.
inline constexpr double work_slack = 0.02;
/// By how much the energy of a piece may exceed the budget of a step, and what of it is kept.
struct Tolerance {
    double elastic_share;       // of the elastic energy, above the budget
    double reserve_kept;        // share of the unspent budget that the next step has, of pieces that touch
    double apart_reserve_kept;  // of pieces that touch nothing
    double repeat_share;        // of the budget, excess from which the step is repeated
};
/// Implicit steps. A larger elastic_share (0 to 0.1) lets energy in; a smaller one repeats steps. Contacts do
/// their work at other times than the forces that are known of them, so pieces that touch have a reserve.
/// Others have none: the schemes damp, and what they lost would come back as an error. A larger repeat_share
/// (0.001 to 0.1) leaves excesses to the guard, which damps; a smaller one costs substeps.
inline constexpr Tolerance implicit_tolerance{0.02, 0.9, 0, 0.01};
/// Explicit steps: the energy of a mode near the stability limit of leapfrog oscillates by the elastic share.
/// A larger reserve (0 to 1) lets oscillating errors pass longer; a smaller one damps pieces whose error
/// would reverse by itself. Steps are repeated for excess strain only.
inline constexpr Tolerance explicit_tolerance{0.25, 0.9, 0.9, std::numeric_limits<double>::infinity()};
/// Numbers of substeps that are tried in turn when an implicit step exceeds its budget, ascending. More and
/// larger ones cost time; fewer leave the excess to the guard, which damps.
inline constexpr std::array<int, 3> implicit_divisions = {1, 2, 4};
/// Factors on the number of substeps that are tried in turn when an explicit step exceeds its budget,
/// ascending.
inline constexpr std::array<int, 3> explicit_divisions = {2, 4, 8};
/// Additional Newton iterations of a repeated step, 1 to 4. More cost solves; fewer leave the error that made
/// the step exceed its budget.
inline constexpr int further_newton_solves = 2;

}  // namespace energy

/// Relaxation of what a cut adds to the elastic energy (cut_relaxation.cpp).
namespace relaxation {

/// Share of the elastic energy of a piece that a cut may add, 1e-5 to 1e-2. Larger lets energy in; smaller
/// costs time where rounding or hardly any energy is relaxed.
inline constexpr double tolerance = 1e-3;
/// Maximum number of linearisations of the energy, 4 to 20. Fewer leave energy where strains are large; more
/// cost time.
inline constexpr int max_rounds = 12;
/// Maximum number of iterations of conjugate gradients for each, 4 to 8: without a preconditioner, more let
/// the rounding of single precision grow by orders of magnitude; fewer linearise more often.
inline constexpr int max_iterations = 6;
/// Halvings of a displacement that raised the energy, 1 to 5, before the piece is given up. Fewer give up
/// early; more cost time.
inline constexpr int max_halvings = 3;
/// Weight of no rotation beside the links that join a group to its piece again, 0.001 to 0.1: decides where
/// links along one line leave the rotation open. Larger leaves groups turned.
inline constexpr double open_rotation = 0.01;

}  // namespace relaxation

/// Substeps of explicit steps (explicit_solver.cpp).
namespace explicit_steps {

/// Substep size as a share of the stability limit, 0 to 1: the one that is chosen, and the range in which the
/// number of substeps is kept, since leapfrog gains energy if steps keep changing. Larger is faster; near 1
/// substeps become unstable, as the largest frequency is estimated from below.
struct Margin {
    double chosen, min, max;
};
/// Plain corotated material, whose frequency does not grow.
inline constexpr Margin steady_margin{0.6, 0.45, 0.7};
/// All other materials.
inline constexpr Margin growing_margin{0.5, 0.35, 0.65};
/// Iterations of the power method for the largest frequency from the initial guess, 8 to 50. More get closer
/// to it; fewer underestimate it, so the margins above must be smaller.
inline constexpr int first_power_iterations = 16;
/// Iterations of the power method for updates within a step, 1 to 16.
inline constexpr int further_power_iterations = 4;
/// Substeps after which a stiffness that depends on stretch is estimated again, 1 to 50. More miss growth;
/// fewer cost time.
inline constexpr int substeps_between_estimates = 8;
/// Growth factor of the largest |F|^2, above 1, after which it is estimated again at once.
inline constexpr double growth_between_estimates = 1.15;
/// Maximum number of substeps per step, 500 to 2000: bodies that need more take the step implicitly. Larger
/// lets steps take seconds; an implicit step costs as much as a few hundred substeps.
inline constexpr int max_substeps_per_step = 1000;
/// Minimum mass that a phyxel moves with, as a share of the mean mass, 0 to 0.2. Larger allows longer
/// substeps and distorts the motion of light phyxels more.
inline constexpr double min_mass_share = 0.02;
/// Largest ratio of stiffness to mass of a phyxel, relative to the median of its body, 3 to 30; phyxels above
/// it move with more mass. Smaller allows longer substeps and distorts the motion of small fragments.
inline constexpr double max_stiffness_ratio = 8;

}  // namespace explicit_steps

/// Rigid pieces near obstacles (rigid_step.cpp).
namespace rigid {

/// rad, maximum rotation per substep of a piece near obstacles, 0.02 to 0.3. Smaller follows contact points
/// on arcs better and costs time.
inline constexpr double max_contact_substep_rotation = 0.1;
/// Maximum number of these substeps in a step. Fewer let points of fast pieces pass through thin obstacles.
inline constexpr int max_contact_substeps = 256;
/// Maximum number of substeps of free rotation in a step near obstacles; a faster piece precesses without
/// nutation.
inline constexpr int max_rotation_substeps = 4096;
/// Maximum number of Gauss-Seidel iterations over the contacts of a substep, 10 to 100. Fewer leave pieces
/// sinking in where several contacts act.
inline constexpr int max_impulse_iterations = 40;
/// Share of the speed that gravity adds in a substep below which a touching piece rests, 0 to 0.1. Larger
/// stops slow sliding; smaller lets pieces tremble.
inline constexpr double resting_share = 0.02;
/// Share of an initial penetration that is removed per step, 0 to 1. Larger frees pieces sooner, visibly
/// jumping; smaller later.
inline constexpr double penetration_correction_share = 1;

}  // namespace rigid

}  // namespace splitcubes::meshless::tuning
