// Energy budget of each elastic piece: a step must not leave more energy than was put in.
#pragma once

#include <splitcubes/dynamics/solver_types.h>
#include <splitcubes/dynamics/step_results.h>
#include <splitcubes/elasticity/simd/sliced_elasticity.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless::tuning::energy {
struct Tolerance;
}

namespace splitcubes::meshless {

/// Keeps an energy account for each elastic piece and removes what a step gained beyond its budget.
///
/// Energy of a piece without external forces: kinetic energy about its centre of mass plus elastic energy.
/// Gravity does no work on that, so it must not grow at all. Energy of a piece that is held, touches
/// something or was pushed: kinetic energy of its free phyxels plus elastic energy; gravity and moving holds
/// do work.
///
/// At the start of a step a piece has its kinetic energy, the elastic energy of its phyxels at the end of the
/// last step (with the links of that time: what a cut changes in the fitted strain is not energy that
/// anything put in), and its reserve. The sum of these and the work of the step is the budget. Steps do not
/// conserve energy to rounding, so the energy may exceed the budget by a share of the internal energy; the
/// budget of the next step is not raised by the excess, so excesses do not add up. Unspent budget goes to the
/// reserve, which decays, of pieces that touch something, as the work of contacts is not known exactly, and
/// of all pieces in explicit steps: the energy error of leapfrog oscillates within a few steps (it is bounded
/// and does not grow: Hairer, Lubich and Wanner 2006, section IX.3). Other implicit steps damp, so their
/// reserve is zero.
///
/// Corrections; the first that suffices applies:
/// 1. The step is repeated with finer substeps (TimeIntegrator), unless the excess is small.
/// 2. If the elastic energy alone is within the budget, or nearly, velocities relative to the rigid motion of
///    the piece are scaled. Linear and angular momentum stay.
/// 3. Otherwise the rigid motion of the piece stays, its deformation in the step is halved until the elastic
///    energy is at most that before the step or what the budget allows, or the least that is found, and its
///    non-rigid motion is stopped.
/// If a cut raised the elastic energy of phyxels that did not move, the account is negative: the piece has no
/// non-rigid motion until the excess is gone.
///
/// All state is in Phyxels (elastic_energy, reserve); this object holds buffers only. Rigid pieces conserve
/// energy by themselves and have no account.
class EnergyGuard {
  public:
    /// Records the state and the energy of the pieces. Must be called immediately before the elastic step,
    /// with the input.held of that step.
    void begin(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
               const StepInput& input, const Parallel& parallel);
    /// Adds work done on a piece in this step, J; infinite: the piece is not checked in this step.
    void add_work(std::int32_t piece, double work);
    /// Counts the work of the contacts on the free phyxels of each piece of a part. contact_work: J, per
    /// piece; empty: the sum of the forces of the contacts that are active after the step times the
    /// displacements of their sides. Pieces pulled by attachment springs are not checked in this step. part:
    /// index of the phyxels' body in the contacts. Must be called before evaluate; replaces what it counted
    /// before.
    void count_contacts(const Phyxels& phyxels, const StepInput& input, const ContactInput& contacts,
                        std::uint32_t part, std::span<const double> contact_work);
    /// Compares the energy after the step with the budget. hold_work: J per piece, work of moving holds;
    /// empty: estimated from the forces before and after the step. Returns whether the step should be
    /// repeated with finer substeps: the elastic energy of some piece exceeds its budget, or the whole energy
    /// does by more than a share.
    bool evaluate(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                  const StepInput& input, const tuning::energy::Tolerance& tolerance,
                  std::span<const double> hold_work, const Parallel& parallel);
    /// Restores the phyxels to their state at begin.
    void restore_start(Phyxels& phyxels) const;
    /// Sets the history after a step of several substeps: the previous state is that at begin, and the next
    /// step starts with backward Euler.
    void reset_history(Phyxels& phyxels, double dt) const;
    /// Corrects the excesses that evaluate found, writes the reserves, and recomputes the sums of the report
    /// if something was corrected. Adds the work of the holds to the report.
    void enforce(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                 const StepInput& input, SolverReport& report, const Parallel& parallel);

  private:
    struct Account {
        double mass = 0;                        // kg
        double volume = 0;                      // m^3
        Vec3 linear = Vec3::Zero();             // kg m/s
        double total_kinetic = 0;               // J
        double free_kinetic = 0;                // J, of free phyxels
        double elastic = 0;                     // J
        double reserve = 0;                     // J
        double work = 0;                        // J, by gravity and holds
        double held_work = 0;                   // J, on held phyxels, without the forces of the free ones
        double held_mass = 0;                   // kg
        Vec3 held_displacement = Vec3::Zero();  // m, displacement of the first held phyxel in the step
        bool has_uniform_hold = true;           // all held phyxels have this displacement
        bool touches = false;                   // before or after the step
        bool held_moves = false;

