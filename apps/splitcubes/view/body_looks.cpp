#include "body_looks.h"

#include <splitcubes/core/error.h>
#include <splitcubes/geometry/attribute_transfer.h>
#include <splitcubes/io/read_picture.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/course.h>
#include <splitcubes/scene/strength.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::view {

namespace {

bool is_of_cuts(const std::string& name) {
    return name.find(geometry::cut_material) != std::string::npos;
}

}  // namespace

int inside_of(const std::vector<std::string>& names) {
    const auto found = std::find_if(names.begin(), names.end(), is_of_cuts);
    return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

std::vector<Vec3> palette_of(const std::vector<std::string>& names,
                             const std::vector<geometry::Material>& materials) {
    constexpr double gamma = 2.2;  // materials are linear
    const Vec3 skin(0.90, 0.74, 0.62), cut(0.84, 0.20, 0.13);
    std::vector<Vec3> out;
    for (std::size_t k = 0; k < names.size(); ++k) {
        out.push_back(is_of_cuts(names[k]) ? cut : skin);
        if (k < materials.size())
            for (int channel = 0; channel < 3; ++channel)
                out.back()[channel] =
                    std::pow(materials[k].colour[static_cast<std::size_t>(channel)], 1 / gamma);
    }
    return out;
}

std::shared_ptr<const SurfacePicture> material_picture(const geometry::Material& material) {
    if (material.texture.empty() && !material.image) return nullptr;
    try {
        io::ColourPicture read = material.image
                                     ? io::read_colours_from_memory(material.image->bytes, material.texture)
                                     : io::read_colours(material.texture);
        return std::make_shared<const SurfacePicture>(
            SurfacePicture{read.width, read.height, std::move(read.rgb)});
    } catch (const InputError&) {
        return nullptr;
    }
}

BodyLooks::BodyLooks(const SceneSource& source, std::size_t body, const std::vector<std::string>& materials) {
    const scene::SceneDescription& scene = source.description;
    read_pictures(source, body);
    if (body >= scene.bodies.size() || body >= source.bodies.size()) return;
    const scene::AppearanceDescription& appearance = scene.bodies[body].appearance;
    if (!appearance.empty()) {
        Finishes finishes;
        bool has_layers = false;
        for (const std::string& name : materials) {
            const bool is_cut = name == geometry::cut_material;
            const auto& wish = is_cut && appearance.cut ? appearance.cut : appearance.surface;
            finishes.push_back(wish ? std::make_shared<const geometry::Finish>(*wish) : nullptr);
            if (!wish) continue;
            has_layers = has_layers || !wish->layers.empty();
            needs_rest_ = needs_rest_ || !wish->is_plain();
        }
        finishes_ = std::make_shared<const Finishes>(std::move(finishes));
        if (has_layers) {
            geometry::TriangleMesh placed = source.bodies[body].model.mesh;
            const Isometry pose = scene::pose_of(scene.bodies[body].placement);
            for (Vec3& p : placed.positions) p = pose * p;
            uncut_ = std::make_shared<const geometry::NearestPoint>(placed);
        }
    }
    if (!scene.display.held) return;
    for (std::size_t k = 0; k < scene.constraints.size(); ++k)
        if (scene.constraints[k].body == scene.bodies[body].name)
            regions_.push_back({scene::region_test(scene.constraints[k].region), k, false});
    for (std::size_t k = 0; k < scene.handles.size(); ++k)
        if (scene.handles[k].body == scene.bodies[body].name)
            regions_.push_back({scene::region_test(scene.handles[k].region), k, true});
    needs_rest_ = needs_rest_ || !regions_.empty();
}

// A picture that cannot be read is left out: the mesh has its colours.
void BodyLooks::read_pictures(const SceneSource& source, std::size_t body) {
    if (body >= source.bodies.size()) return;
    const geometry::MeshAttributes& attributes = source.bodies[body].model.attributes;
    if (attributes.corner_uv.empty()) return;
    Pictures pictures(attributes.materials.size());
    bool any = false;
    for (std::size_t m = 0; m < pictures.size(); ++m) {
        pictures[m] = material_picture(attributes.materials[m]);
        any = any || pictures[m] != nullptr;
    }
    if (any) pictures_ = std::make_shared<const Pictures>(std::move(pictures));
}

std::vector<float> BodyLooks::rest_and_depth(const SurfaceView& surface, bool all) {
    if (!needs_rest_) return {};
    const std::size_t count = surface.rest_positions.size() / 3;
    const std::size_t before = all ? 0 : std::min(count, rest_and_depth_.size() / 4);
    rest_and_depth_.resize(4 * count);
    const auto compute = [&](std::size_t v) {
        Vec3 rest;
        for (std::size_t k = 0; k < 3; ++k) {
            rest_and_depth_[4 * v + k] = surface.rest_positions[3 * v + k];
            rest[static_cast<Eigen::Index>(k)] = static_cast<double>(surface.rest_positions[3 * v + k]);
        }
        const bool is_used = uncut_ && surface.pieces[v] >= 0;
        rest_and_depth_[4 * v + 3] =
            is_used ? static_cast<float>(uncut_->at({.point = rest}).distance) : 0.0F;
    };
    for (std::size_t v = before; v < count; ++v) compute(v);
    if (all) return rest_and_depth_;
    for (const Range& range : surface.changed_vertices)
        for (std::size_t v = range.first; v < std::min<std::size_t>(before, range.first + range.count); ++v)
            compute(v);
    return rest_and_depth_;
}

std::vector<float> BodyLooks::marks(const SurfaceView& surface, double time,
                                    const scene::Course& course) const {
    std::vector<float> out;
    for (const MarkedRegion& region : regions_) {
        const auto [from, until] = region.is_pulled ? course.handle_activity(region.index)
                                                    : course.constraint_activity(region.index);
        if (time < from || time >= until) continue;
        out.resize(surface.rest_positions.size() / 3, 0.0F);
        for (std::size_t v = 0; v < out.size(); ++v) {
            const Eigen::Map<const Vec3f> rest(surface.rest_positions.data() + 3 * v);
            if (region.contains(rest.cast<double>())) out[v] = region.is_pulled ? -1.0F : 1.0F;
        }
    }
    // A state without marks removes those of the one before.
    if (out.empty() && !regions_.empty()) out.assign(surface.rest_positions.size() / 3, 0.0F);
    return out;
}

}  // namespace splitcubes::view
