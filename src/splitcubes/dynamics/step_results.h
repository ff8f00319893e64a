// Shared by all solvers: input checks, restored momenta, plastic flow and the report.
#pragma once

#include <splitcubes/dynamics/solver_types.h>
#include <splitcubes/elasticity/simd/sliced_elasticity.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Throws InputError when dt is not positive or an array has a wrong length.
void check_step_input(const Phyxels& phyxels, const StepInput& input);

/// Computes the rotation rates of pieces, rad/s, from their momenta; those of rigid pieces are zero. Returns
/// the largest.
double find_rotation_rates(const Phyxels& phyxels, std::span<const Momenta> pieces,
                           std::vector<double>& rates);

/// Restores momenta: gives pieces the rigid velocity that restores their linear momentum and their angular
/// momentum about the centre of mass. Joined pieces are treated as one.
class MomentumKeeper {
  public:
    /// Records the momenta of all pieces. None is excluded.
    void begin(const Phyxels& phyxels, int piece_count, const Parallel& parallel);
    /// Returns the largest rotation rate of an elastic piece before the step, rad/s.
    double largest_rate() const { return largest_rate_; }
    /// Returns the rotation rate of a piece before the step, rad/s; zero for rigid pieces.
    double rate(std::size_t piece) const { return rate_[piece]; }
    /// Excludes a piece that is held or in contact with something else: its momenta are not restored.
    void bind(std::int32_t piece) { bound_[slot(piece)] = 1; }
    /// Joins two pieces in contact: only their total momenta are restored.
    void join(std::int32_t a, std::int32_t b);
    /// Joins the pieces that contacts press together (those in the cached contacts that the step wrote) and
    /// excludes those in contact with anything but a piece of this part.
    void join_touching(const Phyxels& phyxels, const ContactInput& contacts, std::uint32_t part);
    /// Gives every piece that is not excluded the momenta factor * (p + m velocity) and factor * L. If
    /// `shift` (s, per phyxel) is given, phyxels first move by the change of velocity times it; the rotation
    /// in that is a finite one, and turns the velocities, too. The centre of
    /// mass moves by the mean of the old and new velocities over dt seconds: along its parabola.
    void restore(Phyxels& phyxels, double factor, const Vec3& velocity, std::span<const double> shift,
                 double dt, const Parallel& parallel);

  private:
    /// Returns the slot of a piece; the last one is for phyxels without a piece.
    std::size_t slot(std::int32_t piece) const {
        const auto last = static_cast<std::int32_t>(bound_.size()) - 1;
        return static_cast<std::size_t>(piece >= 0 && piece < last ? piece : last);
    }
    std::size_t root(std::size_t slot) const;
    void sum_groups(std::vector<Momenta>& momenta);
    void correct(Phyxels& phyxels, double factor, const Vec3& velocity, std::span<const double> shift,
                 double dt, const Parallel& parallel);

    std::vector<std::uint8_t> bound_;  // 1: excluded; per piece, and one for phyxels without a piece
    std::vector<std::size_t> joined_;  // per slot: a lower slot of its group, or itself
    std::vector<Momenta> before_, after_, group_;  // per slot; group_: of the whole group
    std::vector<Momenta> partial_;                 // per chunk and piece
    std::vector<Momenta> group_sum_;               // per slot, scratch
    std::vector<double> rate_;                     // rad/s, per piece
    double largest_rate_ = 0;
    std::vector<Vec3> mean_;          // m/s, per slot, velocity of its group before a correction
    std::vector<Vec3> centre_shift_;  // m, per slot, position correction of its group
};

struct DeformationChange {
    std::size_t non_finite = 0;  // phyxels that were not finite
    bool flowed = false;         // some plastic strain changed, and the stresses with it
};
/// Computes the deformation at the phyxels' positions, into `elastic` and the phyxels, then plastic flow over
/// dt seconds. has_state: `elastic` already holds that state, and no phyxel counts as not finite.
DeformationChange deform_and_flow(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                  const Material& material, double dt, SlicedElasticity& elastic,
                                  const Parallel& parallel, bool has_state = false);

/// Sums of StateDescriber.
struct StateSums {
    std::size_t inverted = 0, rank_deficient = 0;
    double kinetic_energy = 0;    // J
    double top_speed = 0;         // m/s, squared
    Vec3 linear = Vec3::Zero();   // kg m/s
    Vec3 angular = Vec3::Zero();  // kg m^2/s, about the origin
    StateSums& operator+=(const StateSums& other);
};

/// Adds energies, momenta, top speed and counts of inverted and rank-deficient phyxels to a report. `elastic`
/// must hold the state of the phyxels, as after deform_and_flow. Writes phyxels.elastic_energy.
class StateDescriber {
  public:
    void operator()(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, SlicedElasticity& elastic,
                    SolverReport& report, const Parallel& parallel);

  private:
    ChunkSumOf<StateSums> sums_;
};

/// Returns the configuration given by the phyxels' own arrays.
inline SlicedElasticity::Configuration configuration_of(const Phyxels& phyxels) {
    return {phyxels.rest_position, phyxels.position, phyxels.rotation, phyxels.plastic_strain};
}

}  // namespace splitcubes::meshless