        void add_hold(const Vec3& displacement, double m);
        Account& operator+=(const Account& other);
    };
    /// What contacts do to a piece: to its free phyxels where nothing else is said.
    struct ContactSum {
        double work = 0;            // J, in the step
        double work_on_held = 0;    // J, of the forces at the end of the step
        Vec3 force = Vec3::Zero();  // N, at its end
    };
    struct Balance {
        bool is_isolated = false;        // no external forces
        bool has_excess = false;         // energy exceeds the limit
        bool has_excess_strain = false;  // elastic energy alone exceeds max_elastic
        double budget = 0;               // J
        double limit = 0;                // J, budget plus tolerance
        double energy = 0;               // J, after the step
        double max_elastic = 0;          // J, maximum elastic energy
    };

    /// Search for the share of the deformation of a step that a piece keeps.
    struct Relaxation {
        bool is_open = false;      // no share with an allowed energy has been found
        double share = 1;          // that is being tried
        double best_share = 1;     // with the least energy
        double least_elastic = 0;  // J
    };

    /// Positions and plastic strains that the solver found, per phyxel.
    struct Solution {
        std::vector<Vec3> position;        // m
        std::vector<Mat3> plastic_strain;  // if the material has plasticity
    };

    bool is_counted(const Phyxels& phyxels, std::size_t i) const {
        const std::int32_t piece = phyxels.piece[i];
        return piece >= 0 && static_cast<std::size_t>(piece) < start_.size() &&
               phyxels.rigid.index(piece) < 0;
    }
    std::size_t slot(const Phyxels& phyxels, std::size_t i) const {
        return static_cast<std::size_t>(phyxels.piece[i]);
    }
    template <class Prepare>
    void sum_accounts(const Phyxels& phyxels, const StepInput& input, bool gravity,
                      std::vector<Account>& accounts, const Parallel& parallel, const Prepare& prepare);
    void count_handles(const Phyxels& phyxels, const StepInput& input, const ContactInput& contacts,
                       std::uint32_t part);
    void sum_end_accounts(const Phyxels& phyxels, const StepInput& input, bool gravity,
                          const Parallel& parallel);
    void add_phyxel(const Phyxels& phyxels, const StepInput& input, bool gravity, std::size_t i,
                    Account& account) const;
    void find_hold_work(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                        const Material& material, const StepInput& input, const Parallel& parallel);
    double uniform_hold_work(const Material& material, const StepInput& input, std::size_t k) const;
    bool was_pushed(const Material& material, const StepInput& input, std::size_t k) const;
    Balance find_balance(const Material& material, const StepInput& input, double tolerance,
                         std::size_t k) const;
    bool find_excess_strain(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                            const Material& material, const Parallel& parallel);
    void find_rigid_motions(const Phyxels& phyxels, const Parallel& parallel);
    double rigid_energy(std::size_t k) const;
    void relax_excess_strain(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                             const StepInput& input, const Parallel& parallel);
    void interpolate_positions(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                               const Material& material, const StepInput& input, const Parallel& parallel);
    void scale_velocities(Phyxels& phyxels, const StepInput& input);
    void write_reserves(Phyxels& phyxels, const Parallel& parallel);
    std::vector<double>& elastic_by_piece(const Phyxels& phyxels, std::span<const double> rows);

    SlicedElasticity elastic_;
    StateDescriber describe_;
    std::vector<Vec3> position_, velocity_;                       // m, m/s, before the step
    std::vector<Mat3> rotation_, plastic_strain_;                 // before the step
    std::vector<std::uint8_t> touching_;                          // before the step
    std::vector<double> rows_;                                    // J, per phyxel
    std::vector<Vec3> force_;                                     // N, per phyxel, or per handle
    std::vector<ContactSum> contacts_;                            // per piece
    std::vector<Account> start_, end_, chunk_accounts_;           // per piece
    std::vector<Balance> balance_;                                // per piece
    std::vector<double> extra_work_, hold_work_, sum_, scratch_;  // J, per piece
    // Per piece, only if something is corrected; before_ holds rigid velocities at times.
    std::vector<Momenta> before_, after_, partial_;
    std::vector<Relaxation> relaxation_;  // per piece
    Solution solution_;
    /// Result of evaluate beside the balances.
    struct Evaluation {
        bool any_excess = false;
        double work_of_holds = 0;  // J
    };
    Evaluation evaluation_;
    std::array<double, 2> reserve_kept_{};  // as in Tolerance, of pieces that are apart, that touch
};

}  // namespace splitcubes::meshless
