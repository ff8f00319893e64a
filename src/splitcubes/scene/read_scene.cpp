#include <splitcubes/scene/motion.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/read_scene.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace splitcubes::scene {

namespace {

constexpr int max_frames = 1000000;

// Refuses a name that an earlier element of the array has.
void check_new_name(const Value& element, std::string_view kind, const std::string& name,
                    std::set<std::string>& names) {
    if (!name.empty() && !names.insert(name).second)
        Object(element, kind)
            .at("name")
            .fail("is \"" + name + "\", a name given before", "give each its own name");
}

SolverDescription read_solver(const Value& value) {
    const Object object(value, "solver");
    SolverDescription out;
    if (object.has("kind")) out.kind = static_cast<SolverKind>(object.at("kind").choice(solver_kind_names));
    if (object.has("integrator")) {
        out.integrator = static_cast<Integrator>(object.at("integrator").choice(integrator_names));
    }
    object.read("tolerance", out.tolerance, {0, 1, true, true});
    object.read("max_iterations", out.max_iterations, 1, 100000);
    return out;
}

OcclusionDescription read_occlusion(const Value& value) {
    const Object object(value, "occlusion");
    OcclusionDescription out;
    if (object.has("backend")) {
        out.backend = occlusion_backend_names[object.at("backend").choice(occlusion_backend_names)];
    }
    if (object.has("criterion")) {
        out.criterion =
            static_cast<occlusion::CriterionKind>(object.at("criterion").choice(occlusion_criterion_names));
    }
    object.read("disk_size", out.disk_size, 8, 32);
    if (object.sound({"disk_size"}) && out.disk_size != 8 && out.disk_size != 16 && out.disk_size != 32) {
        object.at("disk_size").fail("is " + object.at("disk_size").shown(), "give 8, 16 or 32");
    }
    return out;
}

OutputDescription read_output(const Value& value) {
    const Object object(value, "output");
    OutputDescription out;
    object.read("every_nth_frame", out.every_nth_frame, 1, max_frames);
    if (object.has("format")) {
        out.format = static_cast<SurfaceFormat>(object.at("format").choice(surface_format_names));
    }
    object.read("pictures", out.pictures);
    object.read("links", out.links);
    return out;
}

void read_side(const Object& object, std::string_view key, int& out) {
    object.read(key, out, 16, 8192);
    if (object.sound({key}) && out % 2 != 0)
        object.at(key).fail("is odd", "give an even number, which films need");
}

void check_view(const Value& value, const CameraDescription& camera) {
    if (camera.eye.has_value() != camera.target.has_value()) return;  // already reported
    const Vec3 view = camera.eye ? Vec3(*camera.eye - *camera.target) : camera.direction;
    if (view.norm() < 1e-6) return value.fail("has its eye at its target", "move the eye away");
    if (view.normalized().cross(camera.up.normalized()).norm() < 1e-3)
        value.fail("looks along its up direction", "choose another up");
}

CameraDescription read_camera(const Value& value) {
    const Object object(value, "camera");
    CameraDescription out;
    if (const auto eye = object.find("eye")) out.eye = eye->vector();
    if (const auto target = object.find("target")) out.target = target->vector();
    if (out.eye.has_value() != out.target.has_value()) {
        value.fail(std::string("has ") + (out.eye ? "an eye but no target" : "a target but no eye"),
                   "give both, or neither for an automatic camera");
    }
    object.read_direction("direction", out.direction);
    object.read_direction("up", out.up);
    if (object.sound({"eye", "target", "direction", "up"})) check_view(value, out);
    object.read("vertical_fov_degrees", out.vertical_fov_degrees, {1, 170});
    read_side(object, "width", out.width);
    read_side(object, "height", out.height);
    return out;
}

void read_times(const Object& object, SceneDescription& out) {
    object.read("time_step", out.time_step, {0, 1, true});
    object.not_both("frames", "duration");
    if (const auto frames = object.find("frames")) out.frames = frames->integer(1, max_frames);
    if (const auto duration = object.find("duration")) {
        // Tolerates rounding, so that a duration of whole steps is not rounded up.
        const double steps = std::ceil(duration->number({0, 1e6, true}) / out.time_step - 1e-6);
        if (object.sound({"time_step", "duration"}) && steps > max_frames) {
            duration->fail("is " + duration->shown() + ", more than " + std::to_string(max_frames) + " steps",
                           "shorten it or take a longer time_step");
        }
        out.frames = std::max(1, static_cast<int>(std::min<double>(steps, max_frames)));
    }
}

std::optional<Repetition> read_repetition(const Object& object, std::size_t limit) {
    const auto value = object.find("repeat");
    if (!value) return std::nullopt;
    const Object repeat(*value, "repetition");
    Repetition out;
    out.count = repeat.at("count").integer(1, static_cast<int>(limit));
    repeat.read("position", out.position);
    if (repeat.has("rotation")) out.rotation = read_rotation(repeat.at("rotation"));
    repeat.read("pivot", out.pivot);
    repeat.read("time", out.time, {0, 1e4});
    if (object.value().path().front().key == "bodies" && repeat.find("time"))
        repeat.at("time").fail("is given for a body, which has no delay", "take it out");
    return out;
}

// Appends a thing, or its copies with a number behind the name.
template <class Description>
void add_repeated(const Value& element, const char* kind, const Description& one, std::size_t limit,
                  std::set<std::string>& names, std::vector<Description>& out) {
    const std::optional<Repetition> repetition = read_repetition(Object(element, kind), limit);
    const int count = repetition ? repetition->count : 1;
    element.source().repeats = element.source().repeats || repetition;
    if (item_count(one) * static_cast<std::size_t>(count) > ParseLimits::repeated_items && count > 1) {
        element.fail("has " + std::to_string(item_count(one) * static_cast<std::size_t>(count)) +
                         " points, keyframes and parts in all its copies",
                     "at most " + std::to_string(ParseLimits::repeated_items) + " are taken");
        return;
    }
    if (out.size() + static_cast<std::size_t>(count) > limit) {
        element.fail("makes more than " + std::to_string(limit) + " with its copies", "repeat it less often");
        return;
    }
    for (int k = 0; k < count; ++k) {
        out.push_back(repetition ? repeated(one, *repetition, k) : one);
        if (repetition && !one.name.empty()) out.back().name += "-" + std::to_string(k + 1);
        check_new_name(element, kind, out.back().name, names);
        if (element.sound() && !is_sayable(out.back())) {
            element.fail(
                "makes copy " + std::to_string(k + 1) + " too far away, too late or of too many parts",
                "repeat it less often, or in smaller steps");
            return;
        }
    }
}

void read_bodies(const Object& object, SceneDescription& out) {
    std::set<std::string> names;
    for (const Value& element : object.at("bodies").elements(1, ParseLimits::bodies))
        add_repeated(element, "body", read_body(element), ParseLimits::bodies, names, out.bodies);
}

std::vector<ToolDescription> read_tools(const Object& object, std::size_t min_count,
                                        const std::vector<BodyDescription>& bodies,
                                        const std::vector<ColliderDescription>& colliders) {
    std::vector<ToolDescription> out;
    std::set<std::string> names;
    for (const Value& element : object.at("tools").elements(min_count, ParseLimits::tools))
        add_repeated(element, "tool", read_tool(element, bodies, colliders, out), ParseLimits::tools, names,
                     out);
    return out;
}

// Conditions may name tools that come later.
void check_all_conditions(const Object& scene, const SceneDescription& read) {
    const Known known{read.bodies, read.colliders, read.tools};
    const auto check = [&](std::string_view list, std::string_view kind, std::size_t limit,
                           std::initializer_list<std::string_view> keys) {
        if (!scene.has(list)) return;
        for (const Value& element : scene.at(list).elements(0, limit))
            check_conditions(element, kind, keys, known);
    };
    check("colliders", "collider", ParseLimits::colliders, {"start_when", "end_when"});
    check("tools", "tool", ParseLimits::tools, {"start_when", "end_when"});
    check("handles", "handle", ParseLimits::handles, {"start_when", "release_when"});
    check("constraints", "constraint", ParseLimits::constraints, {"start_when", "release_when"});
    if (scene.has("tools")) check_waiting(scene, read.tools);
}

GroundDescription read_ground(const Value& value) {
    const Object object(value, "ground");
    GroundDescription out;
    object.read("height", out.height);
    object.read("friction", out.friction, {0, 1000});
    return out;
}

}  // namespace

