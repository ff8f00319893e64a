// Never more energy than was put in: an account of each elastic piece's energy.
#pragma once

#include <splitcubes/meshless/sliced_elasticity.h>
#include <splitcubes/meshless/solver_types.h>
#include <splitcubes/meshless/step_results.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Keeps an account for each elastic piece and takes from a step what it cannot pay for.
///
/// Energy of a piece that nothing pushed: kinetic about its centre of mass, and elastic.
/// Gravity does no work on it, so it may not grow at all. Of a piece that is held, touches
/// or was pushed: kinetic of what is not held, and elastic; gravity and moving holds do work.
///
/// At the start of a step a piece has the kinetic energy that it has, the elastic energy that
/// its phyxels had at the end of the last step (with the links of then: what a cut changes in
/// the fitted strain is no energy that anything put in), and its reserve. What it has with the
/// work of the step is its budget. Steps do not keep energy to rounding, so it may exceed that by a
/// share of its internal energy; the budget of the next step is not raised by that, so
/// excesses do not add up. What a step leaves unspent goes to the reserve, which fades: leapfrog
/// lends and takes back energy within a few steps (its energy error is bounded and does not
/// grow: Hairer, Lubich and Wanner 2006, section IX.3).
///
/// Mending, the first that does:
/// 1. The velocities less the piece's rigid motion are scaled. Linear and angular momentum
///    stay. This is all where the elastic energy alone can be paid for, or nearly.
/// 2. Else the step is taken again, in finer parts (TimeIntegrator).
/// 3. Else the piece's rigid motion stays, what deformed is halved until the elastic energy is no more
///    than that before the step or what can be paid, and motion other than rigid ends.
/// Where a cut raised the elastic energy of phyxels that did not move, the account is
/// overdrawn: the piece does not move within itself until what was too much has gone.
///
/// All state is in Phyxels (elastic_energy, reserve), the object holds buffers only. Rigid pieces
/// keep their energy by themselves.
class EnergyGuard {
  public:
    /// Notes what the pieces have. To be called when nothing but the elastic step is left to
    /// be done; input.held as of that.
    void begin(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
               const StepInput& input, const Parallel& parallel);
    /// Further work that is done on a piece in this step, J; infinite: no account is kept of it
    /// in this step.
    void add_work(std::int32_t piece, double work);
    /// Counts as work what contacts that push after the step did on each of its pieces: the sum of their
    /// forces along the ways of their sides; where their forces are not those of the whole step, no less than
    /// nothing. Of what is pulled no account is kept in this step. part: which side of the contacts the
    /// phyxels are. To be called before weigh; replaces what it counted before.
    void count_contacts(const Phyxels& phyxels, const ContactInput& contacts, std::uint32_t part,
                        bool of_whole_step);
    /// Weighs the step that was taken. hold_work: J per piece, what moving holds did; empty:
    /// it is found from the forces before and after the step. Returns whether elastic energy
    /// cannot be paid for by some piece.
    bool weigh(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
               const StepInput& input, double tolerance, std::span<const double> hold_work,
               const Parallel& parallel);
    /// Puts the phyxels back to where begin found them.
    void go_back(Phyxels& phyxels) const;
    /// After a step of several parts: the step before it is where begin found the phyxels, and
    /// the next starts afresh.
    void forget_parts(Phyxels& phyxels, double dt) const;
    /// Mends what weigh found, writes the reserves, and the sums of the report anew where
    /// something was mended.
    void settle(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                const StepInput& input, SolverReport& report, const Parallel& parallel);

  private:
    struct Account {
        double mass = 0;               // kg
        double volume = 0;             // m^3
        Vec3 linear = Vec3::Zero();    // kg m/s
        double all_kinetic = 0;        // J
        double loose_kinetic = 0;      // J, of what is not held
        double elastic = 0;            // J
        double reserve = 0;            // J
        double work = 0;               // J, of gravity and holds
        double held_mass = 0;          // kg
        Vec3 held_way = Vec3::Zero();  // m, of the first held phyxel in the step
        bool one_way = true;           // all that is held goes that way
        bool touches = false;          // before or after the step
        bool held_moves = false;

        void add_hold(const Vec3& way, double m);
        Account& operator+=(const Account& other);
    };
    struct Verdict {
        bool free = false;        // nothing pushed it
        bool over = false;        // has more than it can pay for
        bool strained = false;    // the elastic energy alone is too much
        double budget = 0;        // J
        double limit = 0;         // J, with the tolerance
        double energy = 0;        // J, that counts
        double most_elastic = 0;  // J, that is borne
    };

    bool is_counted(const Phyxels& phyxels, std::size_t i) const {
        const std::int32_t piece = phyxels.piece[i];
        return piece >= 0 && static_cast<std::size_t>(piece) < start_.size() &&
               phyxels.rigid.index(piece) < 0;
    }
    std::size_t slot(const Phyxels& phyxels, std::size_t i) const {
        return static_cast<std::size_t>(phyxels.piece[i]);
    }
    template <class First>
    void sum_up(const Phyxels& phyxels, const StepInput& input, bool gravity, std::vector<Account>& accounts,
                const Parallel& parallel, const First& first);
    void sum_up_step(const Phyxels& phyxels, const StepInput& input, bool gravity, const Parallel& parallel);
    void add_phyxel(const Phyxels& phyxels, const StepInput& input, bool gravity, std::size_t i,
                    Account& account) const;
    void add_hold_work(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                       const StepInput& input, const Parallel& parallel);
    double work_along(const Material& material, const StepInput& input, std::size_t k) const;
    bool was_pushed(const Material& material, const StepInput& input, std::size_t k) const;
    Verdict judge(const Material& material, const StepInput& input, double tolerance, std::size_t k) const;
    bool find_strained(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                       const Parallel& parallel);
    void find_rigid_motions(const Phyxels& phyxels, const Parallel& parallel);
    double rigid_energy(std::size_t k) const;
    void relax_excess_strain(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                             const StepInput& input, const Parallel& parallel);
    void place_between(Phyxels& phyxels, const StepInput& input, double share) const;
    void scale_velocities(Phyxels& phyxels, const StepInput& input);
    void write_reserves(Phyxels& phyxels, const Parallel& parallel);
    std::vector<double>& elastic_by_piece(const Phyxels& phyxels, std::span<const double> rows);

    SlicedElasticity elastic_;
    StateDescriber describe_;
    std::vector<Vec3> position_, velocity_;                        // m, m/s, before the step
    std::vector<Mat3> rotation_, plastic_strain_;                  // before the step
    std::vector<std::uint8_t> touching_;                           // before the step
    std::vector<double> rows_;                                     // J, per phyxel
    std::vector<Vec3> force_, reached_;                            // N, m, per phyxel
    std::vector<Account> start_, end_, chunk_accounts_;            // per piece
    std::vector<Verdict> verdict_;                                 // per piece
    std::vector<double> extra_, pushed_, hold_work_, sum_, most_;  // J, per piece
    std::vector<Momenta> before_, after_, partial_;                // per piece, where something is mended
    std::vector<std::uint8_t> held_back_;                          // per piece
    bool any_over_ = false;
    double tolerance_ = 0;
};

}  // namespace splitcubes::meshless
