// Search for contacts of rigid fragments.
#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/rigid_contacts.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/splitting/pieces.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace splitcubes::body {

namespace {

using meshless::RigidPiece;

}  // namespace

RigidPiece& RigidContacts::piece_of(const Fragment& fragment) const {
    return phyxels_[fragment.body]->rigid.bodies[fragment.index];
}

void RigidContacts::list_fragments(const Task& task) {
    fragments_.clear();
    phyxels_.clear();
    positions_.clear();
    spacing_ = 0;
    const double fall = task.dt * task.dt * task.gravity.norm();
    for (std::uint32_t b = 0; b < task.bodies.size(); ++b) {
        const BodyView& body = task.bodies[b];
        phyxels_.push_back(&body.phyxels);
        positions_.emplace_back(body.phyxels.position);
        if (body.is_lattice_driven) continue;
        spacing_ = std::max(spacing_, body.spacing);
        const meshless::RigidPieces& rigid = body.phyxels.rigid;
        for (std::uint32_t k = 0; k < rigid.bodies.size(); ++k) {
            const RigidPiece& piece = rigid.bodies[k];
            Fragment fragment;
            fragment.body = b;
            fragment.index = k;
            constexpr double limit = tuning::fragments::max_grid_coordinate;
            fragment.start_centre = piece.centre.cwiseMax(-limit).cwiseMin(limit);
            fragment.start_rotation = piece.rotation;
            for (const Vec3& point : rigid.points_of(piece)) {
                fragment.radius = std::max(fragment.radius, point.norm());
                fragment.low = fragment.low.cwiseMin(point);
                fragment.high = fragment.high.cwiseMax(point);
            }
            const double speed = piece.velocity().norm() + piece.angular_velocity().norm() * fragment.radius;
            fragment.max_displacement =
                std::min(task.dt * speed + fall, tuning::fragments::max_displacement_share * body.spacing);
            if (piece.centre.allFinite() && std::isfinite(speed)) fragments_.push_back(std::move(fragment));
        }
    }
}

// Computes the maximum displacement of each piece's surface in the step.
void RigidContacts::measure_surfaces(const Task& task) {
    const double fall = task.dt * task.dt * task.gravity.norm();
    max_surface_displacement_ = 0;
    max_displacements_.resize(task.bodies.size());
    for (std::uint32_t b = 0; b < task.bodies.size(); ++b) {
        const BodyView& body = task.bodies[b];
        max_displacements_[b].assign(body.pieces.count(), 0);
        if (body.is_lattice_driven) continue;
        const meshless::Phyxels& phyxels = body.phyxels;
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            const auto piece = static_cast<std::size_t>(phyxels.piece[i]);
            if (piece < max_displacements_[b].size())
                max_displacements_[b][piece] =
                    std::max(max_displacements_[b][piece], phyxels.velocity[i].squaredNorm());
        }
        for (std::size_t piece = 0; piece < max_displacements_[b].size(); ++piece) {
            double& displacement = max_displacements_[b][piece];
            displacement = std::min(task.dt * std::sqrt(displacement) + fall,
                                    tuning::fragments::max_displacement_share * body.spacing);
            if (phyxels.rigid.index(static_cast<std::int32_t>(piece)) < 0)
                max_surface_displacement_ = std::max(max_surface_displacement_, displacement);
        }
    }
}

double RigidContacts::max_displacement_of(std::uint32_t body, std::int32_t piece) const {
    const auto at = static_cast<std::size_t>(piece);
    return at < max_displacements_[body].size() ? max_displacements_[body][at] : max_surface_displacement_;
}

// Lists the surface samples near each fragment.
void RigidContacts::list_samples(const ContactFinder& finder, const Parallel& parallel) {
    constexpr std::size_t grain = 512;
    const std::span<const Vec3> positions = finder.sample_positions();
    const double reach = tuning::fragments::reach_share * spacing_ + max_surface_displacement_;
    balls_.clear();
    for (const Fragment& fragment : fragments_)
        balls_.push_back({fragment.start_centre, fragment.radius + fragment.max_displacement + reach});
    grid_.build(balls_);
    near_.resize(std::max(near_.size(), (positions.size() + grain - 1) / grain));
    for (std::vector<Near>& near : near_) near.clear();
    const auto list = [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> near;
        for (std::size_t k = begin; k < end; ++k) {
            grid_.containing(positions[k], near);
            if (near.empty()) continue;
            const ContactFinder::SurfaceSample sample = finder.surface_sample(k);
            const double excess = max_surface_displacement_ - max_displacement_of(sample.body, sample.piece);
            for (const std::uint32_t index : near) {
                const SphereGrid::Ball& ball = balls_[index];
                const double far = ball.radius - excess;
                if ((positions[k] - ball.centre).squaredNorm() <= far * far)
                    near_[begin / grain].push_back({static_cast<std::uint32_t>(k), index});
            }
        }
    };
    parallel.for_chunks(positions.size(), grain, std::cref(list));
    for (const std::vector<Near>& part : near_)
        for (const Near& near : part) fragments_[near.fragment].near.push_back(near.sample);
}

