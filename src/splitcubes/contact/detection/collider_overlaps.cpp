#include <splitcubes/contact/detection/collider_overlaps.h>
#include <splitcubes/contact/detection/rigid_motion.h>
#include <splitcubes/contact/detection/tuning.h>
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
    const double margin = tuning::overlaps::near_share * body.spacing;
    found_.resize((positions.size() + grain - 1) / grain);
    const auto list = [&](std::size_t begin, std::size_t stop) {
        std::vector<Near>& found = found_[begin / grain];
        found.clear();
        geometry::Box box;
        for (std::size_t v = begin; v < stop; ++v)
            if (vertices[v].alive()) box.add(positions[v]);
        if (box.empty()) return;
        const double radius = 0.5 * box.size().norm();
        for (std::size_t c = 0; c < poses_.size(); ++c) {
            const geometry::SignedDistance& solid = *task.colliders[c].solid;
            if (solid.at(poses_[c].to_after * box.center()).distance >
                solid.lipschitz_constant() * radius + margin)
                continue;
            for (std::size_t v = begin; v < stop; ++v) {
                if (!vertices[v].alive() || !positions[v].allFinite()) continue;
                const double distance = solid.at(poses_[c].to_after * positions[v]).distance;
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

// Returns the translation, m, that takes the vertices of a piece up to the depth that is allowed. Colliders
// between which there is no room leave an overlap.
Vec3 ColliderOverlaps::lift_of(const Task& task, std::span<const Near> near, double spacing) const {
    const double allowed = tuning::overlaps::allowed_share * spacing;
    Vec3 lift = Vec3::Zero();
    bool any = true;
    for (int pass = 0; any && pass < tuning::overlaps::max_lifts; ++pass) {
        any = false;
        for (std::size_t c = 0; c < task.colliders.size(); ++c) {
            geometry::SignedDistance::Sample deepest;
            deepest.distance = 0;
            for (const Near& vertex : near) {
                const geometry::SignedDistance::Sample at =
                    task.colliders[c].solid->at(poses_[c].to_after * (vertex.point + lift));
                if (at.distance < deepest.distance) deepest = at;
            }
            const double height = -deepest.distance - allowed;
            if (!(height > tuning::overlaps::negligible_share * spacing)) continue;
            lift += height * (poses_[c].after.linear() * deepest.normal);
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
    for (std::size_t c = 0; c < task.colliders.size(); ++c) {
        const Collider& collider = task.colliders[c];
        const ColliderPoses& poses = poses_[c];
        for (const Near& vertex : near) {
            const Vec3 point = vertex.point + lift, own = poses.to_after * point;
            const geometry::SignedDistance::Sample at = collider.solid->at(own);
            if (!(at.distance < 0)) continue;
            Stop stop;
            stop.arm = point - motion.centre;
            stop.normal = poses.after.linear() * at.normal;
            stop.surface_velocity = (poses.after * own - poses.before * own) / task.dt;
            stop.mobility = mobility_at(1 / motion.mass, motion.inverse_inertia, stop.arm);
            stop.friction = collider.friction;
            if (stop.normal.allFinite()) stops_.push_back(stop);
        }
    }
}

// Removes the approach at all stops by projected Gauss-Seidel on the rigid motion.
void ColliderOverlaps::stop(PieceMotion& motion) {
    for (int iteration = 0; iteration < tuning::overlaps::iterations; ++iteration)
        for (Stop& stop : stops_) {
            const auto push = [&](const Vec3& impulse) {
                motion.velocity += impulse / motion.mass;
                motion.angular_velocity += motion.inverse_inertia * stop.arm.cross(impulse);
            };
            const auto velocity = [&] {
                return Vec3(motion.velocity + motion.angular_velocity.cross(stop.arm) -
                            stop.surface_velocity);
            };
            const double along = stop.normal.dot(stop.mobility * stop.normal);
            const double impulse = std::max(0.0, stop.impulse - stop.normal.dot(velocity()) / along);
            push((impulse - stop.impulse) * stop.normal);
            stop.impulse = impulse;
            // Overestimates the mobility along both tangents: too small an impulse still only removes energy.
            Vec3 sliding = velocity();
            sliding -= stop.normal * stop.normal.dot(sliding);
            Vec3 tangential = stop.tangential - sliding / (stop.mobility.trace() - along);
            const double limit = stop.friction * stop.impulse;
            if (tangential.norm() > limit) tangential *= limit / tangential.norm();
            push(tangential - stop.tangential);
            stop.tangential = tangential;
        }
}

// Moves a piece and returns its rigid motion.
ColliderOverlaps::PieceMotion ColliderOverlaps::translate(meshless::Phyxels& phyxels, std::int32_t piece,
                                                          const Vec3& shift) {
    const std::int32_t index = phyxels.rigid.index(piece);
    if (index >= 0) {
        RigidPiece& rigid = phyxels.rigid.bodies[static_cast<std::size_t>(index)];
        rigid.centre += shift;
        return {rigid.mass, rigid.inverse_inertia(), rigid.centre, rigid.velocity(),
                rigid.angular_velocity()};
    }
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
    if (!(sum.mass > 0)) return {};
    const Mat3 inverse_inertia = inverse_of_inertia(sum.inertia);
    return {sum.mass, inverse_inertia, sum.centre, sum.linear / sum.mass,
            inverse_inertia * sum.angular_momentum};
}

void ColliderOverlaps::lift(const Task& task, const BodyView& body, std::span<const Near> near,
                            Outcome& outcome) {
    const std::int32_t piece = near.front().piece;
    const Vec3 shift = lift_of(task, near, body.spacing);
    if (shift.isZero(0) || !shift.allFinite()) return;
    ++outcome.pieces;
    meshless::Phyxels& phyxels = body.phyxels;
    PieceMotion motion = translate(phyxels, piece, shift);
    if (!(motion.mass > 0)) return;
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
    // Only the energy of the rigid motion changes.
    outcome.kinetic_energy += 0.5 * impulse.dot(before.velocity + motion.velocity) +
                              0.5 * torque.dot(before.angular_velocity + motion.angular_velocity);
    if (const std::int32_t index = phyxels.rigid.index(piece); index >= 0) {
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
    poses_.clear();
    for (const Collider& collider : task.colliders) poses_.emplace_back(collider, task.time, task.dt);
    for (std::size_t b = 0; b < task.bodies.size(); ++b) {
        const BodyView& body = task.bodies[b];
        if (body.is_lattice_driven) continue;
        list_near(task, body, parallel);
        if (near_.empty()) continue;
        const std::vector<std::uint8_t> held = held_pieces(body);
        const std::size_t before = outcome.pieces;
        for (auto first = near_.begin(); first != near_.end();) {
            auto last = first;
            while (last != near_.end() && last->piece == first->piece) ++last;
            const std::int32_t rigid = body.phyxels.rigid.index(first->piece);
            const bool is_held = rigid >= 0 ? body.holds_rigid(static_cast<std::size_t>(rigid))
                                            : held[static_cast<std::size_t>(first->piece)] != 0;
            if (!is_held) lift(task, body, {first, last}, outcome);
            first = last;
        }
        if (outcome.pieces == before) continue;
        moved_[b] = 1;
        if (!body.phyxels.rigid.empty()) meshless::write_phyxels(body.phyxels);
    }
    return outcome;
}

}  // namespace splitcubes::body
