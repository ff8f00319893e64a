// The parts of a body that contact search sees.
#include <splitcubes/body/body.h>
#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/node_motion/node_motion.h>

namespace splitcubes::body {

BodyView Body::view() {
    return {grid_,
            *surface_,
            *pieces_,
            occluders_.grid(),
            occluders_.changes(),
            sampler_,
            surface_motion_,
            motion_->tracker(),
            samples_.phyxels,
            samples_.locator,
            samples_.spacing,
            is_lattice_driven(),
            boundary_.kinematic_rigid_pieces(),
            !handles().empty()};
}

std::vector<BodyView> views_of(std::span<const std::unique_ptr<Body>> bodies) {
    std::vector<BodyView> views;
    views.reserve(bodies.size());
    for (const auto& body : bodies) views.push_back(body->view());
    return views;
}

}  // namespace splitcubes::body
