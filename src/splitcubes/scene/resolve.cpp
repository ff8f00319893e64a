#include <splitcubes/scene/inputs.h>
#include <splitcubes/scene/overloaded.h>
#include <splitcubes/scene/read_scene.h>
#include <splitcubes/scene/resolve.h>

#include <nlohmann/json.hpp>

namespace splitcubes::scene {

namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Vec3& v) {
    return Json::array({v.x(), v.y(), v.z()});
}

template <class T>
Json or_null(const std::optional<T>& value) {
    return value ? Json(*value) : Json();
}

template <class Enumeration>
std::string name_of(Enumeration value, const std::vector<std::string_view>& names) {
    return std::string(names.at(static_cast<std::size_t>(value)));
}

Json to_json(const Rotation& rotation) {
    return {{"axis", to_json(rotation.axis)}, {"angle_degrees", rotation.angle_degrees}};
}

// One number where all axes have the same.
Json scale_of(const PlacementDescription& placement) {
    const Vec3& scale = placement.scale;
    return scale == Vec3::Constant(scale.x()) ? Json(scale.x()) : to_json(scale);
}

Json to_json(const Vec3i& v) {
    return Json::array({v.x(), v.y(), v.z()});
}

Json to_json(const ImplicitPart& part) {
    Json out;
    if (const auto* ball = std::get_if<BallPart>(&part.form)) {
        out["ball"] = {{"center", to_json(ball->center)},
                       {"radii", to_json(ball->radii)},
                       {"colour", to_json(part.colour)}};
    } else {
        const auto& cone = std::get<ConePart>(part.form);
        out["cone"] = {{"from", to_json(cone.from)},
                       {"to", to_json(cone.to)},
                       {"from_radius", cone.from_radius},
                       {"to_radius", cone.to_radius},
                       {"colour", to_json(part.colour)}};
    }
    return out;
}

Json to_json(const DeformationDescription& deformation) {
    if (std::holds_alternative<MassSpringDescription>(deformation)) return {{"mass_spring", Json::object()}};
    const auto& form = std::get<FreeFormDescription>(deformation);
    Json keyframes = Json::array();
    for (const LatticeKeyframeDescription& key : form.keyframes) {
        Json points = Json::array();
        for (const LatticePoint& point : key.points)
            points.push_back(
                {{"index", to_json(point.index)}, {"displacement", to_json(point.displacement)}});
        keyframes.push_back({{"time", key.time}, {"points", points}});
    }
    return {{"free_form", {{"degree", to_json(form.degree)}, {"keyframes", keyframes}}}};
}

Json to_json(const Shape& shape) {
    return std::visit(
        Overloaded{
            [](const MeshShape& s) -> Json {
                Json out = {{"file", s.file.string()}};
                if (!s.sha256.empty()) out["sha256"] = s.sha256;
                return {{"mesh", out}};
            },
            [](const BoxShape& s) -> Json {
                return {{"box", {{"size", to_json(s.size)}}}};
            },
            [](const SphereShape& s) -> Json {
                return {{"sphere", {{"radius", s.radius}}}};
            },
            [](const CylinderShape& s) -> Json {
                return {{"cylinder", {{"radius", s.radius}, {"height", s.height}}}};
            },
            [](const TorusShape& s) -> Json {
                return {{"torus", {{"ring_radius", s.ring_radius}, {"tube_radius", s.tube_radius}}}};
            },
            [](const CapsuleShape& s) -> Json {
                return {{"capsule", {{"radius", s.radius}, {"straight_height", s.straight_height}}}};
            },
            [](const PearShape& s) -> Json {
                return {{"pear", {{"height", s.height}, {"foot", s.foot}}}};
            },
            [](const ImplicitShape& s) -> Json {
                Json parts = Json::array();
                for (const ImplicitPart& part : s.parts) parts.push_back(to_json(part));
                return {{"implicit", {{"smoothness", s.smoothness}, {"cells", s.cells}, {"parts", parts}}}};
            },
        },
        shape);
}