void RigidContacts::find(const Task& task, const ContactFinder& finder,
                         std::span<const ContactIsland> islands, const Parallel& parallel) {
    constexpr std::size_t grain = 16;
    rows_.clear();
    proxies_.clear();
    supports_.clear();
    list_fragments(task);
    if (fragments_.empty()) return;
    measure_surfaces(task);
    if (!finder.sample_positions().empty()) list_samples(finder, parallel);
    parallel.for_chunks(fragments_.size(), grain, [&](std::size_t begin, std::size_t end) {
        Planes planes;
        for (auto k = static_cast<std::uint32_t>(begin); k < end; ++k) meet_surface(task, finder, k, planes);
    });
    for (Fragment& fragment : fragments_)
        for (ContactRow& row : fragment.rows) row.proxy = proxy_of(row.side.part, row.proxy);
    list_supports(islands);
    measure_proxies(task);
    for (std::uint32_t k = 0; k < proxies_.size(); ++k)
        if (proxies_[k].mass > 0)
            proxies_[k].start_energy = energy_of(task, static_cast<std::uint32_t>(fragments_.size()) + k);
}

void RigidContacts::Planes::list(const ContactFinder& finder, std::span<const std::uint32_t> samples) {
    all.clear();
    lanes.reset(samples.size());
    for (const std::uint32_t k : samples) {
        const ContactFinder::SurfaceSample sample = finder.surface_sample(k);
        all.push_back({finder.sample_positions()[k], finder.sample_normals()[k], sample.body, sample.piece});
        lanes.add(all.back().position, all.back().normal);
    }
}

// Finds the contacts of a fragment's points with the planes through surface samples.
void RigidContacts::meet_surface(const Task& task, const ContactFinder& finder, std::uint32_t fragment_index,
                                 Planes& planes) {
    Fragment& fragment = fragments_[fragment_index];
    if (fragment.near.empty()) return;
    planes.list(finder, fragment.near);
    const meshless::RigidPieces& rigid = phyxels_[fragment.body]->rigid;
    for (const Vec3& own : rigid.points_of(rigid.bodies[fragment.index])) {
        const Vec3 point = piece_of(fragment).world_point(own);
        const std::size_t partner = planes.lanes.find_nearest(point, piece_of(fragment).rotation * own);
        if (partner == planes.all.size()) continue;
        ContactRow row;
        row.upper = fragment_index;
        row.own = own;
        if (set_gap(task, point, partner, planes, row))
            set_lower_side(task.bodies[planes.all[partner].body],
                           finder.surface_sample(fragment.near[partner]), point, row);
        if (row.side.count > 0) fragment.rows.push_back(row);
    }
}

// Sets gap and normal of the point from the weighted mean of the planes around its partner. Returns false if
// the point will not come near.
bool RigidContacts::set_gap(const Task& task, const Vec3& point, std::size_t partner, const Planes& planes,
                            ContactRow& row) const {
    const Plane& face = planes.all[partner];
    const double spacing = task.bodies[face.body].spacing;
    const std::span<const double> square = planes.lanes.squared_distances();
    const double width = std::sqrt(square[partner]) + tuning::fragments::face_reach_share * spacing;
    double distance = 0, total = 0;
    Vec3 normal = Vec3::Zero();
    for (std::size_t n = 0; n < planes.all.size(); ++n) {
        if (!(square[n] < width * width)) continue;
        const Plane& plane = planes.all[n];
        if (plane.body != face.body || plane.piece != face.piece) continue;
        if (!(plane.normal.dot(face.normal) > tuning::fragments::one_face_cosine)) continue;
        const double share = 1 - square[n] / (width * width);
        distance += share * share * plane.normal.dot(point - plane.position);
        normal += share * share * plane.normal;
        total += share * share;
    }
    if (!(total > 0) || !(normal.norm() > 0)) return false;
    distance /= total;
    normal.normalize();
    const Vec3 off = point - face.position;
    if (distance < -tuning::fragments::max_overlap_share * spacing ||
        (off - normal.dot(off) * normal).norm() > tuning::fragments::max_tangential_share * spacing)
        return false;
    row.normal = normal;
    row.gap = distance;
    row.max_depenetration = tuning::fragments::depenetration_share * spacing +
                            tuning::fragments::depth_share * std::max(-distance, 0.0);
    row.friction = task.friction;
    return normal.allFinite() && distance <= tuning::fragments::speculative_share * spacing +
                                                 fragments_[row.upper].max_displacement +
                                                 max_displacement_of(face.body, face.piece);
}

// Sets the lower side to the sample's influences; to none if the offset is not finite.
void RigidContacts::set_lower_side(const BodyView& body, const ContactFinder::SurfaceSample& partner,
                                   const Vec3& point, ContactRow& row) {
    row.side =
        body.influences_of(partner.vertex, body.dominant_node(partner.vertex), partner.piece, partner.body);
    row.proxy = partner.piece;
    Vec3 lower = Vec3::Zero();
    for (std::uint32_t k = 0; k < row.side.count; ++k)
        lower += row.side.weight[k] * body.phyxels.position[row.side.phyxel[k]];
    row.lower_own = point - lower;
    if (!row.lower_own.allFinite()) row.side.count = 0;
}

std::int32_t RigidContacts::proxy_of(std::uint32_t body, std::int32_t piece) {
    for (std::size_t k = 0; k < proxies_.size(); ++k)
        if (proxies_[k].body == body && proxies_[k].piece == piece) return static_cast<std::int32_t>(k);
    proxies_.emplace_back();
    proxies_.back().body = body;
    proxies_.back().piece = piece;
    return static_cast<std::int32_t>(proxies_.size() - 1);
}

}  // namespace splitcubes::body
