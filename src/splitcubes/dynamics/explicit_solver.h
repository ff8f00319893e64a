// Explicit time steps: leapfrog with as many substeps as stability requires.
#pragma once

#include <splitcubes/contact/response/contact_impulses.h>
#include <splitcubes/dynamics/solver_types.h>
#include <splitcubes/dynamics/step_results.h>

#include <vector>

namespace splitcubes::meshless {

/// Leapfrog in its kick-drift-kick form (velocity Verlet). It is symplectic, so the energy of an undamped
/// body does not drift. A step is divided into equal substeps of 0.6 of 2/w (0.5 for other than plain
/// corotated material), w being the highest frequency of K v = w^2 M v; for stiffness damping b the limit 2/w
/// is multiplied by sqrt(1 + z^2) - z, z = b w / 2 (Belytschko, Liu and Moran 2000, section 6.2).
///
/// w^2 is found by power iteration on the body's own operator, including its tangents and penalties. The
/// common estimate C d_min / sqrt((lambda + 2 mu) / rho) is not used: it accounts neither for the penalty on
/// zero-energy modes nor for the light phyxels that cuts leave, and C depends on the kernel. Power iteration
/// approaches w from below; sixteen iterations come within a tenth of w. The number of substeps is kept while
/// they are 0.45 to 0.7 of 2/w (0.35 to 0.65). For plain corotated material w depends on links and masses
/// alone (rotation changes no frequency): it is recomputed when these change, with the tangents at rest.
/// Other materials stiffen with stretch: w is found in each step, and for St. Venant-Kirchhoff and with
/// volume stiffness again every few substeps. A phyxel lighter than a fiftieth of the mean mass moves as if
/// it had that mass; momenta are restored as in ImplicitSolver.
///
/// Contacts: impulses in every substep (contact/response/contact_impulses.h), on the velocities between two
/// drifts, and once more at the end of the step. Bodies in contact take the same substeps. Held phyxels move
/// along straight lines. All state is in Phyxels; this object holds buffers only.
class ExplicitSolver {
  public:
    /// One of several bodies that are in contact with each other.
    struct Member {
        ExplicitSolver& solver;
        Phyxels& phyxels;
        const Neighbourhoods& neighbourhoods;
        const Material& material;
        const StepInput& input;    // `contacts` is ignored
        SolverReport report = {};  // output
    };
    /// Steps all members; part k of the contacts is member k, and all use the same dt. Returns false if that
    /// takes more than max_substeps_per_step substeps; then nothing has changed. Throws InputError like
    /// check_step_input.
    static bool step_together(std::span<Member> members, const ContactInput& contacts,
                              const SolverOptions& options, const Parallel& parallel);
    /// Steps one body with the contacts of its input.
    bool step(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
              const StepInput& input, const SolverOptions& options, SolverReport& report,
              const Parallel& parallel);
    /// Returns the work of moving held phyxels on each piece in the last step, J: their forces times their
    /// displacements, summed over substeps. Empty if none moved.
    std::span<const double> hold_work() const { return hold_work_; }
    /// Returns the work of contacts on each piece in the last step, J. Empty if there were
    /// none.
    std::span<const double> contact_work() const { return contact_work_; }

  private:
    struct Job {
        ExplicitSolver& solver;
        Phyxels& phyxels;
        const Neighbourhoods& neighbourhoods;
        const Material& material;
        const StepInput& input;
        const Parallel& parallel;
        int refinement;
    };
    /// Drifts between which impulses act.
    enum class DriftsAround : std::uint8_t { next, both, last };
    /// Bodies that step together, as spans over their arrays.
    struct Group {
        std::vector<Job> jobs;
        ContactImpulses contacts;
        std::vector<ContactImpulses::Part> parts;
        std::vector<std::span<Vec3>> velocity, force;
        std::vector<std::span<const Vec3>> position;
        std::vector<std::span<std::uint8_t>> touching;
        std::span<const HandleSpring> handle_springs;
        double dt = 0;            // s
        double last_substep = 0;  // s
        double handle_work = 0;   // J, in the step so far
        bool changes = false;     // the stiffness of some member grows with its stretch

        void clear();
        void add(const Job& job);
        bool take_substeps(int& substeps);
        int substeps_for(int before, int iterations);
        double largest_stretch() const;
        void substep(double h, double before, double after);
        void record_velocities();
        void add_contact_work(DriftsAround drifts);
        void find_forces();
        void finish();
    };
    void begin(const Job& job);
    void choose_masses(const Job& job);
    void save_start(const Job& job);
    void restore_start(const Job& job) const;
    void draw_initial_mode(const Job& job);
    double highest_frequency(const Job& job, int iterations);
    double frequency_at_rest(const Job& job);
    void deform(const Job& job, double h);
    double max_stable_step(const Job& job, int iterations);
    int substeps_for(const Job& job, int before, int iterations);
    double largest_stretch(const Job& job) const;
    void find_forces(const Job& job);
    void kick(const Job& job, double h);
    void drift(const Job& job, double h, double done);
    void end(const Job& job, const ContactInput& contacts, std::uint32_t part, bool restore_momentum,
             SolverReport& report);
    void restore_momenta(const Job& job, const ContactInput& contacts, std::uint32_t part);
    void add_hold_work(const Job& job, double h);

    SlicedElasticity elastic_;
    StateDescriber describe_;
    ChunkSum sum_;
    MomentumKeeper momenta_;
    Group group_;                         // used by the first member
    std::vector<double> effective_mass_;  // kg, per phyxel
    std::vector<double> inverse_mass_;    // 1/kg, per phyxel
    std::vector<double> zeros_;           // zeros, per phyxel
    std::vector<Vec3> force_, damping_;   // N
    std::vector<Vec3> mode_, product_;    // power iteration: mode (m), and M^-1 K times it (m/s^2)
    std::vector<Vec3> start_position_, start_velocity_;  // m, m/s, before the step
    /// State before the step, besides positions and velocities, if substeps may have to be undone.
    struct Start {
        bool is_kept = false;
        std::vector<Mat3> rotation, deformation, plastic_strain;
    };
    Start start_;
    std::vector<std::uint8_t> held_, failed_;       // per phyxel, of this step
    std::vector<double> hold_work_, contact_work_;  // J, per piece
    // m/s, per touched phyxel: before an impulse, and in the last drift.
    std::vector<Vec3> velocity_before_, drift_velocity_;
    /// Cached w of plain corotated material, and what it was computed for.
    struct FrequencyCache {
        std::uint64_t revision = 0;
        double mu = 0, lambda = 0;  // Pa
        std::vector<double> effective_mass;
        double frequency = 0;  // rad/s
    };
    FrequencyCache frequency_cache_;
    double gravity_time_ = 0;  // s, time that gravity acted in this step, reduced by damping
};

}  // namespace splitcubes::meshless
