#include <splitcubes/contact/detection/collider_overlaps.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/math/cross_matrix.h>
#include <splitcubes/node_motion/surface_motion.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/samples/rigid_pieces.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace splitcubes::body {

namespace {

using meshless::RigidPiece;

constexpr std::size_t grain = 256;  // vertices

// Returns the depth, m, at which a vertex begins to be too deep.
double allowed_depth(const BodyView& body) {
    return tuning::overlaps::allowed_share * body.spacing;
}

}  // namespace

// Lists the vertices near colliders, by piece, if there is one that lies too deep.
void ColliderOverlaps::list_near(const Task& task, const BodyView& body, const Parallel& parallel) {
    const std::span<const Vec3> positions = body.surface_motion.positions();
    const std::vector<splitting::SurfaceVertex>& vertices = body.surface.vertices();
    const double end = task.time + task.dt, margin = tuning::overlaps::near_share * body.spacing;
    found_.resize((positions.size() + grain - 1) / grain);
    to_own_.clear();
    for (const Collider& collider : task.colliders) to_own_.push_back(collider.at(end).inverse());
    const auto list = [&](std::size_t begin, std::size_t stop) {
        std::vector<Near>& found = found_[begin / grain];
        found.clear();
        geometry::Box box;
        for (std::size_t v = begin; v < stop; ++v)
            if (vertices[v].alive()) box.add(positions[v]);
        if (box.empty()) return;
        const double radius = 0.5 * box.size().norm();
        for (std::size_t c = 0; c < to_own_.size(); ++c) {
            const geometry::SignedDistance& solid = *task.colliders[c].solid;
            if (solid.at(to_own_[c] * box.center()).distance > solid.lipschitz_constant() * radius + margin)
                continue;
            for (std::size_t v = begin; v < stop; ++v) {
                if (!vertices[v].alive() || !positions[v].allFinite()) continue;
                const double distance = solid.at(to_own_[c] * positions[v]).distance;
                if (distance > margin) continue;
                const std::int32_t piece =
                    body.pieces.piece_of(body.grid, body.surface.influence(vertices[v]));
                found.push_back({piece, positions[v], distance < -allowed_depth(body)});
            }
        }
    };
    // Passed by reference because a copied function object would be allocated.
    parallel.for_chunks(positions.size(), grain, std::cref(list));
    near_.clear();
    for (const std::vector<Near>& found : found_) near_.insert(near_.end(), found.begin(), found.end());
    deep_.assign(body.pieces.count(), 0);
    for (const Near& near : near_)
        if (near.deep) deep_[static_cast<std::size_t>(near.piece)] = 1;
    std::erase_if(near_, [&](const Near& near) { return deep_[static_cast<std::size_t>(near.piece)] == 0; });
    std::stable_sort(near_.begin(), near_.end(),
                     [](const Near& a, const Near& b) { return a.piece < b.piece; });
}

bool ColliderOverlaps::is_held(const BodyView& body, std::int32_t piece) const {
    const std::int32_t rigid = body.phyxels.rigid.index(piece);
    if (rigid >= 0) return body.holds_rigid(static_cast<std::size_t>(rigid));
    for (std::size_t i = 0; i < body.held.size(); ++i)
        if (body.held[i] != 0 && body.phyxels.piece[i] == piece) return true;
    return false;
}

// Returns the translation, m, that takes the vertices of a piece up to the depth that is allowed. Colliders
// between which there is no room leave an overlap.
Vec3 ColliderOverlaps::lift_of(const Task& task, std::span<const Near> near, double spacing) const {
    const double allowed = tuning::overlaps::allowed_share * spacing;
    Vec3 lift = Vec3::Zero();
    bool any = true;
    for (int pass = 0; any && pass < tuning::overlaps::max_lifts; ++pass) {
        any = false;
        for (const Collider& collider : task.colliders) {
            const Isometry pose = collider.at(task.time + task.dt), to_own = pose.inverse();
            geometry::SignedDistance::Sample deepest;
            deepest.distance = 0;
            for (const Near& vertex : near) {
                const geometry::SignedDistance::Sample at =
                    collider.solid->at(to_own * (vertex.point + lift));
                if (at.distance < deepest.distance) deepest = at;
            }
            const double height = -deepest.distance - allowed;
            if (!(height > tuning::overlaps::negligible_share * spacing)) continue;
            lift += height * (pose.linear() * deepest.normal);
            any = true;
        }
    }
    return lift;
}

// Lists the vertices that colliders stop: those that were too deep, and those that are as deep after the
// lift.
void ColliderOverlaps::list_stops(const Task& task, std::span<const Near> near, const Vec3& lift,
                                  const PieceMotion& motion) {
    stops_.clear();
    for (const Collider& collider : task.colliders) {
        const Isometry after = collider.at(task.time + task.dt), to_own = after.inverse();
        const Isometry before = collider.at(task.time);
        for (const Near& vertex : near) {
            const Vec3 point = vertex.point + lift, own = to_own * point;
            const geometry::SignedDistance::Sample at = collider.solid->at(own);
            if (!(at.distance < 0)) continue;
            Stop stop;
            stop.arm = point - motion.centre;
            stop.normal = after.linear() * at.normal;
            stop.surface_velocity = (after * own - before * own) / task.dt;
            stop.friction = collider.friction;
            if (stop.normal.allFinite()) stops_.push_back(stop);
        }
    }
}

