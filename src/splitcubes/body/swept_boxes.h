// What a blade sweeps, held by boxes that lie along its segments.
#pragma once

#include <splitcubes/cutting/sweep.h>
#include <splitcubes/geometry/box.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// A box for each moving segment of a blade, one axis along the segment and one along its
/// way: a thin blade keeps thin boxes however it is turned.
class SweptBoxes {
  public:
    /// margin: m, added on every side.
    SweptBoxes(std::span<const cutting::SweptBlade> blades, double margin);

    /// Axis-aligned, of all boxes; m, world.
    const geometry::Box& bounds() const { return bounds_; }
    std::size_t size() const { return boxes_.size(); }
    /// Numbers of those that may meet the box (m, world). `out` is replaced.
    void meeting(const geometry::Box& box, std::vector<std::uint32_t>& out) const;
    /// Whether one of `among` may meet the box. Never false where one does.
    bool any_meets(const geometry::Box& box, std::span<const std::uint32_t> among) const;

  private:
    struct Oriented {
        geometry::Box bounds;  // axis-aligned
        Mat3 axes;             // rows, orthonormal
        Vec3 centre, half;     // m, along the axes
    };
    static bool meets(const Oriented& swept, const geometry::Box& box);

    std::vector<Oriented> boxes_;
    geometry::Box bounds_;
};

}  // namespace splitcubes::body
