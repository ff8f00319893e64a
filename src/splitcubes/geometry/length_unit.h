// Length units of mesh files. Internally all lengths are in metres.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

#include <span>
#include <string_view>

namespace splitcubes::geometry {

/// A unit of `numerator / denominator` metres. A fraction, since 0.001 has no exact double: lengths that are
/// read and written in the same unit keep all digits except the last.
struct LengthUnit {
    std::string_view name = "m";
    double numerator = 1, denominator = 1;

    bool is_metre() const { return numerator == denominator; }
    double to_metres(double length) const { return length * numerator / denominator; }
    double from_metres(double length) const { return length * denominator / numerator; }
    double volume_to_metres(double volume) const { return to_metres(to_metres(to_metres(volume))); }
    double volume_from_metres(double volume) const { return from_metres(from_metres(from_metres(volume))); }
    double area_from_metres(double area) const { return from_metres(from_metres(area)); }
};

/// Returns the known units: m, mm, cm, inch.
std::span<const LengthUnit> length_units();
/// Returns the unit of a name; throws InputError for an unknown name.
const LengthUnit& length_unit(std::string_view name);

/// Multiplies the positions by the factor; a factor of one changes nothing.
void scale(TriangleMesh& mesh, double factor);
/// Converts coordinates of a file in `unit` to metres, and back (also a surface's rest positions).
void to_metres(TriangleMesh& mesh, const LengthUnit& unit);
void from_metres(SurfaceMesh& surface, const LengthUnit& unit);

}  // namespace splitcubes::geometry
