#include <splitcubes/core/disjoint_sets.h>
#include <splitcubes/splitting/pieces.h>

#include <algorithm>
#include <bit>

namespace splitcubes::splitting {

namespace {

using Word = std::uint64_t;

// Nodes of a brick whose coordinate along the axis is 3 (their edge leaves the brick).
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

// All nodes of the brick that hang together with `seed` within the brick.
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

}  // namespace

void Pieces::find_components(const NodeGrid& grid, std::vector<Component>& components,
                             std::vector<std::uint32_t>& first) {
    const std::size_t brick_total = grid.bricks().total();
    components.clear();
    first.assign(brick_total + 1, 0);
    for (std::size_t brick = 0; brick < brick_total; ++brick) {
        first[brick] = static_cast<std::uint32_t>(components.size());
        const BrickWords w = words_of(grid, brick);
        for (Word rest = w.inside; rest;) {
            const Word part = flood(w, rest & (~rest + 1));
            components.push_back({part, -1});
            rest &= ~part;
        }
    }
    first[brick_total] = static_cast<std::uint32_t>(components.size());
}

std::vector<PieceSplit> Pieces::update(const NodeGrid& grid) {
    std::vector<Component> components;
    std::vector<std::uint32_t> first;
    find_components(grid, components, first);
    DisjointSets sets(components.size());
    const BrickLayout& layout = grid.bricks();
    const std::size_t strides[3] = {
        1, static_cast<std::size_t>(layout.brick_count[0]),
        static_cast<std::size_t>(layout.brick_count[0]) * static_cast<std::size_t>(layout.brick_count[1])};
    for (std::size_t brick = 0; brick < layout.total(); ++brick) {
        if (first[brick] == first[brick + 1]) continue;
        const Vec3i base = layout.base(brick) / brick_side;
        for (int axis = 0; axis < 3; ++axis) {
            if (base[axis] + 1 >= layout.brick_count[axis]) continue;
            const std::size_t next = brick + strides[axis];
            const Word open = ~grid.cut_word(brick, axis) & last_layer[axis];
            for (std::uint32_t i = first[brick]; i < first[brick + 1]; ++i) {
                const Word reach = (components[i].nodes & open) >> (3 * stride[axis]);
                if (!reach) continue;
                for (std::uint32_t j = first[next]; j < first[next + 1]; ++j)
                    if (reach & components[j].nodes) sets.join(i, j);
            }
        }
    }

    // Size and old number of each connected set; a set's root is its lowest component.
    std::vector<std::size_t> size(components.size(), 0);
    std::vector<std::int32_t> parent(components.size(), -1);
    for (std::size_t brick = 0; brick < layout.total(); ++brick)
        for (std::uint32_t i = first[brick]; i < first[brick + 1]; ++i) {
            const std::uint32_t root = sets.find(i);
            size[root] += static_cast<std::size_t>(std::popcount(components[i].nodes));
            if (parent[root] >= 0 || first_.empty()) continue;
            for (std::uint32_t j = first_[brick]; j < first_[brick + 1]; ++j)
                if (components_[j].nodes & components[i].nodes) parent[root] = components_[j].piece;
        }
    std::vector<std::uint32_t> heir(node_counts_.size(), UINT32_MAX);
    for (std::uint32_t root = 0; root < components.size(); ++root) {
        if (sets.find(root) != root || parent[root] < 0) continue;
        std::uint32_t& best = heir[static_cast<std::size_t>(parent[root])];
        if (best == UINT32_MAX || size[root] > size[best]) best = root;
    }
    std::vector<PieceSplit> splits;
    std::vector<std::size_t> counts(node_counts_.size(), 0);
    for (std::uint32_t root = 0; root < components.size(); ++root) {
        if (sets.find(root) != root) continue;
        std::int32_t piece = parent[root];
        if (piece < 0 || heir[static_cast<std::size_t>(piece)] != root) {
            piece = static_cast<std::int32_t>(counts.size());
            counts.push_back(0);
            splits.push_back({parent[root], piece});
        }
        counts[static_cast<std::size_t>(piece)] = size[root];
        components[root].piece = piece;
    }
    for (std::uint32_t i = 0; i < components.size(); ++i)
        components[i].piece = components[sets.find(i)].piece;
    components_ = std::move(components);
    first_ = std::move(first);
    node_counts_ = std::move(counts);
    return splits;
}

Pieces::Pieces(const NodeGrid& grid) {
    update(grid);
}

std::int32_t Pieces::piece_of(const NodeGrid& grid, const Vec3i& node) const {
    const std::size_t brick = grid.bricks().brick_of(node);
    const Word bit = Word{1} << BrickLayout::local(node);
    for (std::uint32_t i = first_[brick]; i < first_[brick + 1]; ++i)
        if (components_[i].nodes & bit) return components_[i].piece;
    return -1;
}

}  // namespace splitcubes::splitting