// Removes the approach at all stops by projected Gauss-Seidel on the rigid motion.
void ColliderOverlaps::stop(PieceMotion& motion) {
    for (int iteration = 0; iteration < tuning::overlaps::iterations; ++iteration)
        for (Stop& stop : stops_) {
            const Mat3 arm = cross_matrix(stop.arm);
            const Mat3 mobility = Mat3::Identity() / motion.mass - arm * motion.inverse_inertia * arm;
            const auto push = [&](const Vec3& impulse) {
                motion.velocity += impulse / motion.mass;
                motion.angular_velocity += motion.inverse_inertia * stop.arm.cross(impulse);
            };
            const auto velocity = [&] {
                return Vec3(motion.velocity + motion.angular_velocity.cross(stop.arm) -
                            stop.surface_velocity);
            };
            const double along = stop.normal.dot(mobility * stop.normal);
            const double impulse = std::max(0.0, stop.impulse - stop.normal.dot(velocity()) / along);
            push((impulse - stop.impulse) * stop.normal);
            stop.impulse = impulse;
            // Overestimates the mobility along both tangents: too small an impulse still only removes energy.
            Vec3 sliding = velocity();
            sliding -= stop.normal * stop.normal.dot(sliding);
            Vec3 tangential = stop.tangential - sliding / (mobility.trace() - along);
            const double limit = stop.friction * stop.impulse;
            if (tangential.norm() > limit) tangential *= limit / tangential.norm();
            push(tangential - stop.tangential);
            stop.tangential = tangential;
        }
}

void ColliderOverlaps::lift(const Task& task, const BodyView& body, std::span<const Near> near,
                            Outcome& outcome) {
    const std::int32_t piece = near.front().piece;
    const Vec3 shift = lift_of(task, near, body.spacing);
    if (shift.isZero(0) || !shift.allFinite()) return;
    ++outcome.pieces;
    meshless::Phyxels& phyxels = body.phyxels;
    const std::int32_t index = phyxels.rigid.index(piece);
    PieceMotion motion;
    if (index >= 0) {
        RigidPiece& rigid = phyxels.rigid.bodies[static_cast<std::size_t>(index)];
        rigid.centre += shift;
        motion = {rigid.mass, rigid.inverse_inertia(), rigid.centre, rigid.velocity(),
                  rigid.angular_velocity()};
    } else {
        std::vector<meshless::Momenta> parts;
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            if (phyxels.piece[i] != piece) continue;
            phyxels.position[i] += shift;
            phyxels.previous_position[i] += shift;
            meshless::Momenta one;
            one.mass = phyxels.mass[i];
            one.centre = phyxels.position[i];
            one.linear = one.mass * phyxels.velocity[i];
            parts.push_back(one);
        }
        const meshless::Momenta sum = meshless::together(parts);
        if (!(sum.mass > 0)) return;
        motion.mass = sum.mass;
        motion.centre = sum.centre;
        motion.velocity = sum.linear / sum.mass;
        for (int axis = 0; axis < 3; ++axis)
            motion.inverse_inertia.col(axis) = meshless::angular_velocity(sum.inertia, Vec3::Unit(axis));
        motion.inverse_inertia = (0.5 * (motion.inverse_inertia + motion.inverse_inertia.transpose())).eval();
        motion.angular_velocity = motion.inverse_inertia * sum.angular_momentum;
    }
    const PieceMotion before = motion;
    list_stops(task, near, shift, motion);
    stop(motion);
    const Vec3 velocity = motion.velocity - before.velocity;
    const Vec3 turn = motion.angular_velocity - before.angular_velocity;
    if (!velocity.allFinite() || !turn.allFinite()) return;
    Vec3 impulse = Vec3::Zero(), torque = Vec3::Zero();
    for (const Stop& stop : stops_) {
        const Vec3 one = stop.impulse * stop.normal + stop.tangential;
        impulse += one;
        torque += stop.arm.cross(one);
    }
    outcome.momentum += impulse;
    outcome.angular_momentum += motion.centre.cross(impulse) + torque;
    outcome.angular_momentum += shift.cross(motion.mass * before.velocity);
    // Of the rigid motion; the rest does not change.
    outcome.kinetic_energy += 0.5 * impulse.dot(before.velocity + motion.velocity) +
                              0.5 * torque.dot(before.angular_velocity + motion.angular_velocity);
    if (index >= 0) {
        RigidPiece& rigid = phyxels.rigid.bodies[static_cast<std::size_t>(index)];
        rigid.momentum += impulse;
        rigid.angular_momentum += torque;
        return;
    }
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (phyxels.piece[i] != piece) continue;
        const Vec3 change = velocity + turn.cross(phyxels.position[i] - motion.centre);
        phyxels.velocity[i] += change;
        phyxels.previous_velocity[i] += change;
    }
}

ColliderOverlaps::Outcome ColliderOverlaps::undo(const Task& task, const Parallel& parallel) {
    Outcome outcome;
    moved_.assign(task.bodies.size(), 0);
    if (task.colliders.empty()) return outcome;
    for (std::size_t b = 0; b < task.bodies.size(); ++b) {
        const BodyView& body = task.bodies[b];
        if (body.is_lattice_driven) continue;
        list_near(task, body, parallel);
        const std::size_t before = outcome.pieces;
        for (auto first = near_.begin(); first != near_.end();) {
            auto last = first;
            while (last != near_.end() && last->piece == first->piece) ++last;
            if (!is_held(body, first->piece)) lift(task, body, {first, last}, outcome);
            first = last;
        }
        if (outcome.pieces == before) continue;
        moved_[b] = 1;
        if (!body.phyxels.rigid.empty()) meshless::write_phyxels(body.phyxels);
    }
    return outcome;
}

}  // namespace splitcubes::body
