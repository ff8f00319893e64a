#ifdef SPLITCUBES_WITH_RENDER

#include "frame_looks.h"

#include "body_materials.h"
#include "report.h"

#include <splitcubes/core/error.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/read_picture.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/loft.h>
#include <splitcubes/scene/strength.h>

#include <algorithm>
#include <set>
#include <utility>

namespace splitcubes::app {

FrameLooks::FrameLooks(const scene::SceneDescription& scene) : scene_(scene) {
    find_regions();
}

void FrameLooks::find_regions() {
    regions_.clear();
    const auto index_of = [&](const std::string& name) {
        std::size_t k = 0;
        while (k + 1 < scene_.bodies.size() && scene_.bodies[k].name != name) ++k;
        return k;
    };
    for (const scene::ConstraintDescription& c : scene_.constraints)
        regions_.push_back({index_of(c.body),
                            false,
                            c.from_time,
                            c.until_time.value_or(1e300),
                            c.release_when,
                            scene::region_test(c.region),
                            {}});
    for (const scene::HandleDescription& h : scene_.handles)
        regions_.push_back({index_of(h.body), true, h.from_time, h.until_time.value_or(1e300), h.release_when,
                            scene::region_test(h.region), scene::handle_motion(h, scene_)});
}

std::int32_t FrameLooks::body_of_vertex(const geometry::SurfaceMesh& surface, std::size_t vertex) const {
    if (!surface.vertex_body.empty()) return surface.vertex_body[vertex];
    return scene_.bodies.size() == 1 ? 0 : -1;
}

std::size_t FrameLooks::pieces_of(const std::string& body, const geometry::SurfaceMesh& surface) const {
    std::set<std::int32_t> pieces;
    for (std::size_t v = 0; v < surface.vertex_piece.size(); ++v) {
        const std::int32_t b = body_of_vertex(surface, v);
        if (b >= 0 && scene_.bodies[static_cast<std::size_t>(b)].name == body)
            pieces.insert(surface.vertex_piece[v]);
    }
    return pieces.size();
}

bool FrameLooks::acts(const Region& region, double time, const geometry::SurfaceMesh& surface) const {
    if (time < region.from || time >= region.until) return false;
    return !region.release_when || region.release_when->body.empty() ||
           pieces_of(region.release_when->body, surface) <
               static_cast<std::size_t>(region.release_when->at_least);
}

const geometry::NearestPoint* FrameLooks::uncut_surface(std::size_t body) {
    const auto [known, is_new] = uncut_.try_emplace(body);
    if (!is_new) return known->second.get();
    try {
        scene::BuildReport report;
        const io::Model model = scene::placed_model(scene_.bodies[body], report);
        known->second = std::make_unique<const geometry::NearestPoint>(model.mesh);
    } catch (const InputError& error) {
        print_notes(scene_.bodies[body].name, {std::string("its layers are not drawn: ") + error.what()});
    }
    return known->second.get();
}

std::shared_ptr<const render::Picture> FrameLooks::picture_of(const geometry::Material& material) {
    if (material.texture.empty()) return nullptr;
    const auto [known, is_new] = pictures_.try_emplace(material.texture);
    if (!is_new) return known->second;
    try {
        io::ColourPicture read = material.image
                                     ? io::read_colours_from_memory(material.image->bytes, material.texture)
                                     : io::read_colours(material.texture);
        known->second = std::make_shared<const render::Picture>(
            render::Picture{read.width, read.height, std::move(read.rgb)});
    } catch (const InputError& error) {
        print_notes("texture", {std::string("is not drawn: ") + error.what()});
    }
    return known->second;
}

void FrameLooks::find_depth(const geometry::SurfaceMesh& surface,
                            const std::vector<std::int32_t>& body_of_material, render::SurfaceLooks& out) {
    if (surface.rest.empty()) return;
    std::vector<char> is_done(surface.rest.size(), 0);
    for (std::size_t t = 0; t < surface.attributes.triangle_material.size(); ++t) {
        const std::int32_t material = surface.attributes.triangle_material[t];
        if (material < 0) continue;
        const auto m = static_cast<std::size_t>(material);
        if (body_of_material[m] < 0 || out.finishes[m]->layers.empty()) continue;
        const geometry::NearestPoint* uncut = uncut_surface(static_cast<std::size_t>(body_of_material[m]));
        if (uncut == nullptr) continue;
        out.depth.resize(surface.rest.size(), 0.0F);
        for (const std::uint32_t v : surface.mesh.triangles[t]) {
            if (std::exchange(is_done[v], 1) != 0) continue;
            out.depth[v] = static_cast<float>(uncut->at({.point = surface.rest[v]}).distance);
        }
    }
}

render::SurfaceLooks FrameLooks::of(const geometry::SurfaceMesh& surface, double time) {
    render::SurfaceLooks out;
    const std::vector<geometry::Material>& materials = surface.attributes.materials;
    std::vector<std::int32_t> body_of_material(materials.size(), -1);
    out.finishes.resize(materials.size());
    out.pictures.resize(materials.size());
    for (std::size_t m = 0; m < materials.size(); ++m) {
        out.pictures[m] = picture_of(materials[m]);
        for (std::size_t b = 0; b < scene_.bodies.size(); ++b) {
            const scene::BodyDescription& body = scene_.bodies[b];
            for (const geometry::Origin origin : {geometry::Origin::boundary, geometry::Origin::cut}) {
                const geometry::Finish* finish = finish_of(body.appearance, origin);
                if (finish == nullptr || materials[m].name != material_name(body.name, origin)) continue;
                out.finishes[m] = std::make_shared<const geometry::Finish>(*finish);
                body_of_material[m] = static_cast<std::int32_t>(b);
            }
        }
    }
    find_depth(surface, body_of_material, out);
    if (surface.rest.empty() || !scene_.display.held) return out;
    for (const Region& region : regions_) {
        if (!acts(region, time, surface)) continue;
        out.mark.resize(surface.rest.size(), render::no_region);
        for (std::size_t v = 0; v < surface.rest.size(); ++v)
            if (body_of_vertex(surface, v) == static_cast<std::int32_t>(region.body) &&
                region.contains(surface.rest[v]))
                out.mark[v] = region.is_pulled ? render::pulled_region : render::held_region;
    }
    return out;
}

void FrameLooks::add_handles(render::DrawList& list, const geometry::SurfaceMesh& surface,
                             double time) const {
    if (surface.rest.empty() || !scene_.display.handles) return;
    for (const Region& region : regions_) {
        if (!region.is_pulled || !acts(region, time, surface)) continue;
        Vec3 now = Vec3::Zero(), rest = Vec3::Zero();
        geometry::Box body;
        double count = 0;
        for (std::size_t v = 0; v < surface.rest.size(); ++v) {
            if (body_of_vertex(surface, v) != static_cast<std::int32_t>(region.body)) continue;
            body.add(surface.rest[v]);
            if (!region.contains(surface.rest[v])) continue;
            now += surface.mesh.positions[v];
            rest += surface.rest[v];
            ++count;
        }
        if (count == 0) continue;
        const Vec3 target = region.motion(time) * Vec3(rest / count);
        now /= count;
        const double radius = 0.022 * body.size().norm();
        geometry::TriangleMesh rod = geometry::make_sphere(radius, 3);
        for (Vec3& p : rod.positions) p += target;
        if ((target - now).norm() > 0.2 * radius) rod.append(scene::make_tube({now, target}, 0.35 * radius));
        geometry::Finish finish;
        finish.colour = Vec3(0.93, 0.45, 0.08);
        finish.roughness = 0.35;
        std::vector<Vec3> own = rod.positions;
        render::add_mesh(list, rod, finish, std::move(own));
    }
}

}  // namespace splitcubes::app

#endif
