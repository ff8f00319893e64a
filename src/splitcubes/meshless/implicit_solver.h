// One time step of the elastic body: implicit, predict and correct.
#pragma once

#include <splitcubes/meshless/aggregates.h>
#include <splitcubes/meshless/contact_forces.h>
#include <splitcubes/meshless/solver_types.h>
#include <splitcubes/meshless/step_results.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Implicit steps in predict-correct form. Predict y without elastic force by
/// BDF2 (b = 2/3 dt), or backward Euler (b = dt) for phyxels whose history is
/// broken, whose piece is hit in this step, that are held or lie beside an inverted one; take F
/// and R at y; solve (M/b^2 + K) dx = f(y) by conjugate gradients; x = y + dx. Where that
/// tears what was whole, once more from there. All state is in Phyxels, the
/// object holds buffers only.
///
/// Conjugate gradients run in single precision (SlicedElasticity) with sums in double.
/// Where single precision does not carry to the tolerance, which is so of stiff bodies
/// that are held, the residual is taken in double and they start again from it.
///
/// Contacts and pulls: springs within the solve (contact_forces.h), linearised at its
/// start; where they push otherwise than assumed, up to five further solves, started
/// from the last. A piece that is hit steps by backward Euler, and so does its next step.
///
/// Momentum: an unfinished solve leaks it and backward Euler loses spin, so each
/// piece that nothing holds or touches, and all pieces together that push on nothing but
/// each other, are given the rigid velocity that restores the linear momentum p + dt m g
/// and the angular momentum about their centre, both divided by 1 + dt mass_damping.
class ImplicitSolver {
  public:
    /// Throws InputError when dt is not positive or an array has a wrong length.
    SolverReport step(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                      const StepInput& input, const SolverOptions& options, const Parallel& parallel);

    /// One of several bodies that push on each other.
    struct Member {
        ImplicitSolver& solver;
        Phyxels& phyxels;
        const Neighbourhoods& neighbourhoods;
        const Material& material;
        const StepInput& input;    // `contacts` is not read
        SolverReport report = {};  // written
    };
    /// Steps all of them in one linear solve. Part k of the contacts is member k; all have
    /// the same dt. Throws as step does.
    static void step_together(std::span<Member> members, const ContactInput& contacts,
                              const SolverOptions& options, const Parallel& parallel);

  private:
    static constexpr int max_contact_passes = 9;
    static constexpr int letting_go_passes = 6;
    static constexpr int max_distorted_passes = 3;
    static constexpr int max_refinements = 4;

    /// Sums over phyxels, in the preconditioner's norm.
    struct WantedSums {
        double right = 0, borne = 0, felt = 0, least = 0;
        WantedSums& operator+=(const WantedSums& other) {
            right += other.right;
            borne += other.borne;
            felt += other.felt;
            least += other.least;
            return *this;
        }
    };
    /// The arguments of a step, passed on.
    struct Job {
        Phyxels& phyxels;
        const Neighbourhoods& neighbourhoods;
        const Material& material;
        const StepInput& input;
        const SolverOptions& options;
        const Parallel& parallel;
    };
    struct Group;
    /// Copies are empty: it holds nothing from step to step but memory.
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
    void find_hits(const Job& job, const ContactInput& contacts, std::span<const std::uint8_t> impact,
                   std::uint32_t part);
    void find_force_jumps(const Job& job, const ContactForces& forces, const ContactInput& contacts,
                          std::uint32_t part);
    void prepare(const Job& job);
    void place_at_solution(const Job& job);
    void take_step(const Job& job);
    void bind_pieces(const Job& job, const ContactInput& contacts, std::uint32_t part);
    void finish(const Job& job);
    static void restore_shared(Group& group, const ContactInput& contacts);
    void size_buffers(std::size_t count);
    void choose_steps(const Job& job);
    void predict(const Job& job);
    void linearise(const Job& job);
    bool is_torn(const Job& job);
    void right_side(const Job& job);
    void choose_step(const Job& job, std::size_t i);
    void predict_phyxel(const Job& job, std::size_t i);
    void guess_acceleration(const Job& job, std::size_t i);
    void start_guess(const Job& job);
    static bool has_high_acceleration(const Job& job, const Vec3& beyond_gravity);
    void smooth_high_accelerations(const Job& job);
    double wanted_residual(const Job& job, double tolerance);
    bool is_at_base(const Job& job);
    void stiffness_times_solution(const Job& job, bool exact);
    double square_of(const Job& job, std::span<const Vec3> of);
    double residual_at_base(const Job& job);
    double residual_from_product(const Job& job, bool exact, double& noise);
    void take_residual(const Job& job);
    void add_found(const Job& job);
    void weigh_aggregates(const Job& job);
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

    SlicedElasticity elastic_;
    Aggregates aggregates_;
    ElasticForces exact_;  // for residuals beyond single precision
    StateDescriber describe_;
    ChunkSum sum_;
    std::vector<double> b_;                 // s, per phyxel
    std::vector<double> diagonal_;          // N/m, (1 + b mass_damping) m / b^2
    std::vector<double> mobility_;          // m/N, of the solve's diagonal without contacts
    std::vector<double> inverse_;           // m/N, preconditioner
    std::vector<Vec3> predicted_;           // m, y
    std::vector<Vec3> predicted_velocity_;  // m/s
    std::vector<Vec3> base_;                // m, y with held phyxels put in place
    std::vector<Vec3> start_position_;      // m, before the step
    std::vector<Vec3> start_velocity_;      // m/s, before the step
    std::vector<Mat3> deformation_;         // at base_, where exact_ needs them
    std::vector<Mat3> rotation_;            // at base_, where exact_ needs them
    std::vector<Vec3> right_;               // N
    std::vector<Vec3> pushed_;              // N, of contacts and pulls at base_
    std::vector<Vec3> d_, r_, p_, q_;       // x - base_ (m), residual (N), scratch
    FloatArray fine_d_, fine_r_, fine_p_,
        fine_q_;  // conjugate gradients, row arrays of 3: part of d_, residual, direction, A p
    FloatArray fine_diagonal_, fine_inverse_;  // row arrays of diagonal_ and inverse_
    std::vector<std::uint32_t> constrained_;   // phyxels that are held
    ChunkSumOf<double> slice_sum_;
    ChunkSumOf<WantedSums> wanted_sum_;
    bool exact_is_taken_ = false;         // exact_ has the tangents at base_
    bool solution_is_taken_ = false;      // elastic_ has the state at p_, the solution
    std::vector<std::uint8_t> inverted_;  // per phyxel, det F <= 0 before the step
    bool any_inverted_ = false;
    std::vector<std::uint8_t> held_;               // per phyxel
    std::vector<std::uint8_t> high_acceleration_;  // per phyxel, its acceleration is to be smoothed
    std::vector<std::uint32_t> to_smooth_;         // those phyxels
    std::vector<std::uint8_t> whole_;              // per phyxel, not distorted at base_
    std::vector<std::uint8_t> failed_;             // per phyxel, went non-finite in this step
    std::vector<std::uint8_t> hit_;                // per piece and for none, hit something in this step
    std::vector<std::uint8_t> supported_;          // per piece and for none, held or pushed a step ago
    std::vector<double> added_;                    // N/m, of contacts and pulls, per phyxel
    std::vector<Vec3> change_;                     // N, per piece
    std::vector<double> piece_mass_;               // kg, per piece
    MomentumKeeper momenta_;
    ContactForces contacts_;
    GroupBuffer group_;  // of steps that this one leads
    SolverReport report_;
};

}  // namespace splitcubes::meshless
