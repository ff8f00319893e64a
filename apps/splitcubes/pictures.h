// Pictures of a run's frames.
#pragma once

#include "frame_looks.h"
#include "links.h"

#include <splitcubes/cutting/blade.h>
#include <splitcubes/gl/context.h>
#include <splitcubes/render/renderer.h>
#include <splitcubes/scene/description.h>
#include <splitcubes/scene/instrument.h>

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::app {

struct RunScene {
    scene::SceneDescription description;
};

/// Reads the resolved scene from a run's folder, as it ran where that is known, without the colliders whose
/// meshes are missing. Throws InputError if there is none.
RunScene read_run_scene(const std::filesystem::path& folder);

/// Returns the time of a frame file, s, by its number.
double frame_time(const RunScene& scene, const std::filesystem::path& file);

/// Reads a frame of a run in any mesh format. Throws InputError.
geometry::SurfaceMesh read_frame(const std::filesystem::path& file);

/// Returns the bounding boxes of up to 24 of a run's frames, the first and last among them.
std::vector<geometry::Box> boxes_of(const std::vector<std::filesystem::path>& frames);

/// Returns what an automatic camera shows: the boxes, of bodies over time, and the edges of tools and moving
/// colliders while they work, but nothing that is far from the bodies at the start.
geometry::Box seen_box(const scene::SceneDescription& scene, const std::vector<geometry::Box>& boxes);

/// Draws surfaces with the scene's finishes, camera, ground, colliders, instruments and handles.
class PictureMaker {
  public:
    /// Throws JobError if OpenGL cannot start.
    PictureMaker(const RunScene& scene, const std::vector<geometry::Box>& boxes);
    /// Takes tools, colliders, constraints and handles from a variant of the scene that has some of its tools
    /// and the same colliders; the camera stays.
    void follow(const scene::SceneDescription& scene);
    render::Picture draw(const geometry::SurfaceMesh& surface, double time);
    /// Draws links under a translucent surface, less so at cut faces. Links that are partly occluded
    /// are thick, from blue (slightly) to red (entirely); the other links of their phyxels are thin and grey.
    render::Picture draw(const Links& links, const geometry::SurfaceMesh& surface, double time);

  private:
    struct DrawnTool {
        cutting::Blade blade;
        std::vector<scene::InstrumentPart> parts;
        std::pair<double, double> shown;  // s
    };
    void add_colliders(render::DrawList& list, double time) const;
    render::Picture lines_of(const Links& links, double time);
    void add_blades(render::DrawList& list, double time) const;

    void make_tools();

    std::shared_ptr<RunScene> scene_;
    FrameLooks looks_;
    std::vector<geometry::TriangleMesh> colliders_;  // own frames
    std::vector<DrawnTool> tools_;
    std::map<std::string, std::vector<scene::InstrumentPart>> parts_;  // by the name of the tool
    double size_ = 1;                                                  // m, of what is seen
    std::optional<gl::HeadlessContext> context_;
    std::optional<render::Renderer> renderer_;
    render::Camera camera_;
};

}  // namespace splitcubes::app
