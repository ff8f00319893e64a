#include <splitcubes/body_samples/elastic_samples.h>
#include <splitcubes/body_samples/ligaments.h>
#include <splitcubes/body_samples/topology_change.h>
#include <splitcubes/body_samples/tuning.h>
#include <splitcubes/splitting/node_grid.h>

#include <algorithm>
#include <deque>
#include <limits>
#include <unordered_map>
#include <unordered_set>

namespace splitcubes::body {

using splitting::GridEdge;

namespace {

std::uint64_t id_of(const Vec3i& node) {
    return splitting::edge_id({node, 0});
}

// Calls act(next) for the nodes to which uncut grid edges lead from a node.
template <class Act>
void for_neighbours(const splitting::NodeGrid& grid, const Vec3i node, const Act& act) {
    for (int axis = 0; axis < 3; ++axis)
        for (const int step : {-1, 1}) {
            Vec3i next = node;
            next[axis] += step;
            if (!grid.rest().contains(next) || !grid.inside(next)) continue;
            if (!grid.is_cut(GridEdge{step > 0 ? node : next, axis})) act(next);
        }
}

// Returns the lengths of the shortest paths over uncut grid edges from a node, in edges, up to max_length.
// Key: id_of.
std::unordered_map<std::uint64_t, int> path_lengths_from(const splitting::NodeGrid& grid, const Vec3i& start,
                                                         int max_length) {
    std::unordered_map<std::uint64_t, int> path_lengths{{id_of(start), 0}};
    std::deque<Vec3i> queue{start};
    while (!queue.empty()) {
        const int length = path_lengths.at(id_of(queue.front())) + 1;
        if (length > max_length) break;
        for_neighbours(grid, queue.front(), [&](const Vec3i& next) {
            if (path_lengths.emplace(id_of(next), length).second) queue.push_back(next);
        });
        queue.pop_front();
    }
    return path_lengths;
}

// Groups of phyxels that visible pairs connect. They grow from several phyxels at once, until at most one
// group of each piece still grows: the others are then complete, and separate from the rest of their piece.
class GroupSearch {
  public:
    GroupSearch(const ElasticSamples& samples, std::size_t piece_count)
        : samples_(samples), growing_(piece_count, 0), label_(samples.phyxels.size(), -1) {}

    /// Returns the complete groups, each ascending.
    std::vector<std::vector<std::uint32_t>> separate_groups(std::span<const std::uint32_t> sources) {
        for (const std::uint32_t i : sources) begin_at(i);
        for (std::size_t k = 0; k < queue_.size(); ++k)
            if (growing_[piece_of(queue_[k])] > 1) grow_from(queue_[k]);
        std::vector<std::vector<std::uint32_t>> out;
        std::vector<std::size_t> index(parent_.size(), parent_.size());
        for (const std::uint32_t i : queue_) {
            const auto root = static_cast<std::size_t>(root_of(label_[i]));
            if (waiting_[root] > 0) continue;
            if (index[root] == parent_.size()) {
                index[root] = out.size();
                out.emplace_back();
            }
            out[index[root]].push_back(i);
        }
        for (std::vector<std::uint32_t>& group : out) std::sort(group.begin(), group.end());
        return out;
    }

  private:
    std::size_t piece_of(std::uint32_t i) const {
        return static_cast<std::size_t>(samples_.phyxels.piece[i]);
    }
    std::int32_t root_of(std::int32_t label) const {
        while (parent_[static_cast<std::size_t>(label)] != label)
            label = parent_[static_cast<std::size_t>(label)];
        return label;
    }
    void begin_at(std::uint32_t i) {
        if (label_[i] >= 0 || samples_.phyxels.rigid.index(samples_.phyxels.piece[i]) >= 0) return;
        label_[i] = static_cast<std::int32_t>(parent_.size());
        parent_.push_back(label_[i]);
        waiting_.push_back(1);
        ++growing_[piece_of(i)];
        queue_.push_back(i);
    }
    void grow_from(std::uint32_t i) {
        const meshless::Neighbourhoods& links = samples_.neighbourhoods;
        const std::int32_t root = root_of(label_[i]);
        std::size_t& waiting = waiting_[static_cast<std::size_t>(root)];
        for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l) {
            if (!(samples_.pairs.visibility[links.pair()[l]] > 0)) continue;
            const std::uint32_t j = links.neighbour()[l];
            if (label_[j] < 0) {
                label_[j] = root;
                ++waiting;
                queue_.push_back(j);
                continue;
            }
            const std::int32_t other = root_of(label_[j]);
            if (other == root) continue;
            parent_[static_cast<std::size_t>(other)] = root;
            waiting += waiting_[static_cast<std::size_t>(other)];
            --growing_[piece_of(i)];
        }
        if (--waiting == 0) --growing_[piece_of(i)];
    }

