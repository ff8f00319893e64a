// Readers of constraints and tools: objects that move along a prescribed path.
#include <splitcubes/scene/motion.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/read_scene.h>

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

namespace splitcubes::scene {

namespace {

std::string read_body_name(const Value& value, const std::vector<BodyDescription>& bodies) {
    const std::string name = value.text();
    std::string known;
    for (const BodyDescription& body : bodies) {
        if (body.name == name) return name;
        // A body whose invalid name was reported may be the one meant.
        if (body.name.empty()) return name;
        if (known.size() < 200) known += (known.empty() ? "" : ", ") + body.name;
    }
    if (!known.empty() && value.sound())
        value.fail("is " + value.shown() + ", but no body has that name", "there are " + known);
    return name;
}

Region read_box_region(const Value& value) {
    const Object object(value, "box_region");
    const BoxRegion box{object.at("min").vector(), object.at("max").vector()};
    if (object.sound({"min", "max"}) && (box.min.array() > box.max.array()).any()) {
        object.at("max").fail("is less than min on an axis",
                              "give the lower corner as min, the upper as max");
    }
    return box;
}

CylinderRegion read_cylinder_region(const Value& value) {
    const Object object(value, "cylinder_region");
    const CylinderRegion out{object.at("from").vector(), object.at("to").vector(),
                             object.at("radius").number(positive)};
    if (object.sound({"from", "to"}) && out.from == out.to)
        value.fail("has no length", "give different points as from and to");
    return out;
}

}  // namespace

Region read_region(const Value& value) {
    const Object object(value, "region");
    const std::string_view kind = object.only_key();
    const Value inner = object.at(kind);
    if (kind == "box") return read_box_region(inner);
    if (kind == "sphere") {
        const Object sphere(inner, "sphere_region");
        return SphereRegion{sphere.at("center").vector(), sphere.at("radius").number(positive)};
    }
    if (kind == "cylinder") return read_cylinder_region(inner);
    if (kind == "slab") {
        const Object slab(inner, "slab_region");
        return SlabRegion{slab.at("point").vector(), slab.at("normal").direction(),
                          slab.at("thickness").number(positive)};
    }
    const Object half_space(inner, "half_space_region");
    return HalfSpaceRegion{half_space.at("point").vector(), half_space.at("normal").direction()};
}

namespace {

Vec3 region_center(const Region& region) {
    if (const auto* box = std::get_if<BoxRegion>(&region)) return 0.5 * (box->min + box->max);
    if (const auto* sphere = std::get_if<SphereRegion>(&region)) return sphere->center;
    if (const auto* cylinder = std::get_if<CylinderRegion>(&region))
        return 0.5 * (cylinder->from + cylinder->to);
    if (const auto* slab = std::get_if<SlabRegion>(&region)) return slab->point;
    return std::get<HalfSpaceRegion>(region).point;
}

BladeDescription read_blade(const Value& value) {
    const Object object(value, "blade");
    const std::string_view kind = object.only_key();
    const Value inner = object.at(kind);
    if (kind == "polyline") {
        PolylineBlade out;
        for (const Value& point :
             Object(inner, "polyline_blade").at("points").elements(2, ParseLimits::points)) {
            out.points.push_back(point.vector());
        }
        return out;
    }
    if (kind == "straight") {
        const Object straight(inner, "straight_blade");
        const StraightBlade out{straight.at("from").vector(), straight.at("to").vector()};
        if (straight.sound({"from", "to"}) && out.from == out.to)
            inner.fail("has no length", "give different points as from and to");
        return out;
    }
    const Object arc(inner, "arc_blade");
    ArcBlade out;
    arc.read("center", out.center);
    out.radius = arc.at("radius").number(positive);
    arc.read_direction("axis", out.axis);
    out.start_angle_degrees = arc.at("start_angle_degrees").number(any_angle);
    out.end_angle_degrees = arc.at("end_angle_degrees").number(any_angle);
    if (arc.sound({"start_angle_degrees", "end_angle_degrees"}) &&
        out.start_angle_degrees == out.end_angle_degrees) {
        inner.fail("has no length", "give different start and end angles");
    }
    arc.read("segments", out.segments, 1, 10000);
    return out;
}

// Reads the keys that circles and helices share.
CircularMotion read_circle(const Object& object) {
    CircularMotion out;
    object.read("center", out.center);
    object.read_direction("axis", out.axis);
    out.radius = object.at("radius").number(not_negative);
    object.read("start_angle_degrees", out.start_angle_degrees, any_angle);
    object.read("turns", out.turns, {-10000, 10000});
    object.read("from_time", out.from_time, any_time);
    out.until_time = object.at("until_time").number(any_time);
    if (object.sound({"from_time", "until_time"}) && out.until_time <= out.from_time) {
        object.at("until_time").fail("is not after from_time", "let the motion end later than it starts");
    }
    object.read("turn_with_path", out.turn_with_path);
    return out;
}

HelixMotion read_helix(const Value& value) {
    const Object object(value, "helix_motion");
    HelixMotion out;
    out.circle = read_circle(object);
    out.rise = object.at("rise").number();
    object.read_optional("end_radius", out.end_radius, not_negative);
    return out;
}

KeyframeMotion read_keyframe_motion(const Value& value) {
    const Object object(value, "path_motion");
    KeyframeMotion out;
    out.keyframes = read_keyframes(object.at("keyframes"));
    if (object.has("interpolation")) {
        out.interpolation =
            static_cast<Interpolation>(object.at("interpolation").choice(interpolation_names));
    }
    return out;
}

SimpleMotion read_simple_motion(const Value& value) {
    const Object motion(value, "motion");
    const std::string_view kind = motion.only_key();
    const Value inner = motion.at(kind);
    if (kind == "circular") return read_circle(Object(inner, "circular_motion"));
    if (kind == "helix") return read_helix(inner);
    if (kind == "composed") {
        inner.fail("stands inside of another composed motion", "write its parts there in its place");
        return KeyframeMotion{};
    }
    return read_keyframe_motion(inner);
}

Motion read_motion(const Value& value) {
    const Object motion(value, "motion");
    if (!motion.has("composed") || motion.only_key() != "composed")
        return std::visit([](auto&& m) { return Motion(std::move(m)); }, read_simple_motion(value));
    ComposedMotion out;
    const Object composed(motion.at("composed"), "composed_motion");
    for (const Value& part : composed.at("parts").elements(1, ParseLimits::motion_parts))
        out.parts.push_back(read_simple_motion(part));
    return out;
}

// Puts the tool's motion into the frame of what it goes along with, where that needs no state; else the
// carrier is kept.
void read_relation(const Object& object, const Known& known, ToolDescription& tool) {
    const std::optional<Carrier> carrier = read_carrier(object, known, tool.name);
    if (!carrier) return;
    const std::optional<Motion> outer = prescribed_motion(*carrier, known.colliders, known.tools);
    if (!outer || tool.start_when || tool.end_when) {
        tool.relative_to = carrier;
        return;
    }
    tool.motion = composed(*outer, tool.motion);
    if (std::get<ComposedMotion>(tool.motion).parts.size() > ParseLimits::motion_parts)
        object.at("relative_to")
            .fail("makes a motion of more than " + std::to_string(ParseLimits::motion_parts) + " parts",
                  "shorten the chain of tools");
}

// Tells whether parts without keyframes were reported.
bool is_complete(const SimpleMotion& motion) {
    const auto* path = std::get_if<KeyframeMotion>(&motion);
    return path == nullptr || !path->keyframes.empty();
}
bool is_complete(const Motion& motion) {
    if (const auto* parts = std::get_if<ComposedMotion>(&motion))
        return !parts->parts.empty() &&
               std::all_of(parts->parts.begin(), parts->parts.end(),
                           [](const SimpleMotion& part) { return is_complete(part); });
    const auto* path = std::get_if<KeyframeMotion>(&motion);
    return path == nullptr || !path->keyframes.empty();
}

void read_active_interval(const Object& object, ToolDescription& tool) {
    if (!is_complete(tool.motion)) return;  // already reported
    std::tie(tool.active_from, tool.active_until) = times_of(tool.motion);
    object.read("active_from", tool.active_from, any_time);
    object.read("active_until", tool.active_until, any_time);
    if (object.sound({"motion", "active_from", "active_until"}) && tool.active_until < tool.active_from) {
        object.at(object.has("active_until") ? "active_until" : "active_from")
            .fail("makes the tool end before it starts",
                  "the motion's own times stand for what is not given");
    }
}

}  // namespace

Region read_any_region(const Value& value) {
    return read_region(value);
}

Vec3 center_of(const Region& region) {
    return region_center(region);
}

std::string read_known_body(const Value& value, const std::vector<BodyDescription>& bodies) {
    return read_body_name(value, bodies);
}

std::vector<MotionKeyframe> read_keyframes(const Value& value) {
    std::vector<MotionKeyframe> out;
    double last = -1;  // the previous time
    for (const Value& element : value.elements(1, ParseLimits::keyframes)) {
        const Object object(element, "keyframe");
        MotionKeyframe keyframe;
        keyframe.time = object.at("time").number(any_time);
        if (object.sound({"time"})) {
            if (keyframe.time <= last)
                object.at("time").fail("is " + object.at("time").shown() + ", not after the keyframe before",
                                       "sort the keyframes by time, each time once");
            last = keyframe.time;
        }
        object.read("position", keyframe.position);
        if (object.has("rotation")) keyframe.rotation = read_rotation(object.at("rotation"));
        out.push_back(keyframe);
    }
    return out;
}

ConstraintDescription read_constraint(const Value& value, const SceneDescription& known) {
    const std::vector<BodyDescription>& bodies = known.bodies;
    const Object object(value, "constraint");
    ConstraintDescription out;
    out.body = read_body_name(object.at("body"), bodies);
    for (const BodyDescription& body : bodies)
        if (body.name == out.body && body.deformation &&
            std::holds_alternative<FreeFormDescription>(*body.deformation))
            object.at("body").fail("is \"" + out.body + "\", which its lattice moves, all of it",
                                   "move the lattice's points, or take the constraint out");
    out.region = read_region(object.at("region"));
    out.kind = static_cast<ConstraintKind>(object.at("kind").choice(constraint_kind_names));
    if (!object.sound({"kind"})) {
        if (const auto keyframes = object.find("keyframes")) out.keyframes = read_keyframes(*keyframes);
    } else if (out.kind == ConstraintKind::move) {
        out.keyframes = read_keyframes(object.at("keyframes"));
    } else if (object.find("keyframes")) {
        object.at("keyframes")
            .fail("is given, but the kind is \"hold\"", "make the kind \"move\" or take it out");
    }
    out.pivot = region_center(out.region);
    object.read("pivot", out.pivot);
    object.read("from_time", out.from_time, any_time);
    object.read_optional("until_time", out.until_time, any_time);
    if (object.sound({"from_time", "until_time"}) && out.until_time && *out.until_time <= out.from_time) {
        object.at("until_time").fail("is not after from_time", "let the constraint end later than it starts");
    }
    out.start_when = read_condition(object, "start_when", bodies);
    out.release_when = read_condition(object, "release_when", bodies);
    out.relative_to = read_carrier(object, {bodies, known.colliders, known.tools}, {});
    return out;
}

ToolDescription read_tool(const Value& value, const std::vector<BodyDescription>& bodies,
                          const std::vector<ColliderDescription>& colliders,
                          const std::vector<ToolDescription>& before) {
    const Object object(value, "tool");
    ToolDescription out;
    out.name = object.at("name").identifier();
    for (const Value& blade : object.at("blades").elements(1, ParseLimits::blades)) {
        out.blades.push_back(read_blade(blade));
    }
    out.motion = read_motion(object.at("motion"));
    out.start_when = read_condition(object, "start_when", bodies);
    out.end_when = read_condition(object, "end_when", bodies);
    read_relation(object, {bodies, colliders, before, true}, out);
    if (object.has("bodies")) {
        for (const Value& body : object.at("bodies").elements(0, ParseLimits::bodies)) {
            out.bodies.push_back(read_body_name(body, bodies));
        }
    }
    read_active_interval(object, out);
    object.read_optional("shown_from", out.shown_from, any_time);
    object.read_optional("shown_until", out.shown_until, any_time);
    if (const auto instrument = object.find("instrument")) out.instrument = read_instrument(*instrument);
    out.finish = read_optional_finish(object, "finish");
    out.grip_finish = read_optional_finish(object, "grip_finish");
    if (const auto solid = object.find("solid")) {
        out.solid = SolidDescription{};
        Object(*solid, "solid").read("friction", out.solid->friction, {0, 1000});
        if (!out.instrument)
            solid->fail("is given to a tool without an instrument",
                        "give it an instrument, whose solid it is");
    }
    object.read("side", out.side, not_negative);
    object.read("friction", out.friction, {0, 1000});
    return out;
}

}  // namespace splitcubes::scene