Json to_json(const Region& region) {
    return std::visit(
        Overloaded{
            [](const BoxRegion& r) -> Json {
                return {{"box", {{"min", to_json(r.min)}, {"max", to_json(r.max)}}}};
            },
            [](const SphereRegion& r) -> Json {
                return {{"sphere", {{"center", to_json(r.center)}, {"radius", r.radius}}}};
            },
            [](const HalfSpaceRegion& r) -> Json {
                return {{"half_space", {{"point", to_json(r.point)}, {"normal", to_json(r.normal)}}}};
            },
            [](const CylinderRegion& r) -> Json {
                return {
                    {"cylinder", {{"from", to_json(r.from)}, {"to", to_json(r.to)}, {"radius", r.radius}}}};
            },
            [](const SlabRegion& r) -> Json {
                return {{"slab",
                         {{"point", to_json(r.point)},
                          {"normal", to_json(r.normal)},
                          {"thickness", r.thickness}}}};
            },
        },
        region);
}

Json to_json(const StrengthLayer& layer) {
    if (const auto* patch = std::get_if<StrengthPatch>(&layer))
        return {{"patch", {{"region", to_json(patch->region)}, {"factor", patch->factor}}}};
    const auto& paint = std::get<StrengthPaint>(layer);
    Json out = {{"dark", paint.dark}, {"light", paint.light}};
    if (!paint.picture.empty()) out["picture"] = paint.picture.string();
    if (!paint.picture_sha256.empty()) out["picture_sha256"] = paint.picture_sha256;
    return {{"paint", out}};
}

Json to_json(const TearingDescription& tearing) {
    Json map = Json::array();
    for (const StrengthLayer& layer : tearing.strength_map) map.push_back(to_json(layer));
    return {{"strength", tearing.strength},
            {"propagation_ratio", tearing.propagation_ratio},
            {"crack_speed", or_null(tearing.crack_speed)},
            {"strength_map", map}};
}

Json to_json(const MaterialDescription& material) {
    Json plasticity;
    if (material.plasticity) {
        plasticity = {{"yield", material.plasticity->yield},
                      {"creep", or_null(material.plasticity->creep)},
                      {"maximum", material.plasticity->maximum}};
    }
    return {{"model", name_of(material.model, material_model_names)},
            {"density", material.density},
            {"youngs_modulus", material.youngs_modulus},
            {"poisson_ratio", material.poisson_ratio},
            {"volume_stiffness", material.volume_stiffness},
            {"mass_damping", material.mass_damping},
            {"stiffness_damping", material.stiffness_damping},
            {"zero_energy", material.zero_energy},
            {"plasticity", plasticity},
            {"tearing", material.tearing ? to_json(*material.tearing) : Json()},
            {"cutting_resistance", material.cutting_resistance}};
}

Json to_json(const geometry::Finish& finish) {
    Json layers = Json::array(), bands = Json::array(), speckles = Json::array();
    for (const auto& layer : finish.layers)
        layers.push_back({{"depth", layer.depth}, {"colour", to_json(layer.colour)}});
    for (const auto& stripe : finish.stripes)
        bands.push_back({{"from", stripe.from}, {"colour", to_json(stripe.colour)}});
    for (const auto& one : finish.speckles)
        speckles.push_back({{"size", one.size}, {"share", one.share}, {"colour", to_json(one.colour)}});
    return {{"colour", to_json(finish.colour)},
            {"roughness", finish.roughness},
            {"metalness", finish.metalness},
            {"layers", layers},
            {"stripes", {{"axis", to_json(finish.stripe_axis)}, {"bands", bands}}},
            {"speckles", speckles}};
}

Json to_json(const std::optional<geometry::Finish>& finish) {
    return finish ? to_json(*finish) : Json();
}

Json to_json(const std::optional<Condition>& condition) {
    if (!condition) return {};
    Json out = Json::object();
    if (!condition->body.empty()) {
        out["body"] = condition->body;
        out["at_least"] = condition->at_least;
    }
    if (!condition->ended.empty()) out["ended"] = condition->ended;
    if (condition->time) out["time"] = *condition->time;
    return out;
}

