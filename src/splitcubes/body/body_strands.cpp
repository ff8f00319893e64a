// Phyxels that see no other phyxel of their piece, though the piece's material, the grid
// nodes over uncut edges, leads round what hides them: left alone they would fly off.
#include <splitcubes/body/body.h>

#include <algorithm>
#include <deque>
#include <unordered_map>

namespace splitcubes::body {

using splitting::GridEdge;

namespace {

// What a bridge counts as: it hardly draws on phyxels that have others to follow, and
// one that has no others follows it alike, whatever it counts.
constexpr float bridge_visibility = 0.1F;
// Phyxels that hang together and are more than that are no strand.
constexpr std::size_t most_stranded = 200;
// By how many grid edges a way through the material may be longer than without cuts.
constexpr int detour = 2;

// Index of the pair of two phyxels, or the number of pairs.
std::size_t find_pair(const meshless::Pairs& pairs, std::uint32_t i, std::uint32_t j) {
    const std::uint32_t a = std::min(i, j), b = std::max(i, j);
    const auto [first, last] = std::equal_range(pairs.a.begin(), pairs.a.end(), a);
    const auto begin = pairs.b.begin() + (first - pairs.a.begin());
    const auto end = pairs.b.begin() + (last - pairs.a.begin());
    const auto found = std::lower_bound(begin, end, b);
    return found == end || *found != b ? pairs.size() : static_cast<std::size_t>(found - pairs.b.begin());
}

// How many uncut grid edges lead from a node to those around it, up to `most`.
std::unordered_map<std::uint64_t, int> ways_from(const splitting::NodeGrid& grid, const Vec3i& start,
                                                 int most) {
    std::unordered_map<std::uint64_t, int> ways{{splitting::edge_id({start, 0}), 0}};
    std::deque<Vec3i> queue{start};
    while (!queue.empty()) {
        const Vec3i at = queue.front();
        queue.pop_front();
        const int length = ways.at(splitting::edge_id({at, 0})) + 1;
        if (length > most) continue;
        for (int axis = 0; axis < 3; ++axis)
            for (const int step : {-1, 1}) {
                Vec3i next = at;
                next[axis] += step;
                if (!grid.rest().contains(next) || !grid.inside(next)) continue;
                if (grid.is_cut(GridEdge{step > 0 ? at : next, axis})) continue;
                if (ways.emplace(splitting::edge_id({next, 0}), length).second) queue.push_back(next);
            }
    }
    return ways;
}

}  // namespace

// The phyxels that hang together with one, itself first; more than `most_stranded` at
// most by a few.
std::vector<std::uint32_t> Body::hanging_together(std::uint32_t phyxel) const {
    std::vector<std::uint32_t> out{phyxel};
    for (std::size_t k = 0; k < out.size() && out.size() <= most_stranded; ++k) {
        const std::uint32_t begin = neighbourhoods_.offsets()[out[k]];
        const std::uint32_t end = neighbourhoods_.offsets()[out[k] + 1];
        for (std::uint32_t l = begin; l < end; ++l) {
            const std::uint32_t j = neighbourhoods_.neighbour()[l];
            if (std::find(out.begin(), out.end(), j) != out.end()) continue;
            if (pairs_.visibility[find_pair(pairs_, out[k], j)] > 0) out.push_back(j);
        }
    }
    return out;
}

// Lets a phyxel see those outside its strand that are near it through the material.
// Returns how many.
std::size_t Body::bridge(std::uint32_t phyxel, std::span<const std::uint32_t> strand) {
    double reach = 0;
    for (const double h : phyxels_.support_radius) reach = std::max(reach, h);
    const int most = detour + static_cast<int>(2 * reach / grid_.rest().cell_size);
    const std::unordered_map<std::uint64_t, int> ways = ways_from(grid_, owner_[phyxel], most);
    std::vector<std::uint32_t> near;
    locator_.near(phyxels_.rest_position[phyxel], reach, near);
    std::size_t bridges = 0;
    for (const std::uint32_t j : near) {
        if (phyxels_.piece[j] != phyxels_.piece[phyxel]) continue;
        if (std::find(strand.begin(), strand.end(), j) != strand.end()) continue;
        const auto way = ways.find(splitting::edge_id({owner_[j], 0}));
        if (way == ways.end()) continue;
        if (way->second > (owner_[j] - owner_[phyxel]).lpNorm<1>() + detour) continue;
        const std::size_t pair = find_pair(pairs_, phyxel, j);
        if (pair == pairs_.size()) continue;
        if (pairs_.visibility[pair] == 0) {
            pairs_.visibility[pair] = bridge_visibility;
            changed_pairs_.push_back(static_cast<std::uint32_t>(pair));
        }
        ++bridges;
    }
    return bridges;
}

void Body::bridge_strands(std::span<const std::uint32_t> asked) {
    std::vector<std::size_t> members(pieces_->count(), 0);
    for (const std::int32_t piece : phyxels_.piece) ++members[static_cast<std::size_t>(piece)];
    std::vector<std::uint8_t> fine(phyxels_.size(), 0);  // hangs together with many, or with all
    for (const std::uint32_t k : asked) {
        if (pairs_.visibility[k] > 0) continue;
        for (const std::uint32_t i : {pairs_.a[k], pairs_.b[k]}) {
            if (fine[i] != 0 || phyxels_.rigid.index(phyxels_.piece[i]) >= 0) continue;
            const std::vector<std::uint32_t> strand = hanging_together(i);
            const bool whole = strand.size() == members[static_cast<std::size_t>(phyxels_.piece[i])];
            if (!whole && strand.size() <= most_stranded)
                for (const std::uint32_t j : strand) bridge(j, strand);
            for (const std::uint32_t j : strand) fine[j] = 1;
        }
    }
}

}  // namespace splitcubes::body
