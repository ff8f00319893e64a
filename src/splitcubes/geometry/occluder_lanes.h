// Conservative single-precision SIMD test of a segment against the triangles of an occluder grid's cell.
// Triangles that are clearly missed are culled; the others need the exact test.
#pragma once

#include <splitcubes/geometry/box.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace splitcubes::geometry {

/// A box in single precision, rounded outward: it meets everything that the exact box meets.
struct RoughBox {
    std::array<float, 3> min, max;  // m, rest space

    static RoughBox around(const Box& box);
    // Branch-free: the outcome is hard to predict for most boxes.
    bool meets(const RoughBox& other) const {
        unsigned apart = 0;
        for (std::size_t k = 0; k < 3; ++k)
            apart |= unsigned{min[k] > other.max[k]} | unsigned{other.min[k] > max[k]};
        return apart == 0;
    }
};

/// A triangle's plane in single precision: a segment clearly on one side of it does not
/// meet the triangle in the exact test.
struct RoughPlane {
    std::array<float, 3> normal{};  // unit; zero if the triangle is too thin
    float offset = 0;               // m, along the normal from the origin

    RoughPlane() = default;
    /// origin: m, a point near the triangles and segments, for precision.
    RoughPlane(const std::array<Vec3, 3>& corner, const Vec3& origin);
};

/// A segment prepared for tests against rough boxes and planes.
struct RoughSegment {
    RoughBox box;
    std::array<float, 3> a, b;            // m, relative to the origin
    float size;                           // m, larger 1-norm of a and b
    std::array<float, 3> start, inverse;  // m, rest space; 1/m, reciprocal of b - a
    float margin;                         // m, exceeds the rounding error of `start`

    /// around: a box that contains the segment. origin: that of the planes.
    RoughSegment(const Vec3& from, const Vec3& to, const Box& around, const Vec3& origin);
};

/// Up to eight triangles in structure-of-arrays layout.
struct alignas(64) OccluderLanes {
    static constexpr std::size_t width = 8;
    static constexpr int spread_bits = 6;
    float min[3][width], max[3][width];     // boxes, m, rest space
    float normal[3][width], offset[width];  // planes
    std::uint32_t tag[width];               // id << spread_bits | bits that exclude a lane (spread)
    std::uint32_t change[width];            // change with which it was set

    /// number: below 2^26, an id chosen by the caller.
    void set(std::size_t lane, const RoughBox& box, const RoughPlane& plane, std::uint32_t id,
             std::uint32_t spread, std::uint32_t change_number);
    /// Empties the lane: it meets nothing.
    void clear(std::size_t lane);
    std::uint32_t id(std::size_t lane) const { return tag[lane] >> spread_bits; }
};

/// Returns one bit per lane: lanes that the segment may meet, that share no bit of `spread` with `seen` and
/// were set with a change after `since`. False positives may depend on the instruction set.
std::uint32_t lanes_that_may_meet(const OccluderLanes& lanes, const RoughSegment& segment, std::uint32_t seen,
                                  std::uint32_t since);

}  // namespace splitcubes::geometry
