#include <splitcubes/api/internal/convert.h>
#include <splitcubes/api/internal/tuning.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/geometry/coordinate_limit.h>
#include <splitcubes/geometry/rest_grid.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::api {

namespace {

std::string number_text(double value) {
    return plain_number(value, 6);
}

template <class T>
void require_data(std::span<const T> values, std::size_t each, const std::string& where) {
    if (values.data() == nullptr && !values.empty())
        throw InputError(where, "is a null pointer with a size (" + std::to_string(values.size()) + ")");
    if (values.size() % each != 0)
        throw InputError(where, "has " + std::to_string(values.size()) + " numbers",
                         "give " + std::to_string(each) + " for each");
}

Vec3 direction_of(const Vector3& v, const std::string& where) {
    const Vec3 out = vector_of(v, where);
    if (!(out.stableNorm() > 0)) throw InputError(where, "has no direction", "give a vector other than zero");
    return out.stableNormalized();
}

}  // namespace

void require_at_least_zero(double value, const std::string& where) {
    if (!(value >= 0 && value <= tuning::input::max_setting))
        throw InputError(where, "must be finite and not below zero (" + number_text(value) + ")");
}

void require_coefficient(const std::optional<double>& value, const std::string& where) {
    if (value && !(*value >= 0 && *value <= 1))
        throw InputError(where, "is not between 0 and 1 (" + number_text(*value) + ")");
}

void require_above_zero(double value, const std::string& where) {
    if (!(value > 0 && value <= tuning::input::max_setting))
        throw InputError(where, "must be finite and above zero (" + number_text(value) + ")");
}

Vec3 vector_of(const Vector3& v, const std::string& where) {
    const Vec3 out(v.x, v.y, v.z);
    if (!(out.cwiseAbs().maxCoeff() <= geometry::max_coordinate) || !out.allFinite())
        throw InputError(where, "is not finite or beyond 1e9");
    return out;
}

Isometry isometry_of(const Pose& pose, const std::string& where) {
    Quat rotation(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z);
    if (!rotation.coeffs().allFinite() || !(rotation.coeffs().stableNorm() > 0))
        throw InputError(where + ", rotation", "is not a rotation",
                         "give a finite quaternion other than zero");
    rotation.coeffs() = rotation.coeffs().stableNormalized().eval();
    Isometry out = Isometry::Identity();
    out.linear() = rotation.toRotationMatrix();
    out.translation() = vector_of(pose.position, where + ", position");
    return out;
}

geometry::TriangleMesh mesh_of(const MeshView& mesh, const std::string& where) {
    require_data(mesh.positions, 3, where + ", positions");
    require_data(mesh.triangles, 3, where + ", triangles");
    if (mesh.triangles.empty()) throw InputError(where, "has no triangles");
    geometry::TriangleMesh out;
    out.positions.resize(mesh.positions.size() / 3);
    for (std::size_t v = 0; v < out.positions.size(); ++v)
        out.positions[v] = Vec3(mesh.positions[3 * v], mesh.positions[3 * v + 1], mesh.positions[3 * v + 2]);
    geometry::require_coordinates(out, where);
    out.triangles.resize(mesh.triangles.size() / 3);
    for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
        if (mesh.triangles[k] >= out.positions.size())
            throw InputError(where + ", triangle " + std::to_string(k / 3),
                             "uses vertex " + std::to_string(mesh.triangles[k]) + " of " +
                                 std::to_string(out.positions.size()));
        out.triangles[k / 3][k % 3] = mesh.triangles[k];
    }
    return out;
}

