// Neighbour pairs of phyxels and their moving least squares gradients.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/samples/aligned.h>
#include <splitcubes/samples/link_slices.h>
#include <splitcubes/samples/locator.h>
#include <splitcubes/samples/material.h>
#include <splitcubes/samples/phyxels.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Undirected pairs of phyxels within each other's support, a < b. Those of the uncut body are sorted by
/// (a, b); pairs with phyxels that were added later follow, sorted by (b, a). So for each phyxel its partners
/// with lower indices come in ascending order, and those with higher ones, too.
struct Pairs {
    std::vector<std::uint32_t> a, b;  // phyxel indices
    std::vector<float> visibility;    // 0 (cut apart) .. 1 (visible to each other)

    std::size_t size() const { return a.size(); }
    /// For checkpoints.
    template <class Archive>
    void serialize(Archive& archive) {
        archive(a, b, visibility);
    }
};

struct SupportOptions {
    /// h_i = factor * mean distance to the `nearest_count` nearest phyxels. On a
    /// lattice 1.6 gives 18 to 26 neighbours.
    double factor = 1.6;
    int nearest_count = 10;
};

/// Writes support_radius of the phyxels first..size-1 from their rest positions
/// (Mueller et al. 2004, section 3.1, with another factor). A single phyxel gets
/// factor times its contact_radius. `locator` holds all rest positions.
void compute_support_radii(Phyxels& phyxels, const PhyxelLocator& locator, const Parallel& parallel,
                           const SupportOptions& options = {}, std::size_t first = 0);

/// Returns all pairs within a piece with |X_j - X_i| < max(h_i, h_j), visibility 1.
Pairs find_pairs(const Phyxels& phyxels, const PhyxelLocator& locator, const Parallel& parallel);

/// Appends the pairs of the phyxels first..size-1, visibility 1. Together with those of the phyxels before
/// they are the pairs that find_pairs returns, apart from pairs that separated since.
void append_pairs(const Phyxels& phyxels, const PhyxelLocator& locator, std::size_t first, Pairs& pairs,
                  const Parallel& parallel);

/// Moving least squares gradients of every phyxel and the penalties on zero-energy
/// modes, as rows of directed links. Row i holds its neighbours in ascending
/// order; rows lie in one pool, and a row that outgrows its capacity moves to the pool's end. A pair with
/// visibility 0 keeps its links, with zero weight. `slices` holds the same data in single precision for the
/// solvers. Weights of rows that are not symmetric are balanced (balance_weights), then multiplied by
/// visibility.
class Neighbourhoods {
  public:
    /// Builds everything from scratch. O(pairs).
    void rebuild(const Phyxels& phyxels, const Pairs& pairs, const Material& material,
                 const Parallel& parallel);
    /// Updates after visibilities of `changed_pairs` changed in the same pair list. The cost grows with the
    /// rows that these pairs touch and their neighbours; the result equals a rebuild bit for bit. Does not
    /// allocate.
    void update(const Phyxels& phyxels, const Pairs& pairs, std::span<const std::uint32_t> changed_pairs,
                const Material& material, const Parallel& parallel);
    /// Adds the phyxels and pairs that were appended since the last rebuild or append, and updates
    /// `changed_pairs` of the others. The cost grows with the rows that these pairs touch and their
    /// neighbours, apart from moving a few numbers per phyxel; each row equals that of a rebuild bit for bit.
    void append(const Phyxels& phyxels, const Pairs& pairs, std::span<const std::uint32_t> changed_pairs,
                const Material& material, const Parallel& parallel);
    /// Updates after phyxels.volume (pieces separated) or the material changed. With the same material only
    /// rows whose volume changed are recomputed.
    void refresh_volumes(const Phyxels& phyxels, const Material& material, const Parallel& parallel);
    /// Updates after phyxels.held changed. Returns whether it has since the last call or rebuild. The cost
    /// beyond a comparison per phyxel grows with the rows around those that changed.
    bool update_held(const Phyxels& phyxels, const Pairs& pairs, const Material& material,
                     const Parallel& parallel);

    std::size_t size() const { return rows_.rank.size(); }
    /// Returns the number of links in all rows.
    std::size_t link_count() const { return 2 * pair_count_; }