Json to_json(const std::optional<Carrier>& carrier) {
    if (!carrier) return {};
    Json out = {{name_of(carrier->kind, carrier_names), carrier->name}};
    if (carrier->region) out["region"] = to_json(*carrier->region);
    return out;
}

Json to_json(const BodyDescription& body) {
    Json out;
    out["name"] = body.name;
    out["shape"] = to_json(body.shape);
    out["placement"] = {{"position", to_json(body.placement.position)},
                        {"rotation", to_json(body.placement.rotation)},
                        {"scale", scale_of(body.placement)}};
    out[body.cell_size ? "cell_size" : "cells"] =
        body.cell_size ? Json(*body.cell_size) : or_null(body.cells);
    out[body.phyxel_spacing ? "phyxel_spacing" : "phyxel_count"] =
        body.phyxel_spacing ? Json(*body.phyxel_spacing) : or_null(body.phyxel_count);
    out["material"] = to_json(body.material);
    out["deformation"] = body.deformation ? to_json(*body.deformation) : Json();
    out["appearance"] = body.appearance.empty() ? Json()
                                                : Json{{"surface", to_json(body.appearance.surface)},
                                                       {"cut", to_json(body.appearance.cut)}};
    out["velocity"] = to_json(body.velocity);
    out["angular_velocity"] = to_json(body.angular_velocity);
    return out;
}

Json to_json(const std::vector<MotionKeyframe>& keyframes) {
    Json out = Json::array();
    for (const MotionKeyframe& keyframe : keyframes) {
        out.push_back({{"time", keyframe.time},
                       {"position", to_json(keyframe.position)},
                       {"rotation", to_json(keyframe.rotation)}});
    }
    return out;
}

Json to_json(const ConstraintDescription& constraint) {
    Json out;
    out["body"] = constraint.body;
    out["region"] = to_json(constraint.region);
    out["kind"] = name_of(constraint.kind, constraint_kind_names);
    if (constraint.kind == ConstraintKind::move) out["keyframes"] = to_json(constraint.keyframes);
    out["pivot"] = to_json(constraint.pivot);
    out["from_time"] = constraint.from_time;
    out["until_time"] = or_null(constraint.until_time);
    out["start_when"] = to_json(constraint.start_when);
    out["release_when"] = to_json(constraint.release_when);
    out["relative_to"] = to_json(constraint.relative_to);
    return out;
}

Json to_json(const BladeDescription& blade) {
    return std::visit(Overloaded{
                          [](const PolylineBlade& b) -> Json {
                              Json points = Json::array();
                              for (const Vec3& point : b.points) points.push_back(to_json(point));
                              return {{"polyline", {{"points", points}}}};
                          },
                          [](const StraightBlade& b) -> Json {
                              return {{"straight", {{"from", to_json(b.from)}, {"to", to_json(b.to)}}}};
                          },
                          [](const ArcBlade& b) -> Json {
                              return {{"arc",
                                       {{"center", to_json(b.center)},
                                        {"radius", b.radius},
                                        {"axis", to_json(b.axis)},
                                        {"start_angle_degrees", b.start_angle_degrees},
                                        {"end_angle_degrees", b.end_angle_degrees},
                                        {"segments", b.segments}}}};
                          },
                      },
                      blade);
}

Json to_json(const CircularMotion& m) {
    return {{"center", to_json(m.center)},
            {"axis", to_json(m.axis)},
            {"radius", m.radius},
            {"start_angle_degrees", m.start_angle_degrees},
            {"turns", m.turns},
            {"from_time", m.from_time},
            {"until_time", m.until_time},
            {"turn_with_path", m.turn_with_path}};
}

