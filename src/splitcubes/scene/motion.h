// Frames of things that a scene moves, as functions of time.
#pragma once

#include <splitcubes/cutting/blade.h>
#include <splitcubes/scene/description.h>

#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace splitcubes::scene {

Quat quaternion(const Rotation& rotation);
/// Returns the axis and angle of a rotation; the z axis for none.
Rotation rotation_of(const Quat& turn);

/// Returns displacement and rotation about the pivot at a time; the identity without keyframes.
Isometry keyframe_motion(const std::vector<MotionKeyframe>& keyframes, const Vec3& pivot, double time);

/// Returns the first and last time of a motion, s. Without keyframes: zero.
std::pair<double, double> times_of(const Motion& motion);

/// Returns the tool's blade with its path. Motions that are no keyframes are sampled.
cutting::Blade make_blade(const ToolDescription& tool);

/// Returns how far a tool has taken along what is attached to it since a time: the identity at that time.
Isometry motion_since(const cutting::Blade& blade, double from, double time);

/// Returns the tool of a name; null: there is none.
const ToolDescription* find_tool(std::span<const ToolDescription> tools, std::string_view name);

/// The difference between one copy of a repeated thing and the next.
struct Repetition {
    int count = 1;
    Vec3 position = Vec3::Zero();  // m, displacement
    Rotation rotation;             // about the pivot
    Vec3 pivot = Vec3::Zero();     // m, world
    double time = 0;               // s, delay
};
/// Make the k-th copy of a thing, counted from 0, which is the thing itself. Names are the caller's.
ToolDescription repeated(ToolDescription tool, const Repetition& repetition, int k);
BodyDescription repeated(BodyDescription body, const Repetition& repetition, int k);

/// Returns how many points, keyframes and parts a scene says of a thing.
std::size_t item_count(const ToolDescription& tool);
std::size_t item_count(const BodyDescription& body);

/// Returns whether what a scene would say of a copy is within its bounds.
bool is_sayable(const ToolDescription& tool);
bool is_sayable(const BodyDescription& body);

/// Returns the motion of a frame that is given in one that moves itself.
Motion composed(const Motion& outer, const Motion& inner);

/// Whether a thing's motion is a function of time alone: it goes along with nothing that depends on the
/// state, and waits for nothing.
bool is_prescribed(const ToolDescription& tool);
bool is_prescribed(const ColliderDescription& collider);
/// Returns the motion of what a carrier names, where it is prescribed: of a tool's own frame, or a collider's
/// displacement from where it is at time 0. None: it depends on the state.
std::optional<Motion> prescribed_motion(const Carrier& carrier,
                                        std::span<const ColliderDescription> colliders,
                                        std::span<const ToolDescription> tools);

}  // namespace splitcubes::scene
