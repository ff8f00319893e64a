// Implicit time step of the elastic body.
#pragma once

#include <splitcubes/contact/response/contact_forces.h>
#include <splitcubes/dynamics/finite_rotations.h>
#include <splitcubes/dynamics/implicit/aggregates.h>
#include <splitcubes/dynamics/solver_types.h>
#include <splitcubes/dynamics/step_results.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Implicit steps in predictor-corrector form. Predict y without elastic force by BDF2 (b = 2/3 dt), or by
/// backward Euler (b = dt) for phyxels whose history is broken, whose piece is hit in this step, that are
/// held, or that have an inverted neighbour; evaluate the deformation F and its rotation R at y; solve (M/b^2
/// + K) dx = f(y) by conjugate gradients; x = y + dx. If the step newly distorts neighbourhoods, the system
/// is relinearised there and solved again. All state is in Phyxels; this object holds buffers only.
///
/// Conjugate gradients run in single precision (SlicedElasticity) with sums in double. If single precision
/// does not reach the tolerance (stiff bodies that are held), the residual is recomputed in double precision
/// and the iteration restarts from it.
///
/// A stage of TR-BDF2 (TimeIntegrator) is a step of its own: the trapezoidal rule takes the forces at the
/// start of the stage into the prediction, and the second stage is BDF2 for unequal steps.
///
/// Contacts and attachment springs are springs within the solve (contact/response/contact_forces.h),
/// linearised at its start. While their active set or friction changes, further solves follow, each started
/// from the last, and ends where the power of all forces along it vanishes (a line search). A piece that is
/// hit uses backward Euler in this step and the next.
///
/// Rotations are finite: where a piece turns in the prediction or in a solve, the rigid rotation of its
/// displacements is carried out as one, and the system is linearised there. Straight lines would stretch a
/// piece that turns by an angle a by a^2 / 2. A free piece that turns by more than
/// tuning::stages::max_rotation uses backward Euler in this step and the next: BDF2 extrapolates along the
/// chords of two steps.
///
/// Momentum: an unfinished solve changes it, and backward Euler loses angular momentum. Therefore each piece
/// that is neither held nor in contact, and each group of pieces that touch nothing but each other, receives
/// the rigid velocity that restores the linear momentum p + dt m g and the angular momentum about its centre,
/// both divided by 1 + dt mass_damping.
class ImplicitSolver {
  public:
    /// Takes one step. Throws InputError when dt is not positive or an array has a wrong length.
    SolverReport step(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                      const StepInput& input, const SolverOptions& options, const Parallel& parallel);

    /// One of several bodies that are in contact with each other.
    struct Member {
        ImplicitSolver& solver;
        Phyxels& phyxels;
        const Neighbourhoods& neighbourhoods;
        const Material& material;
        const StepInput& input;    // `contacts` is ignored
        SolverReport report = {};  // output
    };
    /// Steps all members in one linear solve. Part k of the contacts is member k; all members use the same
    /// dt. Throws like step.
    static void step_together(std::span<Member> members, const ContactInput& contacts,
                              const SolverOptions& options, const Parallel& parallel);

  private:
    /// Sums over phyxels for the stopping criterion, in the norm of the inverse diagonal.
    struct ToleranceSums {
        // Squares: right side, inertia of the base against the prediction, inertia and gravity forces,
        // and the force of a correction that is rounding.
        double right = 0, base = 0, inertial = 0, rounding = 0;
        ToleranceSums& operator+=(const ToleranceSums& other) {
            right += other.right;
            base += other.base;
            inertial += other.inertial;
            rounding += other.rounding;
            return *this;
        }
    };
    /// Arguments of a step.
    struct Job {
        Phyxels& phyxels;
        const Neighbourhoods& neighbourhoods;
        const Material& material;
        const StepInput& input;
        const SolverOptions& options;
        const Parallel& parallel;
    };
    struct Group;
    /// The gap that opens between held and free phyxels of a piece if these follow the guess.
    struct HoldGap {
        Vec3 force = Vec3::Zero();  // N, of the links
        double stiffness = 0;       // N/m, of the links
        double inertia = 0;         // N/m, of the free phyxels
        double change = 0;          // m, by which accelerations of the hold move it, at most
    };
    /// Lazily created group buffers. Copies are empty, since the buffers hold no state.
    class GroupBuffer {
      public:
        GroupBuffer();
        GroupBuffer(const GroupBuffer& other);
        GroupBuffer& operator=(const GroupBuffer& other);
        ~GroupBuffer();
        Group& get();