Json to_json(const SimpleMotion& motion) {
    return std::visit(Overloaded{
                          [](const KeyframeMotion& m) -> Json {
                              return {{"path",
                                       {{"keyframes", to_json(m.keyframes)},
                                        {"interpolation", name_of(m.interpolation, interpolation_names)}}}};
                          },
                          [](const CircularMotion& m) -> Json {
                              return {{"circular", to_json(m)}};
                          },
                          [](const HelixMotion& m) -> Json {
                              Json out = to_json(m.circle);
                              out["rise"] = m.rise;
                              out["end_radius"] = or_null(m.end_radius);
                              return {{"helix", out}};
                          },
                      },
                      motion);
}

Json to_json(const Motion& motion) {
    return std::visit(Overloaded{[](const ComposedMotion& m) -> Json {
                                     Json parts = Json::array();
                                     for (const SimpleMotion& part : m.parts) parts.push_back(to_json(part));
                                     return {{"composed", {{"parts", parts}}}};
                                 },
                                 [](const auto& m) -> Json { return to_json(SimpleMotion(m)); }},
                      motion);
}

Json to_json(const PlacementDescription& placement) {
    return {{"position", to_json(placement.position)},
            {"rotation", to_json(placement.rotation)},
            {"scale", scale_of(placement)}};
}

Json to_json(const InstrumentDescription& instrument) {
    return std::visit(
        Overloaded{[](const BladeInstrument& i) -> Json {
                       constexpr const char* names[] = {"knife", "scalpel", "scissors"};
                       return {{names[static_cast<std::size_t>(i.kind)],
                                {{"height", or_null(i.height)},
                                 {"thickness", or_null(i.thickness)},
                                 {"handle", or_null(i.handle)},
                                 {"grip", i.grip ? Json(name_of(*i.grip, grip_names)) : Json()},
                                 {"back", i.back ? to_json(*i.back) : Json()}}}};
                   },
                   [](const WireInstrument& i) -> Json {
                       return {{"wire", {{"radius", or_null(i.radius)}, {"grips", i.grips}}}};
                   },
                   [](const SpoonInstrument& i) -> Json {
                       return {{"spoon",
                                {{"depth", or_null(i.depth)},
                                 {"thickness", or_null(i.thickness)},
                                 {"handle", or_null(i.handle)},
                                 {"back", i.back ? to_json(*i.back) : Json()}}}};
                   },
                   [](const MeshInstrument& i) -> Json {
                       Json out = {{"file", i.mesh.file.string()}, {"placement", to_json(i.placement)}};
                       if (!i.mesh.sha256.empty()) out["sha256"] = i.mesh.sha256;
                       return {{"mesh", out}};
                   }},
        instrument);
}

Json to_json(const ToolDescription& tool) {
    Json out;
    out["name"] = tool.name;
    out["blades"] = Json::array();
    for (const BladeDescription& blade : tool.blades) out["blades"].push_back(to_json(blade));
    out["motion"] = to_json(tool.motion);
    out["bodies"] = tool.bodies;
    out["active_from"] = tool.active_from;
    out["active_until"] = tool.active_until;
    out["side"] = tool.side;
    out["friction"] = tool.friction;
    out["instrument"] = tool.instrument ? to_json(*tool.instrument) : Json();
    out["finish"] = to_json(tool.finish);
    out["grip_finish"] = to_json(tool.grip_finish);
    out["solid"] = tool.solid ? Json{{"friction", tool.solid->friction}} : Json();
    out["relative_to"] = to_json(tool.relative_to);
    out["start_when"] = to_json(tool.start_when);
    out["end_when"] = to_json(tool.end_when);
    out["shown_from"] = or_null(tool.shown_from);
    out["shown_until"] = or_null(tool.shown_until);
    return out;
}

