#include <splitcubes/body_samples/elastic_samples.h>
#include <splitcubes/body_samples/ligaments.h>
#include <splitcubes/body_samples/topology_change.h>
#include <splitcubes/body_samples/tuning.h>
#include <splitcubes/splitting/node_grid.h>

#include <algorithm>
#include <deque>
#include <unordered_map>

namespace splitcubes::body {

using splitting::GridEdge;

namespace {

// Returns the lengths of the shortest paths over uncut grid edges from a node, in edges, up to max_length.
// Key: edge_id of the node's edge along x.
std::unordered_map<std::uint64_t, int> path_lengths_from(const splitting::NodeGrid& grid, const Vec3i& start,
                                                         int max_length) {
    std::unordered_map<std::uint64_t, int> path_lengths{{splitting::edge_id({start, 0}), 0}};
    std::deque<Vec3i> queue{start};
    while (!queue.empty()) {
        const Vec3i at = queue.front();
        queue.pop_front();
        const int length = path_lengths.at(splitting::edge_id({at, 0})) + 1;
        if (length > max_length) continue;
        for (int axis = 0; axis < 3; ++axis)
            for (const int step : {-1, 1}) {
                Vec3i next = at;
                next[axis] += step;
                if (!grid.rest().contains(next) || !grid.inside(next)) continue;
                if (grid.is_cut(GridEdge{step > 0 ? at : next, axis})) continue;
                if (path_lengths.emplace(splitting::edge_id({next, 0}), length).second) queue.push_back(next);
            }
    }
    return path_lengths;
}

// The phyxels connected to one over visible pairs, itself first. many: the group is larger than a ligament;
// the list may then be incomplete.
struct Ligament {
    std::vector<std::uint32_t> phyxels;
    bool many = false;
};

// Searches the group of a phyxel. Stops at the first phyxel whose `many` is set, which is known to belong to
// a large group, or soon after max_ligament_size. seen: scratch, zero for each phyxel before and after.
Ligament find_ligament(const meshless::Neighbourhoods& links, const meshless::Pairs& pairs,
                       std::uint32_t phyxel, std::span<const std::uint8_t> many,
                       std::span<std::uint8_t> seen) {
    Ligament out{{phyxel}, false};
    std::vector<std::uint32_t>& found = out.phyxels;
    seen[phyxel] = 1;
    for (std::size_t k = 0;
         k < found.size() && found.size() <= tuning::resampling::max_ligament_size && !out.many; ++k)
        for (std::uint32_t l = links.links_begin(found[k]); l < links.links_end(found[k]) && !out.many; ++l) {
            const std::uint32_t j = links.neighbour()[l];
            if (seen[j] != 0 || !(pairs.visibility[links.pair()[l]] > 0)) continue;
            out.many = many[j] != 0;
            if (out.many) continue;
            seen[j] = 1;
            found.push_back(j);
        }
    for (const std::uint32_t i : found) seen[i] = 0;
    out.many = out.many || found.size() > tuning::resampling::max_ligament_size;
    return out;
}

// Makes pairs of a phyxel with phyxels outside its ligament visible if a short path through the material
// connects them. Returns the number of such pairs.
std::size_t bridge(const splitting::NodeGrid& grid, ElasticSamples& samples, std::uint32_t phyxel,
                   std::span<const std::uint32_t> ligament, TopologyChange& change) {
    const meshless::Phyxels& phyxels = samples.phyxels;
    const double reach = samples.largest_support();
    const int max_length =
        tuning::resampling::max_bridge_detour + static_cast<int>(2 * reach / grid.rest().cell_size);
    const std::unordered_map<std::uint64_t, int> path_lengths =
        path_lengths_from(grid, samples.owner[phyxel], max_length);
    std::vector<std::uint32_t> near;
    samples.locator.near(phyxels.rest_position[phyxel], reach, near);
    std::size_t bridges = 0;
    for (const std::uint32_t j : near) {
        if (phyxels.piece[j] != phyxels.piece[phyxel]) continue;
        if (std::find(ligament.begin(), ligament.end(), j) != ligament.end()) continue;
        const auto path = path_lengths.find(splitting::edge_id({samples.owner[j], 0}));
        if (path == path_lengths.end()) continue;
        if (path->second >
            (samples.owner[j] - samples.owner[phyxel]).lpNorm<1>() + tuning::resampling::max_bridge_detour)
            continue;
        const std::uint32_t link = samples.neighbourhoods.find_link(phyxel, j);
        if (link == samples.neighbourhoods.links_end(phyxel)) continue;
        const std::uint32_t pair = samples.neighbourhoods.pair()[link];
        if (samples.pairs.visibility[pair] == 0) {
            samples.pairs.visibility[pair] = tuning::resampling::bridge_visibility;
            change.dirty_pairs.push_back(pair);
        }
        ++bridges;
    }
    return bridges;
}

}  // namespace

void bridge_ligaments(const splitting::NodeGrid& grid, std::size_t piece_count, ElasticSamples& samples,
                      std::span<const std::uint32_t> reevaluated, TopologyChange& change) {
    const meshless::Phyxels& phyxels = samples.phyxels;
    const meshless::Pairs& pairs = samples.pairs;
    const std::vector<std::size_t> members = samples.count_by_piece(piece_count);
    std::vector<std::uint8_t> done(phyxels.size(), 0);  // bridged, or needs no bridge
    std::vector<std::uint8_t> seen(phyxels.size(), 0);  // scratch
    std::vector<std::uint8_t> many(phyxels.size(), 0);  // its group is large, or its whole piece
    for (const std::uint32_t k : reevaluated) {
        if (pairs.visibility[k] > 0) continue;
        for (const std::uint32_t i : {pairs.a[k], pairs.b[k]}) {
            if (done[i] != 0 || phyxels.rigid.index(phyxels.piece[i]) >= 0) continue;
            const Ligament ligament = find_ligament(samples.neighbourhoods, pairs, i, many, seen);
            const std::vector<std::uint32_t>& own = ligament.phyxels;
            const bool whole = own.size() == members[static_cast<std::size_t>(phyxels.piece[i])];
            if (!whole && !ligament.many)
                for (const std::uint32_t j : own) bridge(grid, samples, j, own, change);
            for (const std::uint32_t j : own) {
                done[j] = 1;
                many[j] = whole || ligament.many ? 1 : 0;
            }
        }
    }
}

}  // namespace splitcubes::body
