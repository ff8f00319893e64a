// Conserves momenta when pieces split and are resampled, relumped or made rigid.
#pragma once

#include <splitcubes/samples/phyxels.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Restores the momenta of families after a split. A family is an old piece and all pieces
/// that separated from it. Resampling, relumping and the change to rigid pieces alter its
/// momenta a little: for example, a rigid piece has the inertia of its nodes, its phyxels
/// had that of coarser samples. The difference is applied to the whole family as one rigid
/// velocity, so that no piece is spun up; a shift of its centre of mass is undone by
/// translating the family. Kinetic energy that the family has gained by that is removed from
/// what its velocities deviate from its rigid motion, which keeps the momenta.
class SplitMomentum {
  public:
    /// Records the momenta. `family`: per piece, the index of its family, or -1 if it is
    /// unchanged. phyxels.piece holds the new pieces, masses and velocities are the old
    /// ones. `held`: per phyxel, 1 if it is kinematic (missing entries: 0). Families with
    /// held phyxels are not translated, nor are those at rest.
    SplitMomentum(const Phyxels& phyxels, std::vector<std::int32_t> family,
                  std::span<const std::uint8_t> held = {});

    /// Restores every family's centre of mass, linear momentum and angular momentum about
    /// that centre, up to rounding.
    void settle(Phyxels& phyxels) const;

  private:
    std::vector<Momenta> of_families(const Phyxels& phyxels) const;
    std::vector<double> energy_of_families(const Phyxels& phyxels) const;
    std::int32_t family_of(std::int32_t piece) const {
        const bool known = piece >= 0 && static_cast<std::size_t>(piece) < family_.size();
        return known ? family_[static_cast<std::size_t>(piece)] : -1;
    }
    void restore_momenta(Phyxels& phyxels) const;
    void limit_energy(Phyxels& phyxels) const;

    std::vector<std::int32_t> family_;  // per piece
    std::vector<Momenta> before_;       // per family
    std::vector<double> energy_;        // J, kinetic, per family
    std::vector<std::uint8_t> moves_;   // per family, 1: its centre is restored
};

}  // namespace splitcubes::meshless
