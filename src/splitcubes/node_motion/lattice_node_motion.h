// Motion of the grid nodes by a deformation model.
#pragma once

#include <splitcubes/deformation/deformation.h>
#include <splitcubes/node_motion/node_motion.h>
#include <splitcubes/splitting/slot_map.h>

#include <memory>

namespace splitcubes::body {

/// A deformation model moves the inside nodes, and the phyxels follow their nodes.
class LatticeNodeMotion final : public NodeMotion {
  public:
    /// Motion of a body at time 0.
    struct InitialMotion {
        double mass;            // kg
        Vec3 velocity;          // m/s
        Vec3 angular_velocity;  // rad/s, about the centre of mass
    };
    /// Makes the model of an uncut body. nodes: grid coordinates of the inside nodes; must outlive this
    /// object.
    LatticeNodeMotion(const splitting::NodeGrid& grid, const std::vector<Vec3i>& nodes,
                      const InitialMotion& initial, const deformation::MakeDeformation& make);

    bool has_fallback_frames() const override { return false; }
    void edges_cut(const splitting::NodeGrid& grid, std::span<const std::int32_t> crossings) override;
    /// Takes a step of the model. motion: input, per inside node.
    deformation::MotionReport advance(const deformation::Motion& motion);
    /// Moves the phyxels with the nodes that own them. owner: per phyxel, grid coordinates; dt: s, since
    /// their last positions.
    void move_phyxels(const splitting::NodeGrid& grid, std::span<const Vec3i> owner, double dt,
                      meshless::Phyxels& phyxels) const;

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
    void save_own(StateWriter& writer) const override;
    void load_own(StateReader& reader, const TrackerContext& context) override;
    std::size_t index_of(const Vec3i& node) const {
        return static_cast<std::size_t>(node_index_.get(node, 0));
    }
    deformation::NodeEdge between_nodes(const splitting::GridEdge& edge) const;
    void pick_frames(const std::vector<geometry::Frame>& nodes, std::vector<geometry::Frame>& out) const;
    std::vector<std::uint32_t> bricks_of_nodes_in(const splitting::NodeGrid& grid,
                                                  const geometry::Box& box) const;

    const std::vector<Vec3i>& nodes_;   // inside nodes
    splitting::SlotMap<1> node_index_;  // of inside nodes, per grid node
    std::unique_ptr<deformation::Deformation> deformation_;
    std::vector<geometry::Frame> node_frames_;         // per inside node, now
    std::vector<geometry::Frame> node_frames_before_;  // the same, a step ago
};

}  // namespace splitcubes::body
