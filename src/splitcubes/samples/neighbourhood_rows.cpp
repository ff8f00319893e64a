// The structure of Neighbourhoods: rows of links in a pool, and how they grow.
#include <splitcubes/samples/kernel.h>
#include <splitcubes/samples/loops.h>
#include <splitcubes/samples/neighbourhoods.h>
#include <splitcubes/samples/tuning.h>

#include <algorithm>
#include <atomic>
#include <cassert>

namespace splitcubes::meshless {

std::uint64_t Neighbourhoods::next_revision() {
    static std::atomic<std::uint64_t> last{0};
    return ++last;
}

std::uint32_t Neighbourhoods::find_link(std::size_t i, std::uint32_t j) const {
    const auto begin = links_.neighbour.begin() + links_begin(i),
               end = links_.neighbour.begin() + links_end(i);
    const auto found = std::lower_bound(begin, end, j);
    return found == end || *found != j ? links_end(i)
                                       : static_cast<std::uint32_t>(found - links_.neighbour.begin());
}

void Neighbourhoods::add_rows(const Phyxels& phyxels) {
    const std::size_t n = phyxels.size();
    range_.resize(n);
    rows_.rank.resize(n, 0);
    rows_.off_plane.resize(n, 0);
    rows_.basis.resize(n, Mat3::Identity());
    rows_.gradient_sum.resize(n, Vec3::Zero());
    rows_.moment.resize(n, Mat3::Zero());
    rows_.inverse_moment.resize(n, Mat3::Zero());
    rows_.base_trace.resize(n, 0);
    rows_.penalty.resize(n, 0);
    const auto append_from = [](const auto& source, auto& out) {
        out.insert(out.end(), source.begin() + static_cast<std::ptrdiff_t>(out.size()), source.end());
    };
    append_from(phyxels.volume, rows_.whole_volume);
    append_from(phyxels.volume, rows_.volume);
    append_from(phyxels.held, rows_.held);
    rows_.free_share.resize(n, 1);
    rows_.diagonal.resize(n, 0);
    rows_.coupling.resize(n, 0);
    rows_.revision.resize(n, 0);
    scratch_.mark.resize(n, 0);
    scratch_.rows.reserve(n);
    scratch_.ring.reserve(n);
}

void Neighbourhoods::resize_pool(std::size_t count) {
    for (auto* array : {&links_.neighbour, &links_.reverse, &links_.pair}) array->resize(count);
    for (auto* array : {&links_.base_weight, &links_.weight}) array->resize(count);
    for (auto* array : {&links_.rest_edge, &links_.gradient, &links_.reverse_gradient}) array->resize(count);
}

void Neighbourhoods::reserve_pool(std::size_t count) {
    for (auto* array : {&links_.neighbour, &links_.reverse, &links_.pair}) array->reserve(count);
    for (auto* array : {&links_.base_weight, &links_.weight}) array->reserve(count);
    for (auto* array : {&links_.rest_edge, &links_.gradient, &links_.reverse_gradient}) array->reserve(count);
}

// Computes what a link derives from rest positions and adds it to its row.
void Neighbourhoods::init_link(const Phyxels& phyxels, std::size_t i, std::uint32_t link) {
    Vec3& edge = links_.rest_edge[link];
    edge = phyxels.rest_position[links_.neighbour[link]] - phyxels.rest_position[i];
    links_.base_weight[link] = kernel(edge.squaredNorm(), phyxels.support_radius[i]);
    links_.weight[link] = 0;
    links_.gradient[link] = links_.reverse_gradient[link] = Vec3::Zero();
    rows_.base_trace[i] += links_.base_weight[link] * edge.squaredNorm();
}

void Neighbourhoods::build_structure(const Phyxels& phyxels, const Pairs& pairs, const Parallel& parallel) {
    const std::size_t n = phyxels.size(), links = 2 * pairs.size();
    range_.clear();
    rows_ = {};
    add_rows(phyxels);
    std::vector<std::uint32_t> next(n, 0);
    for (std::size_t p = 0; p < pairs.size(); ++p) {
        assert(pairs.a[p] < pairs.b[p] && pairs.b[p] < n);
        ++next[pairs.a[p]];
        ++next[pairs.b[p]];
    }
    std::uint32_t end = 0;
    for (std::size_t i = 0; i < n; ++i) {
        range_[i] = {end, end + next[i], end + next[i]};
        next[i] = end;
        end = range_[i].end;
    }
    pair_count_ = pairs.size();
    unused_links_ = 0;
    reserve_pool(links + links / tuning::links::spare_part);
    resize_pool(links);
    std::vector<std::uint32_t> link_to_lower(pairs.size());  // b -> a of each pair
    // The order of Pairs brings the lower neighbours of a row in ascending order, and then the higher ones.
    for (const bool lower : {true, false})
        for (std::size_t p = 0; p < pairs.size(); ++p) {
            const std::uint32_t from = lower ? pairs.b[p] : pairs.a[p];
            const std::uint32_t link = next[from]++;
            links_.neighbour[link] = lower ? pairs.a[p] : pairs.b[p];
            links_.pair[link] = static_cast<std::uint32_t>(p);
            if (lower) {
                link_to_lower[p] = link;
                continue;
            }
            links_.reverse[link] = link_to_lower[p];
            links_.reverse[links_.reverse[link]] = link;
        }
    structure_ = next_revision();
    std::fill(scratch_.mark.begin(), scratch_.mark.end(), std::uint8_t{0});
    for_phyxels(parallel, n, [&](std::size_t i) {
        for (std::uint32_t l = links_begin(i); l < links_end(i); ++l) init_link(phyxels, i, l);
    });
    slices_.build({range_, links_.neighbour, phyxels.rest_position});
}

// Moves a row without a free link to the end of the pool.
void Neighbourhoods::make_room(std::uint32_t i) {
    LinkRange& range = range_[i];
    if (range.end < range.limit) return;
    const std::uint32_t size = range.end - range.begin,
                        begin = static_cast<std::uint32_t>(links_.pair.size());
    unused_links_ += range.limit - range.begin;
    resize_pool(begin + size + size / 4 + 4);
    const auto move = [&](auto& array) {
        std::copy_n(array.begin() + range.begin, size, array.begin() + begin);
    };
    move(links_.neighbour);
    move(links_.reverse);
    move(links_.pair);
    move(links_.rest_edge);
    move(links_.gradient);
    move(links_.reverse_gradient);
    move(links_.base_weight);
    move(links_.weight);
    range = {begin, begin + size, static_cast<std::uint32_t>(links_.pair.size())};
    for (std::uint32_t l = range.begin; l < range.end; ++l) links_.reverse[links_.reverse[l]] = l;
}

// Appends the link i -> j. Links to i from rows that have moved keep up with make_room.
std::uint32_t Neighbourhoods::add_link(const Phyxels& phyxels, std::uint32_t i, std::uint32_t j,
                                       std::uint32_t pair) {
    make_room(i);
    const std::uint32_t link = range_[i].end++;
    links_.neighbour[link] = j;
    links_.pair[link] = pair;
    init_link(phyxels, i, link);
    return link;
}

// Adds the rows and links of new phyxels and pairs, and marks the rows in scratch_.
void Neighbourhoods::add_pairs(const Phyxels& phyxels, const Pairs& pairs) {
    const std::size_t known = size();
    add_rows(phyxels);
    for (auto i = static_cast<std::uint32_t>(known); i < phyxels.size(); ++i) mark_row(i);
    for (auto p = static_cast<std::uint32_t>(pair_count_); p < pairs.size(); ++p) {
        const std::uint32_t a = pairs.a[p], b = pairs.b[p];
        const std::uint32_t forward = add_link(phyxels, a, b, p), back = add_link(phyxels, b, a, p);
        links_.reverse[forward] = back;
        links_.reverse[back] = forward;
        mark_row(a);
        mark_row(b);
    }
    pair_count_ = pairs.size();
}

// Rebuilds the slices of rows that got links, and those whose runs may now reach farther because there are
// more rows.
void Neighbourhoods::rebuild_slices(const Phyxels& phyxels, std::size_t old_size) {
    constexpr std::size_t lanes = LinkSlices::lanes;
    std::vector<std::uint8_t> chosen((size() + lanes - 1) / lanes, 0);
    for (const std::uint32_t i : scratch_.rows) chosen[i / lanes] = 1;
    for (std::size_t j = old_size - std::min(old_size, 2 * lanes); j < old_size; ++j)
        for (std::uint32_t l = links_begin(j); l < links_end(j); ++l) chosen[links_.neighbour[l] / lanes] = 1;
    scratch_.slices.clear();
    for (std::uint32_t slice = 0; slice < chosen.size(); ++slice)
        if (chosen[slice] != 0) scratch_.slices.push_back(slice);
    slices_.append({range_, links_.neighbour, phyxels.rest_position}, scratch_.slices);
}

void Neighbourhoods::append(const Phyxels& phyxels, const Pairs& pairs,
                            std::span<const std::uint32_t> changed_pairs, const Material& material,
                            const Parallel& parallel) {
    if (2 * unused_links_ > links_.pair.size() || slices_.is_sparse())
        return rebuild(phyxels, pairs, material, parallel);
    const std::size_t old_size = size();
    revision_ = structure_ = next_revision();
    scratch_.rows.clear();
    add_pairs(phyxels, pairs);
    rebuild_slices(phyxels, old_size);
    mark_rows(pairs, changed_pairs);
    update_rows(pairs, material, parallel);
    for_phyxels(parallel, scratch_.slices.size() * LinkSlices::lanes, [&](std::size_t k) {
        const std::size_t i =
            scratch_.slices[k / LinkSlices::lanes] * LinkSlices::lanes + k % LinkSlices::lanes;
        if (i < size()) write_links(i);
    });
}

}  // namespace splitcubes::meshless
