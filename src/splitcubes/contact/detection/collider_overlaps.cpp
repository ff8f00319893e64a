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

void ColliderOverlaps::take_poses(const Task& task) {
    poses_.clear();
    for (const Collider& collider : task.colliders) poses_.emplace_back(collider, task.time, task.dt);
}

// Lists the vertices near colliders, ascending.
void ColliderOverlaps::list_near(const Task& task, std::size_t index, Time time, const Parallel& parallel) {
    const BodyView& body = task.bodies[index];
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
            const Isometry& to_own = time == Time::start ? poses_[c].to_before : poses_[c].to_after;
            if (solid.at(to_own * box.center()).distance > solid.lipschitz_constant() * radius + margin)
                continue;
            for (std::size_t v = begin; v < stop; ++v) {
                if (!vertices[v].alive() || !positions[v].allFinite()) continue;
                const double depth = -solid.at(to_own * positions[v]).distance;
                if (depth < -margin) continue;
                const std::int32_t piece =
                    body.pieces.piece_of(body.grid, body.surface.influence(vertices[v]));
                const auto vertex = static_cast<std::uint32_t>(v);
                found.push_back({piece, vertex, positions[v], depth, allowed_depth(body)});
            }
        }
    };
    // Passed by reference because a copied function object would be allocated.
    parallel.for_chunks(positions.size(), grain, std::cref(list));
    near_.clear();
    for (const std::vector<Near>& found : found_) near_.insert(near_.end(), found.begin(), found.end());
}

// Lets vertices of elastic pieces be as deep as the means of phyxels, on which contact forces act, leave
// single ones; others as deep as they were at the start of the step.
void ColliderOverlaps::allow_depths(const BodyView& body, std::span<const Depth> kept) {
    const double most = tuning::overlaps::max_kept_share * body.spacing;
    for (Near& near : near_) {
        if (body.phyxels.rigid.index(near.piece) < 0) {
            near.allowed = tuning::overlaps::max_elastic_share * body.spacing;
            continue;
        }
        if (!near.is_deep()) continue;
        const auto found = std::lower_bound(kept.begin(), kept.end(), near.vertex,
                                            [](const Depth& a, std::uint32_t v) { return a.vertex < v; });
        if (found != kept.end() && found->vertex == near.vertex)
            near.allowed = std::clamp(found->depth, near.allowed, most);
    }
}

// Keeps the vertices of pieces with one that is too deep, sorted by piece.
void ColliderOverlaps::keep_deep_pieces(const BodyView& body) {
    deep_.assign(body.pieces.count(), 0);
    for (const Near& near : near_)
        if (near.is_deep()) deep_[static_cast<std::size_t>(near.piece)] = 1;
    std::erase_if(near_, [&](const Near& near) { return deep_[static_cast<std::size_t>(near.piece)] == 0; });
}

// Returns the depth of a point in the collider that it is deepest in, m.
double ColliderOverlaps::depth_of(const Task& task, const Vec3& point) const {
    double depth = -std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < poses_.size(); ++c)
        depth = std::max(depth, -task.colliders[c].solid->at(poses_[c].to_after * point).distance);
    return depth;
}

// Replaces the vertices of elastic pieces by their phyxels that are too deep.
void ColliderOverlaps::take_phyxels(const Task& task, const BodyView& body) {
    const meshless::Phyxels& phyxels = body.phyxels;
    std::erase_if(near_, [&](const Near& near) { return phyxels.rigid.index(near.piece) < 0; });
    const double allowed = tuning::overlaps::max_centre_share * body.spacing;
    for (std::uint32_t i = 0; i < phyxels.size(); ++i) {
        const std::int32_t piece = phyxels.piece[i];
        if (piece < 0 || deep_[static_cast<std::size_t>(piece)] == 0 || phyxels.rigid.index(piece) >= 0)
            continue;
        const Near near{piece, i, phyxels.position[i], depth_of(task, phyxels.position[i]), allowed};
        if (near.is_deep()) near_.push_back(near);
    }
    std::stable_sort(near_.begin(), near_.end(),
                     [](const Near& a, const Near& b) { return a.piece < b.piece; });
}

