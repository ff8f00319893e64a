// From what a scene says to a world that can be stepped.
#pragma once

#include <splitcubes/body/world.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/scene/description.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::scene {

struct BuildReport {
    /// What was found in meshes and done about it, and what is to be known of the world before it is
    /// stepped (advice.h): (body name, one line).
    std::vector<std::pair<std::string, std::string>> notes;
    /// Per body the mesh that it was made of, placed, with its attributes; empty for
    /// bodies whose mesh has none. The bodies themselves know nothing of colours.
    std::vector<io::Model> models;
    /// Of each mesh file what it needs beside it: libraries, buffers, textures that are there.
    std::map<std::filesystem::path, std::vector<std::filesystem::path>> files;
};

/// A shape in its own frame; a mesh file is read, and what it needs beside it reported.
geometry::TriangleMesh shape_mesh(const Shape& shape, const Parallel& parallel = Parallel(1),
                                  BuildReport* report = nullptr);

/// Displacement and turn about the pivot at a time; none where there are no keyframes.
Isometry keyframe_motion(const std::vector<MotionKeyframe>& keyframes, const Vec3& pivot, double time);

/// World from a collider's own frame at a time; own: `shape` with its scale.
Isometry collider_frame(const ColliderDescription& collider, double time);
/// In its own frame; empty for a half space.
geometry::TriangleMesh collider_mesh(const ColliderDescription& collider,
                                     const Parallel& parallel = Parallel(1), BuildReport* report = nullptr);
body::Collider make_collider(const ColliderDescription& collider, const Parallel& parallel,
                             BuildReport* report = nullptr);

/// The body's mesh where the scene places it, world at time 0, with its attributes. Reads mesh files.
io::Model placed_model(const BodyDescription& body, BuildReport& report,
                       const Parallel& parallel = Parallel(1));

/// The tool's blade with its path.
cutting::Blade make_blade(const ToolDescription& tool);

/// Throws InputError for meshes that cannot be used and for regions of
/// constraints that hold no phyxel.
/// make_opengl_backend: what makes the disks of scenes that ask for backend
/// "opengl"; without it they are refused.
std::unique_ptr<body::World> build_world(
    const SceneDescription& scene, std::shared_ptr<const Parallel> parallel, BuildReport& report,
    const decltype(body::BodySettings::make_visibility_backend)& make_opengl_backend = {});

}  // namespace splitcubes::scene
