// The published problem size, for benchmarks.
#pragma once

#include <splitcubes/occlusion/criterion.h>
#include <splitcubes/world/world.h>

#include <memory>

namespace splitcubes::app {

/// Steps of 1/60 s after which the blade has passed through.
inline constexpr int paper_steps = 72;

/// Builds a world of the size that the authors published for their "cut2" (about 800 phyxels, 2400 surface
/// cells, 16 x 16 disks): a cube of 20^3 cells, held at one side, that a blade longer than the cube passes
/// through in a second of simulated time.
std::unique_ptr<body::World> make_paper_world(
    const std::shared_ptr<const Parallel>& parallel,
    occlusion::CriterionKind criterion = occlusion::CriterionKind::occlusion_disk);

}  // namespace splitcubes::app
