// Readers of finishes, instruments and what is displayed.
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/read_scene.h>

#include <string>

namespace splitcubes::scene {

namespace {

using geometry::Finish;

constexpr Range shade{0, 1};

Vec3 read_colour(const Object& object) {
    return object.at("colour").vector(shade);
}

// Notes values that do not grow along a list.
void check_growth(const Object& object, std::string_view key, double value, double& last) {
    if (!object.sound({key})) return;
    if (value <= last)
        object.at(key).fail("is " + object.at(key).shown() + ", not above the one before",
                            "sort the list, each value once");
    last = value;
}

void read_layers(const Value& value, Finish& out) {
    double last = 0;
    out.layers.clear();
    for (const Value& element : value.elements(0, Finish::max_layers)) {
        const Object layer(element, "finish_layer");
        out.layers.push_back({layer.at("depth").number(positive), read_colour(layer)});
        check_growth(layer, "depth", out.layers.back().depth, last);
    }
}

void read_stripes(const Value& value, Finish& out) {
    const Object object(value, "finish_stripes");
    object.read_direction("axis", out.stripe_axis);
    double last = 2 * any_number.low;
    out.stripes.clear();
    for (const Value& element : object.at("bands").elements(0, Finish::max_stripes)) {
        const Object band(element, "finish_band");
        out.stripes.push_back({band.at("from").number(), read_colour(band)});
        check_growth(band, "from", out.stripes.back().from, last);
    }
}

void read_speckles(const Value& value, Finish& out) {
    out.speckles.clear();
    for (const Value& element : value.elements(0, Finish::max_speckles)) {
        const Object speckles(element, "finish_speckles");
        geometry::FinishSpeckles one;
        one.size = speckles.at("size").number(positive);
        speckles.read("share", one.share, {0, 0.6});
        one.colour = read_colour(speckles);
        out.speckles.push_back(one);
    }
}

std::optional<Grip> read_grip(const Object& object) {
    const auto grip = object.find("grip");
    if (!grip) return std::nullopt;
    return static_cast<Grip>(grip->choice(grip_names));
}

std::optional<Vec3> read_back(const Object& object) {
    const auto back = object.find("back");
    if (!back) return std::nullopt;
    return back->direction();
}

BladeInstrument read_blade_instrument(const Value& value, BladeKind kind) {
    const Object object(value, "blade_instrument");
    BladeInstrument out;
    out.kind = kind;
    object.read_optional("height", out.height, positive);
    object.read_optional("thickness", out.thickness, positive);
    object.read_optional("handle", out.handle, not_negative);
    out.grip = read_grip(object);
    out.back = read_back(object);
    return out;
}

}  // namespace

geometry::Finish read_finish(const Value& value) {
    const Object object(value, "finish");
    Finish out;
    if (const auto kind = object.find("kind"))
        out = *finish_of_kind(finish_kind_names()[kind->choice(finish_kind_names())]);
    object.read("colour", out.colour, shade);
    object.read("roughness", out.roughness, shade);
    object.read("metalness", out.metalness, shade);
    if (object.has("layers")) read_layers(object.at("layers"), out);
    if (const auto stripes = object.find("stripes")) read_stripes(*stripes, out);
    if (object.has("speckles")) read_speckles(object.at("speckles"), out);
    return out;
}

std::optional<geometry::Finish> read_optional_finish(const Object& object, std::string_view key) {
    const auto value = object.find(key);
    if (!value) return std::nullopt;
    return read_finish(*value);
}

AppearanceDescription read_appearance(const Value& value) {
    const Object object(value, "appearance");
    return {read_optional_finish(object, "surface"), read_optional_finish(object, "cut")};
}

InstrumentDescription read_instrument(const Value& value) {
    const Object object(value, "instrument");
    const std::string_view kind = object.only_key();
    const Value inner = object.at(kind);
    if (kind == "wire") {
        const Object wire(inner, "wire_instrument");
        WireInstrument out;
        wire.read_optional("radius", out.radius, positive);
        wire.read("grips", out.grips);
        return out;
    }
    if (kind == "spoon") {
        const Object spoon(inner, "spoon_instrument");
        SpoonInstrument out;
        spoon.read_optional("depth", out.depth, positive);
        spoon.read_optional("thickness", out.thickness, positive);
        spoon.read_optional("handle", out.handle, not_negative);
        out.back = read_back(spoon);
        return out;
    }
    if (kind == "mesh") {
        const Object mesh(inner, "mesh_instrument");
        MeshInstrument out;
        out.mesh = read_named_mesh(mesh);
        if (mesh.has("placement")) out.placement = read_any_placement(mesh.at("placement"));
        return out;
    }
    if (kind == "scalpel") return read_blade_instrument(inner, BladeKind::scalpel);
    if (kind == "scissors") return read_blade_instrument(inner, BladeKind::scissors);
    return read_blade_instrument(inner, BladeKind::knife);
}

DisplayDescription read_display(const Value& value) {
    const Object object(value, "display");
    DisplayDescription out;
    object.read("tools", out.tools);
    object.read("handles", out.handles);
    object.read("held", out.held);
    return out;
}

}  // namespace splitcubes::scene
