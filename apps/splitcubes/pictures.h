// Pictures of a run's frames.
#pragma once

#include "links.h"

#include <splitcubes/gl/context.h>
#include <splitcubes/render/renderer.h>
#include <splitcubes/scene/description.h>

#include <filesystem>
#include <optional>
#include <vector>

namespace splitcubes::app {

struct RunScene {
    scene::SceneDescription description;
};

/// Reads the resolved scene from a run's folder, without the colliders whose meshes are missing. Throws
/// InputError if there is none.
RunScene read_run_scene(const std::filesystem::path& folder);

/// Returns the time of a frame file, s, by its number.
double frame_time(const RunScene& scene, const std::filesystem::path& file);

/// Returns the bounding boxes of the first, middle and last of a run's frames.
std::vector<geometry::Box> boxes_of(const std::vector<std::filesystem::path>& frames);

/// Draws surfaces with the scene's camera, ground and blades. An automatic camera shows all of the given
/// boxes.
class PictureMaker {
  public:
    /// Throws JobError if OpenGL cannot start.
    PictureMaker(const RunScene& scene, const std::vector<geometry::Box>& boxes);
    render::Picture draw(const geometry::SurfaceMesh& surface, double time);
    /// Draws links under a translucent surface, less so at cut faces. Links that are partly occluded
    /// are thick, from blue (slightly) to red (entirely); the other links of their phyxels are thin and grey.
    render::Picture draw(const Links& links, const geometry::SurfaceMesh& surface, double time);

  private:
    void add_colliders(render::DrawList& list, double time) const;
    render::Picture lines_of(const Links& links, double time);
    void add_blades(render::DrawList& list, double time) const;

    RunScene scene_;
    std::optional<gl::HeadlessContext> context_;
    std::optional<render::Renderer> renderer_;
    render::Camera camera_;
};

}  // namespace splitcubes::app
