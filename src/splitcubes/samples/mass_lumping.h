// Mass lumping: each node of the surface's grid owns a volume, which it distributes to
// the phyxels of its own piece. A piece therefore has the mass of its nodes, whatever
// was cut.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/samples/locator.h>
#include <splitcubes/samples/phyxels.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// The nodes inside the material; three arrays of one length.
struct MaterialNodes {
    std::span<const Vec3> rest_position;  // m, rest space
    std::span<const double> volume;       // m^3
    std::span<const std::int32_t> piece;  // id of the node's piece
};

/// Distribution of the nodes' volumes to phyxels, as rows of nodes (CSR).
struct MassLumping {
    std::vector<std::uint32_t> offsets;  // node count + 1
    std::vector<std::uint32_t> phyxel;   // per entry
    std::vector<double> share;           // per entry; a row sums to 1
    std::vector<std::int32_t> piece;     // per node, its piece when it was lumped
    std::vector<std::uint8_t> whole;     // per node, 1: keep_moments did not scale back its correction
    std::size_t unlumped = 0;            // nodes of pieces without any phyxel: their row is empty

    std::size_t node_count() const { return offsets.empty() ? 0 : offsets.size() - 1; }
    /// For checkpoints.
    template <class Archive>
    void serialize(Archive& archive) {
        archive(offsets, phyxel, share, piece, whole, unlumped);
    }
};

/// Lumps all nodes: shares are kernel weights of the phyxels whose support reaches the node,
/// corrected to preserve moments (lumping_moments.h). A node outside all supports goes
/// to the nearest phyxel of its piece (ties: the lower index).
/// `locator` holds all rest positions of the phyxels.
MassLumping lump(const MaterialNodes& nodes, const Phyxels& phyxels, const PhyxelLocator& locator,
                 const Parallel& parallel);

/// Sets volume and mass of all phyxels. volumes: m^3 per node; density: kg/m^3.
void apply(const MassLumping& lumping, std::span<const double> volumes, double density, Phyxels& phyxels);

/// Lumps the nodes of new or changed pieces again after pieces separated or phyxels were
/// appended (nodes.piece and phyxels.piece are the new ones, `lumping` is still the old).
/// Sets volume and mass and corrects the velocities of every such piece by one rigid
/// velocity, so that it has the momentum of its nodes before (node b: m_b sum_i s_bi v_i)
/// and their angular momentum (m_b sum_i s_bi x_i x v_i). The latter is taken about the
/// centre of mass of the old piece and relative to its velocity, so that a falling body
/// does not begin to spin because lumped mass moved within it. The pieces of one old
/// piece together therefore conserve its mass, momentum and angular momentum about its
/// centre, up to rounding. Exceptions: fragments whose radius of gyration about an axis is
/// below 0.15 of their support get no angular velocity correction about it, and pieces
/// whose phyxels are all new get their linear momentum only. Pieces with unchanged nodes
/// and phyxels are not touched. Phyxels of the old lumping must keep their indices.
void relump_after_split(MassLumping& lumping, const MaterialNodes& nodes, double density,
                        const PhyxelLocator& locator, Phyxels& phyxels, const Parallel& parallel);

}  // namespace splitcubes::meshless
