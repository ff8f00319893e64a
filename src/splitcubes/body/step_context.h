// Input of one step of one body.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/dynamics/solver_types.h>

#include <optional>
#include <span>

namespace splitcubes::body {

/// Input of one step of one body.
struct StepContext {
    double time = 0;  // s, at the start of the step
    double dt = 0;    // s
    Vec3 gravity = Vec3::Zero();
    std::optional<meshless::GroundPlane> ground;    // for bodies with a deformation model
    std::span<const meshless::Obstacle> obstacles;  // for rigid pieces
    meshless::SolverOptions solver;
    const Parallel& parallel;
    bool contacts = true;  // the next step searches for contacts and needs the contact samples
};

}  // namespace splitcubes::body
