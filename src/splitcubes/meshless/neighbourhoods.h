// Who is whose neighbour, and the moving least squares gradients that follow.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/meshless/locator.h>
#include <splitcubes/meshless/material.h>
#include <splitcubes/meshless/phyxels.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Undirected pairs of phyxels in each other's reach. a < b, sorted by (a, b).
struct Pairs {
    std::vector<std::uint32_t> a, b;  // phyxel numbers
    std::vector<float> visibility;    // 0 (cut apart) .. 1 (see each other)

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
/// (Mueller et al. 2004, section 3.1, with another factor). A phyxel that is
/// alone gets factor times its contact_radius. `locator` holds all rest positions.
void compute_support_radii(Phyxels& phyxels, const PhyxelLocator& locator, const Parallel& parallel,
                           const SupportOptions& options = {}, std::size_t first = 0);

/// All pairs of one piece with |X_j - X_i| < max(h_i, h_j), visibility 1.
Pairs find_pairs(const Phyxels& phyxels, const PhyxelLocator& locator, const Parallel& parallel);

/// Copies the visibility of the pairs that `from` and `to` share. Returns the
/// indices (ascending) of the pairs of `to` that `from` does not know.
std::vector<std::uint32_t> carry_visibility(const Pairs& from, Pairs& to);

/// Moving least squares gradients of every phyxel and the pair stiffnesses
/// against zero-energy modes, as rows of directed links (CSR). Row i holds its
/// neighbours in ascending order. A pair that no longer sees itself keeps its
/// links, with zero weight.
class Neighbourhoods {
  public:
    /// From scratch. O(pairs).
    void rebuild(const Phyxels& phyxels, const Pairs& pairs, const Material& material,
                 const Parallel& parallel);
    /// After visibilities of `changed_pairs` changed in the same pair list: costs
    /// by the rows these pairs touch and their neighbours; equal to a rebuild bit
    /// for bit. Does not allocate.
    void update(const Phyxels& phyxels, const Pairs& pairs, std::span<const std::uint32_t> changed_pairs,
                const Material& material, const Parallel& parallel);
    /// After phyxels.volume or the material changed (pieces parted).
    void refresh_volumes(const Phyxels& phyxels, const Material& material, const Parallel& parallel);

    std::size_t size() const { return rank_.size(); }
    std::size_t link_count() const { return neighbour_.size(); }

    // Per phyxel.
    /// size + 1 entries: row i is [offsets[i], offsets[i + 1]).
    std::span<const std::uint32_t> offsets() const { return offsets_; }
    /// Directions in which the neighbours spread: 0..3.
    std::span<const std::uint8_t> rank() const { return rank_; }
    /// Columns: the kept directions first, then the dropped ones; rest space,
    /// right-handed.
    std::span<const Mat3> basis() const { return basis_; }
    /// The projection onto the kept directions of phyxel i; the identity exactly with rank 3.
    Mat3 kept_directions(std::size_t i) const {
        if (rank_[i] == 3) return Mat3::Identity();
        Mat3 projection = Mat3::Zero();
        for (int k = 0; k < rank_[i]; ++k) projection += basis_[i].col(k) * basis_[i].col(k).transpose();
        return projection;
    }
    /// sum_j g_ij, 1/m.
    std::span<const Vec3> gradient_sum() const { return gradient_sum_; }
    /// m^3, as of the last rebuild, update or refresh.
    std::span<const double> volume() const { return volume_; }
    /// Mean of the diagonal of the stiffness matrix's 3x3 block, N/m; approximate
    /// (pairs of two neighbours are left out): for the preconditioner.
    std::span<const double> stiffness_diagonal() const { return diagonal_; }

    /// sum_j k_ij s_ij x_ij, N.
    std::span<const Vec3> pair_first() const { return pair_first_; }
    /// sum_j k_ij s_ij^2 x_ij x_ij^T, N m.
    std::span<const Mat3> pair_second() const { return pair_second_; }

    // Per link i -> j.
    std::span<const std::uint32_t> neighbour() const { return neighbour_; }
    /// g_ij = w_ij A_i^+ x_ij, 1/m, rest space.
    std::span<const Vec3> gradient() const { return gradient_; }
    /// g_ji, so that forces can be gathered.
    std::span<const Vec3> reverse_gradient() const { return reverse_gradient_; }
    /// x_ij = X_j - X_i, m, rest space.
    std::span<const Vec3> rest_edge() const { return rest_edge_; }
    /// k_ij, N/m.
    std::span<const double> pair_stiffness() const { return pair_stiffness_; }
    /// Share of F_i in the pair's mean gradient; that of F_j is 1 - share. One
    /// half, unless one of the two cannot tell the pair's direction.
    std::span<const double> share() const { return share_; }
    /// w_ij * visibility, 1/m^3.
    std::span<const double> weight() const { return weight_; }

  private:
    void build_structure(const Phyxels& phyxels, const Pairs& pairs, const Parallel& parallel);
    void compute_row(const Pairs& pairs, std::size_t i);
    void link_row(const Phyxels& phyxels, const Material& material, std::size_t i);
    void compute_sums(const Material& material, std::size_t i);
    bool tells_direction(std::size_t i, std::size_t link) const;

    std::vector<std::uint32_t> offsets_;      // rows of links, one more than phyxels
    std::vector<std::uint32_t> neighbour_;    // per link, phyxel
    std::vector<std::uint32_t> reverse_;      // per link i -> j, the link j -> i
    std::vector<std::uint32_t> pair_;         // per link, index of its pair
    std::vector<Vec3> rest_edge_;             // per link, m
    std::vector<Vec3> gradient_;              // per link, 1/m
    std::vector<Vec3> reverse_gradient_;      // per link, 1/m
    std::vector<double> base_weight_;         // per link, w_ij, 1/m^3
    std::vector<double> weight_;              // per link, w_ij * visibility, 1/m^3
    std::vector<double> pair_stiffness_;      // per link, N/m
    std::vector<double> share_;               // per link
    std::vector<float> visibility_;           // per link
    std::vector<std::uint8_t> rank_;          // per phyxel
    std::vector<Mat3> basis_;                 // per phyxel
    std::vector<Vec3> gradient_sum_;          // per phyxel, 1/m
    std::vector<double> base_weight_sum_;     // per phyxel, sum_j w_ij before any cut, 1/m^3
    std::vector<double> volume_;              // per phyxel, m^3
    std::vector<double> diagonal_;            // per phyxel, N/m
    std::vector<Vec3> pair_first_;            // per phyxel, N
    std::vector<Mat3> pair_second_;           // per phyxel, N m
    std::vector<std::uint8_t> mark_;          // scratch of update: 1 own row, 2 beside one
    std::vector<std::uint32_t> rows_, ring_;  // scratch of update
};

}  // namespace splitcubes::meshless
