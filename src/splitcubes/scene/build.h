// Builds a world that can be stepped from a scene description.
#pragma once

#include <splitcubes/body/body_settings.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/scene/description.h>
#include <splitcubes/scene/motion.h>
#include <splitcubes/world/world.h>

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::scene {

struct BuildReport {
    /// Repairs and findings in the meshes and advice about the world (advice.h): (body name, one line).
    std::vector<std::pair<std::string, std::string>> notes;
    /// Source mesh of each body, placed, with its attributes; empty for bodies whose mesh has none. The
    /// bodies themselves hold no attributes.
    std::vector<io::Model> models;
    /// Files that each mesh file refers to (material libraries, buffers, textures) and that exist.
    std::map<std::filesystem::path, std::vector<std::filesystem::path>> files;
};

/// Returns a shape's mesh in its own frame. A mesh file is read, and the files that it refers to are
/// reported.
geometry::TriangleMesh shape_mesh(const Shape& shape, const Parallel& parallel = Parallel(1),
                                  BuildReport* report = nullptr);

/// Returns the transform from a collider's own frame to the world at a time; own: `shape` with its scale. Of
/// one whose motion is not prescribed without what carries it.
Isometry collider_frame(const ColliderDescription& collider, double time);
/// Returns a collider's mesh in its own frame; empty for a half space.
geometry::TriangleMesh collider_mesh(const ColliderDescription& collider,
                                     const Parallel& parallel = Parallel(1), BuildReport* report = nullptr);
body::Collider make_collider(const ColliderDescription& collider, const Parallel& parallel,
                             BuildReport* report = nullptr);

/// Returns the body's mesh with attributes and the scale of its placement, in its own frame. Reads mesh
/// files.
io::Model own_model(const BodyDescription& body, BuildReport& report, const Parallel& parallel = Parallel(1));
/// Returns the rotation and the position of a placement: world at time 0 from the body's own frame.
Isometry pose_of(const PlacementDescription& placement);
/// Returns the body's mesh with attributes where the scene places it, world at time 0. Reads mesh files.
io::Model placed_model(const BodyDescription& body, BuildReport& report,
                       const Parallel& parallel = Parallel(1));

/// Returns the motion of a handle's target: world from rest, s. It may go along with a tool or a collider
/// whose motion is prescribed; others are for Course.
std::function<Isometry(double time)> handle_motion(const HandleDescription& handle,
                                                   const SceneDescription& scene);

/// Returns a solid tool's instrument as a collider.
body::Collider make_solid_tool(const ToolDescription& tool, const Parallel& parallel,
                               BuildReport* report = nullptr);

/// Builds the world. What depends on the state is moved, started and ended by a WorldCourse. Throws
/// InputError for meshes that cannot be used and for constraint regions without phyxels. make_opengl_backend:
/// factory of the disk backend for scenes with backend "opengl"; without it such scenes are refused.
std::unique_ptr<body::World> build_world(
    const SceneDescription& scene, std::shared_ptr<const Parallel> parallel, BuildReport& report,
    const decltype(body::BodySettings::make_visibility_backend)& make_opengl_backend = {});

}  // namespace splitcubes::scene
