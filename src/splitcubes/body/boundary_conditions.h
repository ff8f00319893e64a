// Prescribed motions and springs that act on regions of a body.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/samples/rigid_pieces.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::meshless {
struct HandleSpring;
}

namespace splitcubes::body {

/// Prescribes the positions of the phyxels that are in a region at time 0: fixed, or along a path.
struct HoldConstraint {
    std::function<bool(const Vec3& at_start)> region;  // world at time 0
    /// World from the world at time 0 for the held phyxels at a time, s; identity: fixed.
    std::function<Isometry(double time)> motion;
    double from = 0;       // s
    double until = 1e300;  // s

    /// Whether it holds in a step that starts at a time, s.
    bool is_active(double time) const { return time >= from && time < until; }
};

/// Attachment of a region of a body to a moving frame by springs of limited total force.
struct Handle {
    std::string name;
    std::function<bool(const Vec3& at_start)> region;  // world at time 0
    /// World from the world at time 0 of the grabbed region at a time, s.
    std::function<Isometry(double time)> motion;
    double stiffness = 1000;  // N/m, sum over the region
    double limit = 1e300;     // N, maximum of the total force
    double from = 0;          // s, start time
    double until = 1e300;     // s, end time

    /// Whether it acts in a step that starts at a time, s.
    bool is_active(double time) const { return time >= from && time < until; }
};

/// The constraints and handles of one body, and the phyxels that they hold in a step.
class BoundaryConditions {
  public:
    /// pose: world at time 0 from rest space.
    explicit BoundaryConditions(const Isometry& pose) : pose_(pose) {}
    void add_constraint(HoldConstraint constraint);
    void add_handle(Handle handle);
    /// Removes one; those behind it move up by one, also in what phyxels ignore.
    void remove_constraint(std::size_t index, meshless::Phyxels& phyxels);
    void remove_handle(std::size_t index, meshless::Phyxels& phyxels);
    /// Sets when one acts, s.
    void set_constraint_active(std::size_t index, double from, double until) {
        constraints_[index].from = from;
        constraints_[index].until = until;
    }
    void set_handle_active(std::size_t index, double from, double until) {
        handles_[index].from = from;
        handles_[index].until = until;
    }
    const std::vector<HoldConstraint>& constraints() const { return constraints_; }
    const std::vector<Handle>& handles() const { return handles_; }
    void set_constraint_motion(std::size_t index, std::function<Isometry(double time)> motion) {
        constraints_[index].motion = std::move(motion);
    }
    void set_handle_motion(std::size_t index, std::function<Isometry(double time)> motion) {
        handles_[index].motion = std::move(motion);
    }
    /// Makes the next step search the phyxels of each region again. To be called when phyxels were added or
    /// replaced.
    void forget_phyxels();

    /// Determines the phyxels and rigid pieces that the constraints hold in the step of dt, s, that starts at
    /// a time, s, and their positions at its end.
    void begin_step(const meshless::Phyxels& phyxels, double time, double dt, const Parallel& parallel);
    /// Per phyxel, as of the last begin_step: 1 if a constraint prescribes its position.
    std::span<const std::uint8_t> held() const { return held_; }
    /// Per phyxel, as of the last begin_step: m, world, at the end of the step; zero if it is not held.
    std::span<const Vec3> held_position() const { return held_position_; }
    /// The prescribed motions of rigid pieces, as of the last begin_step: a piece with a phyxel in a held
    /// region moves as a whole with the first such constraint.
    std::span<const meshless::RigidKinematicTarget> kinematic_rigid_pieces() const {
        return kinematic_rigid_pieces_;
    }

    /// Returns which phyxels are held in a step that starts at a time, s: 1 if held. Valid until the next
    /// call.
    std::span<const std::uint8_t> held_among(const meshless::Phyxels& phyxels, double time);
    /// Returns whether a constraint, active or not, acts on a phyxel.
    bool is_held(const meshless::Phyxels& phyxels, std::size_t i) const;
    /// The same for handles.
    bool is_pulled(const meshless::Phyxels& phyxels, std::size_t i) const;
    /// Returns how far, m, the active constraints at a time, s, put a point at rest from a position in the
    /// world, m; 0 if none contains it.
    double hold_offset(const Vec3& rest, const Vec3& position, double time) const;
    /// Points and their prescribed positions.
    struct HeldPoints {
        std::vector<std::uint8_t> held;  // per point, 1: its position is prescribed
        std::vector<Vec3> position;  // per point, m, world, at the end of the step; zero if it is not held
    };
    /// Returns the same for points that are no phyxels, with their positions at the end of the step.
    HeldPoints hold(std::span<const Vec3> rest_position, double time, double dt) const;

    /// Appends the springs of the active handles, with their targets at the end of the step, and one force
    /// limit, N, per handle. part: index of the body in its contact island.
    void add_handle_springs(const meshless::Phyxels& phyxels, double time, double dt, std::uint32_t part,
                            std::vector<meshless::HandleSpring>& handle_springs, std::vector<double>& limits);

  private:
    std::vector<meshless::RigidKinematicTarget> find_kinematic_rigid_pieces(const meshless::Phyxels& phyxels,
                                                                            double time, double dt) const;

    Isometry pose_;  // world at time 0 from rest space
    std::vector<HoldConstraint> constraints_;
    std::vector<std::vector<std::uint32_t>> constrained_;  // per constraint: its phyxels; empty: dirty
    std::vector<std::uint8_t> held_;                       // per phyxel, of this step
    std::vector<Vec3> held_position_;                      // per phyxel, m, world
    std::vector<meshless::RigidKinematicTarget> kinematic_rigid_pieces_;  // of this step
    std::vector<std::uint8_t> held_among_;                                // see held_among
    std::vector<Handle> handles_;
    std::vector<std::vector<std::uint32_t>> handle_phyxels_;  // per handle: its phyxels; empty: dirty
};

}  // namespace splitcubes::body