Json to_json(const ColliderDescription& collider) {
    Json out;
    out["name"] = collider.name;
    if (collider.half_space) {
        out["half_space"] = {{"point", to_json(collider.half_space->point)},
                             {"normal", to_json(collider.half_space->normal)}};
    } else {
        out["shape"] = to_json(*collider.shape);
        out["placement"] = to_json(collider.placement);
    }
    out["rounding"] = collider.rounding;
    if (!collider.keyframes.empty()) out["keyframes"] = to_json(collider.keyframes);
    out["pivot"] = to_json(collider.pivot);
    out["friction"] = collider.friction;
    out["relative_to"] = to_json(collider.relative_to);
    out["start_when"] = to_json(collider.start_when);
    out["end_when"] = to_json(collider.end_when);
    out["finish"] = to_json(collider.finish);
    return out;
}

Json to_json(const HandleDescription& handle) {
    Json out;
    out["name"] = handle.name;
    out["body"] = handle.body;
    out["region"] = to_json(handle.region);
    if (!handle.keyframes.empty()) out["keyframes"] = to_json(handle.keyframes);
    out["pivot"] = to_json(handle.pivot);
    out["stiffness"] = handle.stiffness;
    out["force_limit"] = or_null(handle.force_limit);
    out["from_time"] = handle.from_time;
    out["until_time"] = or_null(handle.until_time);
    out["start_when"] = to_json(handle.start_when);
    out["release_when"] = to_json(handle.release_when);
    out["relative_to"] = to_json(handle.relative_to);
    return out;
}

Json to_json(const CameraDescription& camera) {
    Json out;
    out["eye"] = camera.eye ? to_json(*camera.eye) : Json();
    out["target"] = camera.target ? to_json(*camera.target) : Json();
    out["direction"] = to_json(camera.direction);
    out["up"] = to_json(camera.up);
    out["vertical_fov_degrees"] = camera.vertical_fov_degrees;
    out["width"] = camera.width;
    out["height"] = camera.height;
    return out;
}

template <class T>
Json array_of(const std::vector<T>& elements) {
    Json out = Json::array();
    for (const T& element : elements) out.push_back(to_json(element));
    return out;
}

}  // namespace

nlohmann::ordered_json resolved_scene(const SceneDescription& scene) {
    Json out;
    out["name"] = scene.name;
    out["time_step"] = scene.time_step;
    out["frames"] = scene.frames;
    out["threads"] = scene.threads;
    out["gravity"] = to_json(scene.gravity);
    out["ground"] = Json();
    if (scene.ground) {
        out["ground"] = {{"height", scene.ground->height}, {"friction", scene.ground->friction}};
    }
    out["colliders"] = array_of(scene.colliders);
    out["contact"] = {{"pieces", scene.contact.pieces},
                      {"friction", scene.contact.friction},
                      {"restitution", or_null(scene.contact.restitution)}};
    out["bodies"] = array_of(scene.bodies);
    out["constraints"] = array_of(scene.constraints);
    out["handles"] = array_of(scene.handles);
    out["tools"] = array_of(scene.tools);
    out["solver"] = {{"kind", name_of(scene.solver.kind, solver_kind_names)},
                     {"integrator", name_of(scene.solver.integrator, integrator_names)},
                     {"tolerance", scene.solver.tolerance},
                     {"max_iterations", scene.solver.max_iterations}};
    out["occlusion"] = {{"backend", scene.occlusion.backend},
                        {"criterion", name_of(scene.occlusion.criterion, occlusion_criterion_names)},
                        {"disk_size", scene.occlusion.disk_size}};
    out["output"] = {{"every_nth_frame", scene.output.every_nth_frame},
                     {"format", name_of(scene.output.format, surface_format_names)},
                     {"pictures", scene.output.pictures},
                     {"links", scene.output.links}};
    out["camera"] = to_json(scene.camera);
    out["display"] = {
        {"tools", scene.display.tools}, {"handles", scene.display.handles}, {"held", scene.display.held}};
    return out;
}

nlohmann::ordered_json resolved_scene(SceneDescription scene, const std::filesystem::path& folder) {
    const std::filesystem::path base = std::filesystem::absolute(folder).lexically_normal();
    for (const Input& input : inputs_of(scene)) *input.file = input.file->lexically_relative(base);
    return resolved_scene(scene);
}

}  // namespace splitcubes::scene
