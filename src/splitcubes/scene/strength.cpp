#include <splitcubes/core/error.h>
#include <splitcubes/geometry/nearest_point.h>
#include <splitcubes/io/read_picture.h>
#include <splitcubes/scene/overloaded.h>
#include <splitcubes/scene/strength.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace splitcubes::scene {

namespace {

bool within(const Vec3& p, const CylinderRegion& r) {
    const Vec3 axis = r.to - r.from;
    const double along = (p - r.from).dot(axis) / axis.squaredNorm();
    return along >= 0 && along <= 1 && (p - r.from - along * axis).norm() <= r.radius;
}

using Factor = std::function<double(const Vec3&)>;

double mean(const geometry::Rgba& c) {
    return (static_cast<double>(c[0]) + c[1] + c[2]) / 3;
}

// Brightness at a point of the mesh's surface.
using Brightness = std::function<double(const geometry::NearestPoint::Hit&)>;

Brightness by_vertex_colours(const io::Model& model) {
    if (model.attributes.corner_colour.empty())
        throw InputError("tearing", "the strength is painted, but the mesh has no vertex colours",
                         "give it a mesh with colours, name a picture, or take the paint out of its "
                         "strength_map");
    return [colours = model.attributes.corner_colour](const geometry::NearestPoint::Hit& hit) {
        double out = 0;
        for (std::size_t k = 0; k < 3; ++k) out += hit.weights[k] * mean(colours[hit.triangle][k]);
        return out;
    };
}

Brightness by_picture(const std::filesystem::path& file, const io::Model& model) {
    if (model.attributes.corner_uv.empty())
        throw InputError(
            "tearing",
            "the strength is painted by " + file.string() + ", but the mesh has no texture coordinates",
            "give it a mesh that has them, or take the picture out of its strength_map");
    return [picture = io::read_brightness(file),
            uv = model.attributes.corner_uv](const geometry::NearestPoint::Hit& hit) {
        double u = 0, v = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            u += hit.weights[k] * static_cast<double>(uv[hit.triangle][k][0]);
            v += hit.weights[k] * static_cast<double>(uv[hit.triangle][k][1]);
        }
        return picture.at(u, v);
    };
}

Factor painted_factor(const StrengthPaint& paint, const io::Model& model) {
    const auto nearest = std::make_shared<const geometry::NearestPoint>(model.mesh);
    const auto brightness = std::make_shared<const Brightness>(
        paint.picture.empty() ? by_vertex_colours(model) : by_picture(paint.picture, model));
    return [nearest, brightness, paint](const Vec3& rest) {
        const double light = (*brightness)(nearest->at({.point = rest}));
        return paint.dark + std::clamp(light, 0.0, 1.0) * (paint.light - paint.dark);
    };
}

}  // namespace

std::function<bool(const Vec3&)> region_test(const Region& region) {
    return std::visit(Overloaded{[](const BoxRegion& r) -> std::function<bool(const Vec3&)> {
                                     return [r](const Vec3& p) {
                                         return geometry::Box{r.min, r.max}.contains(p);
                                     };
                                 },
                                 [](const SphereRegion& r) -> std::function<bool(const Vec3&)> {
                                     return [r](const Vec3& p) { return (p - r.center).norm() <= r.radius; };
                                 },
                                 [](const HalfSpaceRegion& r) -> std::function<bool(const Vec3&)> {
                                     return [r](const Vec3& p) { return (p - r.point).dot(r.normal) >= 0; };
                                 },
                                 [](const CylinderRegion& r) -> std::function<bool(const Vec3&)> {
                                     return [r](const Vec3& p) { return within(p, r); };
                                 },
                                 [](const SlabRegion& r) -> std::function<bool(const Vec3&)> {
                                     const Vec3 normal = r.normal.normalized();
                                     return [r, normal](const Vec3& p) {
                                         return std::abs((p - r.point).dot(normal)) <= 0.5 * r.thickness;
                                     };
                                 }},
                      region);
}

body::TearSettings tear_settings(const TearingDescription& tearing, const io::Model& model) {
    body::TearSettings out;
    out.strength = tearing.strength;
    out.propagation_ratio = tearing.propagation_ratio;
    out.crack_speed = tearing.crack_speed.value_or(0);
    if (tearing.strength_map.empty()) return out;
    std::vector<Factor> factors;
    for (const StrengthLayer& layer : tearing.strength_map) {
        if (const auto* paint = std::get_if<StrengthPaint>(&layer)) {
            factors.push_back(painted_factor(*paint, model));
            continue;
        }
        const auto& patch = std::get<StrengthPatch>(layer);
        factors.push_back([inside = region_test(patch.region), factor = patch.factor](const Vec3& rest) {
            return inside(rest) ? factor : 1.0;
        });
    }
    out.strength_factor = [factors](const Vec3& rest) {
        double product = 1;
        for (const Factor& factor : factors) product *= factor(rest);
        return product;
    };
    return out;
}

}  // namespace splitcubes::scene
