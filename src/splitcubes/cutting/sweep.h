// Crossings of the edges of a moving body with a moving blade.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/cutting/blade.h>
#include <splitcubes/geometry/box.h>
#include <splitcubes/geometry/swept_segments.h>

#include <cstdint>
#include <span>
#include <vector>

namespace splitcubes::cutting {

/// A blade's motion during a part of an interval; its points move linearly.
struct SweptBlade {
    std::vector<geometry::MovingSegment> segments;  // m, world
    geometry::Box bounds;                           // m, world, of all segments
    double begin = 0, end = 1;                      // fractions of the whole interval
};

/// The maximum rotation of a blade within one SweptBlade, rad: linear motion then deviates from the true arcs
/// by at most 1.25e-3 of their radius.
inline constexpr double max_turn = 0.1;

/// Returns the times (s, increasing) at which sweep() evaluates the blade's pose; empty if it sweeps nothing.
std::vector<double> sweep_times(const Blade& blade, double t0, double t1);

/// Returns the motion of the blade while it is active between t0 and t1 (s), as consecutive parts. Parts end
/// at keyframes, rotate by at most max_turn and cover at most a sixteenth of a smooth path's span. Part k
/// ends, to the last bit, where part k + 1 begins, and so do consecutive intervals. Empty if the blade is
/// active for no longer than an instant.
std::vector<SweptBlade> sweep(const Blade& blade, double t0, double t1);

/// An edge that may be cut, with its motion over the same whole interval.
struct CandidateEdge {
    std::uint64_t id;
    geometry::MovingSegment motion;  // m, world
    Mat3 world_from_rest;            // Jacobian at the edge, d world / d rest
};

struct EdgeCut {
    std::uint64_t id;
    double parameter;  // along the edge, [0, 1]
    Vec3 rest_normal;  // of the cut, rest space, unit; its sign is arbitrary
    double time;       // fraction of the whole interval, [0, 1]
};

/// Returns a world normal transformed to rest space, unit: the plane n . dx = 0 in the world is (J^T n) . dX
/// = 0 at rest.
Vec3 pulled_back(const Mat3& world_from_rest, const Vec3& normal);

/// Returns the first hit of each edge that is hit, sorted by id. The cut's normal is the blade's direction x
/// its velocity relative to the edge at the hit, transformed to rest space by the transposed Jacobian. If the
/// blade does not move across itself relative to the edge, the stroke's last normal is used, and if that is
/// zero, the direction across the blade that separates the edge's ends best.
///
/// swept: consecutive in time, of one interval. last_normal: world, unit or zero; kept from call to call, it
/// becomes the normal of the latest hit that had one. Candidates that are not finite are not hit.
std::vector<EdgeCut> cut_edges(std::span<const SweptBlade> swept, std::span<const CandidateEdge> candidates,
                               Vec3& last_normal, const Parallel& parallel);

}  // namespace splitcubes::cutting