      private:
        std::unique_ptr<Group> group_;
    };
    void mark_far_turns(const Job& job);
    void mark_hits(const Job& job, const ContactInput& contacts, std::span<const std::uint8_t> impact,
                   std::uint32_t part);
    void mark_force_jumps(const Job& job, const ContactForces& forces, const ContactInput& contacts,
                          std::uint32_t part);
    void mark_restrained(const Job& job, const ContactInput& contacts, std::uint32_t part);
    void prepare(const Job& job);
    void place_at_solution(const Job& job);
    void update_phyxels(const Job& job);
    void bind_pieces(const Job& job, const ContactInput& contacts, std::uint32_t part);
    void finish(const Job& job);
    double energy_of_motion(const Job& job);
    void turn_prediction(const Job& job);
    void straighten_velocities(const Job& job);
    double weight_of_pieces(const Job& job, std::span<const std::uint32_t> of);
    void sum_piece_masses(const Job& job);
    double work_along_solve(const Job& job, std::span<const Vec3> r);
    static void restore_shared(Group& group, const ContactInput& contacts);
    void size_buffers(std::size_t count);
    void find_step_conditions(const Job& job);
    void predict(const Job& job);
    void find_start_accelerations(const Job& job);
    static bool has_history(const Job& job);
    static double history_divisor(const Job& job);
    static double second_order_step(const Job& job);
    void linearise(const Job& job);
    bool has_new_distortion(const Job& job);
    void compute_rhs(const Job& job);
    void choose_step_size(const Job& job, std::size_t i);
    void predict_phyxel(const Job& job, std::size_t i);
    void guess_acceleration(const Job& job, std::size_t i);
    void start_guess(const Job& job);
    void follow_holds(const Job& job);
    bool is_jerked(const Job& job) const;
    void add_gap(const Job& job, std::size_t i, HoldGap& gap) const;
    static bool has_high_acceleration(const Job& job, const Vec3& acceleration_less_gravity);
    void smooth_high_accelerations(const Job& job);
    double wanted_residual(const Job& job, double tolerance);
    bool is_at_base(const Job& job);
    void stiffness_times_solution(const Job& job, bool exact);
    double squared_norm(const Job& job, std::span<const Vec3> of);
    double residual_at_base(const Job& job);
    double residual_from_product(const Job& job, bool exact, double& noise);
    void load_residual(const Job& job);
    void add_correction(const Job& job);
    void compute_aggregate_weights(const Job& job);
    template <class Chunk>
    double sum_slices(const Job& job, const Chunk& chunk) {
        return slice_sum_(job.parallel, elastic_.slice_count(), slice_grain(elastic_.slice_count()),
                          [&](std::size_t begin, std::size_t end) {
                              return chunk(SliceRange{begin, end});
                          });
    }
    void filter();
    double damping_ratio(const Job& job) const;
    void finish_phyxel(const Job& job, std::size_t i);
    std::size_t piece_of(const Job& job, std::size_t i) const;
    Vec3 filtered(std::size_t i, const Vec3& force) const;

