// What all solvers share: checked input, momenta restored, flow, the report.
#pragma once

#include <splitcubes/meshless/sliced_elasticity.h>
#include <splitcubes/meshless/solver_types.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Throws InputError when dt is not positive or an array has a wrong length.
void check_step_input(const Phyxels& phyxels, const StepInput& input);

/// Gives pieces the rigid velocity that restores their linear momentum and their
/// angular momentum about the centre of mass; pieces that were joined are one.
class MomentumKeeper {
  public:
    /// Notes the momenta of all pieces. None is bound.
    void begin(const Phyxels& phyxels, int piece_count, const Parallel& parallel);
    /// The piece of a phyxel that something holds or touches: its momenta are not restored.
    void bind(std::int32_t piece) { bound_[slot(piece)] = 1; }
    /// The two pieces push on each other: only what they have together is kept.
    void join(std::int32_t a, std::int32_t b);
    /// Joins the pieces that contacts press together (those in the contacts' memory, written
    /// by the step) and binds those that something else than a piece of this part presses.
    void join_touching(const Phyxels& phyxels, const ContactInput& contacts, std::uint32_t part);
    /// Every free piece gets kept * (p + m velocity) and kept * spin. Where `shift`
    /// (s, one a phyxel) is given, phyxels first move by the change of velocity times it.
    /// Its centre of mass goes by the mean of both velocities over dt seconds: along its parabola.
    void restore(Phyxels& phyxels, double kept, const Vec3& velocity, std::span<const double> shift,
                 double dt, const Parallel& parallel);

  private:
    /// The last slot for phyxels without a piece.
    std::size_t slot(std::int32_t piece) const {
        const auto last = static_cast<std::int32_t>(bound_.size()) - 1;
        return static_cast<std::size_t>(piece >= 0 && piece < last ? piece : last);
    }
    std::size_t root(std::size_t slot) const;
    void sum_groups(std::vector<Momenta>& momenta);
    void correct(Phyxels& phyxels, double kept, const Vec3& velocity, std::span<const double> shift,
                 double dt, const Parallel& parallel);

    std::vector<std::uint8_t> bound_;              // per piece, and one for none
    std::vector<std::size_t> joined_;              // per slot: a lower one of its group, or itself
    std::vector<Momenta> before_, after_, group_;  // per piece; group_: of the whole group
    std::vector<Momenta> partial_;                 // per chunk and piece
    std::vector<Momenta> whole_;                   // per slot, scratch
    std::vector<Vec3> way_;                        // m, per piece, by which its group's centre is put right
};

/// Deformation at the phyxels' positions, into `elastic` and into the phyxels, then plastic
/// flow over dt seconds. Returns the number of phyxels that were not finite. taken: `elastic` has taken that
/// state already, and 0 is returned.
std::size_t deform_and_flow(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                            double dt, SlicedElasticity& elastic, const Parallel& parallel,
                            bool taken = false);

/// What describe_state sums.
struct StateSums {
    std::size_t inverted = 0, rank_deficient = 0;
    double kinetic_energy = 0;    // J
    double top_speed = 0;         // m/s, squared
    Vec3 linear = Vec3::Zero();   // kg m/s
    Vec3 angular = Vec3::Zero();  // kg m^2/s, about the origin
    StateSums& operator+=(const StateSums& other);
};

/// Adds energies, momenta, top speed and counts of inverted and rank-deficient
/// phyxels to a report; `elastic` has taken the phyxels' state, as deform_and_flow does. Writes
/// phyxels.elastic_energy.
class StateDescriber {
  public:
    void operator()(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, SlicedElasticity& elastic,
                    SolverReport& report, const Parallel& parallel);

  private:
    ChunkSumOf<StateSums> sums_;
};

/// The phyxels' own arrays.
inline SlicedElasticity::Configuration configuration_of(const Phyxels& phyxels) {
    return {phyxels.rest_position, phyxels.position, phyxels.rotation, phyxels.plastic_strain};
}

}  // namespace splitcubes::meshless
