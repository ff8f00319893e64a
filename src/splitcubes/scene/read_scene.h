// Reads a scene description from checked JSON. Internal to scene.
#pragma once

#include <splitcubes/occlusion/criterion.h>
#include <splitcubes/scene/description.h>
#include <splitcubes/scene/reader.h>

#include <initializer_list>
#include <span>

namespace splitcubes::scene {

/// Names of the alternatives, in the order of their variant or enumeration; used for reading and writing.
inline const std::vector<std::string_view> constraint_kind_names = {"hold", "move"};
inline const std::vector<std::string_view> carrier_names = {"tool", "collider", "body"};
inline const std::vector<std::string_view> interpolation_names = {"linear", "smooth"};
inline const std::vector<std::string_view> grip_names = {"start", "end"};
inline const std::vector<std::string_view> solver_kind_names = {"implicit", "explicit"};
inline const std::vector<std::string_view> material_model_names = {"corotated", "st-venant-kirchhoff"};
inline const std::vector<std::string_view> integrator_names = {"bdf2", "backward_euler", "tr_bdf2"};
inline const std::vector<std::string_view> surface_format_names = {"ply", "obj", "stl", "glb"};
inline const std::vector<std::string_view> occlusion_backend_names = {"cpu", "opengl"};
inline const std::vector<std::string_view> occlusion_criterion_names(occlusion::criterion_names.begin(),
                                                                     occlusion::criterion_names.end());

/// Reads a scene; the value is the whole file's.
SceneDescription read_scene(const Value& value);
/// Reads the tools of a path file; the value is the whole file's.
std::vector<ToolDescription> read_path(const Value& value);

// Readers of the parts of a scene.
BodyDescription read_body(const Value& value);
geometry::Finish read_finish(const Value& value);
std::optional<geometry::Finish> read_optional_finish(const Object& object, std::string_view key);
AppearanceDescription read_appearance(const Value& value);
InstrumentDescription read_instrument(const Value& value);
DisplayDescription read_display(const Value& value);
/// Reads keys file and sha256 of an object.
MeshShape read_named_mesh(const Object& object);
/// Things that a value may name.
struct Known {
    std::span<const BodyDescription> bodies;
    std::span<const ColliderDescription> colliders;
    std::span<const ToolDescription> tools;
    bool only_before = false;  // colliders and tools are those before the thing that names one
};
/// Reads the key relative_to, if it is there. own_name: of what has it.
std::optional<Carrier> read_carrier(const Object& object, const Known& known, const std::string& own_name);
/// Reads a condition, if it is there; whether its tool exists is for check_conditions.
std::optional<Condition> read_condition(const Object& object, std::string_view key,
                                        const std::vector<BodyDescription>& bodies);
/// Notes conditions under the keys of an element that name no tool.
void check_conditions(const Value& element, std::string_view kind,
                      std::initializer_list<std::string_view> keys, const Known& known);
/// Notes tools that wait for each other in a circle.
void check_waiting(const Object& scene, const std::vector<ToolDescription>& tools);
Region read_region(const Value& value);
Rotation read_rotation(const Value& value);
Shape read_any_shape(const Value& value);
PlacementDescription read_any_placement(const Value& value);
Region read_any_region(const Value& value);
Vec3 center_of(const Region& region);
std::string read_known_body(const Value& value, const std::vector<BodyDescription>& bodies);
/// Reads a collider; those that it may refer to come before it.
ColliderDescription read_collider(const Value& value, const std::vector<BodyDescription>& bodies,
                                  const std::vector<ColliderDescription>& before);
ContactDescription read_contact(const Value& value);
/// Reads a handle; known: all of the scene.
HandleDescription read_handle(const Value& value, const SceneDescription& known);
/// Reads at least one keyframe, with strictly increasing times.
std::vector<MotionKeyframe> read_keyframes(const Value& value);
/// Reads a constraint; known: all of the scene.
ConstraintDescription read_constraint(const Value& value, const SceneDescription& known);
/// Reads a tool; those that it may refer to come before it.
ToolDescription read_tool(const Value& value, const std::vector<BodyDescription>& bodies,
                          const std::vector<ColliderDescription>& colliders,
                          const std::vector<ToolDescription>& before);

}  // namespace splitcubes::scene
