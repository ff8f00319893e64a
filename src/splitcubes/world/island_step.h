// Buffers of the step of a contact island.
#pragma once

#include <splitcubes/dynamics/time_integrator.h>
#include <splitcubes/world/world.h>

namespace splitcubes::body {

/// Buffers of the island that is being stepped, reused to avoid allocations.
struct World::IslandStep {
    std::vector<meshless::CachedContact> cached;
    std::vector<meshless::HandleSpring> handle_springs;
    std::vector<double> limits;
    std::vector<Vec3> handle_forces;
    std::vector<meshless::StepInput> inputs;
    std::vector<meshless::TimeIntegrator::Member> members;
};

}  // namespace splitcubes::body
