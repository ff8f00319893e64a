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

/// Distribution of the nodes' volumes to phyxels, as rows of nodes. Rows lie in one pool; a row that outgrows
/// its capacity moves to the pool's end.
///
/// A row holds shares that keep the moments of the node's mass (lumping_moments.h). They would leave some
/// phyxels too light; these take volume from those around (move_volumes). Volumes are sums of integers, which
/// do not depend on the order of their terms: a row can be replaced without summing the others again, and the
/// result equals that of lumping everything anew.
struct MassLumping {
    struct Row {
        std::uint32_t begin = 0, count = 0, capacity = 0;  // into phyxel and share
    };
    /// Volume of a phyxel in units: by kernel weights, and with moments kept.
    struct Volume {
        std::int64_t plain = 0, corrected = 0;
    };
    /// Volume of nodes that `to` holds in place of `from`, in units.
    struct Transfer {
        std::uint32_t from = 0, to = 0;
        std::int64_t volume = 0;

        bool operator==(const Transfer&) const = default;
    };
    std::vector<Row> rows;                   // per node
    std::vector<std::uint32_t> phyxel;       // pool; ascending within a row
    std::vector<double> share;               // pool; a row sums to 1
    std::vector<std::int32_t> piece;         // per node, its piece when it was lumped
    std::vector<std::int32_t> phyxel_piece;  // per phyxel, its piece then
    std::vector<Volume> volume;              // per phyxel
    std::vector<Transfer> transfers;
    double unit = 1;         // m^3, a power of two
    std::size_t unused = 0;  // entries of the pool that no row owns

    std::size_t node_count() const { return rows.size(); }
    /// Returns the phyxels of a node, ascending; empty if its piece has no phyxel.
    std::span<const std::uint32_t> phyxels_of(std::size_t node) const {
        return std::span(phyxel).subspan(rows[node].begin, rows[node].count);
    }
    /// Returns the shares that keep the moments.
    std::span<const double> shares_of(std::size_t node) const {
        return std::span(share).subspan(rows[node].begin, rows[node].count);
    }
    /// Returns the number of nodes of pieces without any phyxel: their rows are empty.
    std::size_t unlumped() const;
};

/// Lumps all nodes: shares are kernel weights of the phyxels whose support reaches the node,
/// corrected to preserve moments (lumping_moments.h). A node outside all supports goes
/// to the nearest phyxel of its piece (ties: the lower index).
/// `locator` holds all rest positions of the phyxels.
MassLumping lump(const MaterialNodes& nodes, const Phyxels& phyxels, const PhyxelLocator& locator,
                 const Parallel& parallel);

/// Computes the volumes and transfers of the phyxels from the rows, for rows that were loaded.
void sum_volumes(const MaterialNodes& nodes, const Phyxels& phyxels, const PhyxelLocator& locator,
                 MassLumping& lumping, const Parallel& parallel);

/// Sets volume and mass of all phyxels. Masses keep the centres of mass of the pieces (mass_centres.h).
/// density: kg/m^3.
void apply(const MassLumping& lumping, const MaterialNodes& nodes, double density, Phyxels& phyxels);

/// Lumps the nodes again whose phyxels changed after pieces separated or phyxels were appended (nodes.piece
/// and phyxels.piece are the new ones, `lumping` is still the old). The result equals lumping all nodes anew.
/// Sets volume and mass and corrects the velocities of every changed piece by one rigid
/// velocity, so that it has the momentum of its nodes before (node b: m_b sum_i s_bi v_i)
/// and their angular momentum (m_b sum_i s_bi x_i x v_i). The latter is taken about the
/// centre of mass of the old piece and relative to its velocity, so that a falling body
/// does not begin to spin because lumped mass moved within it. The pieces of one old
/// piece together therefore conserve its mass, momentum and angular momentum about its
/// centre, up to rounding. Exceptions: fragments whose radius of gyration about an axis is
/// below 0.15 of their support get no angular velocity correction about it, and pieces
/// whose phyxels are all new get their linear momentum only. Pieces with unchanged nodes
/// and phyxels are not touched. Phyxels of the old lumping must keep their indices.
///
/// Rows are computed where a node and a phyxel of its row separated, and in pieces that got phyxels. Beyond
/// that the cost is a few operations per node and phyxel.
void relump_after_split(MassLumping& lumping, const MaterialNodes& nodes, double density,
                        const PhyxelLocator& locator, Phyxels& phyxels, const Parallel& parallel);

}  // namespace splitcubes::meshless
