// Rows of links in single precision for the vector loops, in sliced ELLPACK format
// (Monakov, Lokhmotov and Avetisyan 2010): sixteen rows per slice, one row per lane.
#pragma once

#include <splitcubes/math/types.h>
#include <splitcubes/samples/aligned.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// A slice is a sequence of columns; a column holds one link of each of its rows.
/// Consecutive phyxels of a lattice have neighbours at the same index offset, so most
/// columns are sixteen contiguous neighbours (`run`); the remaining links are packed into
/// columns with one index per lane. Lanes without a link have weight zero. The slot of a
/// link depends on the structure alone: a cut changes values, never slots.
///
/// Link data is stored twice: gradients for loops that need full precision (forward,
/// backward), and weights for faster loops (forward_weight, backward_weight, edge).
///
/// Every sum over a row runs through its columns in order, in one lane, so results do not
/// depend on the machine's vector width.
class LinkSlices {
  public:
    static constexpr std::size_t lanes = 16;

    /// Values of a link i -> j.
    struct Link {
        Vec3 gradient = Vec3::Zero();  // g_ij, 1/m
        double penalty = 0;            // m_ij = c_i w_ij + c_j w_ji, N/m
        Vec3 reverse = Vec3::Zero();   // g_ji, 1/m
        double weight = 0;             // w_ij, 1/m^3
        double reverse_weight = 0;     // w_ji, 1/m^3
    };
    /// Values of a row.
    struct Row {
        double volume = 0;                   // m^3
        Vec3 gradient_sum = Vec3::Zero();    // 1/m
        double penalty = 0;                  // c_i, N m^2
        Mat3 penalty_moment = Mat3::Zero();  // c_i A_i, N m, symmetric
        Mat3 inverse_moment = Mat3::Zero();  // A_i^+, m, symmetric
        Vec3 edge_sum = Vec3::Zero();        // A_i sum_j g_ij, 1/m^2
    };

    /// Builds the structure from the rows of links of Neighbourhoods (CSR) and the rest
    /// positions (m). All values are zero.
    void build(std::span<const std::uint32_t> offsets, std::span<const std::uint32_t> neighbour,
               std::span<const Vec3> rest_position);
    void set_link(std::size_t link, const Link& value);
    void set_reverse(std::size_t link, const Vec3& reverse, double reverse_weight);
    void set_penalty(std::size_t link, double penalty);
    void set_row(std::size_t row, const Row& value);
    /// Not thread-safe for rows of one slice.
    void set_rank(std::size_t row, bool full);

    std::size_t row_count() const { return rows_; }
    std::size_t slice_count() const { return first_column_.empty() ? 0 : first_column_.size() - 1; }
    /// Length of a row array, a multiple of `lanes`: component k of row i is at k * stride() + i.
    std::size_t stride() const { return slice_count() * lanes; }
    std::size_t column_count() const { return run_.size(); }
    /// Number of columns with one index per lane.
    std::size_t gather_count() const { return index_.size() / lanes; }
    /// Bytes of link data that one application of the stiffness reads.
    std::size_t bytes() const;
    /// Returns whether an application reads less data with weights than with gradients: g_ij =
    /// w_ij A_i^+ x_ij, and on a lattice all lanes of a column share x_ij.
    bool weights_pay() const { return weights_pay_; }

    // Per slice, plus an end entry.
    std::span<const std::uint32_t> first_column() const { return first_column_; }
    // Per column: the first of sixteen contiguous phyxels, or ~k: the k-th set of indices.
    std::span<const std::int32_t> run() const { return run_; }
    const float* forward() const { return forward_.data(); }    // per column: 16 each of g_ij (x, y, z), m_ij
    const float* backward() const { return backward_.data(); }  // per column: 16 each of g_ji (x, y, z)
    const std::int32_t* index() const { return index_.data(); }
    const float* forward_weight() const {
        return forward_weight_.data();
    }  // per column: 16 each of w_ij, m_ij
    const float* backward_weight() const { return backward_weight_.data(); }  // per column: 16 of w_ji
    // Per column: offset of x_ij in edge(): k: three values shared by all lanes; ~k: 16 each.
    std::span<const std::int32_t> edge_at() const { return edge_at_; }
    const float* edge() const { return edge_.data(); }  // m
    // Row arrays.
    const float* rest_position() const { return rest_position_.data(); }  // 3, m, relative to the first
    const float* volume() const { return volume_.data(); }
    const float* penalty() const { return penalty_.data(); }                // c_i, N m^2
    const float* gradient_sum() const { return gradient_sum_.data(); }      // 3
    const float* penalty_moment() const { return penalty_moment_.data(); }  // 6: xx xy xz yy yz zz
    const float* inverse_moment() const { return inverse_moment_.data(); }  // 6, as penalty_moment
    const float* edge_sum() const { return edge_sum_.data(); }              // 3
    /// One bit per row: rank below 3.
    std::span<const std::uint16_t> deficient() const { return deficient_; }

  private:
    void build_slice(std::span<const std::uint32_t> offsets, std::span<const std::uint32_t> neighbour,
                     std::size_t slice);
    void build_edges(std::span<const std::uint32_t> offsets, std::span<const std::uint32_t> neighbour,
                     std::span<const Vec3> rest_position);
    void set_symmetric(FloatArray& array, std::size_t row, const Mat3& value) const;

    std::size_t rows_ = 0;
    std::vector<std::uint32_t> first_column_;
    std::vector<std::int32_t> run_;
    IndexArray index_;
    std::vector<std::uint32_t> slot_;  // per link, column * lanes + lane
    FloatArray forward_, backward_, forward_weight_, backward_weight_, edge_;
    std::vector<std::int32_t> edge_at_;
    bool weights_pay_ = false;
    FloatArray rest_position_, volume_, penalty_, gradient_sum_, penalty_moment_, inverse_moment_, edge_sum_;
    std::vector<std::uint16_t> deficient_;  // per slice
};

}  // namespace splitcubes::meshless
