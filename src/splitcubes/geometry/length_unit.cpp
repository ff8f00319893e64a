#include <splitcubes/core/error.h>
#include <splitcubes/geometry/length_unit.h>

#include <array>

namespace splitcubes::geometry {

namespace {

constexpr std::array<LengthUnit, 4> units = {
    {{"m", 1, 1}, {"mm", 1, 1000}, {"cm", 1, 100}, {"inch", 254, 10000}}};

}  // namespace

std::span<const LengthUnit> length_units() {
    return units;
}

const LengthUnit& length_unit(std::string_view name) {
    for (const LengthUnit& unit : units)
        if (unit.name == name) return unit;
    throw InputError("unit", "'" + printable(std::string(name)) + "' is not known", "use m, mm, cm or inch");
}

void scale(TriangleMesh& mesh, double factor) {
    if (factor == 1) return;
    for (Vec3& p : mesh.positions) p *= factor;
}

void to_metres(TriangleMesh& mesh, const LengthUnit& unit) {
    if (unit.is_metre()) return;
    for (Vec3& p : mesh.positions) p = p * unit.numerator / unit.denominator;
}

void from_metres(SurfaceMesh& surface, const LengthUnit& unit) {
    if (unit.is_metre()) return;
    for (std::vector<Vec3>* positions : {&surface.mesh.positions, &surface.rest})
        for (Vec3& p : *positions) p = p * unit.denominator / unit.numerator;
}

}  // namespace splitcubes::geometry
