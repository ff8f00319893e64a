#include <splitcubes/core/disjoint_sets.h>
#include <splitcubes/splitting/pieces.h>

#include <algorithm>
#include <bit>
#include <queue>
#include <tuple>
#include <utility>

namespace splitcubes::splitting {

namespace {

using Word = std::uint64_t;

constexpr std::uint32_t none = UINT32_MAX;
// Nodes of a brick whose coordinate along the axis is 3: their edge leaves the brick.
constexpr Word last_layer[3] = {0x8888888888888888ULL, 0xf000f000f000f000ULL, 0xffff000000000000ULL};
constexpr int stride[3] = {1, 4, 16};

struct BrickWords {
    Word inside;
    Word open[3];  // uncut edges, at their lower nodes
};

BrickWords words_of(const NodeGrid& grid, std::size_t brick) {
    BrickWords w{grid.inside_word(brick), {}};
    for (int axis = 0; axis < 3; ++axis) w.open[axis] = ~grid.cut_word(brick, axis);
    return w;
}

// Returns all nodes of the brick that are connected with `seed` within the brick.
Word flood(const BrickWords& w, Word seed) {
    for (Word grown = seed;; seed = grown) {
        for (int axis = 0; axis < 3; ++axis) {
            const Word open = w.open[axis] & ~last_layer[axis];
            grown |= (grown & open) << stride[axis];
            grown |= (grown >> stride[axis]) & open;
            grown &= w.inside;
        }
        if (grown == seed) return seed;
    }
}

// Returns the lowest node as one number, by which components are ordered.
std::uint64_t lowest_node(std::uint32_t brick, Word nodes) {
    return std::uint64_t{brick} * nodes_per_brick + static_cast<unsigned>(std::countr_zero(nodes));
}

// A set of connected components: a fragment of the piece that it belonged to.
struct Fragment {
    std::int32_t parent;
    std::size_t size;      // nodes
    std::uint64_t lowest;  // see lowest_node
    std::uint32_t id;      // the caller's id of the fragment
    std::int32_t piece = -1;
};

// Assigns piece ids: the largest fragment of a parent keeps the parent's, the others (and those without a
// parent) get new ids in the order of their lowest nodes. Updates node_counts.
std::vector<PieceSplit> assign_piece_ids(std::vector<Fragment>& fragments,
                                         std::vector<std::size_t>& node_counts) {
    std::sort(fragments.begin(), fragments.end(), [](const Fragment& a, const Fragment& b) {
        return std::tuple(a.parent, b.size, a.lowest) < std::tuple(b.parent, a.size, b.lowest);
    });
    for (std::size_t i = 0; i < fragments.size(); ++i)
        if (fragments[i].parent >= 0 && (i == 0 || fragments[i - 1].parent != fragments[i].parent))
            fragments[i].piece = fragments[i].parent;
    std::sort(fragments.begin(), fragments.end(),
              [](const Fragment& a, const Fragment& b) { return a.lowest < b.lowest; });
    std::vector<PieceSplit> splits;
    for (Fragment& fragment : fragments) {
        if (fragment.piece < 0) {
            fragment.piece = static_cast<std::int32_t>(node_counts.size());
            node_counts.push_back(0);
            splits.push_back({fragment.parent, fragment.piece});
        }
        node_counts[static_cast<std::size_t>(fragment.piece)] = fragment.size;
    }
    return splits;
}

}  // namespace

void Pieces::label_brick(const NodeGrid& grid, std::size_t brick, std::vector<Component>& out) const {
    const BrickWords w = words_of(grid, brick);
    for (Word rest = w.inside; rest;) {
        const Word part = flood(w, rest & (~rest + 1));
        out.push_back({part, static_cast<std::uint32_t>(brick), -1, none});
        rest &= ~part;
    }
}

template <class Visit>
void Pieces::for_neighbours(const NodeGrid& grid, std::uint32_t component, const Visit& visit) const {
    const BrickLayout& layout = grid.bricks();
    const Component& from = components_[component];
    const Vec3i brick_position = layout.base(from.brick) / brick_side;
    const std::size_t strides[3] = {
        1, static_cast<std::size_t>(layout.brick_count[0]),
        static_cast<std::size_t>(layout.brick_count[0]) * static_cast<std::size_t>(layout.brick_count[1])};
    for (int axis = 0; axis < 3; ++axis)
        for (const int side : {-1, 1}) {
            if (brick_position[axis] + side < 0 || brick_position[axis] + side >= layout.brick_count[axis])
                continue;
            const std::size_t next = side > 0 ? from.brick + strides[axis] : from.brick - strides[axis];
            const std::size_t lower = side > 0 ? from.brick : next;
            const Word open = ~grid.cut_word(lower, axis) & last_layer[axis];
            const int shift = 3 * stride[axis];
            const Word reach = side > 0 ? (from.nodes & open) >> shift : (from.nodes << shift) & open;
            if (!reach) continue;
            for (std::uint32_t j = runs_[next].first; j < runs_[next].first + runs_[next].count; ++j)
                if (reach & components_[j].nodes) visit(j);
        }
}

std::vector<PieceSplit> Pieces::update(const NodeGrid& grid) {
    const Pieces old = std::exchange(*this, Pieces());
    node_counts_.assign(old.node_counts_.size(), 0);
    const std::size_t brick_total = grid.bricks().total();
    runs_.resize(brick_total);
    for (std::size_t brick = 0; brick < brick_total; ++brick) {
        runs_[brick].first = static_cast<std::uint32_t>(components_.size());
        label_brick(grid, brick, components_);
        runs_[brick].count = static_cast<std::uint32_t>(components_.size()) - runs_[brick].first;
    }
    DisjointSets sets(components_.size());
    for (std::uint32_t i = 0; i < components_.size(); ++i)
        for_neighbours(grid, i, [&](std::uint32_t j) { sets.join(i, j); });

    // A set's root is its lowest component, which contains its lowest node.
    std::vector<Fragment> fragments;
    std::vector<std::uint32_t> fragment_of(components_.size());
    for (std::uint32_t i = 0; i < components_.size(); ++i) {
        const Component& c = components_[i];
        const std::uint32_t root = sets.find(i);
        if (root == i) {
            fragment_of[i] = static_cast<std::uint32_t>(fragments.size());
            fragments.push_back({-1, 0, lowest_node(c.brick, c.nodes), i});
            if (!old.runs_.empty())
                for (const Component& before : old.components_of(c.brick))
                    if (before.nodes & c.nodes) fragments.back().parent = before.piece;
        }
        fragments[fragment_of[root]].size += static_cast<std::size_t>(std::popcount(c.nodes));
    }
    std::vector<PieceSplit> splits = assign_piece_ids(fragments, node_counts_);
    for (const Fragment& fragment : fragments) components_[fragment.id].piece = fragment.piece;
    for (std::uint32_t i = 0; i < components_.size(); ++i)
        components_[i].piece = components_[sets.find(i)].piece;
    return splits;
}

Pieces::Pieces(const NodeGrid& grid) {
    update(grid);
}

// Relabels the bricks on both sides of the edges; returns their components.
std::vector<std::uint32_t> Pieces::relabel_bricks(const NodeGrid& grid,
                                                  std::span<const std::int32_t> new_slots) {
    std::vector<std::uint32_t> bricks;
    for (const std::int32_t slot : new_slots) {
        const GridEdge& edge = grid.crossing(slot).edge;
        bricks.push_back(static_cast<std::uint32_t>(grid.bricks().brick_of(edge.node)));
        bricks.push_back(static_cast<std::uint32_t>(grid.bricks().brick_of(edge.upper())));
    }
    std::sort(bricks.begin(), bricks.end());
    bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());
    std::vector<std::uint32_t> out;
    std::vector<Component> fresh;
    for (const std::uint32_t brick : bricks) {
        fresh.clear();
        label_brick(grid, brick, fresh);
        const std::span<Component> before = components_of(brick);
        for (Component& c : fresh)
            for (const Component& b : before)
                if (b.nodes & c.nodes) c.piece = b.piece;
        BrickRun& run = runs_[brick];
        if (fresh.size() > run.count) {
            // A run that has grown moves to the end; the old memory is not worth reclaiming.
            run.first = static_cast<std::uint32_t>(components_.size());
            components_.resize(components_.size() + fresh.size());
        }
        run.count = static_cast<std::uint32_t>(fresh.size());
        std::copy(fresh.begin(), fresh.end(), components_.begin() + run.first);
        for (std::uint32_t k = 0; k < run.count; ++k) out.push_back(run.first + k);
    }
    return out;
}

