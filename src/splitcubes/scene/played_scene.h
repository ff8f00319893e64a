// A scene as it ran.
#pragma once

#include <splitcubes/scene/course.h>
#include <splitcubes/scene/description.h>

#include <cstdint>

namespace splitcubes::scene {

/// Returns the scene with what its course decided written out: motions as keyframes at the steps from
/// `first` to `last`, and the times at which things began and ended. What was not there in that time is left
/// out. Conditions and carriers that depend on the state are gone, so that time alone says what to draw. Of
/// long runs of many things not every step has a keyframe.
SceneDescription played_scene(const SceneDescription& scene, const Course& course, std::int64_t first,
                              std::int64_t last);

}  // namespace splitcubes::scene
