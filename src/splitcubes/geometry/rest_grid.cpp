#include <splitcubes/core/error.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/geometry/rest_grid.h>
#include <splitcubes/geometry/shape_frame.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::geometry {

namespace {
std::string text_of(double value) {
    return plain_number(value, 6);
}
}  // namespace

RestGrid grid_around(const Box& box, double cell_size) {
    if (box.empty()) throw InputError("grid", "there is nothing to cover", "give a mesh with triangles");
    if (!(cell_size > 0) || !std::isfinite(cell_size))
        throw InputError("cell size", "must be a positive number of metres, got " + text_of(cell_size));
    if (!(std::max(box.min.cwiseAbs().maxCoeff(), box.max.cwiseAbs().maxCoeff()) <= max_coordinate))
        throw InputError("mesh", "reaches beyond " + text_of(max_coordinate) + " m",
                         "give smaller coordinates");
    RestGrid grid;
    grid.cell_size = cell_size;
    for (int axis = 0; axis < 3; ++axis) {
        const double cells = box.size()[axis] / cell_size;
        if (!(cells <= max_cells_per_axis))
            throw InputError("cell size",
                             text_of(cell_size) + " m makes " + text_of(std::ceil(cells)) +
                                 " cells along an axis, more than " + text_of(max_cells_per_axis),
                             "choose a larger cell size or fewer cells");
        // Nodes are at centre + (k - (n-1)/2) h. Takes the parity of n whose nodes are
        // farther from the box's faces.
        const double half = cells / 2;
        const auto distance_to_node = [&](double offset) {
            const double steps = half - offset;
            return std::abs(steps - std::round(steps));
        };
        const bool even = distance_to_node(0.5) >= distance_to_node(0.0);
        const double first = even ? 0.5 : 0.0;  // the nodes nearest to the centre, in cells
        const int outward = static_cast<int>(std::ceil(half - first)) + 1;
        const int count = even ? 2 * (outward + 1) : 2 * outward + 1;
        grid.node_count[axis] = count;
        grid.origin[axis] = box.center()[axis] - 0.5 * (count - 1) * cell_size;
    }
    return grid;
}

double cell_size_for(const Box& box, int cells) {
    if (cells < 2 || cells > max_cells_per_axis)
        throw InputError("cells", text_of(cells) + " is outside 2.." + text_of(max_cells_per_axis));
    const double longest = box.size().maxCoeff();
    if (!(longest > 0)) throw InputError("mesh", "has no extent", "give a mesh that encloses volume");
    return longest / cells;
}

double cell_size_for(const TriangleMesh& mesh, int cells) {
    const Mat3 mesh_axes = shape_frame(mesh).transpose();
    Box bounds;
    for (const Vec3& p : mesh.positions) bounds.add(mesh_axes * p);
    return cell_size_for(bounds, cells);
}

}  // namespace splitcubes::geometry
