// What all solvers share: checked input, momenta restored, flow, the report.
#pragma once

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
    void begin(const Phyxels& phyxels, int piece_count);
    /// The piece of a phyxel that something holds or touches: its momenta are not restored.
    void bind(std::int32_t piece) { bound_[slot(piece)] = 1; }
    /// The two pieces push on each other: only what they have together is kept.
    void join(std::int32_t a, std::int32_t b);
    /// Joins the pieces that contacts press together (those in the contacts' memory, written
    /// by the step) and binds those that something else than a piece of this part presses.
    void join_touching(const Phyxels& phyxels, const ContactInput& contacts, std::uint32_t part);
    /// Every free piece gets kept * (p + m velocity) and kept * spin. Where `shift`
    /// (s, one a phyxel) is given, phyxels first move by the change of velocity times it.
    void restore(Phyxels& phyxels, double kept, const Vec3& velocity, std::span<const double> shift,
                 const Parallel& parallel);

  private:
    /// The last slot for phyxels without a piece.
    std::size_t slot(std::int32_t piece) const {
        const auto last = static_cast<std::int32_t>(bound_.size()) - 1;
        return static_cast<std::size_t>(piece >= 0 && piece < last ? piece : last);
    }
    std::size_t root(std::size_t slot) const;
    void sum_groups(std::vector<Momenta>& momenta) const;
    void correct(Phyxels& phyxels, double kept, const Vec3& velocity, std::span<const double> shift,
                 const Parallel& parallel);

    std::vector<std::uint8_t> bound_;              // per piece, and one for none
    std::vector<std::size_t> joined_;              // per slot: a lower one of its group, or itself
    std::vector<Momenta> before_, after_, group_;  // per piece; group_: of the whole group
};

/// Deformation at the new positions, then plastic flow over dt seconds.
void deform_and_flow(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                     double dt, const Parallel& parallel);

/// Adds energies, momenta, top speed and counts of inverted and rank-deficient
/// phyxels; deformation and rotation are those of the positions.
void describe_state(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Material& material,
                    ElasticForces& elastic, SolverReport& report, const Parallel& parallel);

/// The phyxels' own arrays.
inline ElasticState state_of(const Phyxels& phyxels) {
    return {phyxels.position, phyxels.deformation, phyxels.rotation, phyxels.plastic_strain};
}

}  // namespace splitcubes::meshless
