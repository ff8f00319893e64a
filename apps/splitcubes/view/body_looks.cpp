#include "body_looks.h"

#include <splitcubes/geometry/attribute_transfer.h>
#include <splitcubes/scene/strength.h>

#include <algorithm>

namespace splitcubes::view {

BodyLooks::BodyLooks(const SceneSource& source, std::size_t body, const std::vector<std::string>& materials) {
    const scene::SceneDescription& scene = source.description;
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
        if (has_layers)
            uncut_ = std::make_shared<const geometry::NearestPoint>(source.bodies[body].model.mesh);
    }
    if (!scene.display.held) return;
    for (const scene::ConstraintDescription& c : scene.constraints)
        if (c.body == scene.bodies[body].name)
            regions_.push_back({scene::region_test(c.region), c.from_time, c.until_time.value_or(1e300),
                                c.release_when, 1.0F});
    for (const scene::HandleDescription& h : scene.handles)
        if (h.body == scene.bodies[body].name)
            regions_.push_back({scene::region_test(h.region), h.from_time, h.until_time.value_or(1e300),
                                h.release_when, -1.0F});
    needs_rest_ = needs_rest_ || !regions_.empty();
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

std::vector<float> BodyLooks::marks(
    const SurfaceView& surface, double time,
    const std::function<std::size_t(const std::string&)>& number_of_pieces) const {
    std::vector<float> out;
    for (const MarkedRegion& region : regions_) {
        if (time < region.from || time >= region.until) continue;
        if (region.release_when && number_of_pieces(region.release_when->body) >=
                                       static_cast<std::size_t>(region.release_when->at_least))
            continue;
        out.resize(surface.rest_positions.size() / 3, 0.0F);
        for (std::size_t v = 0; v < out.size(); ++v) {
            const Eigen::Map<const Vec3f> rest(surface.rest_positions.data() + 3 * v);
            if (region.contains(rest.cast<double>())) out[v] = region.mark;
        }
    }
    // A state without marks removes those of the one before.
    if (out.empty() && !regions_.empty()) out.assign(surface.rest_positions.size() / 3, 0.0F);
    return out;
}

}  // namespace splitcubes::view
