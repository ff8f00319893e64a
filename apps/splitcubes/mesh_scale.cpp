#include "mesh_scale.h"

#include "command_line.h"

#include <splitcubes/core/plain_number.h>
#include <splitcubes/geometry/coordinate_limit.h>
#include <splitcubes/io/write_mesh.h>

namespace splitcubes::app {

namespace {
constexpr int reported_digits = 6;
}  // namespace

void add_unit_option(Command& command, std::string& unit_name, const std::string& help) {
    std::vector<std::string> names;
    for (const geometry::LengthUnit& unit : geometry::length_units()) names.emplace_back(unit.name);
    command.add_choice("--unit", "UNIT", unit_name, names, help);
}

void MeshScale::add_to(Command& command) {
    add_unit_option(command, unit_name,
                    "Unit of lengths in mesh files, read and written, and of this command: m (default), mm, "
                    "cm or inch; reports are in metres");
    command.add_number("--scale", "FACTOR", scale, {1e-9, 1e9}, "Scales all input by this factor (1)");
}

void MeshScale::apply(geometry::TriangleMesh& mesh, const std::string& name) const {
    geometry::scale(mesh, scale);
    // Tested in the unit, so that the output can be read again.
    if (scale > 1) geometry::require_coordinates(mesh, name, " with --scale " + plain_number(scale));
    geometry::to_metres(mesh, unit());
}

std::string MeshScale::volume_text(double volume) const {
    return plain_number(unit().volume_from_metres(volume), reported_digits) + " " + unit_name + "^3";
}

std::string MeshScale::area_text(double area) const {
    return plain_number(unit().area_from_metres(area), reported_digits) + " " + unit_name + "^2";
}

void write_scaled(const std::filesystem::path& path, const geometry::SurfaceMesh& surface,
                  const MeshScale& scale) {
    if (scale.unit().is_metre()) return io::write_mesh(path, surface);
    geometry::SurfaceMesh copy = surface;
    geometry::from_metres(copy, scale.unit());
    io::write_mesh(path, copy);
}

}  // namespace splitcubes::app
