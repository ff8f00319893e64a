// Motion of the grid nodes of a body, and of the grid edges between them.
#pragma once

#include <splitcubes/cutting/sweep.h>
#include <splitcubes/node_motion/node_tracker.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Frames of the tracked nodes, now and a step ago, and where the edges were that the last step tested
/// against blades. Subclasses say what moves the nodes.
class NodeMotion {
  public:
    explicit NodeMotion(const splitting::BrickLayout& layout) : tracker_(layout) {}
    NodeMotion(const NodeMotion&) = delete;
    NodeMotion& operator=(const NodeMotion&) = delete;
    virtual ~NodeMotion() = default;

    NodeTracker& tracker() { return tracker_; }
    const NodeTracker& tracker() const { return tracker_; }
    /// Per tracked node, as of the last update_frames or candidate_edges.
    const std::vector<geometry::Frame>& frames() const { return frames_; }
    /// Whether a node has no influence of its own and takes its frame from another one.
    virtual bool has_fallback_frames() const = 0;
    std::int64_t step_count() const { return step_count_; }
    /// To be called when the body has moved by a step.
    void count_step() { ++step_count_; }

    /// Returns the uncut edges between inside nodes that the blades may have crossed in the last interval.
    std::vector<splitting::GridEdge> edges_near(const splitting::NodeGrid& grid,
                                                std::span<const cutting::SweptBlade> blades,
                                                const Parallel& parallel);
    struct Candidates {
        std::vector<cutting::CandidateEdge> moving;  // all, over the last interval
        /// Those whose start is not where the last interval ended, since their nodes follow other phyxels
        /// now: from there to that start. Nothing must pass between two intervals.
        std::vector<cutting::CandidateEdge> shifted;
    };
    /// Returns the edges with their motion, by the influences that their nodes have now at both ends of the
    /// interval. So it does not depend on which edges were near a blade before. Tracks their nodes.
    Candidates candidate_edges(std::span<const splitting::GridEdge> edges, const TrackerContext& context);
    /// Reports new crossings of the grid between inside nodes.
    virtual void edges_cut(const splitting::NodeGrid& grid, std::span<const std::int32_t> crossings) = 0;
    /// Refreshes the tracker and computes the present frames of all tracked nodes.
    void update_frames(const TrackerContext& context);

    /// Saves the state between two steps.
    void save(StateWriter& writer, const meshless::Phyxels& phyxels) const;
    /// Restores saved state into the motion of a body with the same settings and cuts. Throws DamagedState.
    void load(StateReader& reader, const TrackerContext& context);

  private:
    /// bounds: box of the blades, m, world; not empty.
    virtual std::vector<splitting::GridEdge> find_edges_near(const splitting::NodeGrid& grid,
                                                             std::span<const cutting::SweptBlade> blades,
                                                             const geometry::Box& bounds,
                                                             const Parallel& parallel) = 0;
    virtual void evaluate_now(const TrackerContext& context, std::vector<geometry::Frame>& out) = 0;
    /// Both evaluate at least the given tracked nodes; `out` is resized for all.
    virtual void evaluate_some_now(const TrackerContext& context, std::span<const std::uint32_t> nodes,
                                   std::vector<geometry::Frame>& out) = 0;
    virtual void evaluate_some_before(const TrackerContext& context, std::span<const std::uint32_t> nodes,
                                      std::vector<geometry::Frame>& out) = 0;
    virtual void save_own(StateWriter& writer) const = 0;
    virtual void load_own(StateReader& reader, const TrackerContext& context) = 0;
    std::vector<std::uint32_t> track_ends(std::span<const splitting::GridEdge> edges,
                                          const splitting::NodeGrid& grid);
    cutting::CandidateEdge candidate(const splitting::GridEdge& edge) const;
    void add_shifted(const cutting::CandidateEdge& moving, const splitting::GridEdge& edge, double tolerance,
                     std::vector<cutting::CandidateEdge>& shifted) const;

    NodeTracker tracker_;
    std::vector<geometry::Frame> frames_;         // per tracked node, now
    std::vector<geometry::Frame> frames_before_;  // per tracked node, a step ago; set where candidate_edges
                                                  // requested it
    std::vector<Vec3> cut_position_;              // per tracked node, m, world, at its last candidate_edges
    std::vector<std::int64_t> cut_step_;          // per tracked node, step of cut_position_; -2: never
    std::int64_t step_count_ = 0;
};

}  // namespace splitcubes::body
