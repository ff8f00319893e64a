// Search for contacts of rigid fragments.
#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/rigid_contacts.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/splitting/pieces.h>

#include <Eigen/LU>
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

// Puts a ball around each fragment in the grid, with all that it may meet at this distance (m) in the step.
void RigidContacts::list_balls(double reach) {
    constexpr double limit = tuning::fragments::max_grid_coordinate;
    balls_.clear();
    for (const Fragment& fragment : fragments_)
        balls_.push_back({piece_of(fragment).centre.cwiseMax(-limit).cwiseMin(limit),
                          fragment.radius + fragment.max_displacement + reach});
    grid_.build(balls_);
}

// Lists the surface samples near each fragment.
void RigidContacts::list_samples(const ContactFinder& finder, const Parallel& parallel) {
    constexpr std::size_t grain = 512;
    const std::span<const Vec3> positions = finder.sample_positions();
    list_balls(tuning::fragments::reach_share * spacing_ + max_surface_displacement_);
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
    list_balls(0);
    parallel.for_chunks(fragments_.size(), grain, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> others;
        Planes planes;
        for (auto k = static_cast<std::uint32_t>(begin); k < end; ++k) {
            meet_surface(task, finder, k, planes);
            grid_.meeting_after(k, others);
            for (const std::uint32_t other : others) meet_fragment(task, k, other, fragments_[k].rows);
        }
    });
    for (Fragment& fragment : fragments_)
        for (ContactRow& row : fragment.rows) {
            if (row.lower < 0) row.proxy = proxy_of(row.side.part, row.proxy);
            rows_.push_back(row);
        }
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

// Returns a lower bound of the gap (m) that face_between finds: that of the upper fragment's box.
double RigidContacts::box_gap(const Fragment& upper, const Fragment& lower) const {
    const RigidPiece& moving = piece_of(upper);
    const RigidPiece& box = piece_of(lower);
    const Mat3 rotation = box.rotation.transpose() * moving.rotation;
    const Vec3 middle = box.rotation.transpose() * (moving.centre - box.centre) +
                        0.5 * (rotation * (upper.low + upper.high)) - 0.5 * (lower.low + lower.high);
    const Vec3 half = 0.5 * (rotation.cwiseAbs() * (upper.high - upper.low) + (lower.high - lower.low));
    return (middle.cwiseAbs() - half).maxCoeff();
}

// Returns the face of the lower fragment's box with the largest separation (or smallest penetration) from the
// upper one's points.
RigidContacts::BoxFace RigidContacts::face_between(const Fragment& upper, const Fragment& lower) const {
    const RigidPiece& moving = piece_of(upper);
    const RigidPiece& box = piece_of(lower);
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const Vec3& own : phyxels_[upper.body]->rigid.points_of(moving)) {
        const Vec3 point = box.rotation.transpose() * (moving.world_point(own) - box.centre);
        low = low.cwiseMin(point);
        high = high.cwiseMax(point);
    }
    BoxFace best;
    for (int axis = 0; axis < 3; ++axis)
        for (const int sign : {-1, 1}) {
            const double gap = sign > 0 ? low[axis] - lower.high[axis] : lower.low[axis] - high[axis];
            if (gap > best.gap) best = {axis, sign, gap};
        }
    return best;
}

// Finds the contacts of one fragment's points with the face of the other one's box that separates the two
// best.
void RigidContacts::meet_fragment(const Task& task, std::uint32_t first, std::uint32_t second,
                                  std::vector<ContactRow>& rows) const {
    const Fragment& a = fragments_[first];
    const Fragment& b = fragments_[second];
    const double displacements = a.max_displacement + b.max_displacement,
                 far = a.radius + b.radius + displacements;
    if ((piece_of(a).centre - piece_of(b).centre).squaredNorm() > far * far) return;
    const double spacing = std::min(task.bodies[a.body].spacing, task.bodies[b.body].spacing);
    const double near = tuning::fragments::speculative_share * spacing + displacements;
    const double surely = near + tuning::fragments::negligible_share * spacing;
    if (box_gap(a, b) > surely || box_gap(b, a) > surely) return;
    const BoxFace of_second = face_between(a, b);
    if (of_second.gap > near) return;
    const BoxFace of_first = face_between(b, a);
    const bool takes_second = of_second.gap >= of_first.gap;
    const BoxFace face = takes_second ? of_second : of_first;
    if (face.gap > near) return;
    const std::uint32_t upper = takes_second ? first : second, lower = takes_second ? second : first;
    const RigidPiece& moving = piece_of(fragments_[upper]);
    const RigidPiece& box = piece_of(fragments_[lower]);
    const Vec3 normal = face.sign * Vec3::Unit(face.axis);
    const Vec3 low = fragments_[lower].low - Vec3::Constant(tuning::fragments::speculative_share * spacing);
    const Vec3 high = fragments_[lower].high + Vec3::Constant(tuning::fragments::speculative_share * spacing);
    const std::size_t before = rows.size();
    // If no point lies in front of the face itself, all count: edges cross.
    for (const bool strict : {true, false}) {
        if (rows.size() > before) break;
        for (const Vec3& own : phyxels_[fragments_[upper].body]->rigid.points_of(moving)) {
            const Vec3 point = moving.world_point(own);
            const Vec3 in_box = box.rotation.transpose() * (point - box.centre);
            const double extent =
                face.sign > 0 ? fragments_[lower].high[face.axis] : -fragments_[lower].low[face.axis];
            const double distance = normal.dot(in_box) - extent;
            bool beside = false;
            for (int axis = 0; axis < 3; ++axis)
                beside =
                    beside || (axis != face.axis && (in_box[axis] < low[axis] || in_box[axis] > high[axis]));
            if (distance > near || (strict && beside)) continue;
            ContactRow row;
            row.upper = upper;
            row.lower = static_cast<std::int32_t>(lower);
            row.own = own;
            row.lower_own = in_box - distance * normal;
            row.normal = box.rotation * normal;
            row.gap = distance;
            row.max_depenetration = tuning::fragments::depenetration_share * spacing +
                                    tuning::fragments::depth_share * std::max(-distance, 0.0);
            row.friction = task.friction;
            row.start = point - box.world_point(row.lower_own);
            if (row.start.allFinite()) rows.push_back(row);
        }
    }
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
