#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/read_scene.h>

#include <system_error>

namespace splitcubes::scene {

namespace {

// Shapes have no defaults: each size must be given.

Shape read_mesh_shape(const Value& value) {
    const Value file = Object(value, "mesh_shape").at("file");
    const std::string text = file.label();
    const std::filesystem::path path = (value.source().folder / text).lexically_normal();
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(path, ignored)) {
        file.fail("is " + file.shown() + ", but there is no file " + path.string(),
                  "give a mesh file's name relative to the scene's folder");
    }
    return MeshShape{path};
}

Shape read_torus(const Value& value) {
    const Object object(value, "torus_shape");
    const TorusShape torus{object.at("ring_radius").number(positive),
                           object.at("tube_radius").number(positive)};
    if (torus.tube_radius >= torus.ring_radius) {
        object.at("tube_radius").fail("is not below the ring_radius", "make the tube thinner than the ring");
    }
    return torus;
}

Shape read_shape(const Value& value) {
    const Object object(value, "shape");
    const std::string_view kind = object.only_key();
    const Value inner = object.at(kind);
    if (kind == "mesh") return read_mesh_shape(inner);
    if (kind == "torus") return read_torus(inner);
    if (kind == "box") return BoxShape{Object(inner, "box_shape").at("size").vector(positive)};
    if (kind == "sphere") return SphereShape{Object(inner, "sphere_shape").at("radius").number(positive)};
    if (kind == "pear") return PearShape{Object(inner, "pear_shape").at("height").number(positive)};
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
    object.read("scale", out.scale, positive);
    return out;
}

PlasticityDescription read_plasticity(const Value& value, MaterialModel model) {
    const Object object(value, "plasticity");
    PlasticityDescription out;
    out.yield = object.at("yield").number({0, 10, true});
    object.read_optional("creep", out.creep, {0, 1e6, true});
    object.read("maximum", out.maximum, {0, 0.9, true});
    if (model == MaterialModel::st_venant_kirchhoff && out.maximum > 0.45) {
        object.at("maximum").fail("is " + object.at("maximum").shown(),
                                  "give at most 0.45 with the model st-venant-kirchhoff");
    }
    return out;
}

MaterialDescription read_material(const Value& value) {
    const Object object(value, "material");
    MaterialDescription out;
    if (object.has("model")) {
        out.model = static_cast<MaterialModel>(object.at("model").choice(material_model_names));
    }
    object.read("density", out.density, {0, 1e6, true});
    object.read("youngs_modulus", out.youngs_modulus, {0, 1e13, true});
    object.read("poisson_ratio", out.poisson_ratio, {0, 0.49});
    object.read("volume_stiffness", out.volume_stiffness, {0, 1e13});
    object.read("mass_damping", out.mass_damping, {0, 1e6});
    object.read("stiffness_damping", out.stiffness_damping, {0, 1e6});
    object.read("zero_energy", out.zero_energy, {0, 100});
    object.read("cutting_resistance", out.cutting_resistance, {0, 1e9});
    if (const auto plasticity = object.find("plasticity")) {
        out.plasticity = read_plasticity(*plasticity, out.model);
    }
    return out;
}

}  // namespace

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
    object.read("velocity", out.velocity);
    object.read("angular_velocity", out.angular_velocity);
    return out;
}

}  // namespace splitcubes::scene