// Searches through the components of one piece, one from each seed; searches that meet are merged. The search
// with the fewest nodes always continues first, so no fragment is searched much beyond the size of the second
// largest.
class Pieces::Searches {
  public:
    Searches(Pieces& pieces, const NodeGrid& grid, std::span<const std::uint32_t> seeds)
        : pieces_(pieces), grid_(grid), sets_(seeds.size()), searches_(seeds.size()), open_(seeds.size()) {
        for (std::uint32_t s = 0; s < seeds.size(); ++s) {
            take(seeds[s], s);
            queue_.push({searches_[s].size, s});
        }
    }

    /// Runs until the fragments of the piece are known; their components are in members().
    std::vector<Fragment> run(std::int32_t piece) {
        while (open_ > 1) step();
        std::vector<Fragment> fragments;
        std::size_t others = 0;
        for (std::uint32_t s = 0; s < searches_.size(); ++s)
            if (sets_.find(s) == s && searches_[s].done) others += searches_[s].size;
        const std::size_t total = pieces_.node_counts_[static_cast<std::size_t>(piece)];
        if (open_ == 1) {
            // If another fragment is at least as large, this one does not keep the id, so its members are
            // needed.
            bool largest = true;
            for (std::uint32_t s = 0; s < searches_.size(); ++s)
                if (sets_.find(s) == s && searches_[s].done)
                    largest = largest && total - others > searches_[s].size;
            while (!largest && open_ > 0) step();
        }
        for (std::uint32_t s = 0; s < searches_.size(); ++s) {
            if (sets_.find(s) != s) continue;
            const Search& search = searches_[s];
            fragments.push_back({piece, search.done ? search.size : total - others, search.lowest, s});
        }
        return fragments;
    }