io::Model model_of(const MeshView& mesh, const std::string& where) {
    io::Model out{mesh_of(mesh, where), {}};
    const std::size_t count = out.mesh.triangles.size();
    require_data(mesh.corner_uv, 6, where + ", corner_uv");
    require_data(mesh.triangle_material, 1, where + ", triangle_material");
    if (!mesh.corner_uv.empty() && mesh.corner_uv.size() != 6 * count)
        throw InputError(where + ", corner_uv", "is of another number of triangles",
                         "give six numbers a triangle");
    if (!mesh.triangle_material.empty() && mesh.triangle_material.size() != count)
        throw InputError(where + ", triangle_material", "is of another number of triangles",
                         "give one number a triangle");
    out.attributes.corner_uv.resize(mesh.corner_uv.size() / 6);
    for (std::size_t k = 0; k < mesh.corner_uv.size(); ++k) {
        if (!std::isfinite(mesh.corner_uv[k]))
            throw InputError(where + ", corner_uv of triangle " + std::to_string(k / 6), "is not finite");
        out.attributes.corner_uv[k / 6][k % 6 / 2][k % 2] = mesh.corner_uv[k];
    }
    constexpr std::int32_t max_materials = 65536;
    std::int32_t last = -1;
    for (const std::int32_t material : mesh.triangle_material) {
        if (material < -1 || material >= max_materials)
            throw InputError(where + ", triangle_material",
                             "has a number out of range (" + std::to_string(material) + ")",
                             "give -1 to 65535");
        last = std::max(last, material);
    }
    out.attributes.triangle_material.assign(mesh.triangle_material.begin(), mesh.triangle_material.end());
    for (std::int32_t k = 0; k <= last; ++k)
        out.attributes.materials.emplace_back().name = "material " + std::to_string(k);
    return out;
}

cutting::BladeShape blade_shape_of(const BladeView& blade, const std::string& where) {
    require_data(blade.points, 1, where + ", points");
    cutting::BladeShape out{{{}}};
    for (std::size_t k = 0; k < blade.points.size(); ++k)
        out.polylines[0].push_back(vector_of(blade.points[k], where + ", point " + std::to_string(k)));
    return out;
}

body::BodySettings place_body(io::Model& model, const BodySettings& s) {
    const std::string where = "body '" + s.name + "'";
    require_above_zero(s.scale, where + ", scale");
    require_at_least_zero(s.cell_size, where + ", cell size");
    if (s.cell_size == 0 && (s.cells < 1 || s.cells > geometry::max_cells_per_axis))
        throw InputError(where + ", cells", "out of range (" + std::to_string(s.cells) + ")",
                         "give 1 to 1024");
    body::BodySettings out;
    out.pose = isometry_of(s.placement, where + ", placement");
    geometry::TriangleMesh placed = model.mesh;
    for (std::size_t k = 0; k < placed.positions.size(); ++k) {
        model.mesh.positions[k] *= s.scale;
        placed.positions[k] = out.pose * model.mesh.positions[k];
    }
    geometry::require_coordinates(model.mesh, where);
    geometry::require_coordinates(placed, where);
    out.name = s.name;
    out.cell_size = s.cell_size > 0 ? s.cell_size : geometry::cell_size_for(model.mesh, s.cells);
    out.phyxel_count = s.phyxel_count;
    require_at_least_zero(s.phyxel_spacing, where + ", phyxel spacing");
    out.phyxel_spacing = s.phyxel_spacing;
    out.material = material_of(s.material, where);
    out.velocity = vector_of(s.velocity, where + ", velocity");
    out.angular_velocity = vector_of(s.angular_velocity, where + ", angular velocity");
    out.tearing = tear_settings_of(s.tearing, {});
    return out;
}

meshless::Material material_of(const MaterialSettings& s, const std::string& where) {
    require_at_least_zero(s.cutting_resistance, where + ", cutting resistance");
    meshless::Material out;
    out.density = s.density;
    out.youngs_modulus = s.youngs_modulus;
    out.poisson_ratio = s.poisson_ratio;
    out.mass_damping = s.mass_damping;
    out.stiffness_damping = s.stiffness_damping;
    out.cutting_resistance = s.cutting_resistance;
    if (s.plasticity) out.plasticity = {s.plasticity->yield, s.plasticity->creep, s.plasticity->maximum};
    return out;
}

MaterialSettings public_material(const meshless::Material& m) {
    MaterialSettings out{m.density,
                         m.youngs_modulus,
                         m.poisson_ratio,
                         m.mass_damping,
                         m.stiffness_damping,
                         m.cutting_resistance,
                         {}};
    if (m.plasticity) out.plasticity = {m.plasticity->yield, m.plasticity->creep, m.plasticity->maximum};
    return out;
}

std::optional<body::TearSettings> tear_settings_of(const std::optional<TearingSettings>& settings,
                                                   const std::optional<body::TearSettings>& present) {
    if (!settings) return {};
    body::TearSettings out = present.value_or(body::TearSettings{});
    out.strength = settings->strength;
    out.propagation_ratio = settings->propagation_ratio;
    return out;
}

