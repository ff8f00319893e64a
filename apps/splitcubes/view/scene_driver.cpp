#include "scene_driver.h"

#include "vectors.h"

#include <splitcubes/core/error.h>
#include <splitcubes/cutting/sweep.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/strength.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::view {

namespace {

// Boxes where they can be: a saved file holds no functions.
std::optional<Region> box_of(const scene::HalfSpaceRegion& half) {
    constexpr double far = 1e6;  // m
    const Vec3 normal = half.normal.normalized();
    for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(normal[axis]) < 1 - 1e-12) continue;
        Vec3 low = Vec3::Constant(-far), high = Vec3::Constant(far);
        (normal[axis] > 0 ? low : high)[axis] = half.point[axis];
        return BoxRegion{to_public(low), to_public(high)};
    }
    return std::nullopt;
}

Region region_of(const scene::Region& region) {
    if (const auto* box = std::get_if<scene::BoxRegion>(&region))
        return BoxRegion{to_public(box->min), to_public(box->max)};
    if (const auto* sphere = std::get_if<scene::SphereRegion>(&region))
        return SphereRegion{to_public(sphere->center), sphere->radius};
    if (const auto* half = std::get_if<scene::HalfSpaceRegion>(&region))
        if (const std::optional<Region> box = box_of(*half)) return *box;
    return RegionTest(
        [inside = scene::region_test(region)](const Vector3& rest) { return inside(to_eigen(rest)); });
}

Isometry constraint_pose(const scene::ConstraintDescription& c, double time) {
    return c.kind == scene::ConstraintKind::hold ? Isometry::Identity()
                                                 : scene::keyframe_motion(c.keyframes, c.pivot, time);
}

template <class Description>
bool is_active(const Description& d, double time) {
    return time >= d.from_time && (!d.until_time || time < *d.until_time);
}

template <class Name>
bool is_there(const std::optional<Name>& id, const std::vector<Name>& present) {
    return id && std::find(present.begin(), present.end(), *id) != present.end();
}

}  // namespace

SceneDriver::SceneDriver(const SceneSource& source, Simulation& simulation, const std::vector<BodyId>& bodies)
    : source_(source), bodies_(bodies) {
    constraints_.resize(source.description.constraints.size());
    handles_.resize(source.description.handles.size());
    add_tools(simulation);
    add_colliders(simulation);
}

BodyId SceneDriver::body_of(const std::string& name) const {
    for (std::size_t k = 0; k < bodies_.size(); ++k)
        if (source_.description.bodies[k].name == name) return bodies_[k];
    throw InputError("scene", "there is no body '" + name + "'");
}

void SceneDriver::add_tools(Simulation& simulation) {
    for (std::size_t k = 0; k < source_.blades.size(); ++k) {
        const scene::ToolDescription& tool = source_.description.tools[k];
        ToolSettings settings{.name = tool.name,
                              .pose = to_public(source_.blades[k].frame(simulation.time())),
                              .side_reach = tool.side,
                              .side_friction = tool.friction};
        for (const std::string& name : tool.bodies) settings.bodies.push_back(body_of(name));
        tools_.emplace_back();
        for (const std::vector<Vec3>& line : source_.blades[k].shape().polylines) {
            std::vector<Vector3> points;
            for (const Vec3& p : line) points.push_back(to_public(p));
            tools_.back().push_back(simulation.add_tool({points}, settings));
        }
    }
}

