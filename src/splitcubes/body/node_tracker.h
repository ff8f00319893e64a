// The grid nodes whose motion is needed: those that carry surface vertices, and
// those that blades come near.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/core/state_stream.h>
#include <splitcubes/geometry/frame.h>
#include <splitcubes/geometry/occluder_grid.h>
#include <splitcubes/meshless/frames.h>
#include <splitcubes/splitting/pieces.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// What the tracker reads of its body.
struct TrackerContext {
    const splitting::NodeGrid& grid;
    const splitting::Pieces& pieces;
    const geometry::OccluderGrid& occluders;
    const meshless::Phyxels& phyxels;
    const meshless::PhyxelLocator& locator;
    const Parallel& parallel;
};

/// Node frames by the paper's equation 5: the kernel of a node is the phyxels of
/// its piece that reach it and that it sees (the segment between them meets no
/// surface). A node that sees none takes the frame of the nearest node that does,
/// over uncut edges, so no node of a piece is ever without a frame.
///
/// Nodes that nobody holds or has asked for lately sleep: they have no kernel and are not
/// found until they are tracked again, so that what blades have passed costs nothing.
class NodeTracker {
  public:
    NodeTracker() = default;
    explicit NodeTracker(const splitting::BrickLayout& layout) : index_(layout) {}

    /// Index of a tracked node, the same for good; adds or wakes it (call refresh before use).
    std::uint32_t track(const splitting::NodeGrid& grid, const Vec3i& node);
    /// The same for a node that never sleeps.
    std::uint32_t hold(const splitting::NodeGrid& grid, const Vec3i& node);
    /// -1 where the node is not tracked or sleeps.
    std::int32_t find(const Vec3i& node) const {
        const std::int32_t index = index_.get(node, 0);
        return index >= 0 && use_[static_cast<std::size_t>(index)] == Use::none ? -1 : index;
    }
    /// Whether find would find the node of this index.
    bool is_awake(std::uint32_t index) const { return use_[index] != Use::none; }
    /// Puts to sleep what nobody has tracked since the last call but one.
    void let_sleep();

    /// Brings the kernels up to date: of nodes added since the last refresh, of nodes
    /// that mark_near found, and after mark_pieces_changed or mark_all.
    void refresh(const TrackerContext& context);
    /// The surface changed within the boxes (rest space): nodes within `radius` of
    /// one look again at the phyxels that they see through a box. changes: what the occluders count now.
    void mark_near(std::span<const geometry::Box> boxes, double radius, std::uint32_t changes,
                   const Parallel& parallel);
    /// The occluders count anew.
    void forget_changes() { known_changes_ = marked_changes_ = 0; }
    /// Pieces or the phyxels' pieces changed.
    void mark_pieces_changed() { pieces_changed_ = true; }
    /// All kernels are built again (phyxels were added).
    void mark_all();

    /// Frames of all tracked nodes for a state of the phyxels.
    void evaluate(const TrackerContext& context, std::span<const Vec3> position,
                  std::span<const Mat3> deformation, std::vector<geometry::Frame>& out);

    /// Of some tracked nodes only; `out` gets room for all, what is not asked for stays.
    void evaluate_some(const TrackerContext& context, std::span<const std::uint32_t> nodes,
                       std::span<const Vec3> position, std::span<const Mat3> deformation,
                       std::vector<geometry::Frame>& out);

    /// Nodes whose kernels were built since clear_fresh: they never had a frame or have an
    /// old one. A node may stand here twice.
    const std::vector<std::uint32_t>& fresh() const { return fresh_; }
    void clear_fresh() { fresh_.clear(); }

    std::size_t size() const { return places_.size(); }
    const std::vector<Vec3i>& places() const { return places_; }
    const std::vector<Vec3>& rest_positions() const { return rest_; }
    const meshless::NodeKernels& kernels() const { return kernels_; }
    /// Another number once a tracked node's kernel has been written again; not kept in checkpoints.
    std::uint64_t row_revision(std::uint32_t node) const {
        return node < row_revision_.size() ? row_revision_[node] : 0;
    }
    /// Whether phyxels carry the node by a kernel of its own.
    bool has_row(std::uint32_t node) const { return node < kernels_.size() && kernels_.rows[node].count > 0; }
    /// Nodes that use another node's frame.
    std::size_t fallback_count() const { return fallbacks_.size(); }
    /// For checkpoints, between two steps.
    void save(StateWriter& writer, const meshless::Phyxels& phyxels) const;
    /// Takes it into a tracker of the same grid; kernels are written again. Throws DamagedState.
    void load(StateReader& reader, const TrackerContext& context);

  private:
    /// A phyxel whose support reaches a node.
    struct Link {
        std::uint32_t phyxel;
        bool sees;      // the segment between them meets no surface
        double weight;  // kernel, 1/m^3
    };
    enum class Task : std::uint8_t { none, filter, look, build };    // what a kernel needs
    enum class Use : std::uint8_t { none, before, lately, always };  // none: sleeps
    struct Fallback {
        std::uint32_t node;    // that sees no phyxel
        std::uint32_t source;  // whose frame it takes
    };
    bool carries(const meshless::Phyxels& phyxels, std::size_t node, const Link& link) const {
        return link.sees && phyxels.piece[link.phyxel] == piece_[node];
    }
    bool is_bound(const meshless::Phyxels& phyxels, std::size_t node) const;
    void load_nodes(StateReader& reader, const TrackerContext& context);
    void load_links(StateReader& reader, const TrackerContext& context);
    void load_bonds(StateReader& reader, const TrackerContext& context);
    void make_rows(const TrackerContext& context);
    void build_links(const TrackerContext& context, std::size_t node, std::vector<std::uint32_t>& near);
    void look_again(const TrackerContext& context, std::size_t node, std::vector<geometry::Box>& near);
    void write_row(const TrackerContext& context, std::size_t node);
    void do_tasks(const TrackerContext& context);
    void find_fallbacks(const TrackerContext& context);
    std::uint32_t nearest_source(const TrackerContext& context, std::uint32_t node);
    void take_frame(const Fallback& fallback, std::vector<geometry::Frame>& out) const;
    void bind_to_nearest(const TrackerContext& context, std::uint32_t node);

    splitting::SlotMap<1> index_;
    std::vector<Vec3i> places_;             // per node: grid coordinates
    std::vector<Vec3> rest_;                // per node: m, rest space
    std::vector<std::int32_t> piece_;       // per node
    std::vector<Task> task_;                // per node
    std::vector<Use> use_;                  // per node
    std::vector<std::vector<Link>> links_;  // per node: all phyxels that reach it, seen or not
    std::vector<std::uint32_t> work_;       // scratch: nodes with a task
    std::vector<std::uint32_t> fresh_;      // nodes
    std::vector<geometry::Box> boxes_;      // m, rest space: where the surface changed
    // What the occluders counted when they last changed in boxes: that all nodes have looked at, that are
    // marked.
    std::uint32_t known_changes_ = 0, marked_changes_ = 0;
    bool pieces_changed_ = false;
    double reach_ = 0;  // m, the phyxels' largest support
    meshless::NodeKernels kernels_;
    meshless::FrameEvaluator evaluator_;
    std::vector<Fallback> fallbacks_;
    std::vector<std::uint64_t> row_revision_;  // per kernel
    std::uint64_t writings_ = 0;
};

}  // namespace splitcubes::body
