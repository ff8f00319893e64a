// Explicit time steps: leapfrog with as many substeps as stability asks for.
#pragma once

#include <splitcubes/meshless/contact_impulses.h>
#include <splitcubes/meshless/solver_types.h>
#include <splitcubes/meshless/step_results.h>

#include <vector>

namespace splitcubes::meshless {

/// Leapfrog in its kick-drift-kick form (velocity Verlet): symplectic, so the energy
/// of an undamped body does not drift. A step is divided into equal substeps of
/// 0.6 of 2/w (half of it with other than plain corotated material), w the highest frequency of K v = w^2 M
/// v, lowered to (sqrt(1 + z^2) - z) of that for stiffness damping b, z = b w / 2 (Belytschko, Liu and Moran
/// 2000, section 6.2).
///
/// w^2 comes from power iteration on the body's own operator, with its tangents and its
/// penalties, and not from C d_min / sqrt((lambda + 2 mu) / rho): that bound
/// knows neither the penalty on zero-energy modes nor the light phyxels that cuts leave, and C
/// depends on the kernel. Power iteration comes from below; sixteen rounds are within a tenth
/// of w. The number of substeps stays as it was while they are 0.45 to 0.7 of 2/w (0.35 to 0.65). Of plain
/// corotated material w depends on links and masses alone (turning changes no frequency): it is found where
/// these change, with the tangents at rest. Of other materials, whose stiffness grows with stretch, w is
/// found in each step, of St. Venant-Kirchhoff and with volume stiffness again every few substeps. A phyxel
/// that holds less than a fiftieth of the mean mass moves as if it held that; momenta are restored as of
/// ImplicitSolver.
///
/// Contacts: impulses in every substep (contact_impulses.h). Held phyxels go
/// along straight lines. All state is in Phyxels, the object holds buffers only.
class ExplicitSolver {
  public:
    /// Throws InputError as check_step_input does, JobError where a step would need more
    /// than a hundred thousand substeps.
    SolverReport step(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                      const StepInput& input, const SolverOptions& options, const Parallel& parallel);
    /// What held phyxels that moved did on each piece in the last step, J: their forces times
    /// their ways, substep by substep. Empty where none moved.
    std::span<const double> hold_work() const { return hold_work_; }

  private:
    struct Job {
        Phyxels& phyxels;
        const Neighbourhoods& neighbourhoods;
        const Material& material;
        const StepInput& input;
        const Parallel& parallel;
        int refinement;
    };
    void begin(const Job& job);
    void draw_mode(const Job& job);
    double highest_frequency(const Job& job, int iterations);
    double frequency_at_rest(const Job& job);
    void deform(const Job& job, double h);
    double longest_step(const Job& job, int iterations);
    int substeps_for(const Job& job, int before, int iterations);
    int take_substeps(const Job& job);
    double largest_stretch(const Job& job) const;
    void substep(const Job& job, double h, double done);
    void find_forces(const Job& job);
    void kick(const Job& job, double h);
    void drift(const Job& job, double h, double done);
    void restore_momenta(const Job& job);
    void add_hold_work(const Job& job, double h);

    SlicedElasticity elastic_;
    StateDescriber describe_;
    ChunkSum sum_;
    MomentumKeeper momenta_;
    ContactImpulses contacts_;
    std::vector<double> effective_mass_;                 // kg, per phyxel
    std::vector<double> inverse_inertia_;                // 1/kg, per phyxel
    std::vector<double> none_;                           // zeros
    std::vector<Vec3> force_, damping_;                  // N
    std::vector<Vec3> mode_, image_;                     // power iteration: m, m/s^2
    std::vector<Vec3> start_position_, start_velocity_;  // m, m/s, before the step
    std::vector<std::uint8_t> held_, failed_;            // per phyxel, of this step
    std::vector<double> hold_work_;                      // J, per piece
    /// w of plain corotated material, and what it was found for.
    struct Known {
        std::uint64_t revision = 0;
        double mu = 0, lambda = 0;  // Pa
        std::vector<double> effective_mass;
        double frequency = 0;  // rad/s
    };
    Known known_;
    double pull_ = 0;  // s, for how long gravity has pulled in this step, less what damping took
};

}  // namespace splitcubes::meshless