void change_step_settings(body::WorldSettings& s, const StepSettings& wanted, std::int64_t steps) {
    require_above_zero(wanted.time_step, "step settings, time step");
    require_at_least_zero(wanted.contact_friction, "step settings, contact friction");
    require_coefficient(wanted.restitution, "step settings, restitution");
    if (wanted.ground_friction.has_value() != s.ground.has_value())
        throw InputError("step settings, ground friction",
                         s.ground ? "is missing, and there is a ground" : "is given, and there is no ground",
                         s.ground ? "give one" : "leave it out");
    if (wanted.ground_friction) {
        require_at_least_zero(*wanted.ground_friction, "step settings, ground friction");
        s.ground->friction = *wanted.ground_friction;
    }
    s.gravity = vector_of(wanted.gravity, "step settings, gravity");
    s.contact.friction = wanted.contact_friction;
    s.contact.restitution = wanted.restitution;
    s.start_time += static_cast<double>(steps) * (s.time_step - wanted.time_step);
    s.time_step = wanted.time_step;
}

std::function<bool(const Vec3& rest)> region_of(const Region& region, const std::string& where) {
    if (const auto* box = std::get_if<BoxRegion>(&region)) {
        const Vec3 low = vector_of(box->low, where + ", low"), high = vector_of(box->high, where + ", high");
        return [low, high](const Vec3& p) {
            return (p.array() >= low.array()).all() && (p.array() <= high.array()).all();
        };
    }
    if (const auto* sphere = std::get_if<SphereRegion>(&region)) {
        require_above_zero(sphere->radius, where + ", radius");
        return [centre = vector_of(sphere->centre, where + ", centre"), r = sphere->radius](const Vec3& p) {
            return (p - centre).squaredNorm() <= r * r;
        };
    }
    const RegionTest test = std::get<RegionTest>(region);
    if (!test) throw InputError(where, "is an empty function");
    return [test](const Vec3& p) { return test(public_vector(p)); };
}

body::WorldSettings world_settings_of(const SimulationSettings& s) {
    require_above_zero(s.time_step, "simulation, time step");
    require_at_least_zero(s.contact.friction, "simulation, contact friction");
    require_coefficient(s.contact.restitution, "simulation, restitution");
    require_above_zero(s.solver.tolerance, "simulation, solver tolerance");
    if (s.solver.max_iterations < 1)
        throw InputError("simulation, solver iterations",
                         "below 1 (" + std::to_string(s.solver.max_iterations) + ")");
    if (s.thread_count < 0 || s.thread_count > 1024)
        throw InputError("simulation, thread count", "out of range (" + std::to_string(s.thread_count) + ")",
                         "give 0 to 1024");
    body::WorldSettings out;
    out.time_step = s.time_step;
    out.gravity = vector_of(s.gravity, "simulation, gravity");
    if (s.ground) {
        require_at_least_zero(s.ground->friction, "simulation, ground friction");
        if (!(std::abs(s.ground->offset) <= geometry::max_coordinate))
            throw InputError("simulation, ground offset", "is not finite or beyond 1e9");
        out.ground = {direction_of(s.ground->normal, "simulation, ground normal"), s.ground->offset,
                      s.ground->friction};
    }
    out.contact.pieces = s.contact.pieces;
    out.contact.friction = s.contact.friction;
    out.contact.restitution = s.contact.restitution;
    if (s.solver.explicit_steps) out.solver.kind = meshless::SolverKind::explicit_steps;
    switch (s.solver.integrator) {
        case Integrator::bdf2:
            out.solver.scheme = meshless::TimeScheme::bdf2;
            break;
        case Integrator::backward_euler:
            out.solver.scheme = meshless::TimeScheme::backward_euler;
            break;
        case Integrator::tr_bdf2:
            out.solver.scheme = meshless::TimeScheme::tr_bdf2;
            break;
        default:
            throw InputError("simulation, integrator",
                             "is unknown (" + std::to_string(static_cast<int>(s.solver.integrator)) + ")");
    }
    out.solver.tolerance = s.solver.tolerance;
    out.solver.max_iterations = s.solver.max_iterations;
    return out;
}

}  // namespace splitcubes::api
