// Material booked at the nodes of the surface's grid: each node owns a volume and
// shares it out among the phyxels of its own piece, so that a piece weighs what
// its nodes weigh, whatever was cut.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/meshless/locator.h>
#include <splitcubes/meshless/phyxels.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// The nodes inside the material; three arrays of one length.
struct MaterialNodes {
    std::span<const Vec3> rest_position;  // m, rest space
    std::span<const double> volume;       // m^3
    std::span<const std::int32_t> piece;  // number of the node's piece
};

/// Who holds whose volume: rows of nodes (CSR).
struct MassLumping {
    std::vector<std::uint32_t> offsets;  // node count + 1
    std::vector<std::uint32_t> phyxel;   // per entry
    std::vector<double> share;           // per entry; a row sums to 1
    std::vector<std::int32_t> piece;     // per node, its piece when it was booked
    std::vector<std::uint8_t> whole;  // per node, 1: its shares are by its own row alone, none was taken back
    std::size_t unlumped = 0;         // nodes of pieces without any phyxel: their row is empty

    std::size_t node_count() const { return offsets.empty() ? 0 : offsets.size() - 1; }
    /// For checkpoints.
    template <class Archive>
    void serialize(Archive& archive) {
        archive(offsets, phyxel, share, piece, whole, unlumped);
    }
};

/// Shares by kernel weight within the phyxels' support, changed so that they keep moments
/// (lumping_moments.h); a node out of everyone's
/// reach goes to the nearest phyxel of its piece (the lower index of equals).
/// `locator` holds all rest positions of the phyxels.
MassLumping lump(const MaterialNodes& nodes, const Phyxels& phyxels, const PhyxelLocator& locator,
                 const Parallel& parallel);

/// Sets volume and mass of all phyxels. volumes: m^3 a node; density: kg/m^3.
void apply(const MassLumping& lumping, std::span<const double> volumes, double density, Phyxels& phyxels);

/// After pieces parted or phyxels were appended (nodes.piece and phyxels.piece
/// are the new ones, `booking` still the old): books the nodes of new or changed
/// pieces again, sets volume and mass, and gives every such piece, by one rigid
/// velocity, the momentum that its nodes carried (node b: m_b sum_i s_bi v_i) and
/// their angular momentum (m_b sum_i s_bi x_i x v_i), the latter about the centre
/// of mass of the piece it comes from, in that centre's motion: so a falling body
/// does not begin to spin because booked mass moved within it. The pieces that
/// come from one therefore keep together its mass, its momentum and its angular
/// momentum about its centre, to rounding; but for crumbs whose phyxels lie within
/// 0.15 of their support of a line, which are not given the spin about it, and
/// pieces whose phyxels are all new, which are given their linear momentum only. Pieces whose nodes and
/// phyxels are as before are not touched. Phyxels of the old booking must keep their numbers.
void relump_after_split(MassLumping& lumping, const MaterialNodes& nodes, double density,
                        const PhyxelLocator& locator, Phyxels& phyxels, const Parallel& parallel);

}  // namespace splitcubes::meshless
