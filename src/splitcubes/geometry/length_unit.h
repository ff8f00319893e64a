// Units that the numbers of mesh files are in. Inside, all lengths are metres.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

#include <span>
#include <string_view>

namespace splitcubes::geometry {

/// A length of `numerator / denominator` metres. Two numbers, as a thousandth has no exact double:
/// what is read and written again in one unit keeps its digits but for the last.
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

/// m, mm, cm, inch.
std::span<const LengthUnit> length_units();
/// Throws InputError for a name that is none of theirs.
const LengthUnit& length_unit(std::string_view name);

/// Positions, and of a surface rest positions, times the factor. Nothing changes for a factor of one.
void scale(TriangleMesh& mesh, double factor);
/// Numbers of a file in `unit` to metres, and back.
void to_metres(TriangleMesh& mesh, const LengthUnit& unit);
void from_metres(SurfaceMesh& surface, const LengthUnit& unit);

}  // namespace splitcubes::geometry
