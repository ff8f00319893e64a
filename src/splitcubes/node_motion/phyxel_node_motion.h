// Motion of the grid nodes by the phyxels around them.
#pragma once

#include <splitcubes/node_motion/moving_bricks.h>
#include <splitcubes/node_motion/node_motion.h>

namespace splitcubes::body {

/// The phyxels move the nodes.
class PhyxelNodeMotion final : public NodeMotion {
  public:
    /// previous_deformation: per phyxel, one step ago. Both arrays must outlive this object.
    PhyxelNodeMotion(const splitting::BrickLayout& layout, const meshless::Phyxels& phyxels,
                     const std::vector<Mat3>& previous_deformation)
        : NodeMotion(layout), phyxels_(phyxels), previous_deformation_(previous_deformation) {}

    bool has_fallback_frames() const override { return tracker().fallback_count() > 0; }
    void edges_cut(const splitting::NodeGrid&, std::span<const std::int32_t>) override {}

  private:
    std::vector<splitting::GridEdge> find_edges_near(const splitting::NodeGrid& grid,
                                                     std::span<const cutting::SweptBlade> blades,
                                                     const geometry::Box& bounds,
                                                     const Parallel& parallel) override;
    void evaluate_now(const TrackerContext& context, std::vector<geometry::Frame>& out) override;
    void evaluate_some_now(const TrackerContext& context, std::span<const std::uint32_t> nodes,
                           std::vector<geometry::Frame>& out) override;
    void evaluate_some_before(const TrackerContext& context, std::span<const std::uint32_t> nodes,
                              std::vector<geometry::Frame>& out) override;
    void save_own(StateWriter&) const override {}
    void load_own(StateReader&, const TrackerContext&) override {}

    const meshless::Phyxels& phyxels_;
    const std::vector<Mat3>& previous_deformation_;
    MovingBricks moving_bricks_;
};

}  // namespace splitcubes::body
