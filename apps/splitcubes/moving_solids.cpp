#include "moving_solids.h"

#include "body_materials.h"

#include <splitcubes/scene/build.h>
#include <splitcubes/scene/instrument.h>

namespace splitcubes::app {

std::vector<MovingSolid> moving_solids(const scene::SceneDescription& scene,
                                       const std::vector<double>& times) {
    std::vector<MovingSolid> out;
    for (const scene::ColliderDescription& collider : scene.colliders) {
        MovingSolid solid{collider.name, scene::collider_mesh(collider), {}, {}, {}};
        if (solid.mesh.triangles.empty()) continue;
        solid.material = material_of_finish(
            collider.name, collider.finish.value_or(geometry::Finish{.colour = Vec3(0.62, 0.65, 0.70)}));
        for (const double time : times) {
            if (!solid.times.empty() && collider.keyframes.empty()) break;
            solid.times.push_back(time);
            solid.frames.push_back(scene::collider_frame(collider, time));
        }
        out.push_back(std::move(solid));
    }
    for (const scene::ToolDescription& tool : scene.tools) {
        if (!scene.display.tools || !tool.instrument) continue;
        const cutting::Blade blade = scene::make_blade(tool);
        std::vector<Isometry> frames;
        for (const double time : times) frames.push_back(blade.frame(time));
        for (scene::InstrumentPart& part : scene::instrument_parts(tool)) {
            const std::string name = tool.name + (part.is_grip ? "/grip" : "/blade");
            out.push_back({name, std::move(part.mesh), material_of_finish(name, part.finish), times, frames});
        }
    }
    return out;
}

}  // namespace splitcubes::app
