// Single rows of the mass lumping.
#pragma once

#include <splitcubes/samples/lumping_moments.h>
#include <splitcubes/samples/mass_lumping.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// The row of a node while it is made.
struct LumpedRow {
    std::vector<std::uint32_t> phyxel;
    std::vector<double> plain, share;  // by kernel weights alone, and corrected
};

/// Makes rows, and sums the volumes that they hold. Several threads may use one, each with its own rows.
class RowLumper {
  public:
    RowLumper(const MaterialNodes& nodes, const Phyxels& phyxels, const PhyxelLocator& locator);

    /// Searches for the phyxels of a node.
    void find(std::size_t node, LumpedRow& row, LumpingMoments& moments) const;
    /// The same from the old row of a node whose piece got no phyxels: pieces separate and never join, so no
    /// other phyxel can reach the node.
    void filter(std::size_t node, std::span<const std::uint32_t> old, LumpedRow& row,
                LumpingMoments& moments) const;

  private:
    void weigh(std::size_t node, std::span<const std::uint32_t> candidates, LumpedRow& row,
               LumpingMoments& moments) const;
    void take_nearest(std::size_t node, LumpedRow& row) const;

    const MaterialNodes& nodes_;
    const Phyxels& phyxels_;
    const PhyxelLocator& locator_;
    double reach_ = 0;  // m, largest support radius
};

/// Writes the shares of kernel weights of a row.
void plain_shares(const Vec3& node, const Phyxels& phyxels, std::span<const std::uint32_t> phyxel,
                  std::vector<double>& out);

/// Sums the volumes that nodes give to phyxels. Each thread needs its own, for the same sums.
class VolumeSums {
  public:
    /// A row with its shares by kernel weights and its corrected shares.
    struct Row {
        std::span<const std::uint32_t> phyxel;
        std::span<const double> plain, share;
    };
    /// concurrent: whether other threads add to the same sums.
    VolumeSums(double unit, bool concurrent, std::span<MassLumping::Volume> sums)
        : unit_(unit), concurrent_(concurrent), sums_(sums) {}

    /// Replaces the row of a node with this volume, m^3; an empty row adds nothing.
    void replace(double volume, const Row& old, const Row& row);

  private:
    void add(std::int64_t amount, std::int64_t& sum) const;
    /// Units for each entry of a row.
    struct Parts {
        std::vector<std::int64_t> plain, corrected;
    };
    Parts old_, new_;
    double unit_;  // m^3
    bool concurrent_;
    std::span<MassLumping::Volume> sums_;
};

/// Stores a row in the pool; one that outgrows its capacity moves to the end. Returns false, without storing
/// it, if it would have to move and may not.
bool store(const LumpedRow& row, bool may_move, std::size_t node, MassLumping& lumping);

/// Moves the rows together at the start of the pool.
void compact_rows(MassLumping& lumping);

/// Makes the transfers anew: a phyxel with less than min_volume_share of its plain volume takes what it lacks
/// from the phyxels of its piece within its support, in proportion to what they have above that and more from
/// near ones, and from farther ones if these have too little. Phyxels that take from the same one share
/// what it has, whatever their order.
void move_volumes(const Phyxels& phyxels, const PhyxelLocator& locator, MassLumping& lumping);

}  // namespace splitcubes::meshless
