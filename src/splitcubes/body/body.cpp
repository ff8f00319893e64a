#include <splitcubes/body/body.h>
#include <splitcubes/body/tearing.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/memory.h>
#include <splitcubes/meshless/sampling.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/validate.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace splitcubes::body {

using splitting::GridEdge;

namespace {

void check_settings(const BodySettings& s) {
    const std::string where = "body '" + s.name + "'";
    if (!(s.phyxel_spacing >= 0) || !std::isfinite(s.phyxel_spacing))
        throw InputError(where, "phyxel spacing must be a positive number of metres");
    if (s.phyxel_spacing == 0 && s.phyxel_count < 1)
        throw InputError(where, "phyxel count must be at least 1");
    if (!s.velocity.allFinite() || !s.angular_velocity.allFinite())
        throw InputError(where, "velocities must be finite");
}

// Estimated bytes of phyxels with their links and their share of the nodes; measured.
double phyxel_memory(double count) {
    constexpr double per_phyxel = 14e3;
    return per_phyxel * count;
}

std::unique_ptr<occlusion::Criterion> criterion_of(const BodySettings& settings) {
    return occlusion::make_criterion(settings.criterion,
                                     settings.make_visibility_backend
                                         ? settings.make_visibility_backend(settings.visibility)
                                         : occlusion::make_cpu_backend(settings.visibility));
}

}  // namespace

Body::Body(const geometry::TriangleMesh& placed, const BodySettings& settings, const Parallel& parallel)
    : settings_(settings),
      grid_(splitting::solidify(placed, geometry::grid_around(placed.bounds(), settings.cell_size),
                                solidify_report_, parallel)),
      surface_((parallel.begin("body '" + settings_.name + "': surface"),
                std::make_unique<splitting::Surface>(grid_, parallel))),
      pieces_(std::make_unique<splitting::Pieces>(grid_)),
      occluders_(grid_.rest()),
      criterion_(criterion_of(settings)),
      tracker_(grid_.bricks()) {
    check_settings(settings_);
    meshless::check_material(settings_.material, "body '" + settings_.name + "' material");
    if (settings_.tearing && settings_.deformation)
        throw InputError("body '" + settings_.name + "'", "only an elastic body of phyxels tears",
                         "take out its tearing or its deformation");
    if (settings_.tearing) {
        check_tearing(*settings_.tearing, "body '" + settings_.name + "' tearing");
    }
    solid_crossings_ = grid_.crossings().size();
    parallel.begin("body '" + settings_.name + "': occluders");
    occluders_.build(grid_, *surface_, parallel);
    parallel.begin("body '" + settings_.name + "': nodes");
    inside_ = list_material_nodes(grid_, *surface_, *pieces_, parallel);
    parallel.begin("body '" + settings_.name + "': phyxels");
    // A deformation model moves the phyxels, so few are enough.
    if (settings_.deformation) settings_.phyxel_count = std::min(settings_.phyxel_count, 64);
    sample(parallel);
    solid_phyxels_ = phyxels_.size();
    if (settings_.tearing)
        tearing_ = std::make_unique<Tearing>(*settings_.tearing, settings_.material, grid_, phyxels_,
                                             neighbourhoods_);
    if (settings_.deformation) make_deformation();
    parallel.begin("body '" + settings_.name + "': boundary");
    surface_motion_.track_nodes(grid_, *surface_, tracker_);
    const StepContext at_rest{0, 0, Vec3::Zero(), {}, {}, {}, parallel};
    StepReport report;
    update_node_frames(at_rest, report);
    update_surface(at_rest, report);
}

Body::~Body() = default;

// Extent of a node's material down and up each axis, in cells: up to the crossing, boundary or cut, if the
// edge has one, else half way to the next node.
std::pair<Vec3, Vec3> Body::node_reach(const Vec3i& node) const {
    Vec3 low = Vec3::Constant(0.5), high = low;
    for (int axis = 0; axis < 3; ++axis) {
        const std::int32_t above = grid_.slot({node, axis});
        if (above >= 0) high[axis] = grid_.crossing(above).parameter;
        const std::int32_t below = grid_.slot({node - Vec3i::Unit(axis), axis});
        if (below >= 0) low[axis] = 1 - grid_.crossing(below).parameter;
    }
    return {low, high};
}

// Returns the nearest inside node that sees the point and whose piece is accepted; among equally near ones
// the first in grid order; the fallback if none of the 27 nodes around is.
Vec3i Body::owner_of(const Vec3& rest, const Vec3i& fallback,
                     const std::function<bool(std::int32_t piece)>& accepts) const {
    const Vec3 at = grid_.rest().to_grid(rest);
    const Vec3i base = at.array().round().cast<int>();
    Vec3i best = fallback;
    double best_distance = 1e300;
    for (int k = 0; k < 27; ++k) {
        const Vec3i node = base + Vec3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
        if (!grid_.rest().contains(node) || !grid_.inside(node)) continue;
        const double distance = (node.cast<double>() - at).squaredNorm();
        if (distance >= best_distance) continue;
        if (!accepts(pieces_->piece_of(grid_, node))) continue;
        if (occluders_.grid().segment_blocked(grid_.rest().node_position(node), rest)) continue;
        best = node;
        best_distance = distance;
    }
    return best;
}

