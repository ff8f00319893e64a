#include <splitcubes/samples/link_slices.h>
#include <splitcubes/samples/tuning.h>

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

namespace splitcubes::meshless {

void LinkSlices::build(const LinkRows& rows) {
    rows_ = 0;
    slices_.clear();
    run_.clear();
    index_.clear();
    edge_.clear();
    edge_at_.clear();
    column_count_ = gather_count_ = edge_count_ = 0;
    for (FloatArray* array :
         {&forward_, &backward_, &forward_weight_, &backward_weight_, &volume_, &penalty_, &rest_position_,
          &gradient_sum_, &penalty_moment_, &inverse_moment_, &edge_sum_})
        array->clear();
    deficient_.clear();
    std::vector<std::uint32_t> all((rows.range.size() + lanes - 1) / lanes);
    std::iota(all.begin(), all.end(), 0U);
    append(rows, all);
}

void LinkSlices::append(const LinkRows& rows, std::span<const std::uint32_t> slices) {
    resize_rows(rows);
    slot_.resize(rows.neighbour.size(), 0);
    for (const std::uint32_t slice : slices) {
        count_columns(slice, false);
        build_slice(rows, slice);
        build_edges(rows, slice);
        place_slice(slice);
        count_columns(slice, true);
    }
    const auto grow = [&](FloatArray& array, std::size_t numbers) {
        const std::size_t size = run_.size() * numbers;
        if (size > array.capacity()) array.reserve(size + size / tuning::links::spare_part);
        array.resize(size, 0);
    };
    grow(forward_, 4 * lanes);
    grow(backward_, 3 * lanes);
    grow(forward_weight_, 2 * lanes);
    grow(backward_weight_, lanes);
    for (const std::uint32_t slice : slices) {
        const auto clear = [&](FloatArray& array, std::size_t numbers) {
            std::fill(array.begin() + static_cast<std::ptrdiff_t>(column_begin(slice) * numbers),
                      array.begin() + static_cast<std::ptrdiff_t>(column_end(slice) * numbers), 0.0F);
        };
        clear(forward_, 4 * lanes);
        clear(backward_, 3 * lanes);
        clear(forward_weight_, 2 * lanes);
        clear(backward_weight_, lanes);
    }
    // Edges are read twice: for gradients and for forces.
    weights_pay_ = 2 * edge_count_ + column_count_ * 3 * lanes < column_count_ * 7 * lanes;
}

// Gives the row arrays as many rows as there are.
void LinkSlices::resize_rows(const LinkRows& rows) {
    const std::size_t old_rows = rows_, old_stride = stride();
    rows_ = rows.range.size();
    slices_.resize((rows_ + lanes - 1) / lanes);
    deficient_.resize(slices_.size(), 0);
    const auto grow = [&](FloatArray& array, std::size_t components) {
        if (stride() == old_stride) return;
        FloatArray grown(components * stride(), 0);
        for (std::size_t k = 0; k < components; ++k)
            std::copy_n(array.begin() + static_cast<std::ptrdiff_t>(k * old_stride), old_stride,
                        grown.begin() + static_cast<std::ptrdiff_t>(k * stride()));
        array = std::move(grown);
    };
    for (FloatArray* array : {&volume_, &penalty_}) grow(*array, 1);
    for (FloatArray* array : {&rest_position_, &gradient_sum_, &edge_sum_}) grow(*array, 3);
    for (FloatArray* array : {&penalty_moment_, &inverse_moment_}) grow(*array, 6);
    for (std::size_t i = old_rows; i < rows_; ++i)
        for (std::size_t k = 0; k < 3; ++k)
            rest_position_[k * stride() + i] =
                static_cast<float>((rows.rest_position[i] - rows.rest_position[0])[static_cast<int>(k)]);
}

// Keeps the counts of columns in use.
void LinkSlices::count_columns(std::size_t slice, bool add) {
    std::size_t gathers = 0, edges = 0;
    for (std::uint32_t column = column_begin(slice); column < column_end(slice); ++column) {
        if (run_[column] < 0) ++gathers;
        edges += edge_at_[column] >= 0 ? 3 : 3 * lanes;
    }
    const std::size_t columns = column_end(slice) - column_begin(slice);
    column_count_ = add ? column_count_ + columns : column_count_ - columns;
    gather_count_ = add ? gather_count_ + gathers : gather_count_ - gathers;
    edge_count_ = add ? edge_count_ + edges : edge_count_ - edges;
}

void LinkSlices::sort_slice(const LinkRows& rows, std::size_t slice) {
    const std::size_t first = slice * lanes;
    std::vector<Entry>& entries = scratch_.entries;
    entries.clear();
    for (std::size_t lane = 0; lane < lanes && first + lane < rows_; ++lane)
        for (std::uint32_t l = rows.range[first + lane].begin; l < rows.range[first + lane].end; ++l)
            entries.push_back(
                {static_cast<std::int64_t>(rows.neighbour[l]) - static_cast<std::int64_t>(first + lane), l,
                 static_cast<std::uint32_t>(lane)});
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
        return a.distance != b.distance ? a.distance < b.distance : a.lane < b.lane;
    });
    for (std::vector<std::uint32_t>& links : scratch_.left) links.clear();
}

