// Rotation of the pieces of bodies within a step.
#pragma once

#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/core/parallel.h>
#include <splitcubes/math/types.h>
#include <splitcubes/samples/phyxels.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// Rotations of pieces within a step, at the angular velocities that they start with. The two points of a
/// contact are means of phyxels, and lie apart where these are few or strained. Pieces that rotate together
/// change the vector between them, although they do not slide on each other.
class PieceTurns {
  public:
    struct Piece {
        std::size_t body;
        std::int32_t piece;
    };
    /// dt: s.
    void measure(std::span<const BodyView> bodies, double dt, const Parallel& parallel);
    /// Returns the change of a vector, m, world, between two pieces in the step as both rotate by the mean of
    /// their rotations, weighted by mass. Zero for pieces that were not measured, and where they tumble.
    Vec3 change(const Piece& one, const Piece& other, const Vec3& vector) const;

  private:
    struct Turn {
        double mass = 0;            // kg
        Vec3 angle = Vec3::Zero();  // rad, times the unit axis
    };
    Turn turn_of(const Piece& piece) const;

    std::vector<std::vector<Turn>> turns_;           // per body and piece
    std::vector<meshless::Momenta> momenta_, sums_;  // of the pieces of a body; buffer
};

}  // namespace splitcubes::body
