#include <splitcubes/body_samples/elastic_samples.h>
#include <splitcubes/body_samples/ligaments.h>
#include <splitcubes/body_samples/material_nodes.h>
#include <splitcubes/body_samples/placement.h>
#include <splitcubes/body_samples/topology_change.h>
#include <splitcubes/body_samples/tuning.h>
#include <splitcubes/splitting/pieces.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace splitcubes::body {

Vec3i owner_of(const SampleContext& context, const Vec3& rest, const Vec3i& fallback,
               const std::function<bool(std::int32_t piece)>& accepts) {
    const Vec3 at = context.grid.rest().to_grid(rest);
    const Vec3i base = at.array().round().cast<int>();
    Vec3i best = fallback;
    double best_distance = 1e300;
    for (int k = 0; k < 27; ++k) {
        const Vec3i node = base + Vec3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
        if (!context.grid.rest().contains(node) || !context.grid.inside(node)) continue;
        const double distance = (node.cast<double>() - at).squaredNorm();
        if (distance >= best_distance) continue;
        if (!accepts(context.pieces.piece_of(context.grid, node))) continue;
        if (context.occluders.segment_blocked(context.grid.rest().node_position(node), rest)) continue;
        best = node;
        best_distance = distance;
    }
    return best;
}

ElasticSamples::ElasticSamples(std::unique_ptr<occlusion::Criterion> own_criterion)
    : criterion(std::move(own_criterion)) {}

ElasticSamples::~ElasticSamples() = default;

void ElasticSamples::place(const SampleContext& context, const SampleSettings& settings) {
    const std::string body = "body '" + settings.body + "'";
    const std::vector<Vec3> positions = place_phyxels(context, settings, spacing);
    owner.resize(positions.size());
    context.parallel.for_each(positions.size(), 256, [&](std::size_t i) {
        const Vec3i nearest = context.grid.rest().to_grid(positions[i]).array().round().cast<int>();
        owner[i] = owner_of(context, positions[i], nearest, [](std::int32_t) { return true; });
    });
    for (std::size_t i = 0; i < positions.size(); ++i)
        phyxels.append(positions[i], 0.5 * spacing, context.pieces.piece_of(context.grid, owner[i]));
    set_contact_radii(context);
    context.parallel.begin(body + ": links");
    rebuild_locator();
    meshless::compute_support_radii(phyxels, locator, context.parallel);
    pairs = meshless::find_pairs(phyxels, locator, context.parallel);
    std::vector<std::uint32_t> all(pairs.size());
    std::iota(all.begin(), all.end(), 0U);
    evaluate_pairs(context, all);
    context.parallel.begin(body + ": volumes");
    lumping = meshless::lump(context.nodes.for_lumping(), phyxels, locator, context.parallel);
    meshless::apply(lumping, context.nodes.for_lumping(), context.material.density, phyxels);
    context.parallel.begin(body + ": gradients");
    neighbourhoods.rebuild(phyxels, pairs, context.material, context.parallel);
    set_motion(context, settings);
    initial_count = phyxels.size();
}

// Moves the phyxels to the pose and gives them their velocities.
void ElasticSamples::set_motion(const SampleContext& context, const SampleSettings& settings) {
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        phyxels.position[i] = phyxels.previous_position[i] = context.pose * phyxels.rest_position[i];
        phyxels.deformation[i] = phyxels.rotation[i] = context.pose.linear();
    }
    const Vec3 centre = meshless::total_momenta(phyxels).centre;
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        phyxels.velocity[i] =
            settings.velocity + settings.angular_velocity.cross(phyxels.position[i] - centre);
        phyxels.previous_velocity[i] = phyxels.velocity[i];
    }
    previous_deformation = phyxels.deformation;
}

// Sets the contact radius of phyxels to their distance from the boundary, so that a phyxel touches the
// ground when the boundary next to it would.
void ElasticSamples::set_contact_radii(const SampleContext& context) {
    const std::vector<Vec3> boundary = boundary_points(context);
    if (boundary.empty()) return;
    const double max_radius = 0.75 * spacing;
    const meshless::PhyxelLocator near_boundary(boundary, max_radius);
    context.parallel.for_each(phyxels.size(), 256, [&](std::size_t i) {
        double distance = max_radius;
        near_boundary.visit(phyxels.rest_position[i], max_radius, [&](std::uint32_t index) {
            distance = std::min(distance, (boundary[index] - phyxels.rest_position[i]).norm());
            return true;
        });
        phyxels.contact_radius[i] = distance;
    });
}