// Finds the columns of a slice; slots count from its first column.
void LinkSlices::build_slice(const LinkRows& rows, std::size_t slice) {
    const std::size_t first = slice * lanes;
    sort_slice(rows, slice);
    const std::vector<Entry>& entries = scratch_.entries;
    std::vector<std::int32_t>& run = scratch_.run;
    run.clear();
    scratch_.index.clear();
    for (std::size_t begin = 0; begin < entries.size();) {
        std::size_t end = begin;
        while (end < entries.size() && entries[end].distance == entries[begin].distance) ++end;
        const std::int64_t base = static_cast<std::int64_t>(first) + entries[begin].distance;
        const bool in_range =
            base >= 0 && base + static_cast<std::int64_t>(lanes) <= static_cast<std::int64_t>(stride());
        const bool is_run = in_range && end - begin >= tuning::links::min_run;
        for (std::size_t k = begin; k < end; ++k) {
            if (is_run)
                slot_[entries[k].link] = static_cast<std::uint32_t>(run.size() * lanes) + entries[k].lane;
            else
                scratch_.left[entries[k].lane].push_back(entries[k].link);
        }
        if (is_run) run.push_back(static_cast<std::int32_t>(base));
        begin = end;
    }
    std::size_t longest = 0;
    for (const auto& links : scratch_.left) longest = std::max(longest, links.size());
    for (std::size_t k = 0; k < longest; ++k) {
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            const std::vector<std::uint32_t>& left = scratch_.left[lane];
            if (k >= left.size()) {
                scratch_.index.push_back(static_cast<std::int32_t>(first + lane));
                continue;
            }
            slot_[left[k]] = static_cast<std::uint32_t>(run.size() * lanes + lane);
            scratch_.index.push_back(static_cast<std::int32_t>(rows.neighbour[left[k]]));
        }
        run.push_back(~static_cast<std::int32_t>(scratch_.index.size() / lanes - 1));
    }
}

// Computes the rest edges of the columns of a slice.
void LinkSlices::build_edges(const LinkRows& rows, std::size_t slice) {
    std::vector<std::array<Vec3, lanes>>& edges = scratch_.edges;
    edges.resize(scratch_.run.size());
    scratch_.filled.assign(edges.size(), 0);
    for (const Entry& entry : scratch_.entries) {
        const std::size_t column = slot_[entry.link] / lanes;
        edges[column][entry.lane] =
            rows.rest_position[rows.neighbour[entry.link]] - rows.rest_position[slice * lanes + entry.lane];
        scratch_.filled[column] = static_cast<std::uint16_t>(scratch_.filled[column] | 1U << entry.lane);
    }
    scratch_.edge.clear();
    scratch_.edge_at.clear();
    for (std::size_t column = 0; column < edges.size(); ++column) {
        const auto first = static_cast<std::size_t>(std::countr_zero(scratch_.filled[column]));
        const Vec3 edge = edges[column][first % lanes];
        bool same = true;
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            if ((scratch_.filled[column] >> lane & 1U) == 0) edges[column][lane] = edge;
            same = same && (edges[column][lane] - edge).norm() <= tuning::links::edge_tolerance * edge.norm();
        }
        const auto at = static_cast<std::int32_t>(scratch_.edge.size());
        scratch_.edge_at.push_back(same ? at : ~at);
        for (int k = 0; k < 3; ++k)
            for (std::size_t lane = 0; lane < (same ? 1 : lanes); ++lane)
                scratch_.edge.push_back(static_cast<float>(edges[column][lane][k]));
    }
}

