// Frames that go along with the material of a deforming body.
#pragma once

#include <splitcubes/math/types.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace splitcubes::scene {

/// What a frame reads of the samples of a body; one entry a sample. Samples are only appended.
struct BodySamples {
    std::span<const Vec3> rest;           // m, world at time 0
    std::span<const Vec3> position;       // m, world
    std::span<const Vec3> velocity;       // m/s, world
    std::span<const double> mass;         // kg
    std::span<const std::int32_t> piece;  // number of the sample's piece
    std::size_t piece_count = 1;
};

/// The rigid motion that fits the samples of a region best: those of the region that are connected to its
/// anchor, the sample next to the region's centre of mass at time 0. So the frame stays with one part of the
/// material when the region is cut.
class MaterialFrame {
  public:
    /// region: of the world at time 0; empty: all of the body.
    MaterialFrame(std::function<bool(const Vec3&)> region, const BodySamples& at_start);

    /// Whether the region has a sample.
    bool has_samples() const { return anchor_ != none; }
    /// Returns the motion (world from the world at time 0) that takes the samples' rest positions next to
    /// where they are `ahead` seconds later at the velocities that they have: centre of mass, and rotation
    /// part of the moment of the positions about it. Where these leave the rotation undetermined (one sample,
    /// or a line of them) it is the one nearest to `last`'s. Returns `last` for positions that are not
    /// finite.
    Isometry fit(const BodySamples& now, double ahead, const Isometry& last) const;

  private:
    static constexpr std::size_t none = static_cast<std::size_t>(-1);
    bool contains(const Vec3& rest) const { return !region_ || region_(rest); }

    std::function<bool(const Vec3&)> region_;
    std::size_t anchor_ = none;
};

}  // namespace splitcubes::scene
