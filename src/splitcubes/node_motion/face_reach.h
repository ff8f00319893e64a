// Measures how far a blade has come within a face of the grid.
#pragma once

#include <splitcubes/cutting/sweep.h>
#include <splitcubes/splitting/cut_front.h>

#include <array>
#include <optional>
#include <span>

namespace splitcubes::body {

/// A face at both ends of an interval, in which its corners move linearly.
struct MovingFace {
    std::array<Vec3, 4> before, now;  // m, world: (0, 0), (1, 0), (1, 1), (0, 1)
    splitting::FrontRay ray;          // the way of the sheet in it
};

/// Returns the largest share of the way that the swept blades have come in the face; none if they do not meet
/// it. The face is taken for flat and a parallelogram. swept: consecutive in time, of the interval.
std::optional<double> reach_in(const MovingFace& face, std::span<const cutting::SweptBlade> swept);

}  // namespace splitcubes::body
