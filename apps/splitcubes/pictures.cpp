#ifdef SPLITCUBES_WITH_RENDER

#include "pictures.h"

#include <splitcubes/core/error.h>
#include <splitcubes/io/read_surface.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/parse.h>

namespace splitcubes::app {

RunScene read_run_scene(const std::filesystem::path& folder) {
    const std::filesystem::path file = folder / "scene.json";
    if (!std::filesystem::exists(file))
        throw InputError(folder.string(), "holds no scene.json",
                         "give the folder that `splitcubes run` wrote");
    return {scene::parse_scene_file(file)};
}

double frame_time(const RunScene& scene, const std::filesystem::path& file) {
    return std::atof(file.stem().c_str()) * scene.description.time_step;
}

PictureMaker::PictureMaker(const RunScene& scene, const std::vector<std::filesystem::path>& frames)
    : scene_(scene) {
    std::string why_not;
    context_ = gl::HeadlessContext::create(&why_not);
    if (!context_) throw JobError("OpenGL cannot start: " + why_not);
    const scene::CameraDescription& wish = scene.description.camera;
    geometry::Box seen;
    double lowest = 1e300;
    for (const std::size_t k : {std::size_t{0}, frames.size() / 2, frames.size() - 1}) {
        const geometry::Box box = io::read_surface(frames[k]).mesh.bounds();
        seen.add(box);
        lowest = std::min(lowest, box.min[2]);
    }
    render::RenderOptions options;
    options.width = wish.width;
    options.height = wish.height;
    options.ground = true;
    options.ground_height =
        scene.description.ground ? scene.description.ground->height : lowest - 0.25 * seen.size().norm();
    renderer_.emplace(*context_, options);
    camera_ = wish.eye ? render::Camera{*wish.eye, *wish.target, wish.up, wish.vertical_fov_degrees}
                       : render::frame_camera(seen, wish.direction, wish.vertical_fov_degrees,
                                              static_cast<double>(wish.width) / wish.height, wish.up, 1.15);
}

render::Picture PictureMaker::draw(const geometry::SurfaceMesh& surface, double time) {
    render::DrawList list;
    render::add_surface(list, surface);
    for (const scene::ColliderDescription& collider : scene_.description.colliders) {
        geometry::SurfaceMesh solid;
        solid.mesh = scene::collider_mesh(collider);
        const Isometry frame = scene::collider_frame(collider, time);
        for (Vec3& p : solid.mesh.positions) p = frame * p;
        render::add_surface(list, solid);
    }
    for (const scene::ToolDescription& tool : scene_.description.tools) {
        const cutting::Blade blade = scene::make_blade(tool);
        if (!blade.active(time)) continue;
        for (const std::vector<Vec3>& line : blade.pose(time))
            render::add_polyline(list, line, render::Color(0.15, 0.2, 0.3), 3.5);
    }
    return renderer_->draw(list, camera_);
}

}  // namespace splitcubes::app

#endif