// Returns the candidate if its nearest node is inside and sees it; that node's position if the node is
// inside but does not see it, so that thin parts are sampled too; else nothing.
std::optional<Vec3> Body::point_in_material(const Vec3& candidate) const {
    const Vec3i node = grid_.rest().to_grid(candidate).array().round().cast<int>();
    if (!grid_.rest().contains(node) || !grid_.inside(node)) return std::nullopt;
    const Vec3 at_node = grid_.rest().node_position(node);
    return occluders_.grid().segment_blocked(at_node, candidate) ? at_node : candidate;
}

std::vector<Vec3> Body::sample_positions(double spacing, const Parallel& parallel) const {
    geometry::Box box;
    for (const Vec3& rest : inside_.rest_position) box.add(rest);
    box = box.grown(0.5 * grid_.rest().cell_size);
    // No point of a full lattice is farther than 0.87 spacings from a sample.
    return meshless::sample_solid(
        box, spacing, [this](const Vec3& candidate) { return point_in_material(candidate); },
        inside_.rest_position, 0.95 * spacing, parallel);
}

void Body::sample(const Parallel& parallel) {
    const double volume = inside_.total_volume();
    spacing_ = settings_.phyxel_spacing;
    require_memory("phyxels",
                   phyxel_memory(spacing_ > 0 ? volume / std::pow(spacing_, 3) : settings_.phyxel_count),
                   spacing_ > 0 ? "use a larger phyxel spacing" : "use fewer phyxels");
    std::vector<Vec3> positions;
    if (spacing_ > 0) {
        positions = sample_positions(spacing_, parallel);
    } else {
        // The count scales with the inverse cube of the spacing; the best of a few attempts is kept.
        double spacing = std::cbrt(volume / settings_.phyxel_count);
        double best_error = 1e300;
        for (int attempt = 0; attempt < 6; ++attempt) {
            std::vector<Vec3> tried = sample_positions(spacing, parallel);
            const double ratio = static_cast<double>(tried.size()) / settings_.phyxel_count;
            if (std::abs(std::log(ratio)) < best_error) {
                best_error = std::abs(std::log(ratio));
                spacing_ = spacing;
                positions = std::move(tried);
            }
            spacing *= std::cbrt(ratio);
        }
    }
    owner_.resize(positions.size());
    parallel.for_each(positions.size(), 256, [&](std::size_t i) {
        const Vec3i nearest = grid_.rest().to_grid(positions[i]).array().round().cast<int>();
        owner_[i] = owner_of(positions[i], nearest, [](std::int32_t) { return true; });
    });
    for (std::size_t i = 0; i < positions.size(); ++i)
        phyxels_.append(positions[i], 0.5 * spacing_, pieces_->piece_of(grid_, owner_[i]));
    set_contact_radii(0, parallel);
    parallel.begin("body '" + settings_.name + "': links");
    rebuild_samples(parallel);
    parallel.begin("body '" + settings_.name + "': volumes");
    lumping_ = meshless::lump(inside_.for_lumping(), phyxels_, locator_, parallel);
    meshless::apply(lumping_, inside_.volume, settings_.material.density, phyxels_);
    parallel.begin("body '" + settings_.name + "': gradients");
    neighbourhoods_.rebuild(phyxels_, pairs_, settings_.material, parallel);

    const Vec3 centre = meshless::total_momenta(phyxels_).centre;
    for (std::size_t i = 0; i < phyxels_.size(); ++i) {
        phyxels_.velocity[i] =
            settings_.velocity + settings_.angular_velocity.cross(phyxels_.position[i] - centre);
        phyxels_.previous_velocity[i] = phyxels_.velocity[i];
    }
    previous_deformation_ = phyxels_.deformation;
}

// Sets the contact radius of phyxels to their distance from the boundary, so that a phyxel touches the
// ground when the boundary next to it would.
void Body::set_contact_radii(std::size_t first, const Parallel& parallel) {
    std::vector<Vec3> boundary;
    for (const splitting::Crossing& c : grid_.crossings())
        if (c.origin == splitting::Origin::boundary) boundary.push_back(grid_.crossing_position(c));
    if (boundary.empty()) return;
    const double max_radius = 0.75 * spacing_;
    const meshless::PhyxelLocator near_boundary(boundary, max_radius);
    parallel.for_each(phyxels_.size() - first, 256, [&](std::size_t k) {
        const std::size_t i = first + k;
        double distance = max_radius;
        near_boundary.visit(phyxels_.rest_position[i], max_radius, [&](std::uint32_t index) {
            distance = std::min(distance, (boundary[index] - phyxels_.rest_position[i]).norm());
            return true;
        });
        phyxels_.contact_radius[i] = distance;
    });
}

