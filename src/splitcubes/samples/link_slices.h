// Rows of links in single precision for the vector loops, in sliced ELLPACK format
// (Monakov, Lokhmotov and Avetisyan 2010): sixteen rows per slice, one row per lane.
#pragma once

#include <splitcubes/math/types.h>
#include <splitcubes/samples/aligned.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::meshless {

/// Links of a row in a pool: begin .. end - 1.
struct LinkRange {
    std::uint32_t begin = 0, end = 0, limit = 0;  // limit: end of its capacity
};

/// Rows of links.
struct LinkRows {
    std::span<const LinkRange> range;          // per row
    std::span<const std::uint32_t> neighbour;  // per link of the pool
    std::span<const Vec3> rest_position;       // m, per row
};

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

    /// Builds the structure. All values are zero.
    void build(const LinkRows& rows);
    /// Builds the given slices again, among them all that contain rows or links that were added. Their links'
    /// values are zero; all else stays. Each slice equals that of a build, but may lie elsewhere.
    void append(const LinkRows& rows, std::span<const std::uint32_t> slices);
    /// Whether slices that moved left more unused than used memory.
    bool is_sparse() const {
        return 2 * column_count_ < run_.size() || 2 * gather_count_ * lanes < index_.size() ||
               2 * edge_count_ < edge_.size();
    }
    void set_link(std::size_t link, const Link& value);
    void set_reverse(std::size_t link, const Vec3& reverse, double reverse_weight);
    void set_penalty(std::size_t link, double penalty);
    void set_row(std::size_t row, const Row& value);
    /// Not thread-safe for rows of one slice.
    void set_rank(std::size_t row, bool full);

    std::size_t row_count() const { return rows_; }
    std::size_t slice_count() const { return slices_.size(); }
    /// Length of a row array, a multiple of `lanes`: component k of row i is at k * stride() + i.
    std::size_t stride() const { return slice_count() * lanes; }
    /// Number of columns of all slices.
    std::size_t column_count() const { return column_count_; }
    /// Number of those with one index per lane.
    std::size_t gather_count() const { return gather_count_; }
    /// Bytes of link data that one application of the stiffness reads.
    std::size_t bytes() const;
    /// Returns whether an application reads less data with weights than with gradients: g_ij =
    /// w_ij A_i^+ x_ij, and on a lattice all lanes of a column share x_ij.
    bool weights_pay() const { return weights_pay_; }

    /// The columns of a slice are column_begin(slice) .. column_end(slice) - 1.
    std::uint32_t column_begin(std::size_t slice) const { return slices_[slice].columns.begin; }
    std::uint32_t column_end(std::size_t slice) const { return slices_[slice].columns.end; }
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
    void sort_slice(const LinkRows& rows, std::size_t slice);
    void build_slice(const LinkRows& rows, std::size_t slice);
    void build_edges(const LinkRows& rows, std::size_t slice);
    void place_slice(std::size_t slice);
    void count_columns(std::size_t slice, bool add);
    void resize_rows(const LinkRows& rows);
    void set_symmetric(FloatArray& array, std::size_t row, const Mat3& value) const;

    std::size_t rows_ = 0;
    /// Ranges of a slice in the arrays.
    struct Slice {
        LinkRange columns;  // of run_, edge_at_ and the values of links
        LinkRange indices;  // of index_
        LinkRange edges;    // of edge_
    };
    std::vector<Slice> slices_;
    // In use by all slices; edge_count_: of edge_.
    std::size_t column_count_ = 0, gather_count_ = 0, edge_count_ = 0;
    std::vector<std::int32_t> run_;
    IndexArray index_;
    std::vector<std::uint32_t> slot_;  // per link, column * lanes + lane
    FloatArray forward_, backward_, forward_weight_, backward_weight_, edge_;
    std::vector<std::int32_t> edge_at_;
    bool weights_pay_ = false;
    FloatArray rest_position_, volume_, penalty_, gradient_sum_, penalty_moment_, inverse_moment_, edge_sum_;
    std::vector<std::uint16_t> deficient_;  // per slice

    struct Entry {
        std::int64_t distance;  // neighbour less row
        std::uint32_t link;
        std::uint32_t lane;
    };
    /// The slice that is built; kept to avoid allocations.
    struct Scratch {
        std::vector<Entry> entries;
        std::array<std::vector<std::uint32_t>, lanes> left;  // links, per lane
        std::vector<std::int32_t> run, index;        // as run_ and index_; sets count from the slice's first
        std::vector<std::array<Vec3, lanes>> edges;  // m, per column
        std::vector<std::int32_t> edge_at;           // as edge_at_, from the slice's first
        std::vector<float> edge;                     // as edge_
        std::vector<std::uint16_t> filled;           // per column, a bit per lane
    };
    Scratch scratch_;
};

}  // namespace splitcubes::meshless
