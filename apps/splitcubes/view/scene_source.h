// Sources of a session: a scene, or a mesh that becomes a body on a table.
#pragma once

#include <splitcubes/api/simulation.h>
#include <splitcubes/cutting/blade.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/scene/description.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace splitcubes::scene {
struct InstrumentPart;
}

namespace splitcubes::view {

/// A body before it is added.
struct BodySource {
    io::Model model;  // in its own frame
    BodySettings settings;
};

/// A scene that can be started any number of times. Meshes are read once.
struct SceneSource {
    std::filesystem::path file;
    scene::SceneDescription description;
    std::vector<BodySource> bodies;
    std::vector<cutting::Blade> blades;  // of the scene's tools
    /// Solids of the scene's tools, own frames; a tool without an instrument has none.
    std::vector<std::shared_ptr<const std::vector<scene::InstrumentPart>>> instruments;
    std::vector<std::string> notes;  // what the viewer leaves out
    bool is_checkpoint = false;      // a saved simulation; there is nothing else then
};

/// Reads the scene of a run's folder, without bodies, and without what its missing files hold. Throws
/// InputError.
SceneSource open_run_scene(const std::filesystem::path& folder);

/// Gives a mesh that has colours at its vertices and no materials up to 14 materials of about these colours:
/// the public interface knows no colours of vertices.
void materials_of_colours(geometry::MeshAttributes& attributes);

/// Reads a scene or a recording of `run` (.json), a mesh, or a saved simulation. Throws InputError.
SceneSource open_source(const std::filesystem::path& file);

}  // namespace splitcubes::view
