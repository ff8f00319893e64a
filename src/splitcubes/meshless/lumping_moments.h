// Shares of booked volume that leave it where its nodes are.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/meshless/mass_lumping.h>

#include <cstdint>
#include <span>

namespace splitcubes::meshless {

/// Changes the shares of the rows of these nodes, which are > 0 and sum to 1, so that the phyxels of a row
/// have the volume, the centre and the second moments of the node's: sum_i s_i q(x_i - x_node) = q(0)
/// for all quadratic q (reproducing conditions; Liu, Jun and Zhang 1995), as nearly as the row's
/// phyxels determine it. A piece's centre of mass and moments of inertia are then the same whoever holds it,
/// so that parting moves nothing and what spins goes on spinning as fast. Shares may fall below zero; the sum
/// over a phyxel does not fall below 0.3 of what it was: else all of the piece's shares change by less.
///
/// chosen: 1 per node whose row is to change; pieces are chosen as wholes. last: an earlier result for the
/// first of these nodes: where a row has the same phyxels its shares are the same and are taken from there.
void keep_moments(const MaterialNodes& nodes, const Phyxels& phyxels, std::span<const std::uint8_t> chosen,
                  const MassLumping& last, MassLumping& lumping, const Parallel& parallel);

}  // namespace splitcubes::meshless
