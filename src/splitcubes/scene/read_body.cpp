#include <splitcubes/core/sha256.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/read_scene.h>

#include <algorithm>
#include <system_error>

namespace splitcubes::scene {

namespace {

// Returns the SHA-256 that the scene requires of a file. An override of the file name alone drops it.
std::string content_of(const Object& object, std::string_view file_key, std::string_view content_key) {
    const auto content = object.find(content_key);
    if (!content) return {};
    const std::string text = content->text();
    if (!content->sound()) return {};
    if (!is_sha256(text)) {
        content->fail("is " + content->shown() + ", which is not a SHA-256",
                      "give the 64 digits that sha256sum prints, or take it out");
        return {};
    }
    const Source& source = content->source();
    const auto file = object.find(file_key);
    const bool together = file && source.override_of(content->path()) == source.override_of(file->path());
    return together ? text : std::string();
}

// A missing file with a given SHA-256 is accepted: find_inputs searches for it.
std::filesystem::path named_file(const Value& file, const std::string& content, const char* remedy) {
    const std::string name = file.label();
    if (name.empty()) return {};
    const std::filesystem::path path = (file.source().folder / name).lexically_normal();
    std::error_code ignored;
    if (content.empty() && !std::filesystem::is_regular_file(path, ignored))
        file.fail("is " + file.shown() + ", but there is no file " + path.string(), remedy);
    return path;
}

// Shapes have no defaults: each size is required.

Shape read_mesh_shape(const Value& value) {
    return read_named_mesh(Object(value, "mesh_shape"));
}

Shape read_torus(const Value& value) {
    const Object object(value, "torus_shape");
    const TorusShape torus{object.at("ring_radius").number(positive),
                           object.at("tube_radius").number(positive)};
    if (object.sound({"ring_radius", "tube_radius"}) && torus.tube_radius >= torus.ring_radius) {
        object.at("tube_radius").fail("is not below the ring_radius", "make the tube thinner than the ring");
    }
    return torus;
}

ImplicitPart read_part(const Value& value) {
    const Object object(value, "implicit_part");
    ImplicitPart out;
    if (object.only_key() == "ball") {
        const Object ball(object.at("ball"), "ball_part");
        ball.read("colour", out.colour, {0, 1});
        out.form = BallPart{ball.at("center").vector(), ball.at("radii").vector(positive)};
        return out;
    }
    const Object cone(object.at("cone"), "cone_part");
    cone.read("colour", out.colour, {0, 1});
    const ConePart form{cone.at("from").vector(), cone.at("to").vector(),
                        cone.at("from_radius").number(positive), cone.at("to_radius").number(positive)};
    if (cone.sound({"from", "to"}) && form.from == form.to)
        cone.value().fail("has no length", "give different points as from and to");
    out.form = form;
    return out;
}

ImplicitShape read_implicit(const Value& value) {
    const Object object(value, "implicit_shape");
    ImplicitShape out;
    object.read("smoothness", out.smoothness, {0, 1e3});
    object.read("cells", out.cells, 8, 400);
    for (const Value& part : object.at("parts").elements(1, ParseLimits::parts))
        out.parts.push_back(read_part(part));
    return out;
}

// Reads three integers of a range.
Vec3i read_integers(const Value& value, int low, int high) {
    const std::vector<Value> elements = value.elements(3, 3);
    Vec3i out = Vec3i::Constant(low);
    if (elements.empty()) return out;
    for (int k = 0; k < 3; ++k) out[k] = elements[static_cast<std::size_t>(k)].integer(low, high);
    return out;
}

// Reads a point of a keyframe; `before`: the earlier points.
LatticePoint read_lattice_point(const Value& value, const FreeFormDescription& form, bool degree_sound,
                                const std::vector<LatticePoint>& before) {
    const Object object(value, "lattice_point");
    const LatticePoint out{read_integers(object.at("index"), 0, 12), object.at("displacement").vector()};
    const Value index = object.at("index");
    if (!index.sound()) return out;
    if (degree_sound && (out.index.array() > form.degree.array()).any())
        index.fail("is beyond the lattice", "give at most the degree along each axis");
    if (std::any_of(before.begin(), before.end(),
                    [&](const LatticePoint& p) { return p.index == out.index; }))
        index.fail("is there twice", "give each point of a keyframe once");
    return out;
}

FreeFormDescription read_free_form(const Value& value) {
    const Object object(value, "free_form");
    FreeFormDescription out;
    out.degree = read_integers(object.at("degree"), 1, 12);
    const bool degree_sound = object.at("degree").sound();
    double last = -1;  // the previous time
    for (const Value& element : object.at("keyframes").elements(1, ParseLimits::keyframes)) {
        const Object keyframe(element, "lattice_keyframe");
        LatticeKeyframeDescription key;
        key.time = keyframe.at("time").number(any_time);
        if (keyframe.sound({"time"})) {
            if (key.time <= last)
                keyframe.at("time").fail("is not after the keyframe before", "give times that increase");
            last = key.time;
        }
        if (keyframe.has("points"))
            for (const Value& point : keyframe.at("points").elements(0, 2197))
                key.points.push_back(read_lattice_point(point, out, degree_sound, key.points));
        out.keyframes.push_back(key);
    }
    return out;
}

DeformationDescription read_deformation(const Value& value) {
    const Object object(value, "deformation");
    const std::string_view kind = object.only_key();
    if (kind == "free_form") return read_free_form(object.at(kind));
    const Object none(object.at(kind), "mass_spring");
    return MassSpringDescription{};
}

PearShape read_pear(const Value& value) {
    const Object object(value, "pear_shape");
    PearShape out{object.at("height").number(positive), 0};
    if (const auto foot = object.find("foot")) out.foot = foot->number(not_negative);
    // make_pear needs a foot below half the belly's radius, which is 0.1625 of the height.
    if (object.sound({"height", "foot"}) && out.foot >= 0.16 * out.height)
        object.at("foot").fail("is not below 0.16 of the height", "give a smaller foot");
    return out;
}

Shape read_shape(const Value& value) {
    const Object object(value, "shape");
    const std::string_view kind = object.only_key();
    const Value inner = object.at(kind);
    if (kind == "mesh") return read_mesh_shape(inner);
    if (kind == "torus") return read_torus(inner);
    if (kind == "implicit") return read_implicit(inner);
    if (kind == "box") return BoxShape{Object(inner, "box_shape").at("size").vector(positive)};
    if (kind == "sphere") return SphereShape{Object(inner, "sphere_shape").at("radius").number(positive)};
    if (kind == "pear") return read_pear(inner);
    if (kind == "cylinder") {
        const Object cylinder(inner, "cylinder_shape");
        return CylinderShape{cylinder.at("radius").number(positive), cylinder.at("height").number(positive)};
    }
    const Object capsule(inner, "capsule_shape");
    return CapsuleShape{capsule.at("radius").number(positive),
                        capsule.at("straight_height").number(not_negative)};
}

PlacementDescription read_placement(const Value& value) {
    const Object object(value, "placement");
    PlacementDescription out;
    object.read("position", out.position);
    if (object.has("rotation")) out.rotation = read_rotation(object.at("rotation"));
    if (const auto scale = object.find("scale"))
        out.scale =
            scale->json().is_array() ? scale->vector(positive) : Vec3::Constant(scale->number(positive));
    return out;
}

PlasticityDescription read_plasticity(const Value& value, MaterialModel model) {
    const Object object(value, "plasticity");
    PlasticityDescription out;
    out.yield = object.at("yield").number({0, 10, true});
    object.read_optional("creep", out.creep, {0, 1e6, true});
    object.read("maximum", out.maximum, {0, 0.9, true});
    if (object.sound({"maximum"}) && model == MaterialModel::st_venant_kirchhoff && out.maximum > 0.45) {
        object.at("maximum").fail("is " + object.at("maximum").shown(),
                                  "give at most 0.45 with the model st-venant-kirchhoff");
    }
    return out;
}

StrengthLayer read_strength_layer(const Value& value) {
    const Object object(value, "strength_layer");
    const std::string_view kind = object.only_key();
    const Value inner = object.at(kind);
    constexpr Range any_factor{0, 1e6, true};
    if (kind == "patch") {
        const Object patch(inner, "strength_patch");
        return StrengthPatch{read_region(patch.at("region")), patch.at("factor").number(any_factor)};
    }
    const Object paint(inner, "strength_paint");
    StrengthPaint out;
    paint.read("dark", out.dark, any_factor);
    paint.read("light", out.light, any_factor);
    if (const auto picture = paint.find("picture")) {
        out.picture_sha256 = content_of(paint, "picture", "picture_sha256");
        out.picture =
            named_file(*picture, out.picture_sha256, "give a picture's name relative to the scene's folder");
    }
    return out;
}

TearingDescription read_tearing(const Value& value) {
    const Object object(value, "tearing");
    TearingDescription out;
    out.strength = object.at("strength").number({0, 1e13, true});
    object.read("propagation_ratio", out.propagation_ratio, {0, 1, true});
    object.read_optional("crack_speed", out.crack_speed, {0, 1e5, true});
    if (object.has("strength_map"))
        for (const Value& layer : object.at("strength_map").elements(0, ParseLimits::strength_layers))
            out.strength_map.push_back(read_strength_layer(layer));
    return out;
}

// Notes paint on a shape without colours and texture coordinates.
void check_paint(const Object& material, const Shape& shape) {
    const Value tearing = material.at("tearing");
    const auto layers = Object(tearing, "tearing").find("strength_map");
    if (!layers || !layers->sound() || std::holds_alternative<MeshShape>(shape) ||
        std::holds_alternative<ImplicitShape>(shape))
        return;
    for (const Value& layer : layers->elements(0, ParseLimits::strength_layers))
        if (Object(layer, "strength_layer").has("paint"))
            layer.fail("paints a shape that has no colours and no texture coordinates",
                       "give the body a mesh with them, or a patch instead");
}

MaterialDescription read_material(const Value& value) {
    const Object object(value, "material");
    MaterialDescription out;
    if (object.has("model")) {
        out.model = static_cast<MaterialModel>(object.at("model").choice(material_model_names));
    }
    object.read("density", out.density, {0, 1e6, true});
    object.read("youngs_modulus", out.youngs_modulus, {0, 1e13, true});
    object.read("poisson_ratio", out.poisson_ratio, {0, 0.499});
    object.read("volume_stiffness", out.volume_stiffness, {0, 1e13});
    object.read("mass_damping", out.mass_damping, {0, 1e6});
    object.read("stiffness_damping", out.stiffness_damping, {0, 1e6});
    object.read("zero_energy", out.zero_energy, {0, 100});
    object.read("cutting_resistance", out.cutting_resistance, {0, 1e9});
    if (const auto plasticity = object.find("plasticity")) {
        out.plasticity = read_plasticity(*plasticity, out.model);
    }
    if (const auto tearing = object.find("tearing")) out.tearing = read_tearing(*tearing);
    return out;
}

}  // namespace

MeshShape read_named_mesh(const Object& object) {
    const std::string content = content_of(object, "file", "sha256");
    return {named_file(object.at("file"), content, "give a mesh file's name relative to the scene's folder"),
            content};
}

Shape read_any_shape(const Value& value) {
    return read_shape(value);
}

PlacementDescription read_any_placement(const Value& value) {
    return read_placement(value);
}

Rotation read_rotation(const Value& value) {
    const Object object(value, "rotation");
    Rotation out;
    object.read_direction("axis", out.axis);
    object.read("angle_degrees", out.angle_degrees, any_angle);
    return out;
}

BodyDescription read_body(const Value& value) {
    const Object object(value, "body");
    BodyDescription out;
    out.name = object.at("name").identifier();
    out.shape = read_shape(object.at("shape"));
    if (object.has("placement")) out.placement = read_placement(object.at("placement"));
    object.not_both("cells", "cell_size");
    if (const auto cells = object.find("cells")) out.cells = cells->integer(2, 1000);
    object.read_optional("cell_size", out.cell_size, positive);
    if (out.cell_size) out.cells.reset();
    object.not_both("phyxel_count", "phyxel_spacing");
    if (const auto count = object.find("phyxel_count")) out.phyxel_count = count->integer(1, 1000000);
    object.read_optional("phyxel_spacing", out.phyxel_spacing, positive);
    if (out.phyxel_spacing) out.phyxel_count.reset();
    if (object.has("material")) out.material = read_material(object.at("material"));
    if (out.material.tearing && object.sound({"shape"}))
        check_paint(Object(object.at("material"), "material"), out.shape);
    if (const auto deformation = object.find("deformation")) {
        out.deformation = read_deformation(*deformation);
        if (out.material.tearing)
            deformation->fail("is given to a body that tears", "take its material's tearing out");
    }
    if (const auto appearance = object.find("appearance")) out.appearance = read_appearance(*appearance);
    object.read("velocity", out.velocity);
    object.read("angular_velocity", out.angular_velocity);
    return out;
}

}  // namespace splitcubes::scene