SceneDescription read_scene(const Value& value) {
    const Object object(value, "scene");
    SceneDescription out;
    if (object.has("$schema")) object.at("$schema").text();
    if (object.has("name")) {
        out.name = object.at("name").label();
    } else {
        out.name = std::filesystem::path(value.source().name).stem().string();
    }
    out.folder = value.source().folder;
    read_times(object, out);
    object.read("threads", out.threads, 0, 1024);
    object.read("gravity", out.gravity);
    if (const auto ground = object.find("ground")) out.ground = read_ground(*ground);
    read_bodies(object, out);
    if (object.has("colliders")) {
        std::set<std::string> names;
        for (const Value& element : object.at("colliders").elements(0, ParseLimits::colliders)) {
            out.colliders.push_back(read_collider(element, out.bodies, out.colliders));
            check_new_name(element, "collider", out.colliders.back().name, names);
        }
    }
    if (object.has("contact")) out.contact = read_contact(object.at("contact"));
    if (object.has("tools")) out.tools = read_tools(object, 0, out.bodies, out.colliders);
    if (object.has("handles")) {
        std::set<std::string> names;
        for (const Value& element : object.at("handles").elements(0, ParseLimits::handles)) {
            out.handles.push_back(read_handle(element, out));
            check_new_name(element, "handle", out.handles.back().name, names);
        }
    }
    if (object.has("constraints")) {
        for (const Value& element : object.at("constraints").elements(0, ParseLimits::constraints)) {
            out.constraints.push_back(read_constraint(element, out));
        }
    }
    // Both become colliders, which recordings tell by their names.
    for (const ToolDescription& tool : out.tools)
        for (const ColliderDescription& collider : out.colliders)
            if (tool.solid && !tool.name.empty() && tool.name == collider.name)
                object.at("tools").fail(
                    "has the solid tool \"" + tool.name + "\", and a collider is called so",
                    "give one of the two another name");
    check_all_conditions(object, out);
    if (object.has("display")) out.display = read_display(object.at("display"));
    if (object.has("solver")) out.solver = read_solver(object.at("solver"));
    if (object.has("occlusion")) out.occlusion = read_occlusion(object.at("occlusion"));
    if (object.has("output")) out.output = read_output(object.at("output"));
    if (object.has("camera")) out.camera = read_camera(object.at("camera"));
    return out;
}

std::vector<ToolDescription> read_path(const Value& value) {
    const Object object(value, "path_file");
    if (object.has("$schema")) object.at("$schema").text();
    if (object.has("name")) object.at("name").label();
    // Checked before the tools are read, which would report an unknown body.
    for (const Value& element : object.at("tools").elements(1, ParseLimits::tools)) {
        const Object tool(element, "tool");
        if (tool.has("bodies"))
            tool.at("bodies").fail("is given, but a path has no bodies",
                                   "take it out: a path cuts a single solid");
        for (const char* key : {"start_when", "end_when"})
            if (tool.has(key))
                tool.at(key).fail("is given, but nothing happens on a path that it could wait for",
                                  "take it out");
    }
    return read_tools(object, 1, {}, {});
}

}  // namespace splitcubes::scene
