// Buffers of the step of a contact island.
#pragma once

#include <splitcubes/dynamics/implicit/implicit_solver.h>
#include <splitcubes/world/world.h>

namespace splitcubes::body {

/// Buffers of the island that is being stepped, reused to avoid allocations.
struct World::IslandStep {
    std::vector<meshless::CachedContact> cached;
    std::vector<meshless::HandleSpring> handle_springs;
    std::vector<double> limits;
    std::vector<Vec3> handle_forces;
    std::vector<meshless::StepInput> inputs;
    std::vector<meshless::ImplicitSolver::Member> members;
};

}  // namespace splitcubes::body
