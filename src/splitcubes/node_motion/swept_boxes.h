// Oriented bounding boxes of what a blade sweeps.
#pragma once

#include <splitcubes/cutting/sweep.h>
#include <splitcubes/geometry/box.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::body {

/// One oriented box per moving segment of a blade, with one axis along the segment and one along its motion,
/// so that boxes are thin whatever the blade's orientation.
class SweptBoxes {
  public:
    /// margin: m, added on every side.
    SweptBoxes(std::span<const cutting::SweptBlade> blades, double margin);

    /// Axis-aligned bounds of all boxes; m, world.
    const geometry::Box& bounds() const { return bounds_; }
    std::size_t size() const { return boxes_.size(); }
    /// Replaces `out` by the indices of the boxes that may meet a box (m, world).
    void meeting(const geometry::Box& box, std::vector<std::uint32_t>& out) const;
    /// Whether one of the boxes `among` may meet a box. Conservative: never false if one does.
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
