#include <splitcubes/body_samples/centroids.h>
#include <splitcubes/body_samples/elastic_samples.h>
#include <splitcubes/body_samples/material_nodes.h>
#include <splitcubes/body_samples/placement.h>
#include <splitcubes/body_samples/tuning.h>
#include <splitcubes/core/memory.h>
#include <splitcubes/geometry/box.h>
#include <splitcubes/samples/sampling.h>
#include <splitcubes/splitting/node_grid.h>

#include <cmath>

namespace splitcubes::body {

namespace {

// Estimated bytes of phyxels with their links and their share of the nodes; measured.
double phyxel_memory(double count) {
    return tuning::set_up::bytes_per_phyxel * count;
}

std::vector<Vec3> lattice_positions(const SampleContext& context, double spacing) {
    geometry::Box box;
    for (const Vec3& rest : context.nodes.rest_position) box.add(rest);
    box = box.grown(0.5 * context.grid.rest().cell_size);
    // No point of a full lattice is farther than 0.87 spacings from a sample.
    return meshless::sample_solid(
        box, spacing, [&](const Vec3& candidate) { return point_in_material(context, candidate); },
        context.nodes.rest_position, 0.95 * spacing, context.parallel);
}

// Returns the positions for about `count` phyxels and sets their spacing, m. The count scales with the
// inverse cube of the spacing; the best of a few attempts is kept.
std::vector<Vec3> positions_by_count(const SampleContext& context, double volume, int count,
                                     double& spacing) {
    std::vector<Vec3> positions;
    double tried_spacing = std::cbrt(volume / count);
    double best_error = 1e300;
    for (int attempt = 0; attempt < 6; ++attempt) {
        std::vector<Vec3> tried = lattice_positions(context, tried_spacing);
        const double ratio = static_cast<double>(tried.size()) / count;
        if (std::abs(std::log(ratio)) < best_error) {
            best_error = std::abs(std::log(ratio));
            spacing = tried_spacing;
            positions = std::move(tried);
        }
        tried_spacing *= std::cbrt(ratio);
    }
    return positions;
}

}  // namespace

std::optional<Vec3> point_in_material(const SampleContext& context, const Vec3& candidate) {
    const Vec3i node = context.grid.rest().to_grid(candidate).array().round().cast<int>();
    if (!context.grid.rest().contains(node) || !context.grid.inside(node)) return std::nullopt;
    const Vec3 at_node = context.grid.rest().node_position(node);
    return context.occluders.segment_blocked(at_node, candidate) ? at_node : candidate;
}

std::vector<Vec3> boundary_points(const SampleContext& context) {
    std::vector<Vec3> out;
    for (const splitting::Crossing& c : context.grid.crossings())
        if (c.origin == splitting::Origin::boundary) out.push_back(context.grid.crossing_position(c));
    return out;
}

std::vector<Vec3> place_phyxels(const SampleContext& context, const SampleSettings& settings,
                                double& spacing) {
    const double volume = context.nodes.total_volume();
    spacing = settings.spacing;
    require_memory("phyxels", phyxel_memory(spacing > 0 ? volume / std::pow(spacing, 3) : settings.count),
                   spacing > 0 ? "use a larger phyxel spacing" : "use fewer phyxels");
    std::vector<Vec3> positions = spacing > 0 ? lattice_positions(context, spacing)
                                              : positions_by_count(context, volume, settings.count, spacing);
    if (settings.at_centroids) move_to_centroids(context, spacing, positions);
    return positions;
}

}  // namespace splitcubes::body
