// Tracks the grid nodes whose motion is needed: those that influence surface vertices, and those near blades.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/core/state_stream.h>
#include <splitcubes/geometry/frame.h>
#include <splitcubes/geometry/occluder_grid.h>
#include <splitcubes/samples/frames.h>
#include <splitcubes/splitting/pieces.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// The state of a body that the tracker reads.
struct TrackerContext {
    const splitting::NodeGrid& grid;
    const splitting::Pieces& pieces;
    const geometry::OccluderGrid& occluders;
    const meshless::Phyxels& phyxels;
    const meshless::PhyxelLocator& locator;
    const Parallel& parallel;
};

/// Frames of grid nodes by the paper's equation 5. The kernel of a node consists of the phyxels of its piece
/// that are in reach and visible (the segment between them meets no surface). A node that sees none takes the
/// frame of the nearest node over uncut edges that sees one, so that every node has a frame.
///
/// Nodes that are neither held nor tracked recently sleep: they have no kernel, and find does not return them
/// until they are tracked again. So nodes that blades have passed cost nothing.
class NodeTracker {
  public:
    NodeTracker() = default;
    explicit NodeTracker(const splitting::BrickLayout& layout) : index_(layout) {}

    /// Adds or wakes a node and returns its index, which never changes. Call refresh before use.
    std::uint32_t track(const splitting::NodeGrid& grid, const Vec3i& node);
    /// Tracks a node that then never sleeps.
    std::uint32_t hold(const splitting::NodeGrid& grid, const Vec3i& node);
    /// Returns the index of a node, or -1 if it is not tracked or sleeps.
    std::int32_t find(const Vec3i& node) const {
        const std::int32_t index = index_.get(node, 0);
        return index >= 0 && use_[static_cast<std::size_t>(index)] == Use::none ? -1 : index;
    }
    bool is_awake(std::uint32_t index) const { return use_[index] != Use::none; }
    /// Puts the nodes to sleep that have not been tracked since the call before the last one.
    void let_sleep();

    /// Updates the kernels of nodes added since the last refresh, of marked nodes, and of those that phyxels
    /// added since then reach.
    void refresh(const TrackerContext& context);
    /// Marks the nodes within `radius`, m, of boxes (m, rest space) in which the surface changed: the
    /// visibility of their phyxels is tested again where the segment passes through a box. changes:
    /// OccluderGrid::changes() now.
    void mark_near(std::span<const geometry::Box> boxes, double radius, std::uint32_t changes,
                   const Parallel& parallel);
    /// Resets the change counters. To be called when the occluders' counter restarts.
    void forget_changes() { known_changes_ = marked_changes_ = 0; }
    /// Marks all kernels after pieces, or the pieces of phyxels, changed.
    void mark_pieces_changed() { pieces_changed_ = true; }

    /// Computes the frames of all tracked nodes for a state of the phyxels.
    void evaluate(const TrackerContext& context, std::span<const Vec3> position,
                  std::span<const Mat3> deformation, std::vector<geometry::Frame>& out);

    /// Computes the frames of some tracked nodes. `out` is resized for all; the other frames are kept.
    void evaluate_some(const TrackerContext& context, std::span<const std::uint32_t> nodes,
                       std::span<const Vec3> position, std::span<const Mat3> deformation,
                       std::vector<geometry::Frame>& out);

    /// Nodes whose kernels were built since clear_fresh, so that their frames are missing or out of date. May
    /// contain a node twice.
    const std::vector<std::uint32_t>& fresh() const { return fresh_; }
    void clear_fresh() { fresh_.clear(); }

