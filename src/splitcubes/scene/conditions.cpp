#include <splitcubes/body/body.h>
#include <splitcubes/scene/conditions.h>
#include <splitcubes/world/world.h>

#include <map>
#include <string_view>

namespace splitcubes::scene {

void release_by_conditions(const SceneDescription& scene, body::World& world) {
    const auto body_of = [&](std::string_view name) -> body::Body& {
        std::size_t k = 0;
        while (scene.bodies[k].name != name) ++k;
        return *world.bodies()[k];
    };
    const auto holds = [&](const std::optional<PieceCondition>& when) {
        return when && body_of(when->body).pieces().count() >= static_cast<std::size_t>(when->at_least);
    };
    // Bodies number their own constraints and handles in the order of the scene.
    std::map<std::string_view, std::size_t> constraints, handles;
    for (const ConstraintDescription& c : scene.constraints) {
        const std::size_t index = constraints[c.body]++;
        if (holds(c.release_when)) body_of(c.body).end_constraint(index, world.time());
    }
    for (const HandleDescription& h : scene.handles) {
        const std::size_t index = handles[h.body]++;
        if (holds(h.release_when)) body_of(h.body).end_handle(index, world.time());
    }
}

}  // namespace splitcubes::scene