    // Per phyxel.
    /// The links of phyxel i are links_begin(i) .. links_end(i) - 1.
    std::uint32_t links_begin(std::size_t i) const { return range_[i].begin; }
    std::uint32_t links_end(std::size_t i) const { return range_[i].end; }
    /// Returns the link i -> j, or links_end(i) if there is none.
    std::uint32_t find_link(std::size_t i, std::uint32_t j) const;
    /// Number of independent directions of the neighbours: 0..3.
    std::span<const std::uint8_t> rank() const { return rows_.rank; }
    /// Columns: the kept directions first, then the dropped ones; rest space,
    /// right-handed.
    std::span<const Mat3> basis() const { return rows_.basis; }
    /// Returns the projection onto the kept directions of phyxel i; exactly the identity with rank 3.
    Mat3 kept_directions(std::size_t i) const {
        if (rows_.rank[i] == 3) return Mat3::Identity();
        Mat3 projection = Mat3::Zero();
        for (int k = 0; k < rows_.rank[i]; ++k)
            projection += rows_.basis[i].col(k) * rows_.basis[i].col(k).transpose();
        return projection;
    }
    /// sum_j g_ij, 1/m.
    std::span<const Vec3> gradient_sum() const { return rows_.gradient_sum; }
    /// m^3, as of the last rebuild, update or refresh: the part of phyxels.volume that can be strained, less
    /// than all of it where a phyxel is held and has free neighbours on one side only.
    std::span<const double> volume() const { return rows_.volume; }
    /// Mean of the diagonal of the stiffness matrix's 3x3 block, N/m, for the preconditioner. Exact for
    /// corotated phyxels with equal rotations.
    std::span<const double> stiffness_diagonal() const { return rows_.diagonal; }
    /// Returns the contribution of a link of phyxel i to the stiffness, N/m, against shifting one of its ends
    /// relative to the other. Summed over a plane through a lattice, the mean over shift directions is exact,
    /// since the gradients of both sides see half of each jump. Symmetric in the two directions of the link.
    double link_coupling(std::size_t link, std::size_t i) const {
        return rows_.coupling[i] * links_.weight[link] +
               rows_.coupling[links_.neighbour[link]] * links_.weight[links_.reverse[link]];
    }
    /// A_i = sum_j w_ij x_ij x_ij^T, 1/m.
    std::span<const Mat3> moment() const { return rows_.moment; }
    /// A_i^+, m: the inverse in the kept directions.
    std::span<const Mat3> inverse_moment() const { return rows_.inverse_moment; }
    /// c_i of the penalty c_i w_ij / 2 |F_i x_ij - (x_j - x_i)|^2, N m^2. Zero where the
    /// neighbours do not determine F_i well enough.
    std::span<const double> penalty() const { return rows_.penalty; }

    // Per link i -> j.
    std::span<const std::uint32_t> neighbour() const { return links_.neighbour; }
    /// g_ij = w_ij A_i^+ x_ij, 1/m, rest space.
    std::span<const Vec3> gradient() const { return links_.gradient; }
    /// g_ji, so that forces can be gathered.
    std::span<const Vec3> reverse_gradient() const { return links_.reverse_gradient; }
    /// x_ij = X_j - X_i, m, rest space.
    std::span<const Vec3> rest_edge() const { return links_.rest_edge; }
    /// w_ij, 1/m^3: kernel times visibility, balanced.
    std::span<const double> weight() const { return links_.weight; }
    /// The link j -> i.
    std::span<const std::uint32_t> reverse() const { return links_.reverse; }

    /// Returns whether phyxel i has rank 2 and neighbours off its plane.
    bool has_neighbours_off_plane(std::size_t i) const { return rows_.off_plane[i] != 0; }

    /// Index of the link's pair in the given Pairs.
    std::span<const std::uint32_t> pair() const { return links_.pair; }

    const LinkSlices& slices() const { return slices_; }
    /// Changes with every update; equal revisions mean equal contents.
    std::uint64_t revision() const { return revision_; }
    /// The same for the weights and penalty of each row, and for the list of neighbours.
    std::span<const std::uint64_t> row_revision() const { return rows_.revision; }
    std::uint64_t structure() const { return structure_; }

