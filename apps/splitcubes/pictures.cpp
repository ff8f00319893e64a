#ifdef SPLITCUBES_WITH_RENDER

#include "pictures.h"
#include "report.h"

#include <splitcubes/core/error.h>
#include <splitcubes/io/read_surface.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/parse.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::app {

RunScene read_run_scene(const std::filesystem::path& folder) {
    const std::filesystem::path file = folder / "scene.json";
    if (!std::filesystem::exists(file))
        throw InputError(folder.string(), "holds no scene.json",
                         "give the folder that `splitcubes run` wrote");
    RunScene out{scene::parse_scene_file(file)};
    std::erase_if(out.description.colliders, [](const scene::ColliderDescription& collider) {
        const auto* mesh = collider.shape ? std::get_if<scene::MeshShape>(&*collider.shape) : nullptr;
        std::error_code error;
        if (mesh == nullptr || std::filesystem::is_regular_file(mesh->file, error)) return false;
        print_notes(collider.name, {"is not drawn: there is no file " + mesh->file.string()});
        return true;
    });
    return out;
}

double frame_time(const RunScene& scene, const std::filesystem::path& file) {
    return std::atof(file.stem().c_str()) * scene.description.time_step;
}

std::vector<geometry::Box> boxes_of(const std::vector<std::filesystem::path>& frames) {
    std::vector<geometry::Box> out;
    for (const std::size_t k : {std::size_t{0}, frames.size() / 2, frames.size() - 1})
        out.push_back(io::read_surface(frames[k]).mesh.bounds());
    return out;
}

PictureMaker::PictureMaker(const RunScene& scene, const std::vector<geometry::Box>& boxes) : scene_(scene) {
    std::string why_not;
    context_ = gl::HeadlessContext::create(&why_not);
    if (!context_) throw JobError("OpenGL cannot start: " + why_not);
    const scene::CameraDescription& wish = scene.description.camera;
    geometry::Box seen;
    double lowest = 1e300;
    for (const geometry::Box& box : boxes) {
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

void PictureMaker::add_colliders(render::DrawList& list, double time) const {
    for (const scene::ColliderDescription& collider : scene_.description.colliders) {
        geometry::SurfaceMesh solid;
        solid.mesh = scene::collider_mesh(collider);
        const Isometry frame = scene::collider_frame(collider, time);
        for (Vec3& p : solid.mesh.positions) p = frame * p;
        render::add_surface(list, solid);
    }
}

void PictureMaker::add_blades(render::DrawList& list, double time) const {
    for (const scene::ToolDescription& tool : scene_.description.tools) {
        const cutting::Blade blade = scene::make_blade(tool);
        if (!blade.active(time)) continue;
        for (const std::vector<Vec3>& line : blade.pose(time))
            render::add_polyline(list, line, render::Color(0.15, 0.2, 0.3), 3.5);
    }
}

render::Picture PictureMaker::draw(const geometry::SurfaceMesh& surface, double time) {
    render::DrawList list;
    render::add_surface(list, surface);
    add_colliders(list, time);
    add_blades(list, time);
    return renderer_->draw(list, camera_);
}

namespace {

// Colours from blue over yellow to red.
render::Color link_color(double visibility) {
    const render::Color seen(0.16, 0.42, 0.72), half(0.96, 0.78, 0.26), hidden(0.80, 0.11, 0.11);
    return visibility > 0.5 ? render::Color(half + (2 * visibility - 1) * (seen - half))
                            : render::Color(hidden + 2 * visibility * (half - hidden));
}

}  // namespace

render::Picture PictureMaker::lines_of(const Links& links, double time) {
    std::vector<bool> touched(links.positions.size(), false);
    for (const Link& link : links.links)
        if (link.visibility < 1) touched[link.a] = touched[link.b] = true;
    // Without a cut all links are drawn as those of touched phyxels.
    if (std::find(touched.begin(), touched.end(), true) == touched.end())
        touched.assign(touched.size(), true);
    constexpr int shades = 8;
    render::DrawList list;
    list.lines.resize(shades + 1);
    for (int k = 0; k <= shades; ++k) {
        render::LineSet& set = list.lines[static_cast<std::size_t>(k)];
        set.points = links.positions;
        set.color = k == shades ? render::Color(0.62, 0.66, 0.70) : link_color((k + 0.5) / shades);
        set.width = k == shades ? 0.8 : 2.2;
    }
    for (const Link& link : links.links) {
        if (!touched[link.a] && !touched[link.b]) continue;
        const int shade =
            link.visibility >= 1 ? shades : std::min(static_cast<int>(link.visibility * shades), shades - 1);
        list.lines[static_cast<std::size_t>(shade)].segments.push_back({link.a, link.b});
    }
    std::erase_if(list.lines, [](const render::LineSet& set) { return set.segments.empty(); });
    add_blades(list, time);
    return renderer_->draw(list, camera_);
}

namespace {

// Blends the difference of two pictures over a third, with an opacity.
void lay_over(render::Picture& picture, const render::Picture& with, const render::Picture& without,
              double share) {
    for (std::size_t k = 0; k < picture.rgb.size(); ++k) {
        const double value = picture.rgb[k] + share * (int{with.rgb[k]} - int{without.rgb[k]});
        picture.rgb[k] = static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
    }
}

// Returns the surface's cut faces, or the others.
geometry::SurfaceMesh faces_of(const geometry::SurfaceMesh& surface, bool cut) {
    geometry::SurfaceMesh out;
    out.mesh.positions = surface.mesh.positions;
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
        const bool is_cut =
            !surface.triangle_origin.empty() && surface.triangle_origin[t] == geometry::Origin::cut;
        if (is_cut == cut) out.mesh.triangles.push_back(surface.mesh.triangles[t]);
    }
    return out;
}

}  // namespace

render::Picture PictureMaker::draw(const Links& links, const geometry::SurfaceMesh& surface, double time) {
    constexpr double boundary_share = 0.22, cut_share = 0.45;
    render::SurfacePalette palette;
    palette.boundary = render::Color(0.55, 0.60, 0.66);
    palette.cut = palette.boundary;
    const render::Picture empty = renderer_->draw({}, camera_);
    render::Picture out = lines_of(links, time);
    for (const bool cut : {false, true}) {
        const geometry::SurfaceMesh faces = faces_of(surface, cut);
        if (faces.mesh.triangles.empty()) continue;
        render::DrawList list;
        render::add_surface(list, faces, palette);
        lay_over(out, renderer_->draw(list, camera_), empty, cut ? cut_share : boundary_share);
    }
    render::DrawList rims;
    render::add_surface(rims, surface, palette);
    rims.meshes.clear();
    lay_over(out, renderer_->draw(rims, camera_), empty, 1);
    return out;
}

}  // namespace splitcubes::app

#endif
