#include "scene_source.h"

#include "recorded_scene.h"

#include <splitcubes/core/error.h>
#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/instrument.h>
#include <splitcubes/scene/parse.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <map>
#include <string_view>
#include <utility>

namespace splitcubes::view {

namespace {

// Settings of a body that is made of a mesh alone: a soft tissue, in cells that a laptop steps in real time.
constexpr int mesh_cells = 40;
constexpr int mesh_phyxels = 700;
constexpr double mesh_sag = 0.03;          // share of its size by which its weight deforms it
constexpr double mesh_density = 1000;      // kg/m^3
constexpr double standard_gravity = 9.81;  // m/s^2
constexpr double mesh_poisson_ratio = 0.4;
constexpr double mesh_mass_damping = 1;           // 1/s
constexpr double mesh_stiffness_damping = 0.005;  // s
constexpr double mesh_resistance = 100;           // J/m^2
constexpr double mesh_friction = 0.6;
// Meshes larger than this are taken as drawn in millimetres.
constexpr double largest_in_metres = 5;

MaterialSettings material_of(const scene::MaterialDescription& m) {
    MaterialSettings out{.density = m.density,
                         .youngs_modulus = m.youngs_modulus,
                         .poisson_ratio = m.poisson_ratio,
                         .mass_damping = m.mass_damping,
                         .stiffness_damping = m.stiffness_damping,
                         .cutting_resistance = m.cutting_resistance};
    if (m.plasticity) {
        out.plasticity = PlasticitySettings{.yield = m.plasticity->yield, .maximum = m.plasticity->maximum};
        if (m.plasticity->creep) out.plasticity->creep = *m.plasticity->creep;
    }
    return out;
}

BodySettings body_settings_of(const scene::BodyDescription& b, const geometry::TriangleMesh& own) {
    BodySettings out{.name = b.name, .material = material_of(b.material)};
    out.cell_size = b.cell_size ? *b.cell_size : geometry::cell_size_for(own, *b.cells);
    if (b.phyxel_count) out.phyxel_count = *b.phyxel_count;
    if (b.phyxel_spacing) out.phyxel_spacing = *b.phyxel_spacing;
    if (b.material.tearing)
        out.tearing = TearingSettings{b.material.tearing->strength, b.material.tearing->propagation_ratio};
    const auto vector = [](const Vec3& v) { return Vector3{v.x(), v.y(), v.z()}; };
    const Isometry pose = scene::pose_of(b.placement);
    const Quat rotation(pose.linear());
    out.placement = {vector(pose.translation()), {rotation.w(), rotation.x(), rotation.y(), rotation.z()}};
    out.velocity = vector(b.velocity);
    out.angular_velocity = vector(b.angular_velocity);
    return out;
}

void note_left_out(const scene::BodyDescription& b, std::vector<std::string>& notes) {
    const auto leave_out = [&](bool there, const char* what) {
        if (there) notes.push_back("body '" + b.name + "': the viewer leaves out " + what);
    };
    leave_out(b.material.model != scene::MaterialModel::corotated, "its material model (corotated is used)");
    leave_out(b.material.volume_stiffness > 0, "its volume stiffness");
    leave_out(b.material.tearing && !b.material.tearing->strength_map.empty(), "its map of strength");
    leave_out(b.material.tearing && b.material.tearing->crack_speed.has_value(), "its crack speed");
    if (b.deformation)
        throw InputError("body '" + b.name + "'", "is moved by a lattice, which the viewer does not do",
                         "use `splitcubes run` and `splitcubes render`");
}

bool is_checkpoint(const std::filesystem::path& file) {
    constexpr std::string_view mark = "Splitcubes simulation ";
    std::string first(mark.size(), ' ');
    std::ifstream in(file, std::ios::binary);
    return in.read(first.data(), static_cast<std::streamsize>(first.size())) && first == mark;
}

void add_tools(SceneSource& source, scene::BuildReport* report) {
    for (const scene::ToolDescription& tool : source.description.tools) {
        source.blades.push_back(scene::make_blade(tool));
        source.instruments.push_back(std::make_shared<const std::vector<scene::InstrumentPart>>(
            source.description.display.tools ? scene::instrument_parts(tool, report)
                                             : std::vector<scene::InstrumentPart>()));
    }
}

SceneSource open_scene(const std::filesystem::path& file) {
    SceneSource out;
    out.description = is_run_recording(file) ? scene_of_recording(scene::read_recording(file))
                                             : scene::parse_scene_file(file);
    scene::BuildReport report;
    for (const scene::BodyDescription& body : out.description.bodies) {
        note_left_out(body, out.notes);
        io::Model model = scene::own_model(body, report);
        materials_of_colours(model.attributes);
        BodySettings settings = body_settings_of(body, model.mesh);
        out.bodies.push_back({std::move(model), std::move(settings)});
    }
    add_tools(out, &report);
    return out;
}

// Bodies of scenes have names that can be parts of file names.
std::string body_name_of(const std::filesystem::path& file) {
    std::string out = file.stem().string();
    for (char& c : out)
        if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_' && c != '-' && c != '.') c = '_';
    if (out.empty() || out[0] == '-' || out[0] == '.') out.insert(0, "body_");
    return out;
}

// Puts the mesh on the table, above the origin.
SceneSource open_mesh(const std::filesystem::path& file) {
    SceneSource out;
    io::Model model = io::read_model(file);
    materials_of_colours(model.attributes);
    const geometry::Box bounds = model.mesh.bounds();
    const double size = bounds.size().maxCoeff();
    if (!(size > 0)) throw InputError(file.string(), "has no extent", "give a mesh of a solid");
    double scale = 1;
    if (size > largest_in_metres) {
        scale = 1e-3;
        out.notes.push_back(file.filename().string() + ": is " + std::to_string(static_cast<int>(size)) +
                            " long; taken as millimetres");
    }
    const Vec3 centre = bounds.center();
    for (Vec3& p : model.mesh.positions) p = scale * (p - Vec3(centre.x(), centre.y(), bounds.min.z()));
    BodySettings settings{.name = body_name_of(file)};
    settings.cell_size = geometry::cell_size_for(model.mesh, mesh_cells);
    settings.phyxel_count = mesh_phyxels;
    settings.material = {.density = mesh_density,
                         .youngs_modulus = mesh_density * standard_gravity * scale * size / mesh_sag,
                         .poisson_ratio = mesh_poisson_ratio,
                         .mass_damping = mesh_mass_damping,
                         .stiffness_damping = mesh_stiffness_damping,
                         .cutting_resistance = mesh_resistance};
    out.bodies.push_back({std::move(model), settings});
    out.description.name = file.stem().string();
    scene::BodyDescription body;
    body.name = settings.name;
    body.shape = scene::MeshShape{std::filesystem::absolute(file).lexically_normal()};
    body.placement.scale = Vec3::Constant(scale);
    body.placement.position = -scale * Vec3(centre.x(), centre.y(), bounds.min.z());
    body.cells.reset();
    body.cell_size = out.bodies.front().settings.cell_size;
    body.phyxel_count = mesh_phyxels;
    body.material.density = mesh_density;
    body.material.youngs_modulus = out.bodies.front().settings.material.youngs_modulus;
    body.material.poisson_ratio = mesh_poisson_ratio;
    body.material.mass_damping = mesh_mass_damping;
    body.material.stiffness_damping = mesh_stiffness_damping;
    body.material.cutting_resistance = mesh_resistance;
    out.description.bodies.push_back(std::move(body));
    out.description.ground = scene::GroundDescription{0, mesh_friction};
    out.description.contact.pieces = true;
    return out;
}

}  // namespace

void materials_of_colours(geometry::MeshAttributes& attributes) {
    if (attributes.corner_colour.empty() || !attributes.materials.empty()) return;
    constexpr std::size_t max_materials = 14;
    constexpr int levels = 5;  // of a channel
    std::map<std::array<int, 3>, std::size_t> counts;
    std::vector<std::array<int, 3>> keys;
    for (const auto& corners : attributes.corner_colour) {
        std::array<int, 3> key{};
        for (std::size_t k = 0; k < 3; ++k)
            key[k] = static_cast<int>(
                std::lround((levels / 3.0) * (corners[0][k] + corners[1][k] + corners[2][k])));
        keys.push_back(key);
        ++counts[key];
    }
    std::vector<std::pair<std::size_t, std::array<int, 3>>> common;
    for (const auto& [key, count] : counts) common.emplace_back(count, key);
    std::sort(common.rbegin(), common.rend());
    common.resize(std::min(common.size(), max_materials));
    for (const auto& [count, key] : common) {
        geometry::Material material;
        for (std::size_t k = 0; k < 3; ++k)
            material.colour[k] = std::pow(static_cast<float>(key[k]) / levels, 2.2F);
        attributes.materials.push_back(material);
    }
    for (const std::array<int, 3>& key : keys) {
        const auto distance = [&](const auto& one) {
            int sum = 0;
            for (std::size_t k = 0; k < 3; ++k) sum += (one.second[k] - key[k]) * (one.second[k] - key[k]);
            return sum;
        };
        const auto nearest =
            std::min_element(common.begin(), common.end(),
                             [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
        attributes.triangle_material.push_back(static_cast<std::int32_t>(nearest - common.begin()));
    }
}

SceneSource open_run_scene(const std::filesystem::path& folder) {
    SceneSource out;
    out.file = folder;
    const std::filesystem::path as_run = folder / "scene_as_run.json";
    out.description =
        scene::parse_scene_file(std::filesystem::exists(as_run) ? as_run : folder / "scene.json");
    const auto is_missing = [](const std::filesystem::path& file) {
        std::error_code error;
        return !std::filesystem::is_regular_file(file, error);
    };
    for (scene::ToolDescription& tool : out.description.tools) {
        const auto* shape = tool.instrument ? std::get_if<scene::MeshInstrument>(&*tool.instrument) : nullptr;
        if (shape == nullptr || !is_missing(shape->mesh.file)) continue;
        out.notes.push_back(tool.name + ": is drawn as a line: there is no file " +
                            shape->mesh.file.string());
        tool.instrument.reset();
    }
    std::erase_if(out.description.colliders, [&](const scene::ColliderDescription& collider) {
        const auto* mesh = collider.shape ? std::get_if<scene::MeshShape>(&*collider.shape) : nullptr;
        if (mesh == nullptr || !is_missing(mesh->file)) return false;
        out.notes.push_back(collider.name + ": is not drawn: there is no file " + mesh->file.string());
        return true;
    });
    add_tools(out, nullptr);
    return out;
}

SceneSource open_source(const std::filesystem::path& file) {
    if (!std::filesystem::is_regular_file(file))
        throw InputError(file.string(), "is no file that can be read",
                         "give a scene (.json), a mesh, a recording, a saved state or the folder of a run");
    SceneSource out;
    if (file.extension() == ".jsonl")
        throw InputError(file.string(), "is no recording of a session",
                         "give one that Recording saved; input events go to --replay-input");
    if (is_checkpoint(file)) {
        out.is_checkpoint = true;
        out.description.name = file.stem().string();
    } else {
        out = file.extension() == ".json" ? open_scene(file) : open_mesh(file);
    }
    out.file = file;
    return out;
}

}  // namespace splitcubes::view