  private:
    /// The material parameters that penalties and diagonals depend on.
    struct MaterialKey {
        double zero_energy = -1, mu = -1, lambda = -1, volume_stiffness = -1;
        bool operator==(const MaterialKey&) const = default;
    };
    /// Per directed link i -> j.
    struct Links {
        StreamArray<std::uint32_t> neighbour;  // phyxel j
        StreamArray<std::uint32_t> reverse;    // the link j -> i
        StreamArray<std::uint32_t> pair;       // index of its pair
        StreamArray<Vec3> rest_edge;           // x_ij, m
        StreamArray<Vec3> gradient;            // g_ij, 1/m
        StreamArray<Vec3> reverse_gradient;    // g_ji, 1/m
        StreamArray<double> base_weight;       // w_ij, 1/m^3
        StreamArray<double> weight;            // w_ij, 1/m^3
    };
    /// Per phyxel i.
    struct Rows {
        std::vector<std::uint8_t> rank;
        std::vector<std::uint8_t> off_plane;  // 1: has_neighbours_off_plane
        StreamArray<Mat3> basis;
        std::vector<Vec3> gradient_sum;    // 1/m
        StreamArray<Mat3> moment;          // A_i, 1/m
        StreamArray<Mat3> inverse_moment;  // pseudo-inverse in the kept directions, m
        std::vector<double> base_trace;    // trace of the moment before any cut, 1/m
        std::vector<double> penalty;       // c_i, N m^2
        std::vector<double> whole_volume;  // m^3, of the phyxel
        std::vector<double> free_share;    // of it, 0.5 to 1: the part that is not behind a held phyxel
        std::vector<double> volume;        // m^3, their product
        std::vector<std::uint8_t> held;
        std::vector<double> diagonal;  // N/m
        std::vector<double> coupling;  // link_coupling per unit of weight, N m^2
        std::vector<std::uint64_t> revision;
    };
    /// Rows that an update changes; kept to avoid allocations.
    struct Scratch {
        std::vector<std::uint8_t> mark;   // per phyxel: 1 changed row, 2 neighbour of one; else 0
        std::vector<std::uint32_t> rows;  // changed rows
        std::vector<std::uint32_t> ring;  // these and their neighbours
        std::vector<std::uint32_t> slices;
    };

    static MaterialKey key_of(const Material& material);
    static std::uint64_t next_revision();

    void build_structure(const Phyxels& phyxels, const Pairs& pairs, const Parallel& parallel);
    void add_rows(const Phyxels& phyxels);
    void resize_pool(std::size_t count);
    void reserve_pool(std::size_t count);
    void init_link(const Phyxels& phyxels, std::size_t i, std::uint32_t link);
    void make_room(std::uint32_t i);
    std::uint32_t add_link(const Phyxels& phyxels, std::uint32_t i, std::uint32_t j, std::uint32_t pair);
    void add_pairs(const Phyxels& phyxels, const Pairs& pairs);
    void rebuild_slices(const Phyxels& phyxels, std::size_t old_size);
    void mark_row(std::uint32_t i);
    void mark_rows(const Pairs& pairs, std::span<const std::uint32_t> changed_pairs);
    void update_rows(const Pairs& pairs, const Material& material, const Parallel& parallel);
    void write_links(std::size_t i);
    void face_free_side(std::size_t i);
    void balance_row(std::size_t i);
    void compute_row(const Pairs& pairs, std::size_t i);
    bool has_resolved_gradient(std::size_t i) const;
    void set_penalty(const Material& material, std::size_t i);
    void link_row(std::size_t i);
    void link_back(std::size_t i);
    void finish_row(const Material& material, std::size_t i);
    double link_penalty(std::size_t link, std::size_t i) const {
        return rows_.penalty[i] * links_.weight[link] +
               rows_.penalty[links_.neighbour[link]] * links_.weight[links_.reverse[link]];
    }
    void add_ring();

    std::vector<LinkRange> range_;  // per phyxel
    std::size_t pair_count_ = 0;    // pairs that the rows hold
    std::size_t unused_links_ = 0;  // of the pool
    Links links_;
    Rows rows_;
    LinkSlices slices_;
    MaterialKey material_key_;  // of the penalties and diagonals
    std::uint64_t revision_ = 0, structure_ = 0;
    Scratch scratch_;
};

}  // namespace splitcubes::meshless
