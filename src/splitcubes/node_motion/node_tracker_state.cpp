// Saves and restores the tracked nodes: which are awake, which phyxels reach each and which of these are
// visible. Rest positions, weights and kernels are derived.
#include <splitcubes/node_motion/node_tracker.h>
#include <splitcubes/samples/kernel.h>

#include <algorithm>

namespace splitcubes::body {

// Whether the node's row comes from bind_to_nearest, so that no link accounts for it.
bool NodeTracker::is_bound(const meshless::Phyxels& phyxels, std::size_t node) const {
    if (!has_row(static_cast<std::uint32_t>(node))) return false;
    return std::none_of(links_[node].begin(), links_[node].end(),
                        [&](const Link& link) { return is_influenced_by(phyxels, node, link); });
}

void NodeTracker::save(StateWriter& writer, const meshless::Phyxels& phyxels) const {
    writer.add(std::uint64_t{size()});
    for (std::size_t i = 0; i < size(); ++i) writer.add(splitting::edge_id({nodes_[i], 0}));
    for (std::size_t i = 0; i < size(); ++i) writer.add(static_cast<std::uint8_t>(use_[i]));
    for (std::size_t i = 0; i < size(); ++i) writer.add(static_cast<std::uint32_t>(links_[i].size()));
    for (const std::vector<Link>& links : links_)
        for (const Link& link : links) writer.add(link.phyxel << 1 | std::uint32_t{link.visible});
    std::vector<std::uint32_t> bonds;
    for (std::uint32_t i = 0; i < size(); ++i)
        if (is_bound(phyxels, i)) bonds.insert(bonds.end(), {i, kernels_.phyxel[kernels_.rows[i].begin]});
    writer.add(std::uint64_t{bonds.size() / 2});
    writer.add(std::span<const std::uint32_t>(bonds));
    writer.add(std::uint64_t{fallbacks_.size()});
    for (const Fallback& fallback : fallbacks_) {
        writer.add(fallback.node);
        writer.add(fallback.source);
    }
}

void NodeTracker::load(StateReader& reader, const TrackerContext& context) {
    load_nodes(reader, context);
    load_links(reader, context);
    make_rows(context);
    load_bonds(reader, context);
    pending_.assign(size(), KernelUpdate::none);
    fresh_.clear();
    boxes_.clear();
    pieces_changed_ = false;
    phyxel_piece_ = context.phyxels.piece;
    forget_changes();
}

void NodeTracker::load_nodes(StateReader& reader, const TrackerContext& context) {
    const splitting::NodeGrid& grid = context.grid;
    const std::size_t count = reader.count(sizeof(std::uint64_t));
    const std::vector<std::uint64_t> ids = reader.numbers<std::uint64_t>(count);
    const std::vector<std::uint8_t> uses = reader.numbers<std::uint8_t>(
        count, 0, static_cast<std::uint8_t>(Use::always), "a node with an unknown use");
    index_ = splitting::SlotMap<1>(grid.bricks());
    nodes_.clear();
    rest_.clear();
    piece_.clear();
    use_.clear();
    for (std::size_t i = 0; i < count; ++i) {
        const auto [node, axis] = splitting::edge_from_id(ids[i]);
        require_state(axis == 0 && grid.rest().contains(node) && grid.inside(node),
                      "a node outside the body");
        require_state(index_.get(node, 0) < 0, "a node that is tracked twice");
        index_.set(node, 0, static_cast<std::int32_t>(i));
        nodes_.push_back(node);
        rest_.push_back(grid.rest().node_position(node));
        piece_.push_back(context.pieces.piece_of(grid, node));
        use_.push_back(static_cast<Use>(uses[i]));
    }
}

void NodeTracker::load_links(StateReader& reader, const TrackerContext& context) {
    const meshless::Phyxels& phyxels = context.phyxels;
    const std::vector<std::uint32_t> counts = reader.numbers<std::uint32_t>(size());
    links_.assign(size(), {});
    for (std::size_t i = 0; i < size(); ++i) {
        require_state(counts[i] == 0 || use_[i] != Use::none, "an unused node with links");
        const std::vector<std::uint32_t> stored = reader.numbers<std::uint32_t>(counts[i]);
        links_[i].reserve(stored.size());
        for (const std::uint32_t entry : stored) {
            const std::uint32_t phyxel = entry >> 1;
            require_state(phyxel < phyxels.size() && (links_[i].empty() || links_[i].back().phyxel < phyxel),
                          "a node with links out of order");
            const double weight = meshless::kernel((phyxels.rest_position[phyxel] - rest_[i]).squaredNorm(),
                                                   phyxels.support_radius[phyxel]);
            require_state(weight > 0, "a node with a link to a phyxel out of its reach");
            links_[i].push_back({phyxel, (entry & 1U) != 0, weight});
        }
    }
}

void NodeTracker::make_rows(const TrackerContext& context) {
    kernels_ = {};
    kernels_.rows.resize(size());
    std::uint32_t end = 0;
    for (std::size_t i = 0; i < size(); ++i) {
        if (use_[i] == Use::none) continue;
        const auto capacity = static_cast<std::uint32_t>(std::max<std::size_t>(links_[i].size(), 1));
        kernels_.rows[i] = {end, 0, capacity};
        end += capacity;
    }
    kernels_.phyxel.resize(end);
    kernels_.weight.resize(end);
    row_revision_.assign(size(), 0);
    revision_ = 1;
    context.parallel.for_each(size(), 256, [&](std::size_t i) {
        if (use_[i] != Use::none) write_row(context, i);
    });
}

// Loads the nodes without visible phyxels: those bound to a phyxel, and those with the frame of another node.
void NodeTracker::load_bonds(StateReader& reader, const TrackerContext& context) {
    const auto is_bare = [&](std::uint32_t node) {
        return node < size() && use_[node] != Use::none && kernels_.rows[node].count == 0;
    };
    for (std::size_t k = reader.count(2 * sizeof(std::uint32_t)); k > 0; --k) {
        const auto node = reader.number<std::uint32_t>(), phyxel = reader.number<std::uint32_t>();
        require_state(
            is_bare(node) && phyxel < context.phyxels.size() && context.phyxels.piece[phyxel] == piece_[node],
            "a node bound to a phyxel of another piece");
        kernels_.rows[node].count = 1;
        kernels_.phyxel[kernels_.rows[node].begin] = phyxel;
        kernels_.weight[kernels_.rows[node].begin] = 1;
    }
    fallbacks_.clear();
    for (std::size_t k = reader.count(2 * sizeof(std::uint32_t)); k > 0; --k) {
        const auto node = reader.number<std::uint32_t>(), source = reader.number<std::uint32_t>();
        require_state(is_bare(node) && (fallbacks_.empty() || fallbacks_.back().node < node) &&
                          source < size() && use_[source] != Use::none && has_row(source),
                      "a node that takes the frame of a node without links");
        fallbacks_.push_back({node, source});
    }
}

}  // namespace splitcubes::body
