// Triangles of an occluder grid's cell as a segment on its way looks at them first: roughly, in single
// precision, and side by side. What is clearly not met is passed over; the others are for an exact test.
#pragma once

#include <splitcubes/geometry/box.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace splitcubes::geometry {

/// A box in single precision, rounded outward: what it does not meet, the exact box does not.
struct RoughBox {
    std::array<float, 3> min, max;  // m, rest space

    static RoughBox around(const Box& box);
    // Without branches: most boxes asked are neither clearly near nor far.
    bool meets(const RoughBox& other) const {
        unsigned apart = 0;
        for (std::size_t k = 0; k < 3; ++k)
            apart |= unsigned{min[k] > other.max[k]} | unsigned{other.min[k] > max[k]};
        return apart == 0;
    }
};

/// A triangle's plane in single precision: what lies clearly to one side of it, the
/// exact test does not find to meet the triangle.
struct RoughPlane {
    std::array<float, 3> normal{};  // unit; zero where the triangle is too thin to tell
    float offset = 0;               // m, along the normal from the origin

    RoughPlane() = default;
    /// origin: m, a point near which all that is asked for lies.
    RoughPlane(const std::array<Vec3, 3>& corner, const Vec3& origin);
};

/// A segment as rough boxes and planes see it.
struct RoughSegment {
    RoughBox box;
    std::array<float, 3> a, b;            // m, from the origin
    float size;                           // m, the farthest of the two from it, by the sum of coordinates
    std::array<float, 3> start, inverse;  // m, rest space; 1/m, of the way along each axis
    float room;                           // m, more than what rounding moves `start` by

    /// around: the segment's box, no smaller than it. origin: that of the planes.
    RoughSegment(const Vec3& from, const Vec3& to, const Box& around, const Vec3& origin);
};

/// Up to eight triangles side by side.
struct alignas(64) OccluderLanes {
    static constexpr std::size_t width = 8;
    static constexpr int spread_bits = 6;
    float min[3][width], max[3][width];     // of their boxes, m, rest space
    float normal[3][width], offset[width];  // of their planes
    std::uint32_t tag[width];               // number << spread_bits, and bits by which a lane is passed over
    std::uint32_t change[width];            // with which it came

    /// number: below 2^26, whatever the lane stands for.
    void set(std::size_t lane, const RoughBox& box, const RoughPlane& plane, std::uint32_t number,
             std::uint32_t spread, std::uint32_t change_number);
    /// Meets nothing from now on.
    void clear(std::size_t lane);
    std::uint32_t number(std::size_t lane) const { return tag[lane] >> spread_bits; }
};

/// Bit a lane: those which the segment does not clearly pass by, that share no bit of `spread` with `seen`
/// and came with a change after `since`. What is found beyond those that it meets may depend on the
/// instruction set.
std::uint32_t lanes_that_may_meet(const OccluderLanes& lanes, const RoughSegment& segment, std::uint32_t seen,
                                  std::uint32_t since);

}  // namespace splitcubes::geometry