    /// Linear system (M/b^2 + K) d = rhs and its diagonals, per phyxel.
    struct System {
        std::vector<double> b;         // s, effective time step
        std::vector<double> diagonal;  // N/m, (1 + b mass_damping) m / b^2
        std::vector<double> mobility;  // m/N, inverse diagonal of the system without contacts
        std::vector<double> inverse;   // m/N, inverse diagonal with contacts
        std::vector<Vec3> base;        // m, world: where the system is linearised
        std::vector<Vec3> rhs;         // N
    };
    /// Motion without elastic force, per phyxel.
    struct Prediction {
        std::vector<Vec3> position;        // m, y
        std::vector<Vec3> velocity;        // m/s
        std::vector<Vec3> start_position;  // m, before the step
        std::vector<Vec3> start_velocity;  // m/s, before the step
        // m/s^2, without gravity, before the step; of trapezoidal stages.
        std::vector<Vec3> start_acceleration;
        std::vector<HoldGap> gaps;  // per piece, and one for phyxels without a piece
    };
    /// System in double precision, for residuals beyond single precision.
    struct ExactSystem {
        ElasticForces forces;
        std::vector<Mat3> deformation, rotation;  // per phyxel, at system_.base
        bool is_linearised = false;               // forces are linearised at system_.base
    };
    /// Vectors of the solve, per phyxel.
    struct Vectors {
        std::vector<Vec3> d;  // m, solution: x - system_.base
        std::vector<Vec3> r;  // N, residual
        std::vector<Vec3> p;  // scratch: positions or accelerations
        std::vector<Vec3> q;  // N, product A d
    };
    /// Solution and residual before the last solve, per phyxel.
    struct Kept {
        std::vector<Vec3> d;  // m
        std::vector<Vec3> r;  // N
    };
    /// Buffers of conjugate gradients, in single precision.
    struct ConjugateGradients {
        FloatArray d, r, p, q;  // row arrays of 3: correction of vectors_.d, residual, direction p, A p
        FloatArray diagonal, inverse;            // those of system_ as row arrays
        std::vector<std::uint32_t> constrained;  // held phyxels
    };
    /// Flags that the time integration of phyxels and pieces depends on.
    struct Conditions {
        std::vector<std::uint8_t> inverted;  // per phyxel, det F <= 0 before the step
        bool any_inverted = false;
        bool is_turned = false;             // a piece turned in this step
        std::vector<std::uint8_t> held;     // per phyxel
        std::vector<std::uint8_t> skipped;  // per phyxel, its piece keeps its velocities
        std::vector<std::uint8_t> failed;   // per phyxel, went non-finite in this step
        // Per piece, and one for phyxels without a piece:
        std::vector<std::uint8_t> hit;         // hit in this step
        std::vector<std::uint8_t> turns_far;   // free, and turns too far for BDF2
        std::vector<std::uint8_t> supported;   // held, or in contact in the previous step
        std::vector<std::uint8_t> restrained;  // held or pulled by a handle
        std::vector<std::uint8_t> near;        // may touch something
        std::vector<double> piece_mass;        // kg; infinite if it is held
    };
    /// Smoothing of high accelerations in the initial guess.
    struct Smoothing {
        std::vector<std::uint8_t> high_acceleration;  // per phyxel, acceleration is to be smoothed
        std::vector<std::uint32_t> phyxels;           // indices of these phyxels
    };
    /// State of the check whether a solve distorts neighbourhoods.
    struct Relinearisation {
        std::vector<std::uint8_t> undistorted;  // per phyxel, not distorted at system_.base
        bool has_solution_state = false;        // elastic_ holds the state at vectors_.p, the solution
    };
    /// Contributions of contacts and attachment springs to the system, per phyxel.
    struct Springs {
        std::vector<Vec3> force;        // N, at system_.base
        std::vector<double> stiffness;  // N/m
    };
    /// Changes of contact forces that break the history of a piece, per piece.
    struct ForceJumps {
        std::vector<Vec3> change;        // N, of the contact force since the previous step
        std::vector<double> piece_mass;  // kg
    };

    SlicedElasticity elastic_;
    Aggregates aggregates_;
    ExactSystem exact_;
    StateDescriber describe_;
    ChunkSum sum_;
    ChunkSumOf<double> slice_sum_;
    ChunkSumOf<ToleranceSums> wanted_sum_;
    System system_;
    Prediction prediction_;
    Vectors vectors_;
    Kept kept_;
    ConjugateGradients cg_;
    Conditions conditions_;
    Smoothing smoothing_;
    Relinearisation relinearisation_;
    Springs springs_;
    ForceJumps force_jumps_;
    MomentumKeeper momenta_;
    FiniteRotations rotations_;
    ContactForces contacts_;
    GroupBuffer group_;  // used by the first member of a group
    SolverReport report_;
};

}  // namespace splitcubes::meshless
