// From what a scene says to a world that can be stepped.
#pragma once

#include <splitcubes/body/world.h>
#include <splitcubes/scene/description.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::scene {

struct BuildReport {
    /// What was found in meshes and done about it: (body name, one line).
    std::vector<std::pair<std::string, std::string>> notes;
};

/// The body's mesh where the scene places it: world at time 0. Reads mesh files.
geometry::TriangleMesh placed_mesh(const BodyDescription& body, BuildReport& report);

/// The tool's blade with its path.
cutting::Blade make_blade(const ToolDescription& tool);

/// Throws InputError for meshes that cannot be used and for regions of
/// constraints that hold no phyxel.
std::unique_ptr<body::World> build_world(const SceneDescription& scene,
                                         std::shared_ptr<const Parallel> parallel, BuildReport& report);

}  // namespace splitcubes::scene
