// Pieces of a body: components of inside nodes connected over uncut edges.
#pragma once

#include <splitcubes/splitting/node_grid.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::splitting {

/// A fragment that came off: `piece` is its new id, `parent` the piece that it belonged to.
struct PieceSplit {
    std::int32_t parent;
    std::int32_t piece;

    bool operator==(const PieceSplit&) const = default;
};

/// Piece labels of the inside nodes. Bricks of nodes are labelled as bit sets, so an uncut body of a million
/// nodes takes 16,000 steps. If a piece separates, the fragment with the most nodes (then the lowest node)
/// keeps its id; the others get new ids. Ids are never reused.
class Pieces {
  public:
    explicit Pieces(const NodeGrid& grid);

    /// Relabels all bricks after cuts; returns the fragments that came off, by id. Slow reference for the
    /// other overload.
    std::vector<PieceSplit> update(const NodeGrid& grid);

    /// Does the same if only the edges of `new_slots` (of any origin, in any order) were cut since the last
    /// update. Examines the bricks around these edges and from there as far as needed to find a path around a
    /// cut or the end of a fragment. A cut that separates nothing costs its length; one that separates the
    /// body costs the bricks of all fragments but the largest.
    std::vector<PieceSplit> update(const NodeGrid& grid, std::span<const std::int32_t> new_slots);

    /// Returns the number of pieces; their ids are 0 .. count()-1.
    std::size_t count() const { return node_counts_.size(); }
    /// Returns the number of inside nodes of each piece.
    const std::vector<std::size_t>& node_counts() const { return node_counts_; }
    /// Returns -1 for an outside node.
    std::int32_t piece_of(const NodeGrid& grid, const Vec3i& node) const;
    /// Returns the piece of all inside nodes of a brick; -1 if they belong to several, or if there are none.
    std::int32_t common_piece(std::size_t brick) const;

  private:
    Pieces() = default;

    /// Nodes of one brick that are connected within it.
    struct Component {
        std::uint64_t nodes;
        std::uint32_t brick;
        std::int32_t piece;
        std::uint32_t search;  // scratch of Searches; otherwise none
    };
    /// Components of a brick: a run of components_, ordered by their lowest nodes.
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