// Stores a slice. What has outgrown its place moves to the end of its array.
void LinkSlices::place_slice(std::size_t slice) {
    // A slice that grows gets room for more; `step` keeps indices aligned.
    const auto place = [](LinkRange& range, std::size_t count, std::size_t step, std::size_t pool) {
        if (count > range.limit - range.begin) {
            const std::size_t room = range.limit == 0 ? 0 : (count / 4 + step) / step * step;
            range.begin = static_cast<std::uint32_t>(pool);
            range.limit = static_cast<std::uint32_t>(pool + count + room);
        }
        range.end = static_cast<std::uint32_t>(range.begin + count);
        return std::max<std::size_t>(pool, range.limit);
    };
    Slice& to = slices_[slice];
    run_.resize(place(to.columns, scratch_.run.size(), 1, run_.size()));
    edge_at_.resize(run_.size());
    index_.resize(place(to.indices, scratch_.index.size(), lanes, index_.size()));
    edge_.resize(place(to.edges, scratch_.edge.size(), 1, edge_.size()));
    const auto first_set = static_cast<std::int32_t>(to.indices.begin / lanes);
    const auto first_edge = static_cast<std::int32_t>(to.edges.begin);
    for (std::size_t column = 0; column < scratch_.run.size(); ++column) {
        const std::int32_t run = scratch_.run[column], at = scratch_.edge_at[column];
        run_[to.columns.begin + column] = run >= 0 ? run : ~(~run + first_set);
        edge_at_[to.columns.begin + column] = at >= 0 ? at + first_edge : ~(~at + first_edge);
    }
    std::copy(scratch_.index.begin(), scratch_.index.end(), index_.begin() + to.indices.begin);
    std::copy(scratch_.edge.begin(), scratch_.edge.end(), edge_.begin() + to.edges.begin);
    for (const Entry& entry : scratch_.entries)
        slot_[entry.link] += static_cast<std::uint32_t>(to.columns.begin * lanes);
}

void LinkSlices::set_link(std::size_t link, const Link& value) {
    const std::size_t column = slot_[link] / lanes, lane = slot_[link] % lanes;
    float* const forward = forward_.data() + column * 4 * lanes + lane;
    for (std::size_t k = 0; k < 3; ++k)
        forward[k * lanes] = static_cast<float>(value.gradient[static_cast<int>(k)]);
    forward[3 * lanes] = static_cast<float>(value.penalty);
    float* const forward_weight = forward_weight_.data() + column * 2 * lanes + lane;
    forward_weight[0] = static_cast<float>(value.weight);
    forward_weight[lanes] = static_cast<float>(value.penalty);
    set_reverse(link, value.reverse, value.reverse_weight);
}

void LinkSlices::set_reverse(std::size_t link, const Vec3& reverse, double reverse_weight) {
    const std::size_t column = slot_[link] / lanes, lane = slot_[link] % lanes;
    float* const backward = backward_.data() + column * 3 * lanes + lane;
    for (std::size_t k = 0; k < 3; ++k)
        backward[k * lanes] = static_cast<float>(reverse[static_cast<int>(k)]);
    backward_weight_[slot_[link]] = static_cast<float>(reverse_weight);
}

void LinkSlices::set_penalty(std::size_t link, double penalty) {
    const std::size_t column = slot_[link] / lanes, lane = slot_[link] % lanes;
    forward_[column * 4 * lanes + 3 * lanes + lane] = static_cast<float>(penalty);
    forward_weight_[column * 2 * lanes + lanes + lane] = static_cast<float>(penalty);
}

// Stores the upper triangle.
void LinkSlices::set_symmetric(FloatArray& array, std::size_t row, const Mat3& value) const {
    constexpr std::array<std::array<int, 2>, 6> upper{{{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};
    for (std::size_t k = 0; k < 6; ++k)
        array[k * stride() + row] = static_cast<float>(value(upper[k][0], upper[k][1]));
}

void LinkSlices::set_row(std::size_t row, const Row& value) {
    const std::size_t n = stride();
    volume_[row] = static_cast<float>(value.volume);
    penalty_[row] = static_cast<float>(value.penalty);
    for (std::size_t k = 0; k < 3; ++k)
        gradient_sum_[k * n + row] = static_cast<float>(value.gradient_sum[static_cast<int>(k)]);
    for (std::size_t k = 0; k < 3; ++k)
        edge_sum_[k * n + row] = static_cast<float>(value.edge_sum[static_cast<int>(k)]);
    set_symmetric(penalty_moment_, row, value.penalty_moment);
    set_symmetric(inverse_moment_, row, value.inverse_moment);
}

void LinkSlices::set_rank(std::size_t row, bool full) {
    const auto bit = static_cast<std::uint16_t>(1U << row % lanes);
    std::uint16_t& word = deficient_[row / lanes];
    word = static_cast<std::uint16_t>(full ? word & ~bit : word | bit);
}

std::size_t LinkSlices::bytes() const {
    const std::size_t values = weights_pay_ ? 2 * edge_count_ + column_count_ * 3 * lanes + column_count_
                                            : column_count_ * 7 * lanes;
    return sizeof(float) * values + sizeof(std::int32_t) * (2 * column_count_ + 2 * gather_count_ * lanes);
}

}  // namespace splitcubes::meshless