// Recomputes what depends on the set of phyxels: locator, support radii of new ones, pairs and their
// visibility. Visibility that is already known is kept if the criterion allows it.
void Body::rebuild_samples(const Parallel& parallel) {
    locator_ = meshless::PhyxelLocator(phyxels_.rest_position, 1.6 * spacing_);
    std::size_t old_count = 0;
    while (old_count < phyxels_.size() && phyxels_.support_radius[old_count] > 0) ++old_count;
    meshless::compute_support_radii(phyxels_, locator_, parallel, {}, old_count);
    const meshless::Pairs before = std::move(pairs_);
    pairs_ = meshless::find_pairs(phyxels_, locator_, parallel);
    std::vector<std::uint32_t> unknown = meshless::transfer_visibility(before, pairs_);
    if (criterion_->depends_on_others()) {
        unknown.resize(pairs_.size());
        std::iota(unknown.begin(), unknown.end(), 0U);
    }
    evaluate_pairs(unknown, parallel);
}

geometry::SurfaceMesh Body::surface_mesh() const {
    return splitting::extract(grid_, *surface_, *pieces_, surface_motion_.positions(),
                              surface_motion_.normals());
}

void Body::add_to_hash(StateHash& hash) const {
    for (const splitting::Crossing& c : grid_.crossings()) {
        hash.add_word(splitting::edge_id(c.edge));
        hash.add(c.parameter);
    }
    const auto add = [&](const std::vector<Vec3>& values) {
        for (const Vec3& v : values)
            for (int k = 0; k < 3; ++k) hash.add(v[k]);
    };
    add(phyxels_.position);
    add(phyxels_.velocity);
    if (settings_.material.plasticity)
        for (const Mat3& strain : phyxels_.plastic_strain)
            for (int k = 0; k < 9; ++k) hash.add(strain(k / 3, k % 3));
    for (const meshless::RigidPiece& body : phyxels_.rigid.bodies) {
        hash.add(body.piece);
        for (const Vec3& v : {body.centre, body.momentum, body.angular_momentum})
            for (int k = 0; k < 3; ++k) hash.add(v[k]);
        for (int k = 0; k < 9; ++k) hash.add(body.rotation(k / 3, k % 3));
    }
    for (const std::int32_t piece : phyxels_.piece) hash.add(piece);
    for (const double mass : phyxels_.mass) hash.add(mass);
    for (const float v : pairs_.visibility) hash.add(static_cast<double>(v));
    add(surface_motion_.positions());
}

std::vector<std::string> Body::validate() const {
    std::vector<std::string> lines = splitting::validate(grid_);
    for (std::string& line : splitting::validate(grid_, *surface_, *pieces_)) lines.push_back(line);
    for (std::size_t i = 0; i < inside_.size(); ++i)
        if (inside_.piece[i] != pieces_->piece_of(grid_, inside_.node[i])) {
            lines.push_back("a node with the wrong piece");
            break;
        }
    std::vector<std::size_t> phyxels_of(pieces_->count(), 0);
    for (std::size_t i = 0; i < phyxels_.size(); ++i) {
        if (pieces_->piece_of(grid_, owner_[i]) != phyxels_.piece[i])
            lines.push_back("a phyxel with the wrong piece");
        ++phyxels_of[static_cast<std::size_t>(phyxels_.piece[i])];
        if (!phyxels_.position[i].allFinite() || !phyxels_.velocity[i].allFinite())
            lines.push_back("a phyxel that is not finite");
    }
    for (const std::size_t count : phyxels_of)
        if (count == 0) lines.push_back("a piece without phyxels");
    for (std::size_t k = 0; k < pairs_.size(); ++k)
        if (pairs_.visibility[k] > 0 && phyxels_.piece[pairs_.a[k]] != phyxels_.piece[pairs_.b[k]]) {
            lines.push_back("a link between two pieces");
            break;
        }
    for (const meshless::RigidPiece& body : phyxels_.rigid.bodies)
        if (!body.centre.allFinite() || !body.rotation.allFinite() || !body.momentum.allFinite() ||
            !body.angular_momentum.allFinite())
            lines.push_back("a rigid piece that is not finite");
    double lumped = 0;
    for (const double v : phyxels_.volume) lumped += v;
    const double owned = inside_.total_volume();
    if (std::abs(lumped - owned) > 1e-9 * owned) lines.push_back("the volumes of phyxels and nodes differ");
    return lines;
}

}  // namespace splitcubes::body
