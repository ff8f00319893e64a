// First time of contact of two moving segments.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/math/types.h>

#include <optional>

namespace splitcubes::geometry {

/// The segment ab at the start and at the end of an interval; each end moves
/// along a straight line at a constant speed. m, one frame for all.
struct MovingSegment {
    Vec3 a0, b0, a1, b1;
};

struct SegmentHit {
    double time;             // fraction of the interval, [0, 1]
    double blade_parameter;  // along the blade from a to b, [0, 1]
    double edge_parameter;   // along the edge from a to b, [0, 1]
};

/// Returns a box that contains the segment during the whole interval.
inline Box bounds_of(const MovingSegment& s) {
    return {s.a0.cwiseMin(s.b0).cwiseMin(s.a1.cwiseMin(s.b1)),
            s.a0.cwiseMax(s.b0).cwiseMax(s.a1.cwiseMax(s.b1))};
}

/// Returns an end's position at a fraction of the interval: exactly `start` at 0 and `end` at 1. Equal
/// fractions give equal bits, so subintervals join without a gap.
inline Vec3 moving_point(const Vec3& start, const Vec3& end, double fraction) {
    return (1 - fraction) * start + fraction * end;
}

/// Returns the part of a motion between two fractions of its interval.
inline MovingSegment part_of(const MovingSegment& s, double begin, double end) {
    return {moving_point(s.a0, s.a1, begin), moving_point(s.b0, s.b1, begin), moving_point(s.a0, s.a1, end),
            moving_point(s.b0, s.b1, end)};
}

/// Returns the first time at which the segments meet. The times at which the four ends
/// are coplanar are the roots of a cubic in [0, 1] (Provot 1997); the first at which the
/// segments also touch is the hit. For segments that stay coplanar, parallel or collinear,
/// or are points, the times at which an end reaches the other segment are used.
///
/// Scale-invariant. Segments closer than about 1e-7 of their lengths at such a time count
/// as touching, so a polyline does not leak at its joints. Non-finite input gives no hit.
std::optional<SegmentHit> first_hit(const MovingSegment& blade, const MovingSegment& edge);

}  // namespace splitcubes::geometry
