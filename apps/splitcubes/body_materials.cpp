#include "body_materials.h"

#include <splitcubes/geometry/srgb.h>

#include <algorithm>

namespace splitcubes::app {

using geometry::Origin;

std::string material_name(const std::string& body, Origin origin) {
    return body + (origin == Origin::cut ? "/cut" : "/surface");
}

const geometry::Finish* finish_of(const scene::AppearanceDescription& appearance, Origin origin) {
    if (origin == Origin::cut && appearance.cut) return &*appearance.cut;
    return appearance.surface ? &*appearance.surface : nullptr;
}

geometry::Material material_of_finish(const std::string& name, const geometry::Finish& finish) {
    geometry::Material out{.name = name, .texture = {}, .image = {}};
    for (std::size_t k = 0; k < 3; ++k)
        out.colour[k] =
            geometry::linear_from_srgb(static_cast<float>(finish.colour[static_cast<Eigen::Index>(k)]));
    out.roughness = static_cast<float>(finish.roughness);
    out.metalness = static_cast<float>(finish.metalness);
    return out;
}

void set_body_materials(const std::string& body, const scene::AppearanceDescription& appearance,
                        const geometry::SurfaceMesh& surface, geometry::MeshAttributes& attributes) {
    if (appearance.empty()) return;
    attributes.triangle_material.resize(surface.mesh.triangles.size(), -1);
    for (const Origin origin : {Origin::boundary, Origin::cut}) {
        const geometry::Finish* finish = finish_of(appearance, origin);
        if (finish == nullptr) continue;
        const auto index = static_cast<std::int32_t>(attributes.materials.size());
        attributes.materials.push_back(material_of_finish(material_name(body, origin), *finish));
        for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
            if (surface.triangle_origin[t] != origin) continue;
            attributes.triangle_material[t] = index;
            if (!attributes.corner_colour.empty()) attributes.corner_colour[t].fill({1, 1, 1, 1});
        }
    }
}

}  // namespace splitcubes::app
