#include "scene_driver.h"

#include "vectors.h"

#include <splitcubes/core/error.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/instrument.h>
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

bool acts_at(const scene::Course::Interval& interval, double time) {
    return time >= interval.first && time < interval.second;
}

template <class Name>
bool is_there(const std::optional<Name>& id, const std::vector<Name>& present) {
    return id && std::find(present.begin(), present.end(), *id) != present.end();
}

// Samples of all bodies, as a course reads them.
class CourseSamples {
  public:
    CourseSamples(const Simulation& simulation, const std::vector<BodyId>& bodies, bool with_samples) {
        arrays_.resize(bodies.size());
        for (std::size_t k = 0; k < bodies.size(); ++k) {
            Arrays& own = arrays_[k];
            if (with_samples) {
                SampleState state = simulation.samples(bodies[k]);
                own = {vectors(state.rest_positions), vectors(state.positions), vectors(state.velocities),
                       std::move(state.masses), std::move(state.pieces)};
            }
            samples_.push_back({own.rest, own.position, own.velocity, own.mass, own.piece,
                                simulation.piece_count(bodies[k])});
        }
    }
    scene::Course::Bodies bodies() const { return samples_; }

  private:
    struct Arrays {
        std::vector<Vec3> rest, position, velocity;
        std::vector<double> mass;
        std::vector<std::int32_t> piece;
    };
    static std::vector<Vec3> vectors(const std::vector<Vector3>& of) {
        std::vector<Vec3> out;
        for (const Vector3& v : of) out.push_back(to_eigen(v));
        return out;
    }

    std::vector<Arrays> arrays_;
    std::vector<scene::BodySamples> samples_;
};

}  // namespace

void append_blades(const SceneSource& source, const scene::Course& course, double time,
                   std::vector<std::vector<Vec3>>& out) {
    for (std::size_t k = 0; k < source.blades.size(); ++k) {
        const auto [from, until] = course.tool_activity(k);
        if (time < from || time > until || !source.instruments[k]->empty()) continue;
        const Isometry frame = course.tool_frame(k, time);
        for (std::vector<Vec3> line : source.blades[k].shape().polylines) {
            for (Vec3& p : line) p = frame * p;
            out.push_back(std::move(line));
        }
    }
}

void append_instruments(const SceneSource& source, const scene::Course& course, double time,
                        std::vector<InstrumentState>& out) {
    for (std::size_t k = 0; k < source.blades.size(); ++k) {
        const auto [from, until] = course.tool_shown(k);
        if (source.instruments[k]->empty() || time < from || time > until) continue;
        out.push_back({source.instruments[k], course.tool_frame(k, time)});
    }
}

void append_colliders(const scene::SceneDescription& scene, const scene::Course& course,
                      const std::vector<std::shared_ptr<const geometry::TriangleMesh>>& meshes, double time,
                      std::vector<ColliderState>& out) {
    for (std::size_t k = 0; k < meshes.size(); ++k)
        if (!meshes[k]->triangles.empty())
            out.push_back({meshes[k], course.collider_frame(k, time), scene.colliders[k].finish});
}

