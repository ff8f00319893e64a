#include "mesh_scale.h"

#include "command_line.h"

#include <splitcubes/io/write_mesh.h>

#include <sstream>

namespace splitcubes::app {

namespace {

std::string number_text(double value) {
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text << value;
    return text.str();
}

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
    command.add_number("--scale", "FACTOR", scale, {1e-9, 1e9},
                       "Makes all that is read so many times as large (1)");
}

void MeshScale::apply(geometry::TriangleMesh& mesh) const {
    geometry::scale(mesh, scale);
    geometry::to_metres(mesh, unit());
}

std::string MeshScale::volume_text(double volume) const {
    return number_text(unit().volume_from_metres(volume)) + " " + unit_name + "^3";
}

std::string MeshScale::area_text(double area) const {
    return number_text(unit().area_from_metres(area)) + " " + unit_name + "^2";
}

void write_scaled(const std::filesystem::path& path, const geometry::SurfaceMesh& surface,
                  const MeshScale& scale) {
    if (scale.unit().is_metre()) return io::write_mesh(path, surface);
    geometry::SurfaceMesh copy = surface;
    geometry::from_metres(copy, scale.unit());
    io::write_mesh(path, copy);
}

}  // namespace splitcubes::app