void ColliderOverlaps::begin(const Task& task, const Parallel& parallel) {
    depths_.resize(task.bodies.size());
    for (std::vector<Depth>& depths : depths_) depths.clear();
    if (task.colliders.empty()) return;
    take_poses(task);
    for (std::size_t b = 0; b < task.bodies.size(); ++b) {
        if (task.bodies[b].is_lattice_driven) continue;
        list_near(task, b, Time::start, parallel);
        for (const Near& near : near_)
            if (near.is_deep()) depths_[b].push_back({near.vertex, near.depth});
        // Contact search has not seen the vertices of changed cells: nothing holds them in this step.
        const splitting::Surface& surface = task.bodies[b].surface;
        for (const std::uint32_t cell : surface.changed_cells())
            for (const splitting::SurfaceQuad& quad : surface.quads(surface.cells()[cell]))
                for (const std::uint32_t vertex : quad.vertices)
                    depths_[b].push_back({vertex, std::numeric_limits<double>::infinity()});
        // The deepest of a vertex comes first: that is the one that is found.
        std::sort(depths_[b].begin(), depths_[b].end(), [](const Depth& a, const Depth& other) {
            return a.vertex != other.vertex ? a.vertex < other.vertex : a.depth > other.depth;
        });
    }
}

std::span<const ColliderOverlaps::Drawn> ColliderOverlaps::drawn(const Task& task, std::size_t index,
                                                                 const Parallel& parallel) {
    drawn_.clear();
    const BodyView& body = task.bodies[index];
    if (task.colliders.empty() || body.is_lattice_driven) return drawn_;
    take_poses(task);
    list_near(task, index, Time::end, parallel);
    const std::vector<std::uint8_t> held = held_pieces(body);
    for (const Near& near : near_) {
        if (!near.is_deep()) continue;
        const double most = held[static_cast<std::size_t>(near.piece)] != 0
                                ? tuning::overlaps::max_drawn_share * body.spacing
                                : std::numeric_limits<double>::infinity();
        const Vec3 position = near.point + lift_of(task, {&near, 1}, 0, most);
        if (position.allFinite()) drawn_.push_back({near.vertex, position});
    }
    return drawn_;
}

// Returns the translation, m, that takes vertices up to the depth that is allowed, as far as they are deeper
// by more than `least` and less than `most`, m. Colliders between which there is no room leave an overlap.
Vec3 ColliderOverlaps::lift_of(const Task& task, std::span<const Near> near, double least,
                               double most) const {
    Vec3 lift = Vec3::Zero();
    bool any = true;
    for (int pass = 0; any && pass < tuning::overlaps::max_lifts; ++pass) {
        any = false;
        for (std::size_t c = 0; c < task.colliders.size(); ++c) {
            double height = 0;
            Vec3 normal = Vec3::Zero();
            for (const Near& vertex : near) {
                const geometry::SignedDistance::Sample at =
                    task.colliders[c].solid->at(poses_[c].to_after * (vertex.point + lift));
                if (!(-at.distance - vertex.allowed > height)) continue;
                height = -at.distance - vertex.allowed;
                normal = at.normal;
            }
            if (!(height > least && height < most)) continue;
            lift += height * (poses_[c].after.linear() * normal);
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
    const Vec3 shift = lift_of(task, near, tuning::overlaps::negligible_share * body.spacing,
                               std::numeric_limits<double>::infinity());
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
    found_deep_.assign(task.bodies.size(), 0);
    depths_.resize(task.bodies.size());
    if (task.colliders.empty()) return outcome;
    take_poses(task);
    for (std::size_t b = 0; b < task.bodies.size(); ++b) {
        const BodyView& body = task.bodies[b];
        if (body.is_lattice_driven) continue;
        list_near(task, b, Time::end, parallel);
        found_deep_[b] =
            std::any_of(near_.begin(), near_.end(), [](const Near& near) { return near.is_deep(); });
        allow_depths(body, depths_[b]);
        keep_deep_pieces(body);
        if (near_.empty()) continue;
        take_phyxels(task, body);
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
