// Mass-spring lattice: equal masses on the grid's nodes, springs along its edges and across its faces.
#pragma once

#include <splitcubes/deformation/deformation.h>

namespace splitcubes::deformation {

struct MassSpringSettings {
    double youngs_modulus = 1e5;   // Pa
    double mass_damping = 0;       // 1/s, force -mass_damping * m * v
    double stiffness_damping = 0;  // s, spring force stiffness_damping * stiffness * rate of length
};

/// Springs along edges (structural) and both diagonals of faces (shear), all of stiffness 0.4 E h: for small
/// strains that lattice is isotropic with modulus E and Poisson ratio 1/4, the only one possible with springs
/// between two points. The spring of a cut edge is removed, and a diagonal if both paths around its face are
/// cut, so no spring joins two pieces. Time integration is by symplectic Euler with stable substeps. A node's
/// Jacobian is the least-squares fit to its springs, or the nearest rotation if the springs do not span space
/// or the fit is inverted. Springs resist no bending: a slab one node thick folds.
class MassSpring : public Deformation {
  public:
    /// Throws InputError for settings out of range.
    MassSpring(NodeSet nodes, const MassSpringSettings& settings);

    void edges_cut(std::span<const NodeEdge> edges) override;
    MotionReport advance(const Motion& motion) override;
    void node_frames(std::span<geometry::Frame> out, const Parallel& parallel) const override;
    std::vector<double> state() const override;
    void set_state(std::span<const double> state) override;

    std::size_t spring_count() const;
    const std::vector<Vec3>& positions() const { return position_; }
    std::vector<Vec3>& velocities() { return velocity_; }
    double node_mass() const { return mass_; }

  private:
    // A spring as stored at one of its ends.
    struct Spring {
        std::uint32_t other;
        double length;  // m, at rest
        bool is_intact;
    };
    std::span<const Spring> springs_of(std::size_t node) const {
        return {springs_.data() + offsets_[node], springs_.data() + offsets_[node + 1]};
    }
    std::int32_t node_at(const Vec3i& position) const;
    bool edge_is_intact(const Vec3i& a, const Vec3i& b) const;
    void remove(std::uint32_t a, std::uint32_t b);
    void remove_diagonals(const NodeEdge& edge);
    Vec3 spring_force(std::size_t node) const;
    void substep(const Motion& motion, double dt, double share);
    void resolve_ground_contact(const Motion& motion, std::size_t node);
    MotionReport describe(const Motion& motion) const;

    NodeSet nodes_;
    MassSpringSettings settings_;
    std::vector<std::int32_t> node_index_;  // per grid position, x fastest: node index; -1: not inside
    std::vector<std::array<std::uint8_t, 3>> edge_;  // per node and axis, 1: the edge upwards is uncut
    std::vector<std::uint32_t> offsets_;
    std::vector<Spring> springs_;
    double stiffness_ = 0;  // N/m
    double mass_ = 0;       // kg, of a node
    std::vector<Vec3> position_, velocity_, next_, force_;
    mutable std::vector<Mat3> rotation_;  // per node, of the last frame: used in directions without springs
};

}  // namespace splitcubes::deformation