    std::size_t size() const { return nodes_.size(); }
    const std::vector<Vec3i>& nodes() const { return nodes_; }
    const std::vector<Vec3>& rest_positions() const { return rest_; }
    const meshless::NodeKernels& kernels() const { return kernels_; }
    /// Changes whenever the kernel of a tracked node does; not stored in checkpoints.
    std::uint64_t row_revision(std::uint32_t node) const {
        return node < row_revision_.size() ? row_revision_[node] : 0;
    }
    /// Whether a node has a kernel of its own.
    bool has_row(std::uint32_t node) const { return node < kernels_.size() && kernels_.rows[node].count > 0; }
    /// Nodes that use another node's frame.
    std::size_t fallback_count() const { return fallbacks_.size(); }
    /// Saves the state between two steps.
    void save(StateWriter& writer, const meshless::Phyxels& phyxels) const;
    /// Restores saved state into a tracker of the same grid and rebuilds the kernels. Throws DamagedState.
    void load(StateReader& reader, const TrackerContext& context);

  private:
    /// A phyxel whose support reaches a node.
    struct Link {
        std::uint32_t phyxel;
        bool visible;   // the segment between them meets no surface
        double weight;  // kernel, 1/m^3
    };
    /// Update that a kernel needs, ascending in cost: none, new row, new visibility, new links.
    enum class KernelUpdate : std::uint8_t { none, filter, look, build };
    /// Last use of a node: none (it sleeps), before or after the last let_sleep, held.
    enum class Use : std::uint8_t { none, before, lately, always };
    struct Fallback {
        std::uint32_t node;    // sees no phyxel
        std::uint32_t source;  // provides its frame
    };
    bool is_influenced_by(const meshless::Phyxels& phyxels, std::size_t node, const Link& link) const {
        return link.visible && phyxels.piece[link.phyxel] == piece_[node];
    }
    bool is_bound(const meshless::Phyxels& phyxels, std::size_t node) const;
    void load_nodes(StateReader& reader, const TrackerContext& context);
    void load_links(StateReader& reader, const TrackerContext& context);
    void load_bonds(StateReader& reader, const TrackerContext& context);
    void make_rows(const TrackerContext& context);
    void build_links(const TrackerContext& context, std::size_t node, std::vector<std::uint32_t>& near);
    void find_changed_pieces(const TrackerContext& context);
    void add_new_phyxels(const TrackerContext& context);
    void update_visibility(const TrackerContext& context, std::size_t node, std::vector<geometry::Box>& near);
    void write_row(const TrackerContext& context, std::size_t node);
    void update_kernels(const TrackerContext& context);
    void find_fallbacks(const TrackerContext& context);
    std::uint32_t nearest_source(const TrackerContext& context, std::uint32_t node);
    void take_frame(const Fallback& fallback, std::vector<geometry::Frame>& out) const;
    void bind_to_nearest(const TrackerContext& context, std::uint32_t node);

    splitting::SlotMap<1> index_;
    std::vector<Vec3i> nodes_;              // per node: grid coordinates
    std::vector<Vec3> rest_;                // per node: m, rest space
    std::vector<std::int32_t> piece_;       // per node
    std::vector<KernelUpdate> pending_;     // per node
    std::vector<Use> use_;                  // per node
    std::vector<std::vector<Link>> links_;  // per node: all phyxels that reach it, visible or not
    std::vector<std::uint32_t> work_;       // scratch: nodes with a task
    std::vector<std::uint32_t> fresh_;      // nodes
    std::vector<geometry::Box> boxes_;      // m, rest space: marked regions in which the surface changed
    // Occluder change counters: last one processed by all nodes; last one for which nodes are marked.
    std::uint32_t known_changes_ = 0, marked_changes_ = 0;
    bool pieces_changed_ = false;
    std::vector<std::int32_t> phyxel_piece_;  // per phyxel that the links know, as of the last refresh
    std::vector<std::uint8_t> phyxel_moved_;  // scratch, per phyxel, 1: its piece changed
    double reach_ = 0;                        // m, the phyxels' largest support
    meshless::NodeKernels kernels_;
    meshless::FrameEvaluator evaluator_;
    std::vector<Fallback> fallbacks_;
    std::vector<std::uint64_t> row_revision_;  // per kernel
    std::uint64_t revision_ = 0;
};

}  // namespace splitcubes::body