void SceneDriver::add_colliders(Simulation& simulation) {
    for (const scene::ColliderDescription& c : source_.description.colliders) {
        collider_meshes_.push_back(std::make_shared<const geometry::TriangleMesh>(scene::collider_mesh(c)));
        ColliderSettings settings{.name = c.name,
                                  .pose = to_public(scene::collider_frame(c, simulation.time())),
                                  .friction = c.friction};
        std::vector<double> positions;
        std::vector<std::uint32_t> triangles;
        if (c.half_space) {
            const Vec3 normal = c.half_space->normal.normalized();
            settings.shape = HalfSpaceShape{to_public(normal), normal.dot(c.half_space->point)};
        } else if (const auto* sphere = std::get_if<scene::SphereShape>(&*c.shape)) {
            settings.shape = SphereShape{c.placement.scale * sphere->radius};
        } else if (const auto* box = std::get_if<scene::BoxShape>(&*c.shape)) {
            settings.shape =
                BoxShape{to_public(Vec3(c.placement.scale * box->size)), c.placement.scale * c.rounding};
        } else {
            const geometry::TriangleMesh& mesh = *collider_meshes_.back();
            for (const Vec3& p : mesh.positions) positions.insert(positions.end(), p.data(), p.data() + 3);
            for (const auto& t : mesh.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
            settings.shape = MeshView{positions, triangles};
        }
        colliders_.push_back(simulation.add_collider(settings));
    }
}

void SceneDriver::advance(Simulation& simulation) {
    const double from = simulation.time(), to = from + simulation.time_step();
    move_tools(simulation, from, to);
    move_constraints(simulation, from, to);
    move_handles(simulation, from, to);
    for (std::size_t k = 0; k < colliders_.size(); ++k)
        if (!source_.description.colliders[k].keyframes.empty())
            simulation.add_collider_pose(
                colliders_[k], to, to_public(scene::collider_frame(source_.description.colliders[k], to)));
}

// Activity begins and ends with whole steps.
void SceneDriver::move_tools(Simulation& simulation, double from, double to) {
    for (std::size_t k = 0; k < tools_.size(); ++k) {
        const cutting::Blade& blade = source_.blades[k];
        if (from > blade.active_until() + 2 * (to - from)) continue;
        std::vector<double> times = cutting::sweep_times(blade, from, to);
        std::erase_if(times, [&](double t) { return !(t > from) || t >= to; });
        times.push_back(to);
        const bool cuts = to > blade.active_from() && from < blade.active_until();
        for (const ToolId tool : tools_[k]) {
            for (const double t : times) simulation.add_tool_pose(tool, t, to_public(blade.frame(t)));
            cuts ? simulation.lower_tool(tool) : simulation.raise_tool(tool);
        }
    }
}

void SceneDriver::move_constraints(Simulation& simulation, double from, double to) {
    const std::vector<ConstraintId> present = simulation.constraints();
    for (std::size_t k = 0; k < constraints_.size(); ++k) {
        const scene::ConstraintDescription& c = source_.description.constraints[k];
        const bool there = is_there(constraints_[k], present);
        if (is_active(c, from) && !there)
            constraints_[k] = simulation.add_constraint(
                body_of(c.body),
                {.region = region_of(c.region), .pose = to_public(constraint_pose(c, from))});
        if (!is_active(c, from) && there) simulation.remove_constraint(*constraints_[k]);
        if (is_active(c, from) && c.kind == scene::ConstraintKind::move)
            simulation.add_constraint_pose(*constraints_[k], to, to_public(constraint_pose(c, to)));
    }
}

void SceneDriver::move_handles(Simulation& simulation, double from, double to) {
    const std::vector<HandleId> present = simulation.handles();
    for (std::size_t k = 0; k < handles_.size(); ++k) {
        const scene::HandleDescription& h = source_.description.handles[k];
        const bool there = is_there(handles_[k], present);
        if (is_active(h, from) && !there) {
            HandleSettings settings{.name = h.name,
                                    .region = region_of(h.region),
                                    .pose = to_public(scene::keyframe_motion(h.keyframes, h.pivot, from)),
                                    .stiffness = h.stiffness};
            if (h.force_limit) settings.force_limit = *h.force_limit;
            handles_[k] = simulation.add_handle(body_of(h.body), settings);
        }
        if (!is_active(h, from) && there) simulation.remove_handle(*handles_[k]);
        if (is_active(h, from) && !h.keyframes.empty())
            simulation.add_handle_pose(*handles_[k], to,
                                       to_public(scene::keyframe_motion(h.keyframes, h.pivot, to)));
    }
}

bool SceneDriver::owns(ToolId tool) const {
    return std::any_of(tools_.begin(), tools_.end(), [&](const std::vector<ToolId>& edges) {
        return std::find(edges.begin(), edges.end(), tool) != edges.end();
    });
}

bool SceneDriver::owns(HandleId handle) const {
    return std::find(handles_.begin(), handles_.end(), std::optional(handle)) != handles_.end();
}

void SceneDriver::append_blades(double time, std::vector<std::vector<Vec3>>& out) const {
    for (const cutting::Blade& blade : source_.blades) {
        if (!blade.active(time)) continue;
        for (std::vector<Vec3>& line : blade.pose(time)) out.push_back(std::move(line));
    }
}

void SceneDriver::append_colliders(double time, std::vector<ColliderState>& out) const {
    for (std::size_t k = 0; k < collider_meshes_.size(); ++k)
        if (!collider_meshes_[k]->triangles.empty())
            out.push_back(
                {collider_meshes_[k], scene::collider_frame(source_.description.colliders[k], time)});
}

}  // namespace splitcubes::view
