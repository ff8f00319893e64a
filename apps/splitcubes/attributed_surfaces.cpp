#include "attributed_surfaces.h"

#include "body_materials.h"

#include <splitcubes/body/body.h>
#include <splitcubes/io/write_mesh.h>
#include <splitcubes/splitting/surface.h>
#include <splitcubes/world/world.h>

#include <algorithm>

namespace splitcubes::app {

AttributedSurfaces::AttributedSurfaces(const body::World& world, const std::vector<io::Model>& models,
                                       const scene::SceneDescription& scene)
    : bodies_(world.bodies().size()), keeps_rest_(scene.output.format == scene::SurfaceFormat::ply) {
    for (std::size_t k = 0; k < std::min(scene.bodies.size(), bodies_.size()); ++k) {
        bodies_[k].appearance = scene.bodies[k].appearance;
        any_ = any_ || !bodies_[k].appearance.empty();
    }
    for (std::size_t k = 0; k < std::min(models.size(), bodies_.size()); ++k) {
        if (models[k].attributes.empty()) continue;
        bodies_[k].transfer.emplace(models[k].mesh, models[k].attributes,
                                    world.bodies()[k]->settings().cell_size / 2);
        bodies_[k].materials = models[k].attributes.materials;
        any_ = true;
    }
}

void AttributedSurfaces::write_images(const std::filesystem::path& folder,
                                      const std::function<void(const std::filesystem::path&)>& before) {
    for (std::size_t k = 0; k < bodies_.size(); ++k)
        io::write_images(folder, "body" + std::to_string(k), bodies_[k].materials, before);
}

void AttributedSurfaces::update(Cached& cached, const body::Body& body, const geometry::SurfaceMesh& surface,
                                const Parallel& parallel) const {
    if (cached.known && cached.revision == body.surface().revision()) return;
    if (cached.transfer)
        cached.attributes = cached.transfer->onto(surface, parallel, cached.surface, cached.transferred);
    else if (cached.appearance.surface)
        cached.attributes = {};  // which the appearance gives to all faces
    else
        cached.attributes = geometry::attributes_by_origin(surface);
    cached.surface.mesh.triangles = surface.mesh.triangles;
    cached.surface.triangle_origin = surface.triangle_origin;
    cached.surface.rest = surface.rest;
    // Added materials follow those of the input.
    std::copy(cached.materials.begin(), cached.materials.end(), cached.attributes.materials.begin());
    cached.transferred = cached.attributes;
    set_body_materials(body.name(), cached.appearance, surface, cached.attributes);
    cached.revision = body.surface().revision();
    cached.known = true;
}

geometry::SurfaceMesh AttributedSurfaces::now(const body::World& world) {
    geometry::SurfaceMesh all;
    std::int32_t first_piece = 0;
    for (std::size_t k = 0; k < bodies_.size(); ++k) {
        const body::Body& body = *world.bodies()[k];
        geometry::SurfaceMesh one = body.surface_mesh();
        for (std::int32_t& piece : one.vertex_piece) piece += first_piece;
        first_piece += static_cast<std::int32_t>(body.pieces().count());
        if (any_) {
            update(bodies_[k], body, one, world.parallel());
            one.attributes = bodies_[k].attributes;
        } else if (!keeps_rest_) {
            one.rest.clear();
        }
        if (bodies_.size() > 1)
            one.vertex_body.assign(one.mesh.positions.size(), static_cast<std::int32_t>(k));
        all.append(one);
    }
    return all;
}

}  // namespace splitcubes::app
