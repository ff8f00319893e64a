// Aggregates of adjacent phyxels: the coarse part of the preconditioner.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/samples/aligned.h>
#include <splitcubes/samples/neighbourhoods.h>
#include <splitcubes/samples/phyxels.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Coarse part of an additive multilevel preconditioner (Bramble, Pasciak and Xu 1990), over aggregates of
/// phyxels (Vanek, Mandel and Brezina 1996; unsmoothed, with translations only):
///
///     z = D^-1 r + sum over levels l and their aggregates c of  w_c / d_c  P_c P_c^T r,
///
/// P_c being one translation of all phyxels of c. It is symmetric and positive definite for any non-negative
/// weights.
///
/// The free phyxels of each piece are bisected at the middle of the longest side of their bounding box until
/// at most 64 are left: a box of level 0. Boxes of level l are the first sets of at most 64 * 8^l phyxels in
/// that bisection; those of the last level are the pieces. A connected component of the links within a box is
/// an aggregate, so that the two sides of a cut do not move as one. A component of less than a third of 64
/// phyxels (a splinter) joins the aggregate to which its links are stiffest: on its own it would get a
/// smaller correction than that aggregate, which would tear it off. Held phyxels belong to no aggregate.
///
/// d_c, N/m, is the inertia and contact stiffness of its phyxels plus the stiffness of the links that leave
/// it. The latter is link_coupling of Neighbourhoods: the stiffness against a translation of one side of a
/// plane relative to the other, averaged over directions, so that d_c does not depend on the orientation of
/// the body. w_c is the share of the error that finer levels leave: where inertia outweighs the links, no
/// coarse correction is needed.
///
/// The stored state depends only on rest positions, pieces, held phyxels and links, and equals a rebuild bit
/// for bit. The cost of a cut is proportional to the number of boxes whose links it changes. Sums run in a
/// fixed order.
///
class Aggregates {
  public:
    static constexpr std::size_t max_box_size = 64;  // phyxels per box of level 0

    /// Updates the aggregates to the current links and pieces. held: per phyxel, 1: does not move; or empty.
    void update(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                std::span<const std::uint8_t> held, const Parallel& parallel);
    /// Computes d_c and w_c from the diagonal terms, N/m per phyxel: `inertia` and `added` (contacts; may be
    /// empty). factor: multiplies the stiffness of the links.
    void compute_weights(const Neighbourhoods& neighbourhoods, double factor, std::span<const double> inertia,
                         std::span<const double> added, const Parallel& parallel);
    /// Computes the corrections for a residual r (N, a row array of 3, zero where held) and returns their
    /// product with r.
    double correct(const float* r, const Parallel& parallel);

    /// Sets the corrections to zero.
    void clear_correction() { std::fill(correction_.begin(), correction_.end(), 0.0F); }

    /// Returns the number of aggregates of level 0.
    std::size_t count() const { return levels_.empty() ? 0 : levels_[0].size(); }
    std::size_t level_count() const { return levels_.size(); }
    /// Aggregate of level 0 per row; count() for rows without one. Length: whole slices.
    const std::int32_t* index() const { return index_.data(); }
    /// Sum of the corrections of all levels, m: component k of aggregate c at k * (count() + 1) + c; zero at
    /// count().
    const float* correction() const { return correction_.data(); }

  private:
    /// Boxes and aggregates of a level.
    struct Level {
        std::vector<std::uint32_t> box;           // per box of level 0, box of this level
        std::vector<std::uint32_t> aggregate_of;  // per component, its aggregate of this level
        std::vector<std::uint32_t> parent;        // per aggregate, its aggregate of the next level
        std::vector<double> stiffness;            // N/m, per aggregate, of the links that leave it
        std::vector<double> inertia;              // N/m
        std::vector<double> diagonal;             // N/m, d_c
        std::vector<double> finer;                // N/m, sum of the diagonals of the level below
        std::vector<double> remaining;            // w_c
        std::vector<double> inverse;              // m/N, w_c / d_c
        // N, sum of the residual; then m, sum of its own and its ancestors' corrections
        std::vector<Vec3> sum;
        std::size_t size() const { return stiffness.size(); }
    };
    /// Summed links from a component of one box of level 0 to a component of another or the same box.
    struct Coupling {
        std::uint32_t from = 0;    // component within its box
        std::uint32_t to_box = 0;  // box of level 0, or none
        std::uint32_t to = 0;      // component within to_box
        double stiffness = 0;      // N/m
    };
    /// State from which the aggregates were made, to find what has changed since.
    struct Source {
        std::uint64_t structure = 0;              // structure() of the neighbourhoods at the last bisection
        std::uint64_t revision = 0;               // revision() of the neighbourhoods at the last update
        std::vector<std::int32_t> piece;          // per phyxel, at the last bisection
        std::vector<std::uint8_t> held;           // per phyxel, at the last bisection
        std::vector<std::uint64_t> row_revision;  // per phyxel, at the last update of its links
    };
    /// Position of each phyxel in the boxes of level 0.
    struct Location {
        std::vector<std::uint32_t> box;           // per phyxel, its box, or none
        std::vector<std::uint32_t> component;     // per phyxel, its component within the box
        std::vector<std::uint32_t> index_in_box;  // per phyxel, scratch of update_components
    };
    /// Boxes of level 0.
    struct Boxes {
        std::vector<std::uint32_t> member;             // phyxels, sorted by box and component
        std::vector<std::uint32_t> first_member;       // per box, its start in member; one extra entry
        std::vector<std::uint32_t> component_count;    // per box
        std::vector<std::uint32_t> first_component;    // per box, index of its first component; one extra
        std::vector<std::vector<Coupling>> couplings;  // per box
        std::vector<std::uint8_t> dirty, relink;       // per box: components, couplings to be rebuilt
    };
    /// Components of the boxes of level 0.
    struct Components {
        std::vector<std::uint32_t> first;            // per component, its start in Boxes::member; one extra
        std::vector<std::uint32_t> box;              // per component, the box of its aggregate of level 0
        std::vector<double> inertia, added, finest;  // N/m, per component; finest: with the links
        std::vector<Vec3> sum;                       // N, per component, of the residual
    };
    /// Arrays that are used within one call; kept to avoid allocations.
    struct Scratch {
        std::vector<std::uint32_t> other;  // of bisect: members on the upper side
        std::vector<std::uint32_t> boxes;  // of update: boxes to be rebuilt
        std::vector<std::uint32_t> root;   // of join_splinters and build_level: union-find
        std::vector<double> strongest;     // of join_splinters: N/m, per component
    };
    static constexpr std::uint32_t none = ~0U;

    void bisect_pieces(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods);
    void bisect(std::span<const Vec3> rest, std::size_t begin, std::size_t end);
    void find_dirty(const Neighbourhoods& neighbourhoods);
    bool update_components(const Neighbourhoods& neighbourhoods, std::uint32_t box);
    void update_couplings(const Neighbourhoods& neighbourhoods, std::uint32_t box);
    void number_components();
    void join_splinters();
    void build_level(std::size_t level);
    void sum_link_stiffness(Level& level) const;
    void invert_diagonal(std::size_t level);
    template <class Do>
    void each_coupling(const Do& act) const;

    Source source_;
    Location location_;
    Boxes boxes_;
    Components components_;
    std::vector<Level> levels_;
    IndexArray index_;  // per row, aggregate of level 0
    FloatArray correction_;
    std::size_t stride_ = 0;
    Scratch scratch_;
};

}  // namespace splitcubes::meshless
