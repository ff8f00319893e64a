// Which inside nodes hang together over uncut edges: the pieces of a body.
#pragma once

#include <splitcubes/splitting/node_grid.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::splitting {

/// A fragment that came off: `piece` is new, `parent` is what it belonged to.
struct PieceSplit {
    std::int32_t parent;
    std::int32_t piece;

    bool operator==(const PieceSplit&) const = default;
};

/// Labels of the inside nodes. Bricks of nodes are labelled as bit sets, so an
/// uncut body of a million nodes costs 16,000 steps. A piece that falls apart
/// keeps its number on the fragment with the most nodes (then the lowest node);
/// the others get new numbers, so numbers are never reused.
class Pieces {
  public:
    explicit Pieces(const NodeGrid& grid);

    /// Labels again after cuts; returns the fragments that came off, by number.
    /// Looks at all bricks: the slow truth for the other one.
    std::vector<PieceSplit> update(const NodeGrid& grid);

    /// The same where only these edges were cut since the last time (slots, of any
    /// origin and in any order). Looks at the bricks around them, and from there as
    /// far as it takes to find the way round a cut, or the end of a fragment: a cut
    /// that parts nothing costs what it is long, one that parts the body costs the
    /// bricks of all fragments but the largest.
    std::vector<PieceSplit> update(const NodeGrid& grid, std::span<const std::int32_t> new_slots);

    /// Number of pieces; they are 0 .. count()-1.
    std::size_t count() const { return node_counts_.size(); }
    /// Inside nodes of each piece.
    const std::vector<std::size_t>& node_counts() const { return node_counts_; }
    /// -1 for an outside node.
    std::int32_t piece_of(const NodeGrid& grid, const Vec3i& node) const;

  private:
    Pieces() = default;

    /// Nodes of one brick that hang together within it.
    struct Component {
        std::uint64_t nodes;
        std::uint32_t brick;
        std::int32_t piece;
        std::uint32_t search;  // scratch of the searches; none elsewhere
    };
    /// A brick's components: a run of components_, in order of their lowest nodes.
    struct BrickRun {
        std::uint32_t first = 0, count = 0;
    };
    class Searches;

    std::span<Component> components_of(std::size_t brick) {
        return {components_.data() + runs_[brick].first, runs_[brick].count};
    }
    std::span<const Component> components_of(std::size_t brick) const {
        return {components_.data() + runs_[brick].first, runs_[brick].count};
    }
    void label_brick(const NodeGrid& grid, std::size_t brick, std::vector<Component>& out) const;
    std::vector<std::uint32_t> relabel_bricks(const NodeGrid& grid, std::span<const std::int32_t> new_slots);
    template <class Visit>
    void for_neighbours(const NodeGrid& grid, std::uint32_t component, const Visit& visit) const;

    std::vector<Component> components_;
    std::vector<BrickRun> runs_;  // per brick
    std::vector<std::size_t> node_counts_;
};

}  // namespace splitcubes::splitting