void ElasticSamples::rebuild_locator() {
    locator = meshless::PhyxelLocator(phyxels.rest_position, 1.6 * spacing);
}

void ElasticSamples::append_links(const SampleContext& context, TopologyChange& change) {
    const std::size_t known = neighbourhoods.size(), known_pairs = pairs.size();
    rebuild_locator();
    meshless::compute_support_radii(phyxels, locator, context.parallel, {}, known);
    meshless::append_pairs(phyxels, locator, known, pairs, context.parallel);
    std::vector<std::uint32_t> unknown;
    // Such a criterion may judge other pairs differently with more phyxels around.
    const std::size_t first = criterion->depends_on_others() ? 0 : known_pairs;
    for (std::size_t k = first; k < pairs.size(); ++k) unknown.push_back(static_cast<std::uint32_t>(k));
    change.dirty_pairs.insert(change.dirty_pairs.end(), unknown.begin(), unknown.end());
    evaluate_pairs(context, unknown);
    neighbourhoods.append(phyxels, pairs, change.dirty_pairs, context.material, context.parallel);
    change.dirty_pairs.clear();
    std::vector<std::uint32_t> linked;
    for (const Gap& gap : change.gaps) linked.insert(linked.end(), {gap.inside, gap.around});
    for (std::size_t k = first; k < pairs.size(); ++k) linked.insert(linked.end(), {pairs.a[k], pairs.b[k]});
    // A phyxel that no pair reaches is found beside any other one of its piece.
    std::vector<std::uint8_t> has_new(context.pieces.count(), 0);
    for (std::size_t i = known; i < phyxels.size(); ++i) {
        linked.push_back(static_cast<std::uint32_t>(i));
        has_new[static_cast<std::size_t>(phyxels.piece[i])] = 1;
    }
    for (std::uint32_t i = 0; i < known; ++i) {
        std::uint8_t& is_wanted = has_new[static_cast<std::size_t>(phyxels.piece[i])];
        if (is_wanted != 0) linked.push_back(i);
        is_wanted = 0;
    }
    bridge_ligaments(context.grid, context.pieces.count(), *this, linked, change);
    if (!change.dirty_pairs.empty())
        neighbourhoods.update(phyxels, pairs, change.dirty_pairs, context.material, context.parallel);
}

std::vector<std::int32_t> ElasticSamples::coarse_parts(std::size_t piece_count) const {
    const std::vector<std::size_t> count = count_by_piece(piece_count);
    std::vector<std::uint8_t> is_linked(piece_count, 0);
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (neighbourhoods.rank()[i] > 0) is_linked[static_cast<std::size_t>(phyxels.piece[i])] = 1;
    std::vector<std::int32_t> out;
    for (std::size_t piece = 0; piece < piece_count; ++piece) {
        const bool has_few = piece_count > 1 && count[piece] < tuning::resampling::small_phyxel_count;
        if (is_linked[piece] == 0 || has_few) out.push_back(static_cast<std::int32_t>(piece));
    }
    return out;
}

std::vector<std::int32_t> ElasticSamples::fast_fragments(std::size_t piece_count, double dt) const {
    std::vector<std::int32_t> out;
    if (piece_count < 2) return out;
    const std::vector<std::size_t> count = count_by_piece(piece_count);
    const std::size_t limit =
        std::min(*std::max_element(count.begin(), count.end()), tuning::resampling::small_phyxel_count);
    for (std::size_t k = 0; k < piece_count; ++k)
        if (count[k] < limit && phyxels.rigid.index(static_cast<std::int32_t>(k)) < 0)
            out.push_back(static_cast<std::int32_t>(k));
    if (out.empty()) return out;
    std::vector<meshless::Momenta> momenta;
    meshless::momenta_of_pieces(phyxels, static_cast<int>(piece_count), momenta);
    std::erase_if(out, [&](std::int32_t piece) {
        const meshless::Momenta& of = momenta[static_cast<std::size_t>(piece)];
        const Vec3 rate = meshless::angular_velocity(of.inertia, of.angular_momentum);
        return !(dt * rate.norm() > tuning::resampling::max_rotation);
    });
    return out;
}

std::vector<std::size_t> ElasticSamples::count_by_piece(std::size_t piece_count) const {
    std::vector<std::size_t> count(piece_count, 0);
    for (const std::int32_t piece : phyxels.piece) ++count[static_cast<std::size_t>(piece)];
    return count;
}

double ElasticSamples::largest_support() const {
    double largest = 0;
    for (const double h : phyxels.support_radius) largest = std::max(largest, h);
    return largest;
}

}  // namespace splitcubes::body