    std::span<const std::uint32_t> members(std::uint32_t search) const { return searches_[search].seen; }

    void forget() {
        for (const Search& search : searches_)
            for (const std::uint32_t c : search.seen) pieces_.components_[c].search = none;
    }

  private:
    struct Search {
        std::vector<std::uint32_t> seen;  // components; the last ones are not expanded yet
        std::vector<std::uint32_t> front;
        std::size_t size = 0;  // nodes seen
        std::uint64_t lowest = UINT64_MAX;
        bool done = false;
    };

    void take(std::uint32_t component, std::uint32_t s) {
        Component& c = pieces_.components_[component];
        c.search = s;
        Search& search = searches_[s];
        search.seen.push_back(component);
        search.front.push_back(component);
        search.size += static_cast<std::size_t>(std::popcount(c.nodes));
        search.lowest = std::min(search.lowest, lowest_node(c.brick, c.nodes));
    }

    // Merges two searches, keeping the larger lists, and returns the merged one.
    std::uint32_t join(std::uint32_t a, std::uint32_t b) {
        sets_.join(a, b);
        const std::uint32_t root = sets_.find(a), other = root == a ? b : a;
        Search &into = searches_[root], &from = searches_[other];
        if (into.seen.size() < from.seen.size()) std::swap(into.seen, from.seen);
        if (into.front.size() < from.front.size()) std::swap(into.front, from.front);
        into.seen.insert(into.seen.end(), from.seen.begin(), from.seen.end());
        into.front.insert(into.front.end(), from.front.begin(), from.front.end());
        into.size += from.size;
        into.lowest = std::min(into.lowest, from.lowest);
        from = {};
        --open_;
        return root;
    }

    void step() {
        const auto [size, index] = queue_.top();
        queue_.pop();
        std::uint32_t s = index;
        if (sets_.find(s) != s || searches_[s].done || searches_[s].size != size) return;
        if (searches_[s].front.empty()) {
            searches_[s].done = true;
            --open_;
            return;
        }
        const std::uint32_t component = searches_[s].front.back();
        searches_[s].front.pop_back();
        pieces_.for_neighbours(grid_, component, [&](std::uint32_t next) {
            const std::uint32_t mark = pieces_.components_[next].search;
            if (mark == none)
                take(next, s);
            else if (sets_.find(mark) != s)
                s = join(s, sets_.find(mark));
        });
        queue_.push({searches_[s].size, s});
    }

    Pieces& pieces_;
    const NodeGrid& grid_;
    DisjointSets sets_;
    std::vector<Search> searches_;
    std::size_t open_;  // searches neither done nor merged into another
    using Entry = std::pair<std::size_t, std::uint32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
};

std::vector<PieceSplit> Pieces::update(const NodeGrid& grid, std::span<const std::int32_t> new_slots) {
    std::vector<std::uint32_t> seeds = relabel_bricks(grid, new_slots);
    std::stable_sort(seeds.begin(), seeds.end(), [&](std::uint32_t a, std::uint32_t b) {
        return components_[a].piece < components_[b].piece;
    });
    std::vector<Searches> searches;
    std::vector<Fragment> fragments;
    std::vector<std::uint32_t> group_of;  // per fragment id: index into `searches`
    std::vector<std::uint32_t> search_of;
    for (std::size_t i = 0; i < seeds.size();) {
        const std::int32_t piece = components_[seeds[i]].piece;
        std::size_t end = i;
        while (end < seeds.size() && components_[seeds[end]].piece == piece) ++end;
        if (end - i > 1) {
            searches.emplace_back(*this, grid, std::span(seeds).subspan(i, end - i));
            for (Fragment fragment : searches.back().run(piece)) {
                group_of.push_back(static_cast<std::uint32_t>(searches.size() - 1));
                search_of.push_back(fragment.id);
                fragment.id = static_cast<std::uint32_t>(group_of.size() - 1);
                fragments.push_back(fragment);
            }
        }
        i = end;
    }
    const std::vector<PieceSplit> splits = assign_piece_ids(fragments, node_counts_);
    for (const Fragment& fragment : fragments)
        if (fragment.piece != fragment.parent)
            for (const std::uint32_t c : searches[group_of[fragment.id]].members(search_of[fragment.id]))
                components_[c].piece = fragment.piece;
    for (Searches& group : searches) group.forget();
    return splits;
}

std::int32_t Pieces::piece_of(const NodeGrid& grid, const Vec3i& node) const {
    const Word bit = Word{1} << BrickLayout::local(node);
    for (const Component& c : components_of(grid.bricks().brick_of(node)))
        if (c.nodes & bit) return c.piece;
    return -1;
}

std::int32_t Pieces::common_piece(std::size_t brick) const {
    const std::span<const Component> components = components_of(brick);
    const auto differs = [&](const Component& c) { return c.piece != components.front().piece; };
    return components.empty() || std::any_of(components.begin(), components.end(), differs)
               ? -1
               : components.front().piece;
}

}  // namespace splitcubes::splitting
