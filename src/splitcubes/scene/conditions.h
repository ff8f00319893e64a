// Releases that depend on what happens.
#pragma once

#include <splitcubes/scene/description.h>

namespace splitcubes::body {
class World;
}

namespace splitcubes::scene {

/// Ends the constraints and handles of a world, which build_world made from the scene, whose conditions hold.
/// To be called before each step. A number of pieces only grows, so that a resumed run needs no memory of it.
void release_by_conditions(const SceneDescription& scene, body::World& world);

}  // namespace splitcubes::scene
