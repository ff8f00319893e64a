// Which inside nodes hang together over uncut edges: the pieces of a body.
#pragma once

#include <splitcubes/splitting/node_grid.h>

#include <cstdint>
#include <vector>

namespace splitcubes::splitting {

/// A fragment that came off: `piece` is new, `parent` is what it belonged to.
struct PieceSplit {
    std::int32_t parent;
    std::int32_t piece;
};

/// Labels of the inside nodes. Bricks of nodes are labelled as bit sets, so an
/// uncut body of a million nodes costs 16,000 steps. A piece that falls apart
/// keeps its number on the fragment with the most nodes (then the lowest node);
/// the others get new numbers, so numbers are never reused.
class Pieces {
  public:
    explicit Pieces(const NodeGrid& grid);

    /// Labels again after cuts; returns the fragments that came off, by number.
    std::vector<PieceSplit> update(const NodeGrid& grid);

    /// Number of pieces; they are 0 .. count()-1.
    std::size_t count() const { return node_counts_.size(); }
    /// Inside nodes of each piece.
    const std::vector<std::size_t>& node_counts() const { return node_counts_; }
    /// -1 for an outside node.
    std::int32_t piece_of(const NodeGrid& grid, const Vec3i& node) const;

  private:
    struct Component {
        std::uint64_t nodes;  // of its brick
        std::int32_t piece;
    };
    static void find_components(const NodeGrid& grid, std::vector<Component>& components,
                                std::vector<std::uint32_t>& first);

    std::vector<Component> components_;  // by brick
    std::vector<std::uint32_t> first_;   // per brick: its first component; one past the last at the end
    std::vector<std::size_t> node_counts_;
};

}  // namespace splitcubes::splitting
