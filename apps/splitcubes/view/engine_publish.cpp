// States that an engine publishes.
#include "body_looks.h"
#include "engine.h"
#include "scene_driver.h"
#include "vectors.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace splitcubes::view {

namespace {

// Changes of a surface that a window may lag behind without copying the whole.
constexpr std::size_t max_changes = 64;

}  // namespace

std::shared_ptr<const SurfaceTopology> Engine::take_topology(BodyRecord& record, const SurfaceView& surface) {
    if (record.topology && record.topology->revision == surface.revision) return record.topology;
    const bool follows = record.topology && surface.revision == record.topology->revision + 1;
    if (!follows) record.changes.clear();
    if (follows) {
        record.changes.push_back({surface.revision,
                                  {surface.changed_vertices.begin(), surface.changed_vertices.end()},
                                  {surface.changed_triangles.begin(), surface.changed_triangles.end()}});
        if (record.changes.size() > max_changes) record.changes.pop_front();
    }
    auto out = std::make_shared<SurfaceTopology>();
    out->triangles.assign(surface.triangles.begin(), surface.triangles.end());
    out->origins.assign(surface.origins.begin(), surface.origins.end());
    out->materials.assign(surface.triangle_material.begin(), surface.triangle_material.end());
    out->pieces.assign(surface.pieces.begin(), surface.pieces.end());
    out->rest.assign(surface.rest_positions.begin(), surface.rest_positions.end());
    out->rest_and_depth = record.looks->rest_and_depth(surface, !follows);
    out->cuts.assign(surface.cuts.begin(), surface.cuts.end());
    out->corner_uv.assign(surface.corner_uv.begin(), surface.corner_uv.end());
    find_births(record, surface, !follows, *out);
    out->revision = surface.revision;
    out->changes.assign(record.changes.begin(), record.changes.end());
    record.topology = out;
    return out;
}

// Edges are numbered in the order in which they were cut: those above the highest number of a state are cut
// in the next one. What an undo took back is cut anew.
void Engine::find_births(BodyRecord& record, const SurfaceView& surface, bool all,
                         SurfaceTopology& out) const {
    const double now = simulation_->time();
    std::int32_t edges = 0;
    record.triangles = 0;
    for (std::size_t t = 0; t < surface.triangle_slots(); ++t) {
        if (surface.triangles[3 * t] == surface.triangles[3 * t + 1]) continue;
        edges = std::max(edges, surface.edges[t] + 1);
        ++record.triangles;
    }
    auto& times = record.edge_times;
    while (!times.empty() && (times.back().second > now || (all && times.back().first > edges)))
        times.pop_back();
    if (times.empty() || times.back().first < edges) times.emplace_back(edges, now);
    out.born.assign(surface.triangle_slots(), -1.0F);
    for (std::size_t t = 0; t < surface.triangle_slots(); ++t) {
        if (surface.origins[t] != SurfaceOrigin::cut) continue;
        const auto at =
            std::upper_bound(times.begin(), times.end(), surface.edges[t],
                             [](std::int32_t edge, const auto& until) { return edge < until.first; });
        out.born[t] = static_cast<float>(at == times.end() ? now : at->second);
    }
}

BodyState Engine::body_state(std::size_t index) {
    const BodyId body = bodies_[index];
    const SurfaceView surface = simulation_->surface(body);
    BodyState out;
    out.id = body;
    if (!records_[index].palette)
        records_[index].looks =
            std::make_shared<BodyLooks>(*source_, index, simulation_->material_names(body));
    out.topology = take_topology(records_[index], surface);
    out.positions.assign(surface.positions.begin(), surface.positions.end());
    out.normals.assign(surface.normals.begin(), surface.normals.end());
    if (!records_[index].palette)
        records_[index].palette = std::make_shared<const std::vector<Vec3>>(palette_of(
            simulation_->material_names(body), index < source_->bodies.size()
                                                   ? source_->bodies[index].model.attributes.materials
                                                   : std::vector<geometry::Material>()));
    out.palette = records_[index].palette;
    out.inside = inside_of(simulation_->material_names(body));
    out.finishes = records_[index].looks->finishes();
    if (driver_) out.marks = records_[index].looks->marks(surface, simulation_->time(), driver_->course());
    out.pieces = simulation_->piece_count(body);
    if (index < source_->bodies.size()) out.name = source_->bodies[index].settings.name;
    find_bounds(out);
    out.pictures = records_[index].looks->pictures();
    add_samples(index, surface, out);
    return out;
}

void Engine::add_samples(std::size_t index, const SurfaceView& surface, BodyState& out) {
    const bool shows_points = (details_ & (show_samples | show_links)) != 0;
    if (field_ == Field::none && !shows_points) return;
    const SampleState samples = simulation_->samples(bodies_[index]);
    if (field_ != Field::none) out.field = records_[index].field.at_vertices(surface, samples, field_);
    if (!shows_points) return;
    for (const Vector3& p : samples.positions)
        for (const double v : {p.x, p.y, p.z}) out.sample_positions.push_back(static_cast<float>(v));
    out.sample_field = SampleField::values(samples, field_);
    if ((details_ & show_links) != 0) out.links = simulation_->links(bodies_[index]);
}

std::shared_ptr<PublishedState> Engine::publish() {
    auto out = std::make_shared<PublishedState>();
    out->number = ++published_;
    out->step = step_;
    out->time = simulation_->time();
    for (std::size_t b = 0; b < bodies_.size(); ++b) out->bodies.push_back(body_state(b));
    if (driver_) {
        const scene::Course& course = driver_->course();
        append_blades(*source_, course, out->time, out->blades);
        append_colliders(source_->description, course, driver_->collider_meshes(), out->time, out->colliders);
        append_instruments(*source_, course, out->time, out->instruments);
        driver_->append_rods(out->time, out->bodies, out->rods);
    }
    if (source_->description.ground) out->ground = source_->description.ground->height;
    out->camera = source_->description.camera;
    strokes_.append_blades(out->blades);
    pulls_.append_states(*simulation_, out->pulls);
    out->forces.arrows = scene_forces_;
    strokes_.append_forces(out->forces.arrows);
    pulls_.append_forces(out->forces.arrows);
    if ((details_ & show_contacts) != 0)
        for (const ContactPoint& contact : simulation_->contacts())
            out->forces.contacts.push_back(
                {to_eigen(contact.position), to_eigen(contact.force), contact.by_a_body});
    out->statistics = statistics_;
    out->undo_count = simulation_->undo_count();
    out->redo_count = simulation_->redo_count();
    out->title = source_->description.name;
    out->notice = notice_;
    out->notices = notices_;
    for (std::size_t k = 0; k < parameter_count; ++k) out->parameters.push_back(parameter_value(k));
    return out;
}

}  // namespace splitcubes::view
