// Correction of lumping shares so that they preserve the moments of the nodes' mass.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/samples/mass_lumping.h>

#include <cstdint>
#include <span>

namespace splitcubes::meshless {

/// Changes the shares of the chosen nodes' rows, which are > 0 and sum to 1, so that the phyxels of a row
/// reproduce the node's volume, centre and second moments: sum_i s_i q(x_i - x_node) = q(0) for all
/// quadratic q (reproducing conditions; Liu, Jun and Zhang 1995), as closely as the row's phyxels permit. A
/// piece's centre of mass and moments of inertia are then independent of its phyxels, so that a split
/// neither moves the pieces nor changes their angular velocity. Shares can become negative. The volume of a
/// phyxel does not fall below 0.3 of its uncorrected volume: the changes of its whole piece are scaled down
/// for that.
///
/// chosen: 1 per node whose row is to change; a piece is chosen entirely or not at all. last: an earlier
/// result for the first of these nodes; unscaled rows with the same phyxels are copied from it.
void keep_moments(const MaterialNodes& nodes, const Phyxels& phyxels, std::span<const std::uint8_t> chosen,
                  const MassLumping& last, MassLumping& lumping, const Parallel& parallel);

}  // namespace splitcubes::meshless
