// Bound on the motion of bodies since a state without contacts.
#pragma once

#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/geometry/box.h>
#include <splitcubes/math/types.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Remembers a state in which no two parts of any surface were near each other, and tells whether later
/// states are so close to it that a search for contacts would find none. Each piece may move rigidly; beyond
/// that, its phyxels may move by a small part of their spacing, and pieces must stay apart by their bounding
/// boxes. Costs a few nanoseconds per phyxel.
class QuietMotion {
  public:
    struct Step {
        double dt = 0;  // s
        Vec3 gravity = Vec3::Zero();
    };
    /// Remembers the current state.
    void remember(std::span<const BodyView> bodies);
    void forget() { pieces_.clear(); }
    bool remembers() const { return !pieces_.empty(); }
    /// Returns whether the motion since remember and in the coming step is within the bounds.
    bool holds(std::span<const BodyView> bodies, const Step& step);

  private:
    struct Piece {
        std::size_t count = 0;
        Vec3 centre_before = Vec3::Zero();                       // m, remembered
        Vec3 centre = Vec3::Zero();                              // m
        Vec3 velocity = Vec3::Zero(), drift = Vec3::Zero();      // m/s, m: means
        Mat3 covariance = Mat3::Zero(), inertia = Mat3::Zero();  // m^2: with the remembered state; own
        Vec3 twist = Vec3::Zero();                               // m^2/s, sum of arm x velocity
        Mat3 rotation = Mat3::Identity();                        // since remember
        Vec3 angular_velocity = Vec3::Zero();                    // rad/s
        double spacing = 0;                                      // m
        geometry::Box box;                                       // m, of the positions in the step
    };
    bool measure(std::span<const BodyView> bodies, const Step& step);
    bool is_rigid(std::span<const BodyView> bodies, const Step& step) const;
    bool keeps_normals(const meshless::Phyxels& phyxels, std::size_t body) const;
    bool are_apart() const;

    bool turns_ = false;                          // whether rotations are looked for
    std::vector<Piece> pieces_;                   // of all bodies
    std::vector<std::size_t> first_;              // per body: its first piece
    std::vector<std::vector<Vec3>> position_;     // m, per body and phyxel, remembered
    std::vector<std::vector<Mat3>> deformation_;  // the same
    std::vector<std::vector<Vec3>> drift_;  // m, per body and phyxel: change by acceleration in the step
};

/// Returns how far a phyxel may go in a step beyond its velocity: its change of velocity in the last step,
/// limited to the share of gravity; without history, free fall. m, world.
Vec3 drift_of(const meshless::Phyxels& phyxels, std::size_t i, double dt, const Vec3& gravity);

}  // namespace splitcubes::body
