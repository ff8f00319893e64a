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
    const std::filesystem::path as_run = folder / "scene_as_run.json";
    RunScene out{scene::parse_scene_file(std::filesystem::exists(as_run) ? as_run : file)};
    for (scene::ToolDescription& tool : out.description.tools) {
        const auto* shape = tool.instrument ? std::get_if<scene::MeshInstrument>(&*tool.instrument) : nullptr;
        std::error_code error;
        if (shape == nullptr || std::filesystem::is_regular_file(shape->mesh.file, error)) continue;
        print_notes(tool.name, {"is drawn as a line: there is no file " + shape->mesh.file.string()});
        tool.instrument.reset();
    }
    std::erase_if(out.description.colliders, [](const scene::ColliderDescription& collider) {
        const auto* mesh = collider.shape ? std::get_if<scene::MeshShape>(&*collider.shape) : nullptr;
        std::error_code error;
        if (mesh == nullptr || std::filesystem::is_regular_file(mesh->file, error)) return false;
        print_notes(collider.name, {"is not drawn: there is no file " + mesh->file.string()});
        return true;
    });
    return out;
}

geometry::SurfaceMesh read_frame(const std::filesystem::path& file) {
    return io::read_any_surface(file);
}

double frame_time(const RunScene& scene, const std::filesystem::path& file) {
    return std::atof(file.stem().c_str()) * scene.description.time_step;
}

std::vector<geometry::Box> boxes_of(const std::vector<std::filesystem::path>& frames) {
    constexpr std::size_t most = 24;
    const std::size_t count = std::min(most, frames.size());
    std::vector<geometry::Box> out;
    for (std::size_t k = 0; k < count; ++k)
        out.push_back(
            read_frame(frames[count == 1 ? 0 : k * (frames.size() - 1) / (count - 1)]).mesh.bounds());
    return out;
}

namespace {

geometry::Box intersection(const geometry::Box& a, const geometry::Box& b) {
    return {a.min.cwiseMax(b.min), a.max.cwiseMin(b.max)};
}

// Things further from the bodies than this share of their size do not draw the camera back.
constexpr double bodies_reach = 2.5, tools_reach = 0.6;

}  // namespace

geometry::Box seen_box(const scene::SceneDescription& scene, const std::vector<geometry::Box>& boxes) {
    geometry::Box first;
    for (const geometry::Box& box : boxes)
        if (first.empty()) first = box;
    if (first.empty()) return {Vec3::Zero(), Vec3::Ones()};
    const double size = first.size().norm();
    const geometry::Box near = first.grown(bodies_reach * size);
    geometry::Box out = first;
    for (const geometry::Box& box : boxes) {
        const geometry::Box part = intersection(box, near);
        if (!box.empty() && (part.min.array() <= part.max.array()).all()) out.add(part);
    }
    const geometry::Box around = out.grown(tools_reach * size);
    const auto add = [&](const Vec3& p) { out.add(Vec3(p.cwiseMax(around.min).cwiseMin(around.max))); };
    const double end = scene.frames * scene.time_step;
    constexpr int times = 24;
    for (const scene::ToolDescription& tool : scene.tools) {
        const cutting::Blade blade = scene::make_blade(tool);
        const double from = blade.active_from(), until = std::min(blade.active_until(), end);
        for (int k = 0; k <= times && until >= from; ++k)
            for (const std::vector<Vec3>& line : blade.pose(from + (until - from) * k / times))
                for (const Vec3& p : {line.front(), line[line.size() / 2], line.back()}) add(p);
    }
    for (const scene::ColliderDescription& collider : scene.colliders) {
        if (collider.keyframes.empty() || !collider.shape) continue;
        const geometry::Box own = scene::collider_mesh(collider).bounds();
        for (int k = 0; k <= times; ++k)
            for (const Vec3& p : {own.min, own.max, own.center()})
                add(scene::collider_frame(collider, end * k / times) * p);
    }
    return out;
}

