// One time step of the elastic body: implicit, predict and correct.
#pragma once

#include <splitcubes/meshless/solver_types.h>
#include <splitcubes/meshless/step_results.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Implicit steps in predict-correct form. Predict y without elastic force by
/// BDF2 (b = 2/3 dt), or backward Euler (b = dt) for phyxels whose history is
/// broken, whose piece has just met or left the ground, that are held or lie beside an inverted one; take F
/// and R at y; solve (M/b^2 + K) dx = f(y) by conjugate gradients; x = y + dx. Where that
/// tears what was whole, once more from there. All state is in Phyxels, the
/// object holds buffers only.
///
/// Conjugate gradients run in single precision (SlicedElasticity) with sums in double.
/// Where single precision does not carry to the tolerance, which is so of stiff bodies
/// that are held, the residual is taken in double and they start again from it.
///
/// Ground: an active set. A phyxel whose prediction is below its contact radius
/// is put on the plane and sticks; where the reaction leaves the friction cone it
/// slides under Coulomb friction, where it pulls it is released; up to three
/// further solves, started from the last; who is still below the plane then is put
/// on it. Inelastic: no normal velocity is left.
///
/// Momentum: an unfinished solve leaks it and backward Euler loses spin, so each
/// piece that nothing holds or touches is given the rigid velocity that restores
/// the linear momentum p + dt m g and the angular momentum about its centre, both
/// divided by 1 + dt mass_damping.
class ImplicitSolver {
  public:
    /// Throws InputError when dt is not positive or an array has a wrong length.
    SolverReport step(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                      const StepInput& input, const SolverOptions& options, const Parallel& parallel);

  private:
    enum class Mode : std::uint8_t { free, held, stick, slide };

    static constexpr int max_contact_passes = 3;
    static constexpr int max_distorted_passes = 3;
    static constexpr int max_refinements = 4;

    /// Sums over phyxels, in the preconditioner's norm.
    struct WantedSums {
        double right = 0, felt = 0, least = 0;
        WantedSums& operator+=(const WantedSums& other) {
            right += other.right;
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
    void size_buffers(std::size_t count);
    void choose_steps(const Job& job);
    void predict(const Job& job);
    void meet_ground(const Job& job);
    Vec3 touch_ground(const Job& job, std::size_t i, const Vec3& reached);
    bool below_ground(const Job& job, std::size_t i, const Vec3& place) const;
    void linearise(const Job& job);
    void solve_with_contacts(const Job& job);
    bool is_torn(const Job& job);
    void right_side(const Job& job);
    void start_guess(const Job& job);
    double wanted_residual(const Job& job);
    void solve(const Job& job);
    double residual(const Job& job, bool exact, double& noise);
    void take_residual(const Job& job);
    double descend(const Job& job, double goal, int& left);
    void filter(const Job& job);
    bool revise_contacts(const Job& job);
    bool revise_contact(const Job& job, std::size_t i);
    double damping_ratio(const Job& job) const;
    void finish_phyxel(const Job& job, std::size_t i);
    void break_histories(const Job& job);
    std::size_t piece_of(const Job& job, std::size_t i) const;
    void restore_momenta(const Job& job);
    Vec3 filtered(const Job& job, std::size_t i, const Vec3& force) const;

    SlicedElasticity elastic_;
    ElasticForces exact_;  // for residuals beyond single precision
    StateDescriber describe_;
    ChunkSum sum_;
    std::vector<Mode> mode_;                // per phyxel
    std::vector<double> b_;                 // s, per phyxel
    std::vector<double> diagonal_;          // N/m, (1 + b mass_damping) m / b^2
    std::vector<double> inverse_;           // m/N, preconditioner
    std::vector<Vec3> predicted_;           // m, y
    std::vector<Vec3> predicted_velocity_;  // m/s
    std::vector<Vec3> base_;                // m, y with held and touching phyxels put in place
    std::vector<Vec3> start_position_;      // m, before the step
    std::vector<Vec3> start_velocity_;      // m/s, before the step
    std::vector<Mat3> deformation_;         // at base_, where exact_ needs them
    std::vector<Mat3> rotation_;            // at base_, where exact_ needs them
    std::vector<Vec3> right_;               // N
    std::vector<Vec3> friction_;            // N, on sliding phyxels
    std::vector<Vec3> d_, r_, p_, q_;       // x - base_ (m), residual (N), scratch
    FloatArray fine_d_, fine_r_, fine_p_,
        fine_q_;  // conjugate gradients, row arrays of 3: part of d_, residual, direction, A p
    FloatArray fine_diagonal_, fine_inverse_;  // row arrays of diagonal_ and inverse_
    std::vector<std::uint32_t> constrained_;   // phyxels that are not free
    ChunkSumOf<double> slice_sum_;
    ChunkSumOf<WantedSums> wanted_sum_;
    bool exact_is_taken_ = false;         // exact_ has the tangents at base_
    std::vector<std::uint8_t> inverted_;  // per phyxel, det F <= 0 before the step
    std::vector<std::uint8_t> touched_;   // per phyxel, met the ground in this step, if only for a solve
    std::vector<std::uint8_t> whole_;     // per phyxel, not distorted at base_
    std::vector<std::uint8_t> met_;       // per phyxel, met or left the ground in this step
    std::vector<std::uint8_t> failed_;    // per phyxel, went non-finite in this step
    std::vector<std::uint8_t> broken_;    // per piece, met or left the ground in this step
    MomentumKeeper momenta_;
    SolverReport report_;
};

}  // namespace splitcubes::meshless
