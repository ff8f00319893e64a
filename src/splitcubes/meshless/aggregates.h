// Groups of phyxels that lie together, and what one shift of each adds to the preconditioner.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/meshless/aligned.h>
#include <splitcubes/meshless/neighbourhoods.h>
#include <splitcubes/meshless/phyxels.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// The coarse part of an additive multilevel preconditioner (Bramble, Pasciak and Xu 1990), over
/// aggregates of phyxels (Vanek, Mandel and Brezina 1996, unsmoothed, with shifts only):
///
///     z = D^-1 r + sum over levels l and their aggregates c of  w_c / d_c  P_c P_c^T r,
///
/// P_c being one shift of all phyxels of c. It is symmetric and positive definite whatever the
/// weights are.
///
/// The phyxels of one piece that nothing holds are halved at the middle of their box's longest side
/// until no more than 64 are left: a box of level 0. Boxes of level l are the first sets of no more than
/// 64 * 8^l on that way; those of the last level are the pieces. What hangs together by links within a box
/// is an aggregate, so that no two sides of a cut move as one; a splinter of less than a third of 64 is of
/// the aggregate that it hangs on most: it would be corrected by less than that, and torn off. What is held
/// is in none.
///
/// d_c, N/m: inertia and contact springs of its phyxels, and the stiffness of the links that leave it,
/// link_coupling of Neighbourhoods, which is that of a shift of one side of a plane against the other,
/// its mean over directions, so that d_c does not depend on how the body is turned. w_c is the share that
/// finer levels leave: where the phyxels' own inertia outweighs the links they need no help.
///
/// What is kept follows from places at rest, pieces, holds and links, and is equal to what is built from
/// nothing bit for bit; a cut costs by the boxes whose links it changes. Sums run in a fixed order.
class Aggregates {
  public:
    static constexpr std::size_t most = 64;  // phyxels an aggregate of level 0

    /// Takes the body as it is. held: per phyxel, 1: it does not move; or empty.
    void update(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                std::span<const std::uint8_t> held, const Parallel& parallel);
    /// Takes what the system has beside the links' stiffness, N/m per phyxel: `inertia` and `added`
    /// (contacts; may be empty). factor: of the stiffness.
    void weigh(const Neighbourhoods& neighbourhoods, double factor, std::span<const double> inertia,
               std::span<const double> added, const Parallel& parallel);
    /// Finds the corrections of a residual r (N, a row array of 3, zero where held) and returns their
    /// product with it.
    double correct(const float* r, const Parallel& parallel);

    /// Of level 0.
    std::size_t count() const { return levels_.empty() ? 0 : levels_[0].size(); }
    std::size_t level_count() const { return levels_.size(); }
    /// Per row, its aggregate; count() of those that are in none. Length: whole slices.
    const std::int32_t* index() const { return index_.data(); }
    /// Sum of all levels' corrections, m: component k of aggregate c at k * (count() + 1) + c; zero at
    /// count().
    const float* correction() const { return correction_.data(); }

  private:
    /// Of a level.
    struct Level {
        std::vector<std::uint32_t> box;     // per box of level 0, box of this level
        std::vector<std::uint32_t> of;      // per part of a box of level 0, aggregate of this level
        std::vector<std::uint32_t> parent;  // in the next level
        std::vector<double> stiffness;      // N/m, of the links that leave it
        std::vector<double> inertia;        // N/m
        std::vector<double> diagonal;       // N/m, d_c
        std::vector<double> finer;          // N/m, sum of those of the level below
        std::vector<double> left;           // w_c
        std::vector<double> inverse;        // m/N, w_c / d_c
        std::vector<Vec3> sum;              // N, of the residual; then m, its and its parents' corrections
        std::size_t size() const { return stiffness.size(); }
    };
    /// Links from a part of one box of level 0 to a part of another, or of the same.
    struct Coupling {
        std::uint32_t from = 0;    // part
        std::uint32_t to_box = 0;  // or none
        std::uint32_t to = 0;      // part
        double stiffness = 0;      // N/m
    };
    static constexpr std::uint32_t none = ~0U;

    void divide(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods);
    void halve(std::span<const Vec3> rest, std::size_t begin, std::size_t end);
    void find_stale(const Neighbourhoods& neighbourhoods);
    bool take_parts(const Neighbourhoods& neighbourhoods, std::uint32_t box);
    void take_links(const Neighbourhoods& neighbourhoods, std::uint32_t box);
    void number_parts();
    void join_splinters();
    void number(std::size_t level);
    void stiffen(Level& level) const;
    void invert(std::size_t level);
    template <class Do>
    void each_coupling(const Do& act) const;

    std::uint64_t structure_ = 0;              // of the neighbourhoods that it was divided for
    std::uint64_t revision_ = 0;               // of the neighbourhoods that were taken
    std::vector<std::int32_t> piece_;          // per phyxel, as divided
    std::vector<std::uint8_t> held_;           // per phyxel, as divided
    std::vector<std::uint64_t> row_revision_;  // per phyxel, as its links were taken
    std::vector<std::uint32_t> member_;        // phyxels, one box of level 0 and one part after the other
    std::vector<std::uint32_t> other_;         // scratch of halve
    std::vector<std::uint32_t> first_member_;  // per box of level 0, one more
    std::vector<std::uint32_t> box_;           // per phyxel, of level 0, or none
    std::vector<std::uint32_t> part_;          // per phyxel, of its box
    std::vector<std::uint32_t> place_;         // per phyxel, scratch of take_parts
    std::vector<std::uint32_t> part_count_;    // per box
    std::vector<std::vector<Coupling>> couplings_;  // per box
    std::vector<std::uint8_t> stale_, relink_;      // per box: its parts, its couplings are to be found
    std::vector<std::uint32_t> list_;               // of boxes, scratch
    std::vector<std::uint32_t> first_part_;         // per box, number of its first part, one more
    std::vector<std::uint32_t> first_;              // in member_, per part, one more
    std::vector<std::uint32_t> root_, box_of_;      // scratch of number
    std::vector<double> strongest_;                 // N/m, per part, scratch of join_splinters
    IndexArray index_;                              // per row, its aggregate of level 0
    std::vector<Level> levels_;
    std::vector<double> inertia_, added_, finest_;  // N/m, per part
    std::vector<Vec3> part_sum_;                    // N, per part
    FloatArray correction_;
    std::size_t stride_ = 0;
};

}  // namespace splitcubes::meshless
