#include "run_player.h"

#include "body_looks.h"
#include "parameters.h"
#include "scene_driver.h"

#include <splitcubes/core/error.h>
#include <splitcubes/geometry/attribute_transfer.h>
#include <splitcubes/geometry/nearest_point.h>
#include <splitcubes/io/mesh_format.h>
#include <splitcubes/io/read_surface.h>
#include <splitcubes/scene/build.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <set>

namespace splitcubes::view {

namespace {

namespace fs = std::filesystem;

bool is_frame_file(const fs::path& file) {
    const std::string name = file.stem().string();
    return io::format_of_extension(file) && !name.empty() &&
           name.find_first_not_of("0123456789") == std::string::npos;
}

// Surfaces that another program may have written count as one body.
std::int32_t body_of_triangle(const geometry::SurfaceMesh& surface, std::size_t t) {
    return surface.vertex_body.empty() ? 0 : surface.vertex_body[surface.mesh.triangles[t][0]];
}

std::vector<Vec3> normals_of(const geometry::SurfaceMesh& surface) {
    if (!surface.normals.empty()) return surface.normals;
    std::vector<Vec3> out(surface.mesh.positions.size(), Vec3::Zero());
    for (const geometry::Triangle& t : surface.mesh.triangles) {
        const Vec3& a = surface.mesh.positions[t[0]];
        const Vec3 normal = (surface.mesh.positions[t[1]] - a).cross(surface.mesh.positions[t[2]] - a);
        for (const std::uint32_t v : t) out[v] += normal;
    }
    for (Vec3& normal : out) normal = normal.norm() > 0 ? normal.normalized() : Vec3(Vec3::UnitZ());
    return out;
}

void append_vector(const Vec3& v, std::vector<float>& out) {
    for (int k = 0; k < 3; ++k) out.push_back(static_cast<float>(v[k]));
}

}  // namespace

bool is_run(const fs::path& folder) {
    std::error_code ignored;
    return fs::is_directory(folder / "surface", ignored) &&
           fs::is_regular_file(folder / "scene.json", ignored);
}

RunPlayer::RunPlayer(const fs::path& folder)
    : source_(open_run_scene(folder)),
      course_(std::make_unique<const scene::Course>(source_.description, scene::Course::Bodies())) {
    for (const auto& entry : fs::directory_iterator(folder / "surface"))
        if (is_frame_file(entry.path())) files_.push_back(entry.path());
    if (files_.empty())
        throw InputError((folder / "surface").string(), "holds no frames",
                         "give the folder that `splitcubes run` wrote");
    std::sort(files_.begin(), files_.end());
    const auto same_number = [](const fs::path& a, const fs::path& b) { return a.stem() == b.stem(); };
    files_.erase(std::unique(files_.begin(), files_.end(), same_number), files_.end());
    for (const scene::ColliderDescription& c : source_.description.colliders)
        collider_meshes_.push_back(std::make_shared<const geometry::TriangleMesh>(scene::collider_mesh(c)));
}

RunPlayer::~RunPlayer() = default;

void RunPlayer::seek(std::int64_t frame) {
    frame_ = std::clamp<std::int64_t>(frame, 0, count() - 1);
}

double RunPlayer::time_of(std::int64_t frame) const {
    return std::atof(files_[static_cast<std::size_t>(frame)].stem().c_str()) * source_.description.time_step;
}

double RunPlayer::frame_length() const {
    if (count() < 2) return source_.description.time_step;
    const std::int64_t from = std::min(frame_, count() - 2);
    return time_of(from + 1) - time_of(from);
}

const geometry::NearestPoint* RunPlayer::uncut_surface(std::size_t body) {
    const auto [known, is_new] = uncut_.try_emplace(body);
    if (!is_new) return known->second.get();
    try {
        scene::BuildReport report;
        known->second = std::make_unique<const geometry::NearestPoint>(
            scene::placed_model(source_.description.bodies[body], report).mesh);
    } catch (const InputError&) {
        known->second = nullptr;  // layers are not drawn
    }
    return known->second.get();
}

// Materials are those that the body uses, then those of faces without one.
void RunPlayer::add_looks(const geometry::SurfaceMesh& surface, std::int32_t body,
                          const std::vector<std::int32_t>& materials,
                          const std::vector<std::uint32_t>& vertices, BodyState& out,
                          SurfaceTopology& topology) {
    const scene::SceneDescription& scene = source_.description;
    const auto index = static_cast<std::size_t>(std::max(body, 0));
    std::vector<std::string> names;
    std::vector<geometry::Material> used;
    BodyLooks::Finishes finishes;
    BodyLooks::Pictures pictures;
    bool has_layers = false, has_finish = false, has_picture = false;
    for (const std::int32_t m : materials) {
        const geometry::Material& material = surface.attributes.materials[static_cast<std::size_t>(m)];
        names.push_back(material.name);
        used.push_back(material);
        const geometry::Finish* finish = nullptr;
        if (index < scene.bodies.size()) {
            const scene::AppearanceDescription& looks = scene.bodies[index].appearance;
            if (looks.surface && material.name == scene.bodies[index].name + "/surface")
                finish = &*looks.surface;
            if (material.name == scene.bodies[index].name + "/cut")
                finish = looks.cut ? &*looks.cut : looks.surface ? &*looks.surface : nullptr;
        }
        finishes.push_back(finish != nullptr ? std::make_shared<const geometry::Finish>(*finish) : nullptr);
        has_finish = has_finish || finish != nullptr;
        has_layers = has_layers || (finish != nullptr && !finish->layers.empty());
        const auto [known, is_new] = pictures_.try_emplace(material.texture);
        if (is_new) known->second = material_picture(material);
        pictures.push_back(known->second);
        has_picture = has_picture || known->second != nullptr;
    }
    names.insert(names.end(), {geometry::boundary_material, geometry::cut_material});
    out.palette = std::make_shared<const std::vector<Vec3>>(palette_of(names, used));
    out.inside = inside_of(names);
    if (has_picture && !topology.corner_uv.empty())
        out.pictures = std::make_shared<const BodyLooks::Pictures>(std::move(pictures));
    if (!has_finish) return;
    out.finishes = std::make_shared<const BodyLooks::Finishes>(std::move(finishes));
    if (surface.rest.empty()) return;
    const geometry::NearestPoint* uncut = has_layers ? uncut_surface(index) : nullptr;
    for (const std::uint32_t v : vertices) {
        append_vector(surface.rest[v], topology.rest_and_depth);
        topology.rest_and_depth.push_back(
            uncut != nullptr ? static_cast<float>(uncut->at({.point = surface.rest[v]}).distance) : 0.0F);
    }
}

BodyState RunPlayer::body_of(const geometry::SurfaceMesh& surface, std::int32_t body, bool is_only) {
    static std::uint64_t revisions = 0;
    constexpr std::uint64_t own_revisions = std::uint64_t{1} << 63;  // simulations count from 0
    constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
    auto topology = std::make_shared<SurfaceTopology>();
    BodyState out;
    std::vector<std::uint32_t> slot_of(surface.mesh.positions.size(), none), vertices;
    std::vector<std::int32_t> materials;  // of the surface, that this body uses
    const std::vector<Vec3> normals = normals_of(surface);
    std::set<std::int32_t> pieces;
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
        if (!is_only && body_of_triangle(surface, t) != body) continue;
        for (const std::uint32_t v : surface.mesh.triangles[t]) {
            if (slot_of[v] == none) {
                slot_of[v] = static_cast<std::uint32_t>(vertices.size());
                vertices.push_back(v);
            }
            topology->triangles.push_back(slot_of[v]);
        }
        const bool is_cut =
            !surface.triangle_origin.empty() && surface.triangle_origin[t] == geometry::Origin::cut;
        topology->origins.push_back(is_cut ? SurfaceOrigin::cut : SurfaceOrigin::boundary);
        topology->cuts.push_back(surface.triangle_cut.empty() ? (is_cut ? 0 : -1) : surface.triangle_cut[t]);
        topology->born.push_back(is_cut ? 0.0F : -1.0F);
        if (!surface.attributes.corner_uv.empty())
            for (const geometry::Uv& uv : surface.attributes.corner_uv[t])
                topology->corner_uv.insert(topology->corner_uv.end(), uv.begin(), uv.end());
        std::int32_t material = -1;
        if (!surface.attributes.triangle_material.empty()) material = surface.attributes.triangle_material[t];
        if (material >= 0) {
            auto at = std::find(materials.begin(), materials.end(), material);
            if (at == materials.end()) at = materials.insert(at, material);
            topology->materials.push_back(static_cast<std::int32_t>(at - materials.begin()));
        } else {
            topology->materials.push_back(is_cut ? -2 : -1);
        }
    }
    for (std::int32_t& material : topology->materials)
        if (material < 0) material = static_cast<std::int32_t>(materials.size()) - material - 1;
    for (const std::uint32_t v : vertices) {
        append_vector(surface.mesh.positions[v], out.positions);
        append_vector(normals[v], out.normals);
        append_vector(surface.rest.empty() ? surface.mesh.positions[v] : surface.rest[v], topology->rest);
        topology->pieces.push_back(surface.vertex_piece.empty() ? 0 : surface.vertex_piece[v]);
        pieces.insert(topology->pieces.back());
    }
    topology->revision = own_revisions + ++revisions;
    add_looks(surface, body, materials, vertices, out, *topology);
    out.topology = topology;
    out.pieces = pieces.size();
    if (static_cast<std::size_t>(std::max(body, 0)) < source_.description.bodies.size())
        out.name = source_.description.bodies[static_cast<std::size_t>(std::max(body, 0))].name;
    find_bounds(out);
    return out;
}

std::shared_ptr<PublishedState> RunPlayer::publish() {
    geometry::SurfaceMesh surface = io::read_any_surface(files_[static_cast<std::size_t>(frame_)]);
    materials_of_colours(surface.attributes);
    auto out = std::make_shared<PublishedState>();
    out->number = ++published_;
    out->step = frame_;
    out->run_frames = count();
    out->time = time_of(frame_);
    std::set<std::int32_t> bodies;
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t)
        bodies.insert(body_of_triangle(surface, t));
    if (bodies.empty()) bodies.insert(0);
    for (const std::int32_t body : bodies) out->bodies.push_back(body_of(surface, body, bodies.size() == 1));
    append_blades(source_, *course_, out->time, out->blades);
    append_instruments(source_, *course_, out->time, out->instruments);
    append_colliders(source_.description, *course_, collider_meshes_, out->time, out->colliders);
    if (source_.description.ground) out->ground = source_.description.ground->height;
    out->camera = source_.description.camera;
    out->title = source_.description.name;
    out->parameters.assign(parameter_count, 0.0);
    out->parameters[time_step] = frame_length();
    out->parameters[cell_size] = 0.01 * out->bodies.front().bounds.size().norm();
    return out;
}

}  // namespace splitcubes::view
