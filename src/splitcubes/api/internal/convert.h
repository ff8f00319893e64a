// From the public interface's values to the library's, checked.
#pragma once

#include <splitcubes/api/mesh.h>
#include <splitcubes/api/settings.h>
#include <splitcubes/body/body_settings.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/world/world.h>

#include <optional>
#include <string>

namespace splitcubes::api {

// All throw InputError(where, ...) for what is not finite or out of range.

inline Vector3 public_vector(const Vec3& v) {
    return {v.x(), v.y(), v.z()};
}
Vec3 vector_of(const Vector3& v, const std::string& where);
Isometry isometry_of(const Pose& pose, const std::string& where);
/// The rest is checked by those who use it.
geometry::TriangleMesh mesh_of(const MeshView& mesh, const std::string& where);
io::Model model_of(const MeshView& mesh, const std::string& where);
cutting::BladeShape blade_shape_of(const BladeView& blade, const std::string& where);
/// Places a model and returns the settings of its body.
body::BodySettings place_body(io::Model& model, const BodySettings& settings);
std::function<bool(const Vec3& rest)> region_of(const Region& region, const std::string& where);
body::WorldSettings world_settings_of(const SimulationSettings& settings);
meshless::Material material_of(const MaterialSettings& settings, const std::string& where);
MaterialSettings public_material(const meshless::Material& material);
/// Replaces strength and ratio of settings that tear already, else makes new ones.
std::optional<body::TearSettings> tear_settings_of(const std::optional<TearingSettings>& settings,
                                                   const std::optional<body::TearSettings>& present);
void change_step_settings(body::WorldSettings& settings, const StepSettings& wanted, std::int64_t steps);
void require_at_least_zero(double value, const std::string& where);
/// Throws InputError unless a coefficient, if there is one, is between 0 and 1.
void require_coefficient(const std::optional<double>& value, const std::string& where);
void require_above_zero(double value, const std::string& where);

}  // namespace splitcubes::api
