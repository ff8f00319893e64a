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

// The phyxels that hang together with one, itself first; more than `most_stranded` at
// most by a few. It is left at the first that is `many`, known to hang together with more. seen: zero for
// each phyxel, and again at the end.
struct Ligament {
    std::vector<std::uint32_t> phyxels;
    bool many = false;
};

Ligament hanging_together(const meshless::Neighbourhoods& links, const meshless::Pairs& pairs,
                          std::uint32_t phyxel, std::span<const std::uint8_t> many,
                          std::span<std::uint8_t> seen) {
    Ligament out{{phyxel}, false};
    std::vector<std::uint32_t>& found = out.phyxels;
    seen[phyxel] = 1;
    for (std::size_t k = 0; k < found.size() && found.size() <= most_stranded && !out.many; ++k)
        for (std::uint32_t l = links.offsets()[found[k]]; l < links.offsets()[found[k] + 1] && !out.many;
             ++l) {
            const std::uint32_t j = links.neighbour()[l];
            if (seen[j] != 0 || !(pairs.visibility[links.pair()[l]] > 0)) continue;
            out.many = many[j] != 0;
            if (out.many) continue;
            seen[j] = 1;
            found.push_back(j);
        }
    for (const std::uint32_t i : found) seen[i] = 0;
    out.many = out.many || found.size() > most_stranded;
    return out;
}

}  // namespace

// Lets a phyxel see those outside its strand that are near it through the material.
// Returns how many.
std::size_t Body::bridge(std::uint32_t phyxel, std::span<const std::uint32_t> ligament) {
    double reach = 0;
    for (const double h : phyxels_.support_radius) reach = std::max(reach, h);
    const int most = detour + static_cast<int>(2 * reach / grid_.rest().cell_size);
    const std::unordered_map<std::uint64_t, int> ways = ways_from(grid_, owner_[phyxel], most);
    std::vector<std::uint32_t> near;
    locator_.near(phyxels_.rest_position[phyxel], reach, near);
    std::size_t bridges = 0;
    for (const std::uint32_t j : near) {
        if (phyxels_.piece[j] != phyxels_.piece[phyxel]) continue;
        if (std::find(ligament.begin(), ligament.end(), j) != ligament.end()) continue;
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

void Body::bridge_ligaments(std::span<const std::uint32_t> asked) {
    std::vector<std::size_t> members(pieces_->count(), 0);
    for (const std::int32_t piece : phyxels_.piece) ++members[static_cast<std::size_t>(piece)];
    std::vector<std::uint8_t> fine(phyxels_.size(), 0);  // bridged, or many
    std::vector<std::uint8_t> seen(phyxels_.size(), 0);  // scratch
    std::vector<std::uint8_t> many(phyxels_.size(), 0);  // hangs together with many, or with all
    for (const std::uint32_t k : asked) {
        if (pairs_.visibility[k] > 0) continue;
        for (const std::uint32_t i : {pairs_.a[k], pairs_.b[k]}) {
            if (fine[i] != 0 || phyxels_.rigid.index(phyxels_.piece[i]) >= 0) continue;
            const Ligament ligament = hanging_together(neighbourhoods_, pairs_, i, many, seen);
            const std::vector<std::uint32_t>& own = ligament.phyxels;
            const bool whole = own.size() == members[static_cast<std::size_t>(phyxels_.piece[i])];
            if (!whole && !ligament.many)
                for (const std::uint32_t j : own) bridge(j, own);
            for (const std::uint32_t j : own) {
                fine[j] = 1;
                many[j] = whole || ligament.many ? 1 : 0;
            }
        }
    }
}

}  // namespace splitcubes::body
