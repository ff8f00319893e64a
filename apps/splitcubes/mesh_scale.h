// Unit and scale of mesh files: --unit and --scale.
#pragma once

#include <splitcubes/geometry/length_unit.h>

#include <filesystem>
#include <string>
#include <vector>

namespace splitcubes::app {

class Command;

/// Files are read and written in `unit`; input is scaled by `scale`. Lengths on the command line are in
/// `unit`, after scaling.
struct MeshScale {
    std::string unit_name = "m";
    double scale = 1;

    /// Adds --unit and --scale.
    void add_to(Command& command);

    const geometry::LengthUnit& unit() const { return geometry::length_unit(unit_name); }
    /// Returns metres of the result per unit of an input coordinate.
    double factor() const { return unit().to_metres(scale); }
    /// Converts a mesh that was read from the file `name` to metres of the result. Throws InputError if it
    /// becomes too large (geometry::require_coordinates).
    void apply(geometry::TriangleMesh& mesh, const std::string& name) const;
    /// Returns "1.5 mm^3" for a volume in m^3.
    std::string volume_text(double volume) const;
    std::string area_text(double area) const;
};

/// Adds --unit alone, for displayed quantities.
void add_unit_option(Command& command, std::string& unit_name, const std::string& help);

/// Writes a mesh in the unit.
void write_scaled(const std::filesystem::path& path, const geometry::SurfaceMesh& surface,
                  const MeshScale& scale);

}  // namespace splitcubes::app