PictureMaker::PictureMaker(const RunScene& scene, const std::vector<geometry::Box>& boxes)
    : scene_(std::make_shared<RunScene>(scene)), looks_(scene_->description) {
    std::string why_not;
    context_ = gl::HeadlessContext::create(&why_not);
    if (!context_) throw JobError("OpenGL cannot start: " + why_not);
    const scene::SceneDescription& description = scene_->description;
    const scene::CameraDescription& wish = description.camera;
    const geometry::Box seen = seen_box(description, boxes);
    double lowest = 1e300;
    for (const geometry::Box& box : boxes)
        if (!box.empty()) lowest = std::min(lowest, std::max(box.min[2], seen.min[2]));
    size_ = seen.size().norm();
    render::RenderOptions options;
    options.width = wish.width;
    options.height = wish.height;
    options.ground = true;
    options.ground_height =
        description.ground ? description.ground->height : std::min(lowest, seen.min[2]) - 0.25 * size_;
    renderer_.emplace(*context_, options);
    camera_ = wish.eye ? render::Camera{*wish.eye, *wish.target, wish.up, wish.vertical_fov_degrees}
                       : render::frame_camera(seen, wish.direction, wish.vertical_fov_degrees,
                                              static_cast<double>(wish.width) / wish.height, wish.up, 1.08);
    for (const scene::ColliderDescription& collider : description.colliders)
        colliders_.push_back(scene::collider_mesh(collider));
    make_tools();
}

void PictureMaker::make_tools() {
    tools_.clear();
    for (const scene::ToolDescription& tool : scene_->description.tools) {
        const auto [known, is_new] = parts_.try_emplace(tool.name);
        if (is_new) known->second = scene::instrument_parts(tool);
        tools_.push_back({scene::make_blade(tool), known->second, scene::shown_times(tool)});
    }
}

void PictureMaker::follow(const scene::SceneDescription& scene) {
    scene_->description = scene;
    looks_.find_regions();
    make_tools();
}

void PictureMaker::add_colliders(render::DrawList& list, double time) const {
    for (std::size_t k = 0; k < colliders_.size(); ++k) {
        const scene::ColliderDescription& collider = scene_->description.colliders[k];
        if (colliders_[k].triangles.empty()) continue;
        geometry::TriangleMesh solid = colliders_[k];
        const Isometry frame = scene::collider_frame(collider, time);
        for (Vec3& p : solid.positions) p = frame * p;
        if (collider.finish) {
            render::add_mesh(list, solid, *collider.finish, colliders_[k].positions);
            continue;
        }
        geometry::SurfaceMesh plain;
        plain.mesh = std::move(solid);
        render::add_surface(list, plain);
    }
}

void PictureMaker::add_blades(render::DrawList& list, double time) const {
    if (!scene_->description.display.tools) return;
    for (const DrawnTool& tool : tools_) {
        if (tool.parts.empty() && tool.blade.active(time))
            for (const std::vector<Vec3>& line : tool.blade.pose(time))
                render::add_polyline(list, line, render::Color(0.15, 0.2, 0.3), 3.5);
        if (time < tool.shown.first || time > tool.shown.second) continue;
        const Isometry frame = tool.blade.frame(time);
        for (const scene::InstrumentPart& part : tool.parts) {
            geometry::TriangleMesh solid = part.mesh;
            for (Vec3& p : solid.positions) p = frame * p;
            render::add_mesh(list, solid, part.finish, part.mesh.positions);
        }
    }
}

render::Picture PictureMaker::draw(const geometry::SurfaceMesh& surface, double time) {
    render::DrawList list;
    list.hatch_period = 0.015 * size_;
    render::add_surface(list, surface, {}, looks_.of(surface, time));
    add_colliders(list, time);
    add_blades(list, time);
    looks_.add_handles(list, surface, time);
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
