// Vertices of cuts stay within the boundary of the solid.
#include <splitcubes/splitting/surface.h>
#include <splitcubes/splitting/tuning.h>

#include <algorithm>

namespace splitcubes::splitting {

// Moves a vertex back on its way from `inner` where that passes a tangent plane of the boundary in the cells
// that it reaches, at least those between the nodes `low` and `high`; nodes, from `origin`. A crease that is
// followed beyond its cell would leave the solid. A plane that `inner` lies beyond belongs to a concave
// boundary or to another part of it. is_rim: the vertex is of the boundary, too.
Vec3 Surface::within_boundary(const NodeGrid& grid, const Vec3i& origin, Vec3i low, Vec3i high,
                              const Vec3& point, const Vec3& inner, bool is_rim) {
    const double tolerance =
        is_rim ? tuning::placement::rim_tolerance : tuning::placement::boundary_tolerance;
    constexpr double rounding = 1e-9;
    low = low.cwiseMin((point.array() + rounding).floor().matrix().cast<int>());
    high = high.cwiseMax((point.array() - rounding).ceil().matrix().cast<int>());
    double share = 1;
    const auto keep_below = [&](const GridEdge& edge) {
        if (!grid.has_edge(edge) || grid.inside(edge.node) == grid.inside(edge.upper())) return;
        const Crossing& crossing = grid.crossing(grid.slot(edge));
        Vec3 position = (edge.node - origin).cast<double>();
        position[edge.axis] += crossing.hit;
        const Vec3 outward = grid.inside(edge.node) ? crossing.normal : Vec3(-crossing.normal);
        const double depth = tolerance - outward.dot(inner - position);
        const double rise = outward.dot(point - inner);
        if (depth >= 0 && rise > depth) share = std::min(share, depth / rise);
    };
    for (int z = low.z(); z <= high.z(); ++z)
        for (int y = low.y(); y <= high.y(); ++y)
            for (int x = low.x(); x <= high.x(); ++x)
                for (int axis = 0; axis < 3; ++axis)
                    if (Vec3i(x, y, z)[axis] < high[axis]) keep_below({origin + Vec3i(x, y, z), axis});
    return inner + share * (point - inner);
}

}  // namespace splitcubes::splitting
