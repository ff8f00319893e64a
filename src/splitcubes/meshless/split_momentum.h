// Keeps the momenta of what parts together over a change of phyxels, masses and kinds.
#pragma once

#include <splitcubes/meshless/phyxels.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// A family is a piece as it was and all that came off it. While pieces are resampled,
/// booked anew and made rigid, its momenta change a little: a rigid piece holds the
/// spin of its nodes, its phyxels before it that of samples an h wide. The difference
/// goes to the family as a whole, as one rigid velocity, so that none of it is spun up;
/// its centre, which moves when mass does, is put back by moving all of it.
class SplitMomentum {
  public:
    /// Notes the momenta. `family`: per piece, its family's number, or -1 where it stays
    /// as it is; phyxels.piece are the new pieces, masses and velocities those of before.
    /// `held`: per phyxel, 1 where it is held (or shorter: the rest is not); such families
    /// are not moved, nor are those that are at rest.
    SplitMomentum(const Phyxels& phyxels, std::vector<std::int32_t> family,
                  std::span<const std::uint8_t> held = {});

    /// Gives every family back its centre of mass, its linear momentum and its angular
    /// momentum about that centre, to rounding.
    void settle(Phyxels& phyxels) const;

  private:
    std::vector<Momenta> of_families(const Phyxels& phyxels) const;

    std::vector<std::int32_t> family_;  // per piece
    std::vector<Momenta> before_;       // per family
    std::vector<std::uint8_t> moves_;   // per family, 1: its centre is put back
};

}  // namespace splitcubes::meshless
