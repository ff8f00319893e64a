// Area of the cuts of a surface.
#pragma once

#include <splitcubes/splitting/surface.h>

namespace splitcubes::splitting {

/// Returns the area, m^2 at rest, of one side of all cuts.
inline double area_of_cut(const NodeGrid& grid, const Surface& surface) {
    double area = 0;
    for (const SurfaceCell& cell : surface.cells())
        for (const SurfaceQuad& quad : surface.quads(cell)) {
            if (grid.crossing(quad.crossing).origin != Origin::cut) continue;
            const auto at = [&](std::size_t k) { return surface.vertices()[quad.vertices[k]].rest; };
            area += 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).norm();
            area += 0.5 * (at(2) - at(0)).cross(at(3) - at(0)).norm();
        }
    return 0.5 * area;
}

}  // namespace splitcubes::splitting