SceneDriver::SceneDriver(const SceneSource& source, Simulation& simulation, const std::vector<BodyId>& bodies)
    : source_(source),
      bodies_(bodies),
      course_(source.description, CourseSamples(simulation, bodies, true).bodies()) {
    constraints_.resize(source.description.constraints.size());
    handles_.resize(source.description.handles.size());
    add_tools(simulation);
    add_colliders(simulation);
    add_solid_tools(simulation);
    for (const scene::HandleDescription& h : source.description.handles)
        handle_regions_.push_back(scene::region_test(h.region));
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
                              .pose = to_public(course_.tool_frame(k, simulation.time())),
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
    for (std::size_t k = 0; k < source_.description.colliders.size(); ++k) {
        const scene::ColliderDescription& c = source_.description.colliders[k];
        collider_meshes_.push_back(std::make_shared<const geometry::TriangleMesh>(scene::collider_mesh(c)));
        ColliderSettings settings{.name = c.name,
                                  .pose = to_public(course_.collider_frame(k, simulation.time())),
                                  .friction = c.friction};
        std::vector<double> positions;
        std::vector<std::uint32_t> triangles;
        if (c.half_space) {
            const Vec3 normal = c.half_space->normal.normalized();
            settings.shape = HalfSpaceShape{to_public(normal), normal.dot(c.half_space->point)};
        } else if (const auto* sphere = std::get_if<scene::SphereShape>(&*c.shape);
                   sphere && c.placement.scale == Vec3::Constant(c.placement.scale.x())) {
            settings.shape = SphereShape{c.placement.scale.x() * sphere->radius};
        } else if (const auto* box = std::get_if<scene::BoxShape>(&*c.shape)) {
            settings.shape = BoxShape{to_public(Vec3(c.placement.scale.cwiseProduct(box->size))),
                                      c.placement.scale.minCoeff() * c.rounding};
        } else {
            const geometry::TriangleMesh& mesh = *collider_meshes_.back();
            for (const Vec3& p : mesh.positions) positions.insert(positions.end(), p.data(), p.data() + 3);
            for (const auto& t : mesh.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
            settings.shape = MeshView{positions, triangles};
        }
        colliders_.push_back(simulation.add_collider(settings));
    }
}

void SceneDriver::add_solid_tools(Simulation& simulation) {
    for (std::size_t k = 0; k < source_.description.tools.size(); ++k) {
        const scene::ToolDescription& tool = source_.description.tools[k];
        if (!tool.solid) continue;
        const geometry::TriangleMesh mesh = scene::instrument_mesh(tool);
        std::vector<double> positions;
        std::vector<std::uint32_t> triangles;
        for (const Vec3& p : mesh.positions) positions.insert(positions.end(), p.data(), p.data() + 3);
        for (const auto& t : mesh.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
        ColliderSettings settings{.name = tool.name,
                                  .pose = to_public(course_.tool_frame(k, simulation.time())),
                                  .friction = tool.solid->friction};
        settings.shape = MeshView{positions, triangles};
        solid_tools_.emplace_back(k, simulation.add_collider(settings));
    }
}

void SceneDriver::advance_course(const Simulation& simulation) {
    if (!course_.depends_on_state()) return;
    const CourseSamples samples(simulation, bodies_, course_.reads_samples());
    course_.advance(simulation.time(), simulation.time_step(), samples.bodies());
    // States of the past have courses of their own.
    course_.forget_before(simulation.time() - simulation.time_step());
}

void SceneDriver::go_back(const Simulation& simulation) {
    if (!course_.depends_on_state()) return;
    const CourseSamples samples(simulation, bodies_, course_.reads_samples());
    course_.go_back(simulation.time(), simulation.time_step(), samples.bodies());
}

void SceneDriver::advance(Simulation& simulation) {
    advance_course(simulation);
    const double from = simulation.time(), to = from + simulation.time_step();
    move_tools(simulation, from, to);
    move_constraints(simulation, from, to);
    move_handles(simulation, from, to);
    for (const auto& [tool, collider] : solid_tools_)
        simulation.add_collider_pose(collider, to, to_public(course_.tool_frame(tool, to)));
    for (std::size_t k = 0; k < colliders_.size(); ++k)
        if (!source_.description.colliders[k].keyframes.empty() || course_.decides_collider(k))
            simulation.add_collider_pose(colliders_[k], to, to_public(course_.collider_frame(k, to)));
}

// Activity begins and ends with whole steps.
void SceneDriver::move_tools(Simulation& simulation, double from, double to) {
    for (std::size_t k = 0; k < tools_.size(); ++k) {
        const auto [active_from, active_until] = course_.tool_activity(k);
        if (from > active_until + 2 * (to - from) && !course_.decides_tool(k)) continue;
        const std::vector<double> times = course_.tool_times(k, from, to);
        const bool cuts = to > active_from && from < active_until;
        for (const ToolId tool : tools_[k]) {
            for (const double t : times)
                simulation.add_tool_pose(tool, t, to_public(course_.tool_frame(k, t)));
            cuts ? simulation.lower_tool(tool) : simulation.raise_tool(tool);
        }
    }
}

void SceneDriver::move_constraints(Simulation& simulation, double from, double to) {
    const std::vector<ConstraintId> present = simulation.constraints();
    for (std::size_t k = 0; k < constraints_.size(); ++k) {
        const scene::ConstraintDescription& c = source_.description.constraints[k];
        const bool there = is_there(constraints_[k], present);
        const bool acts = acts_at(course_.constraint_activity(k), from);
        if (acts && !there)
            constraints_[k] = simulation.add_constraint(
                body_of(c.body),
                {.region = region_of(c.region), .pose = to_public(course_.constraint_motion(k, from))});
        if (!acts && there) simulation.remove_constraint(*constraints_[k]);
        if (acts && (c.kind == scene::ConstraintKind::move || c.relative_to))
            simulation.add_constraint_pose(*constraints_[k], to, to_public(course_.constraint_motion(k, to)));
    }
}

void SceneDriver::move_handles(Simulation& simulation, double from, double to) {
    const std::vector<HandleId> present = simulation.handles();
    for (std::size_t k = 0; k < handles_.size(); ++k) {
        const scene::HandleDescription& h = source_.description.handles[k];
        const bool there = is_there(handles_[k], present);
        const bool acts = acts_at(course_.handle_activity(k), from);
        if (acts && !there) {
            HandleSettings settings{.name = h.name,
                                    .region = region_of(h.region),
                                    .pose = to_public(course_.handle_motion(k, from)),
                                    .stiffness = h.stiffness};
            if (h.force_limit) settings.force_limit = *h.force_limit;
            handles_[k] = simulation.add_handle(body_of(h.body), settings);
        }
        if (!acts && there) simulation.remove_handle(*handles_[k]);
        if (acts && (!h.keyframes.empty() || h.relative_to))
            simulation.add_handle_pose(*handles_[k], to, to_public(course_.handle_motion(k, to)));
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

void SceneDriver::append_rods(double time, const std::vector<BodyState>& states,
                              std::vector<RodState>& out) const {
    const scene::SceneDescription& scene = source_.description;
    for (std::size_t k = 0; k < scene.handles.size() && scene.display.handles; ++k) {
        const scene::HandleDescription& h = scene.handles[k];
        if (!acts_at(course_.handle_activity(k), time)) continue;
        for (std::size_t b = 0; b < states.size(); ++b) {
            if (scene.bodies[b].name != h.body) continue;
            const SurfaceTopology& topology = *states[b].topology;
            Vec3 now = Vec3::Zero(), rest = Vec3::Zero();
            double count = 0;
            for (std::size_t v = 0; v < topology.pieces.size(); ++v) {
                if (topology.pieces[v] < 0) continue;
                const Vec3 own = Eigen::Map<const Vec3f>(topology.rest.data() + 3 * v).cast<double>();
                if (!handle_regions_[k](own)) continue;
                rest += own;
                now += Eigen::Map<const Vec3f>(states[b].positions.data() + 3 * v).cast<double>();
                ++count;
            }
            if (count == 0) continue;
            out.push_back({now / count, course_.handle_motion(k, time) * Vec3(rest / count),
                           0.022 * states[b].bounds.size().norm()});
        }
    }
}

void SceneDriver::append_forces(const StepResult& result, double time, std::vector<ForceState>& out) const {
    for (const ToolResult& tool : result.tools) {
        const Vec3 force = to_eigen(tool.force);
        if (!(force.norm() > 0)) continue;
        for (std::size_t k = 0; k < tools_.size(); ++k)
            for (std::size_t edge = 0; edge < tools_[k].size(); ++edge) {
                if (!(tools_[k][edge] == tool.tool)) continue;
                const std::vector<Vec3>& line = source_.blades[k].shape().polylines[edge];
                out.push_back(
                    {course_.tool_frame(k, time) * Vec3(0.5 * (line.front() + line.back())), force});
            }
    }
    for (const HandleResult& handle : result.handles)
        for (std::size_t k = 0; k < handles_.size(); ++k) {
            const Vec3 force = to_eigen(handle.force);
            if (!handles_[k] || !(*handles_[k] == handle.handle) || !(force.norm() > 0)) continue;
            const auto* ball = std::get_if<scene::SphereRegion>(&source_.description.handles[k].region);
            const Vec3 rest = ball != nullptr ? ball->center : source_.description.handles[k].pivot;
            out.push_back({course_.handle_motion(k, time) * rest, force});
        }
}

}  // namespace splitcubes::view
