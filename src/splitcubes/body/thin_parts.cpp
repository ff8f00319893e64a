#include <splitcubes/body/thin_parts.h>
#include <splitcubes/body/tuning.h>
#include <splitcubes/geometry/distance_transform.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

namespace {

// The grid's nodes, or a subsample of them, with a layer of outside points around.
struct Lattice {
    Vec3i count;
    double step;  // m
    std::vector<std::uint8_t> inside;

    explicit Lattice(const splitting::NodeGrid& grid) {
        const Vec3i nodes = grid.rest().node_count;
        const int stride = std::max(
            1, static_cast<int>(
                   std::ceil(std::cbrt(nodes.cast<double>().prod() / tuning::set_up::max_lattice_points))));
        count = (nodes.array() - 1) / stride + 2;
        step = stride * grid.rest().cell_size;
        for (int z = 0; z < count[2]; ++z)
            for (int y = 0; y < count[1]; ++y)
                for (int x = 0; x < count[0]; ++x) {
                    const Vec3i node = stride * Vec3i(x, y, z);
                    inside.push_back(grid.rest().contains(node) && grid.inside(node));
                }
    }
};

}  // namespace

ThinParts thin_parts(const splitting::NodeGrid& grid, double thickness) {
    const Lattice lattice(grid);
    std::vector<std::uint8_t> outside(lattice.inside.size());
    std::transform(lattice.inside.begin(), lattice.inside.end(), outside.begin(),
                   [](std::uint8_t is) { return !is; });
    const std::vector<float> out = geometry::squared_distances(lattice.count, outside);
    // The boundary lies about halfway between the last inside point and the first outside point.
    const auto depth = [&](std::size_t k) { return lattice.step * (std::sqrt(out[k]) - 0.5); };
    const double radius = 0.5 * thickness;
    std::vector<std::uint8_t> core(out.size());
    for (std::size_t k = 0; k < core.size(); ++k) core[k] = lattice.inside[k] && depth(k) >= radius;
    const std::vector<float> from_core = geometry::squared_distances(lattice.count, core);
    // A cube's corner is sqrt(3) radii away from the centre of the ball that fits into it.
    const double far = std::sqrt(3.0) * radius + lattice.step;
    std::size_t all = 0;
    std::vector<double> depths;
    for (std::size_t k = 0; k < core.size(); ++k) {
        if (!lattice.inside[k]) continue;
        ++all;
        if (lattice.step * std::sqrt(from_core[k]) > far) depths.push_back(depth(k));
    }
    if (depths.empty()) return {};
    // The depth at the middle of a thin part is half its thickness; the percentile ignores the few thicker
    // points.
    const auto middle =
        depths.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(depths.size() - 1));
    std::nth_element(depths.begin(), middle, depths.end());
    return {static_cast<double>(depths.size()) / static_cast<double>(all), 2 * *middle + lattice.step};
}

}  // namespace splitcubes::body
