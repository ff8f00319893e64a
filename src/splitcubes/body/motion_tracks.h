// The motions that drive a world, as lists of places: recorded, and followed again.
#pragma once

#include <splitcubes/body/world.h>
#include <splitcubes/math/sampled_motion.h>

#include <string>
#include <vector>

namespace splitcubes::body {

/// What is moved from outside.
enum class Driven { tool, constraint, handle, collider };

struct MotionTrack {
    Driven driven = Driven::tool;
    /// Its name; of a constraint: its body's name and its number there, "body/0".
    std::string name;
    SampledMotion motion;  // world from own; of a constraint or a handle: world from rest
};

/// Where everything driven is at each time at which the world's first `steps` steps ask for
/// it. Follows from the world's settings alone, so it may be asked before or after them.
std::vector<MotionTrack> motion_tracks(const World& world, std::int64_t steps);

/// Puts the tracks in place of the motions that the world was made with. A world of the same
/// settings that follows the tracks of another gives, for as many steps, its states to the last
/// bit. What no track names keeps its motion. Throws InputError, whose place is the track's
/// name, for one that fits nothing.
void follow_tracks(World& world, const std::vector<MotionTrack>& tracks);

}  // namespace splitcubes::body
