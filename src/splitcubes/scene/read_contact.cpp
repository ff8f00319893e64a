// Readers of colliders, contact and handles.
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/read_scene.h>

namespace splitcubes::scene {

ColliderDescription read_collider(const Value& value, const std::vector<BodyDescription>& bodies,
                                  const std::vector<ColliderDescription>& before) {
    const Object object(value, "collider");
    ColliderDescription out;
    out.name = object.at("name").identifier();
    object.not_both("shape", "half_space");
    if (const auto half_space = object.find("half_space")) {
        const Object plane(*half_space, "half_space_shape");
        out.half_space = HalfSpaceShape{plane.at("point").vector(), plane.at("normal").direction()};
        if (object.find("placement"))
            object.at("placement").fail("is given with a half_space", "its point and normal place it");
        out.pivot = out.half_space->point;
    } else {
        out.shape = read_any_shape(object.at("shape"));
        if (object.has("placement")) out.placement = read_any_placement(object.at("placement"));
        out.pivot = out.placement.position;
    }
    object.read("rounding", out.rounding, not_negative);
    const auto* box = out.shape ? std::get_if<BoxShape>(&*out.shape) : nullptr;
    if (object.sound({"shape", "half_space", "rounding"}) && out.rounding > 0 &&
        (!box || out.rounding > 0.5 * box->size.minCoeff()))
        object.at("rounding")
            .fail("is not that of a box's edges", "give it with a box, at most half its shortest side");
    if (object.has("keyframes")) out.keyframes = read_keyframes(object.at("keyframes"));
    object.read("pivot", out.pivot);
    object.read("friction", out.friction, {0, 1000});
    out.relative_to = read_carrier(object, {bodies, before, {}, true}, out.name);
    out.start_when = read_condition(object, "start_when", bodies);
    out.end_when = read_condition(object, "end_when", bodies);
    out.finish = read_optional_finish(object, "finish");
    return out;
}

ContactDescription read_contact(const Value& value) {
    const Object object(value, "contact");
    ContactDescription out;
    object.read("pieces", out.pieces);
    object.read("friction", out.friction, {0, 1000});
    object.read_optional("restitution", out.restitution, {0, 1});
    return out;
}

HandleDescription read_handle(const Value& value, const SceneDescription& known) {
    const Object object(value, "handle");
    HandleDescription out;
    out.name = object.at("name").identifier();
    out.body = read_known_body(object.at("body"), known.bodies);
    out.region = read_any_region(object.at("region"));
    if (object.has("keyframes")) out.keyframes = read_keyframes(object.at("keyframes"));
    out.pivot = center_of(out.region);
    object.read("pivot", out.pivot);
    object.read("stiffness", out.stiffness, {0, 1e12, true});
    object.read_optional("force_limit", out.force_limit, {0, 1e12, true});
    object.read("from_time", out.from_time, any_time);
    object.read_optional("until_time", out.until_time, any_time);
    if (object.sound({"from_time", "until_time"}) && out.until_time && *out.until_time <= out.from_time)
        object.at("until_time").fail("is not after from_time", "let the handle end later than it starts");
    out.start_when = read_condition(object, "start_when", known.bodies);
    out.release_when = read_condition(object, "release_when", known.bodies);
    out.relative_to = read_carrier(object, {known.bodies, known.colliders, known.tools}, {});
    return out;
}

}  // namespace splitcubes::scene
