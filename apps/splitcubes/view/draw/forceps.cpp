#include "forceps.h"

#include <splitcubes/scene/loft.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace splitcubes::view {

namespace {

// In widths of the open forceps.
constexpr double shank_length = 5, tip_depth = 0.45, bow = 0.28, half_thickness = 0.07, half_breadth = 0.26;
constexpr double tip_share = 0.45;  // of the breadth at the tip

// Rings of a rectangular section with bevelled edges along the shank.
geometry::TriangleMesh arm(double width, double opening, int side) {
    constexpr int rings = 28;
    std::vector<std::vector<Vec3>> out;
    for (int k = 0; k <= rings; ++k) {
        const double u = static_cast<double>(k) / rings;
        const double z = width * (-tip_depth + u * (shank_length + tip_depth));
        const double t = half_thickness * width * (k == 0 ? 0.6 : 1.0);
        // Inner faces meet where the forceps are shut, and at the far end.
        const double gap =
            0.5 * opening * (1 - u) + bow * width * std::sin(std::numbers::pi * std::pow(u, 0.8)) + 0.9 * t;
        const double b = half_breadth * width * std::min(1.0, tip_share + 1.6 * u);
        const double x = side * gap;
        out.push_back({{x - t, -0.8 * b, z},
                       {x - 0.6 * t, -b, z},
                       {x + 0.6 * t, -b, z},
                       {x + t, -0.8 * b, z},
                       {x + t, 0.8 * b, z},
                       {x + 0.6 * t, b, z},
                       {x - 0.6 * t, b, z},
                       {x - t, 0.8 * b, z}});
    }
    return scene::loft(out);
}

}  // namespace

std::vector<scene::InstrumentPart> forceps_parts(double width, double opening, bool is_strained) {
    geometry::Finish finish;
    finish.colour = is_strained ? Vec3(0.85, 0.16, 0.10) : Vec3(0.78, 0.80, 0.83);
    finish.roughness = 0.3;
    finish.metalness = is_strained ? 0.2 : 0.9;
    std::vector<scene::InstrumentPart> out;
    for (const int side : {1, -1}) out.push_back({arm(width, opening, side), finish, false});
    return out;
}

}  // namespace splitcubes::view
