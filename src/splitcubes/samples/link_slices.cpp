#include <splitcubes/samples/link_slices.h>
#include <splitcubes/samples/tuning.h>

#include <algorithm>
#include <array>
#include <bit>

namespace splitcubes::meshless {

namespace {

struct Entry {
    std::int64_t distance;  // neighbour less row
    std::uint32_t link;
    std::uint32_t lane;
};

}  // namespace

void LinkSlices::build(std::span<const std::uint32_t> offsets, std::span<const std::uint32_t> neighbour,
                       std::span<const Vec3> rest_position) {
    rows_ = offsets.empty() ? 0 : offsets.size() - 1;
    const std::size_t slices = (rows_ + lanes - 1) / lanes;
    run_.clear();
    index_.clear();
    slot_.assign(neighbour.size(), 0);
    first_column_.assign(slices + 1, 0);  // stride() is valid from here on
    for (std::size_t slice = 0; slice < slices; ++slice) build_slice(offsets, neighbour, slice);
    forward_.assign(run_.size() * 4 * lanes, 0);
    backward_.assign(run_.size() * 3 * lanes, 0);
    forward_weight_.assign(run_.size() * 2 * lanes, 0);
    backward_weight_.assign(run_.size() * lanes, 0);
    build_edges(offsets, neighbour, rest_position);
    for (FloatArray* array : {&volume_, &penalty_}) array->assign(stride(), 0);
    rest_position_.assign(3 * stride(), 0);
    for (std::size_t i = 0; i < rows_; ++i)
        for (std::size_t k = 0; k < 3; ++k)
            rest_position_[k * stride() + i] =
                static_cast<float>((rest_position[i] - rest_position[0])[static_cast<int>(k)]);
    gradient_sum_.assign(3 * stride(), 0);
    for (FloatArray* array : {&penalty_moment_, &inverse_moment_}) array->assign(6 * stride(), 0);
    edge_sum_.assign(3 * stride(), 0);
    deficient_.assign(slices, 0);
}

void LinkSlices::build_edges(std::span<const std::uint32_t> offsets, std::span<const std::uint32_t> neighbour,
                             std::span<const Vec3> rest_position) {
    std::vector<std::array<Vec3, lanes>> edges(run_.size());
    std::vector<std::uint16_t> filled(run_.size(), 0);
    for (std::size_t i = 0; i < rows_; ++i)
        for (std::uint32_t l = offsets[i]; l < offsets[i + 1]; ++l) {
            const std::size_t column = slot_[l] / lanes, lane = slot_[l] % lanes;
            edges[column][lane] = rest_position[neighbour[l]] - rest_position[i];
            filled[column] = static_cast<std::uint16_t>(filled[column] | 1U << lane);
        }
    edge_.clear();
    edge_at_.clear();
    for (std::size_t column = 0; column < edges.size(); ++column) {
        const auto first = static_cast<std::size_t>(std::countr_zero(filled[column]));
        const Vec3 edge = edges[column][first % lanes];
        bool same = true;
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            if ((filled[column] >> lane & 1U) == 0) edges[column][lane] = edge;
            same = same && (edges[column][lane] - edge).norm() <= tuning::links::edge_tolerance * edge.norm();
        }
        const auto at = static_cast<std::int32_t>(edge_.size());
        edge_at_.push_back(same ? at : ~at);
        for (int k = 0; k < 3; ++k)
            for (std::size_t lane = 0; lane < (same ? 1 : lanes); ++lane)
                edge_.push_back(static_cast<float>(edges[column][lane][k]));
    }
    // Edges are read twice: for gradients and for forces.
    weights_pay_ = 2 * edge_.size() + forward_weight_.size() + backward_weight_.size() <
                   forward_.size() + backward_.size();
}

void LinkSlices::build_slice(std::span<const std::uint32_t> offsets, std::span<const std::uint32_t> neighbour,
                             std::size_t slice) {
    const std::size_t first = slice * lanes;
    std::vector<Entry> entries;
    for (std::size_t lane = 0; lane < lanes && first + lane < rows_; ++lane)
        for (std::uint32_t l = offsets[first + lane]; l < offsets[first + lane + 1]; ++l)
            entries.push_back(
                {static_cast<std::int64_t>(neighbour[l]) - static_cast<std::int64_t>(first + lane), l,
                 static_cast<std::uint32_t>(lane)});
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
        return a.distance != b.distance ? a.distance < b.distance : a.lane < b.lane;
    });
    std::array<std::vector<std::uint32_t>, lanes> left;  // links, per lane
    for (std::size_t begin = 0; begin < entries.size();) {
        std::size_t end = begin;
        while (end < entries.size() && entries[end].distance == entries[begin].distance) ++end;
        const std::int64_t base = static_cast<std::int64_t>(first) + entries[begin].distance;
        const bool in_range =
            base >= 0 && base + static_cast<std::int64_t>(lanes) <= static_cast<std::int64_t>(stride());
        const bool is_run = in_range && end - begin >= tuning::links::min_run;
        for (std::size_t k = begin; k < end; ++k) {
            if (is_run)
                slot_[entries[k].link] = static_cast<std::uint32_t>(run_.size() * lanes) + entries[k].lane;
            else
                left[entries[k].lane].push_back(entries[k].link);
        }
        if (is_run) run_.push_back(static_cast<std::int32_t>(base));
        begin = end;
    }
    std::size_t longest = 0;
    for (const auto& links : left) longest = std::max(longest, links.size());
    for (std::size_t k = 0; k < longest; ++k) {
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            if (k >= left[lane].size()) {
                index_.push_back(static_cast<std::int32_t>(first + lane));
                continue;
            }
            slot_[left[lane][k]] = static_cast<std::uint32_t>(run_.size() * lanes + lane);
            index_.push_back(static_cast<std::int32_t>(neighbour[left[lane][k]]));
        }
        run_.push_back(~static_cast<std::int32_t>(index_.size() / lanes - 1));
    }
    first_column_[slice + 1] = static_cast<std::uint32_t>(run_.size());
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
    const std::size_t values =
        weights_pay_ ? 2 * edge_.size() + forward_weight_.size() + backward_weight_.size() + run_.size()
                     : forward_.size() + backward_.size();
    return sizeof(float) * values + sizeof(std::int32_t) * (2 * run_.size() + 2 * index_.size());
}

}  // namespace splitcubes::meshless
