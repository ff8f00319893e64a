// Records the prescribed motions of a world as sampled tracks, and replays them.
#pragma once

#include <splitcubes/math/sampled_motion.h>
#include <splitcubes/world/world.h>

#include <string>
#include <vector>

namespace splitcubes::body {

/// Object whose motion is prescribed.
enum class Driven { tool, constraint, handle, collider };

struct MotionTrack {
    Driven driven = Driven::tool;
    /// Name of the object; of a constraint: name of its body and its index there, "body/0".
    std::string name;
    SampledMotion motion;  // world from own; of a constraint or a handle: world from rest
};

/// Returns the prescribed motions at all times at which the world's first `steps` steps evaluate them.
/// Depends only on the world's settings, so it may be called before or after these steps.
std::vector<MotionTrack> motion_tracks(const World& world, std::int64_t steps);

/// Replaces motions of the world by the tracks. A world of the same settings that follows the tracks of
/// another has bit-identical states for as many steps. Objects without a track keep their motion. Throws
/// InputError, located at the track's name, if a track names no object.
void follow_tracks(World& world, const std::vector<MotionTrack>& tracks);

}  // namespace splitcubes::body