    const ElasticSamples& samples_;
    std::vector<std::size_t> growing_;  // groups, per piece
    std::vector<std::int32_t> label_;   // per phyxel; -1: not reached
    std::vector<std::int32_t> parent_;  // per label: one with which it was merged, or itself
    std::vector<std::size_t> waiting_;  // per label that is a root: phyxels in the queue
    std::vector<std::uint32_t> queue_;  // reached phyxels
};

// The shortest way out of a group along uncut grid edges.
struct WayOut {
    int length = -1;                  // edges, to the nearest phyxel with a pair; -1: there is none
    std::vector<std::uint32_t> ends;  // phyxels of the group where such ways begin, ascending
    Gap gap;                          // on the way to the nearest phyxel, with a pair or not
};

// Finds the ways from a group to the other phyxels of its piece, up to max_bridge_detour longer than the
// shortest.
WayOut way_out(const splitting::NodeGrid& grid, const ElasticSamples& samples,
               std::span<const std::uint32_t> group) {
    const meshless::Neighbourhoods& links = samples.neighbourhoods;
    const std::int32_t piece = samples.phyxels.piece[group.front()];
    std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> others;  // per owner
    for (std::uint32_t i = 0; i < samples.phyxels.size(); ++i)
        if (samples.phyxels.piece[i] == piece && !std::binary_search(group.begin(), group.end(), i))
            others[id_of(samples.owner[i])].push_back(i);
    struct Node {
        Vec3i at;
        std::uint32_t from;    // phyxel
        std::size_t previous;  // index into nodes
        int length;            // edges
    };
    WayOut out;
    std::vector<Node> nodes;
    std::unordered_set<std::uint64_t> seen;
    int limit = std::numeric_limits<int>::max();
    bool has_gap = false;
    const auto set_gap = [&](std::size_t last, std::uint32_t around) {
        out.gap = {nodes[last].at, nodes[last].from, around};
        for (int k = nodes[last].length / 2; k > 0; --k) last = nodes[last].previous;
        out.gap.node = nodes[last].at;
        has_gap = true;
    };
    const auto visit = [&](const Vec3i& at, std::uint32_t from, std::size_t previous, int length) {
        if (!seen.insert(id_of(at)).second) return;
        nodes.push_back({at, from, previous, length});
        const auto found = others.find(id_of(at));
        if (found == others.end()) return;
        if (!has_gap) set_gap(nodes.size() - 1, found->second.front());
        for (const std::uint32_t j : found->second) {
            if (links.find_link(from, j) == links.links_end(from)) continue;
            if (out.length < 0) out.length = length;
            limit = out.length + tuning::resampling::max_bridge_detour;
            out.ends.push_back(from);
        }
    };
    for (const std::uint32_t i : group) visit(samples.owner[i], i, 0, 0);
    for (std::size_t k = 0; k < nodes.size() && nodes[k].length < limit; ++k)
        for_neighbours(grid, nodes[k].at, [&, node = nodes[k]](const Vec3i& next) {
            visit(next, node.from, k, node.length + 1);
        });
    std::sort(out.ends.begin(), out.ends.end());
    out.ends.erase(std::unique(out.ends.begin(), out.ends.end()), out.ends.end());
    return out;
}

// Makes pairs of a phyxel with phyxels outside its group visible if a path through the material connects
// them that is little longer than the shortest way out of the group, or than one without cuts.
void bridge(const splitting::NodeGrid& grid, ElasticSamples& samples, std::uint32_t phyxel, int way_length,
            std::span<const std::uint32_t> group, TopologyChange& change) {
    const meshless::Phyxels& phyxels = samples.phyxels;
    const meshless::Neighbourhoods& links = samples.neighbourhoods;
    const auto straight_length = [&](std::uint32_t j) {
        return (samples.owner[j] - samples.owner[phyxel]).lpNorm<1>();
    };
    std::vector<std::uint32_t> outside;  // links
    int max_length = way_length;
    for (std::uint32_t l = links.links_begin(phyxel); l < links.links_end(phyxel); ++l) {
        const std::uint32_t j = links.neighbour()[l];
        if (phyxels.piece[j] != phyxels.piece[phyxel] || std::binary_search(group.begin(), group.end(), j))
            continue;
        outside.push_back(l);
        max_length = std::max(max_length, straight_length(j));
    }
    const std::unordered_map<std::uint64_t, int> path_lengths =
        path_lengths_from(grid, samples.owner[phyxel], max_length + tuning::resampling::max_bridge_detour);
    for (const std::uint32_t l : outside) {
        const std::uint32_t j = links.neighbour()[l];
        const auto path = path_lengths.find(id_of(samples.owner[j]));
        if (path == path_lengths.end() ||
            path->second > std::max(way_length, straight_length(j)) + tuning::resampling::max_bridge_detour)
            continue;
        samples.pairs.visibility[links.pair()[l]] = tuning::resampling::bridge_visibility;
        change.dirty_pairs.push_back(links.pair()[l]);
    }
}

}  // namespace

std::vector<std::vector<std::uint32_t>> separate_groups(const ElasticSamples& samples,
                                                        std::size_t piece_count,
                                                        std::span<const std::uint32_t> phyxels) {
    return GroupSearch(samples, piece_count).separate_groups(phyxels);
}

void bridge_ligaments(const splitting::NodeGrid& grid, std::size_t piece_count, ElasticSamples& samples,
                      std::span<const std::uint32_t> phyxels, TopologyChange& change) {
    for (bool again = true; again;) {
        again = false;
        change.gaps.clear();
        for (const std::vector<std::uint32_t>& group : separate_groups(samples, piece_count, phyxels)) {
            const WayOut way = way_out(grid, samples, group);
            if (way.length < 0) change.gaps.push_back(way.gap);
            for (const std::uint32_t i : way.ends) bridge(grid, samples, i, way.length, group, change);
            change.rejoined.push_back(group);
            again = again || way.length >= 0;
        }
    }
}

}  // namespace splitcubes::body
