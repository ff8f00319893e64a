// Position correction and impulses of rigid fragments after a step.
#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/rigid_contacts.h>
#include <splitcubes/contact/detection/rigid_motion.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/splitting/pieces.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace splitcubes::body {

namespace {

using meshless::RigidPiece;

}  // namespace

// Computes where the surface points of the rows are at the end of the step; their offsets rotate with the
// piece.
void RigidContacts::find_end_positions() {
    for (ContactRow& row : rows_) {
        if (row.proxy < 0) continue;
        const Vec3 turn = dt_ * proxies_[static_cast<std::size_t>(row.proxy)].end_angular_velocity;
        row.end_position =
            meshless::side_value(row.side, positions_) + row.lower_own + turn.cross(row.lower_own);
    }
}

Vec3 RigidContacts::lower_point(const ContactRow& row) const {
    if (row.lower >= 0)
        return piece_of(fragments_[static_cast<std::size_t>(row.lower)]).world_point(row.lower_own);
    return row.end_position + proxies_[static_cast<std::size_t>(row.proxy)].shift;
}

// Returns a lower bound of the signed distances (m) of the fragment's points.
double RigidContacts::clearance(const meshless::Obstacle& obstacle, const Fragment& fragment) const {
    const Vec3 centre = obstacle.after.inverse() * piece_of(fragment).centre;
    return obstacle.solid->at(centre).distance - tuning::fragments::max_distance_slope * fragment.radius;
}

// Returns the signed distance (m, negative inside) and the world normal at the fragment's deepest point.
geometry::SignedDistance::Sample RigidContacts::deepest(const meshless::Obstacle& obstacle,
                                                        const Fragment& fragment) const {
    const RigidPiece& piece = piece_of(fragment);
    const Isometry to_own = obstacle.after.inverse();
    geometry::SignedDistance::Sample lowest;
    lowest.distance = std::numeric_limits<double>::infinity();
    for (const Vec3& own : phyxels_[fragment.body]->rigid.points_of(piece)) {
        const geometry::SignedDistance::Sample at = obstacle.solid->at(to_own * piece.world_point(own));
        if (at.distance < lowest.distance) lowest = at;
    }
    lowest.normal = obstacle.after.linear() * lowest.normal;
    return lowest;
}

void RigidContacts::record_depth(const Task& task, Fragment& fragment) const {
    fragment.depth.clear();
    for (const meshless::Obstacle& obstacle : task.obstacles)
        fragment.depth.push_back(
            clearance(obstacle, fragment) > 0 ? 0 : std::min(deepest(obstacle, fragment).distance, 0.0));
}

// Moves a fragment out of the obstacles, which do not yield. Returns whether it was in one.
bool RigidContacts::push_out_of_obstacles(const Task& task, Fragment& fragment) {
    const auto mover = static_cast<std::uint32_t>(&fragment - fragments_.data());
    if (ways_[mover] < fragment.outside_until) return false;
    bool any = false;
    double slack = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < task.obstacles.size(); ++k) {
        const double clear = clearance(task.obstacles[k], fragment);
        if (clear > 0) {
            slack = std::min(slack, clear);
            continue;
        }
        const geometry::SignedDistance::Sample at = deepest(task.obstacles[k], fragment);
        const double correction = fragment.depth[k] - at.distance;
        slack = std::min(slack, -correction);
        if (!(correction > 1e-9 * fragment.radius)) continue;
        shift(mover, correction * at.normal);
        max_correction_ = std::max(max_correction_, correction);
        if (!task.obstacles[k].after.isApprox(task.obstacles[k].before, 0))
            groups_[group_of_[mover]].is_driven = true;
        any = true;
    }
    if (!any) fragment.outside_until = ways_[mover] + slack / tuning::fragments::max_distance_slope;
    return any;
}

// Returns the gap at the end of the step minus the smallest gap that is allowed, m.
double RigidContacts::remaining_gap(const ContactRow& row, Overlaps overlaps) const {
    const double depenetration = overlaps == Overlaps::reduce
                                     ? row.max_depenetration
                                     : tuning::fragments::resting_rate * spacing_ * dt_;
    const Vec3 offset = piece_of(fragments_[row.upper]).world_point(row.own) - lower_point(row) - row.start;
    return row.gap + row.normal.dot(offset) - std::min(row.gap + depenetration, 0.0);
}

// Lists the contacts that can overlap while nothing moves farther than max_correction_.
void RigidContacts::list_corrections(Overlaps overlaps) {
    corrections_.clear();
    for (const ContactRow& row : rows_) {
        if (row.lower < 0 && row.proxy < 0) continue;  // an obstacle
        Correction correction;
        correction.upper = row.upper;
        correction.lower = lower_mover(row);
        const Shifted &upper = shifted_[correction.upper], &lower = shifted_[correction.lower];
        if (!(upper.mobility + lower.mobility > 0)) continue;
        correction.normal = row.normal;
        correction.gap = remaining_gap(row, overlaps) - row.normal.dot(upper.by - lower.by);
        correction.min_depth = tuning::fragments::negligible_share * row.max_depenetration;
        if (correction.gap < 2 * max_correction_ && std::isfinite(correction.gap))
            corrections_.push_back(correction);
    }
}

// Undoes the penetration of one contact, as correct_positions does. Returns whether there was one.
bool RigidContacts::correct_position(const Task& task, Correction& correction) {
    const double way = ways_[correction.upper] + ways_[correction.lower];
    if (way < correction.apart_until) return false;
    const Shifted &upper = shifted_[correction.upper], &lower = shifted_[correction.lower];
    const double depth = -correction.gap - correction.normal.dot(upper.by - lower.by);
    if (!(depth > correction.min_depth)) {
        correction.apart_until = way + correction.min_depth - depth;
        return false;
    }
    const Vec3 push = depth / (upper.mobility + lower.mobility) * correction.normal;
    const auto moves_too_far = [&](const Shifted& mover, double sign) {
        return (mover.by + sign * mover.mobility * push).squaredNorm() > max_correction_ * max_correction_ &&
               mover.mobility > 0;
    };
    if (moves_too_far(upper, 1) || moves_too_far(lower, -1)) return false;
    if (upper.mobility > 0 && lower.mobility > 0)
        groups_[group_of_[correction.upper]].angular_momentum_debt -=
            push.cross(upper.velocity - lower.velocity);
    for (const std::uint32_t mover : {correction.upper, correction.lower}) {
        if (mover < fragments_.size()) {
            Fragment& fragment = fragments_[mover];
            if (!fragment.pushed) record_depth(task, fragment);
            fragment.pushed = true;
        }
        const double sign = mover == correction.upper ? 1 : -1;
        if (shifted_[mover].mobility > 0) shift(mover, sign * shifted_[mover].mobility * push);
    }
    return true;
}

// Undoes penetrations that arose in the step, and reduces those that it began with if wanted, on positions
// only. Elastic pieces move as a whole: moving only their surface would add strain energy. Nothing moves
// farther than the deepest penetration: a fragment between surfaces that close on it would be thrown.
void RigidContacts::correct_positions(const Task& task, Overlaps overlaps) {
    shifted_.assign(mover_count(), {});
    ways_.assign(mover_count(), 0);
    for (std::uint32_t mover = 0; mover < mover_count(); ++mover) {
        Shifted& shifted = shifted_[mover];
        shifted.start = centre_of(mover);
        if (is_held(mover) && !(mass_of(mover) > 0)) continue;
        shifted.velocity = velocity_of(mover);
        if (!is_held(mover)) shifted.mobility = 1 / mass_of(mover);
    }
    for (Fragment& fragment : fragments_) fragment.outside_until = 0;
    max_correction_ = 0;
    for (const ContactRow& row : rows_)
        if (row.lower >= 0 || row.proxy >= 0)
            max_correction_ = std::max(max_correction_, -remaining_gap(row, overlaps));
    double listed = -1;  // max_correction_ of the list
    bool any = true;
    for (int iteration = 0; iteration < tuning::fragments::max_position_iterations && any; ++iteration) {
        if (max_correction_ > listed) list_corrections(overlaps);
        listed = max_correction_;
        any = false;
        for (Correction& correction : corrections_) any = correct_position(task, correction) || any;
        for (Fragment& fragment : fragments_)
            if (fragment.pushed && !fragment.held) any = push_out_of_obstacles(task, fragment) || any;
        any = lift_from_supports() || any;
    }
}

// Computes mass, inertia and momenta of the proxies after the step.
void RigidContacts::measure_proxies(const Task& task) {
    std::vector<meshless::Momenta> momenta;
    std::vector<std::uint8_t> held;           // per piece
    std::size_t summed = task.bodies.size();  // body that both belong to
    for (PieceProxy& proxy : proxies_) {
        const BodyView& body = task.bodies[proxy.body];
        const meshless::Phyxels& phyxels = body.phyxels;
        if (summed != proxy.body) {
            meshless::momenta_of_pieces(phyxels, static_cast<int>(body.pieces.count()), momenta);
            held = held_pieces(body);
        }
        summed = proxy.body;
        const meshless::Momenta& now = momenta[static_cast<std::size_t>(proxy.piece)];
        proxy.held = held[static_cast<std::size_t>(proxy.piece)] != 0;
        if (!(now.mass > 0)) continue;
        proxy.mass = now.mass;
        proxy.centre = now.centre;
        proxy.momentum = now.linear;
        proxy.angular_momentum = now.angular_momentum;
        proxy.inertia = now.inertia;
        proxy.inverse_inertia = inverse_of_inertia(now.inertia);
        proxy.end_angular_velocity = proxy.inverse_inertia * now.angular_momentum;
    }
}

// Applies the motion of the proxies to the phyxels of their pieces. The previous state moves, too, so that
// BDF2 does not take an impulse for an acceleration.
void RigidContacts::move_proxies() {
    for (const PieceProxy& proxy : proxies_) {
        if (proxy.held) continue;
        meshless::Phyxels& phyxels = *phyxels_[proxy.body];
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            if (phyxels.piece[i] != proxy.piece) continue;
            phyxels.position[i] += proxy.shift;
            phyxels.previous_position[i] += proxy.shift;
            const Vec3 change =
                proxy.velocity + proxy.angular_velocity.cross(phyxels.position[i] - proxy.moved_centre());
            phyxels.velocity[i] += change;
            phyxels.previous_velocity[i] += change;
        }
    }
}

// Adds rows for the obstacles that support a fragment while others push it.
void RigidContacts::meet_obstacles(const Task& task, std::uint32_t fragment_index) {
    const Fragment& fragment = fragments_[fragment_index];
    if (fragment.held) return;
    const RigidPiece& piece = piece_of(fragment);
    const meshless::RigidPieces& rigid = phyxels_[fragment.body]->rigid;
    const double near = tuning::fragments::support_share * task.bodies[fragment.body].spacing;
    for (const meshless::Obstacle& obstacle : task.obstacles) {
        if (clearance(obstacle, fragment) > near) continue;
        const Isometry to_own = obstacle.after.inverse();
        for (const Vec3& own : rigid.points_of(piece)) {
            const Vec3 point = to_own * piece.world_point(own);
            const geometry::SignedDistance::Sample at = obstacle.solid->at(point);
            if (!(at.distance < near)) continue;
            ContactRow row;
            row.upper = fragment_index;
            row.own = own;
            row.normal = obstacle.after.linear() * at.normal;
            row.friction = obstacle.friction;
            row.surface_velocity = (obstacle.after * point - obstacle.before * point) / task.dt;
            row.min_normal_velocity = -std::max(at.distance, 0.0) / task.dt;
            rows_.push_back(row);
        }
    }
}

std::vector<RigidImpulses::Mover> RigidContacts::list_movers() const {
    std::vector<RigidImpulses::Mover> movers(mover_count() + 1);
    for (std::size_t k = 0; k < fragments_.size(); ++k) {
        const RigidPiece& piece = piece_of(fragments_[k]);
        RigidImpulses::Mover& mover = movers[k];
        const Mat3 inverse_inertia = piece.inverse_inertia();
        mover.velocity = piece.velocity();
        mover.angular_velocity = inverse_inertia * piece.angular_momentum;
        if (fragments_[k].held) continue;
        mover.mobility = 1 / piece.mass;
        mover.inverse_inertia = inverse_inertia;
    }
    for (std::size_t k = 0; k < proxies_.size(); ++k) {
        const PieceProxy& proxy = proxies_[k];
        RigidImpulses::Mover& mover = movers[fragments_.size() + k];
        mover.velocity = proxy.velocity;
        mover.angular_velocity = proxy.angular_velocity;
        if (proxy.held || !(proxy.mass > 0)) continue;
        mover.mobility = 1 / proxy.mass;
        mover.inverse_inertia = proxy.inverse_inertia;
    }
    return movers;
}

void RigidContacts::add_impulse(const ContactRow& row) {
    RigidImpulses::Contact contact;
    contact.upper = row.upper;
    contact.lower = mover_count();
    contact.normal = row.normal;
    contact.arm = row.point - piece_of(fragments_[row.upper]).centre;
    if (row.lower >= 0 || row.proxy >= 0) {
        contact.lower = lower_mover(row);
        contact.lower_arm = row.point - centre_of(contact.lower);
    }
    contact.lower_velocity = row.surface_velocity;
    if (row.proxy >= 0)
        contact.lower_velocity =
            meshless::side_value(row.side, velocities_) +
            proxies_[static_cast<std::size_t>(row.proxy)].end_angular_velocity.cross(row.lower_own);
    contact.min_normal_velocity = row.min_normal_velocity;
    contact.friction = row.friction;
    impulses_.add(contact);
}

// Applies the impulses to both sides, equal and opposite, so momenta are conserved. Returns the work of held
// fragments, J.
double RigidContacts::push_fragments() {
    double work = 0;
    const auto push = [&](const Fragment& fragment, const Vec3& point, const Vec3& impulse) {
        RigidPiece& piece = piece_of(fragment);
        if (fragment.held)
            work -= impulse.dot(piece.velocity() + piece.angular_velocity().cross(point - piece.centre));
        else
            piece.push(point, impulse);
    };
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const ContactRow& row = rows_[k];
        const Vec3 impulse = impulses_.impulse(k);
        push(fragments_[row.upper], row.point, impulse);
        if (row.lower >= 0) push(fragments_[static_cast<std::size_t>(row.lower)], row.point, -impulse);
    }
    for (std::size_t k = 0; k < proxies_.size(); ++k) {
        const RigidImpulses::Mover& mover = impulses_.movers()[fragments_.size() + k];
        proxies_[k].velocity = mover.velocity;
        proxies_[k].angular_velocity = mover.angular_velocity;
    }
    return work;
}

// Sorts the rows along gravity because the sweeps alternate in direction: a heap is supported from below.
void RigidContacts::sort_rows(const Task& task) {
    std::vector<std::pair<double, std::size_t>> order;  // height, index
    order.reserve(rows_.size());
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        ContactRow& row = rows_[k];
        row.point = piece_of(fragments_[row.upper]).world_point(row.own);
        order.emplace_back(-task.gravity.dot(row.point), k);
    }
    std::sort(order.begin(), order.end());
    spare_rows_.clear();
    for (const auto& [height, k] : order) spare_rows_.push_back(rows_[k]);
    rows_.swap(spare_rows_);
}

RigidContacts::Outcome RigidContacts::push(const Task& task, const Parallel& parallel) {
    Outcome outcome;
    listed_ = 0;
    if (fragments_.empty()) return outcome;
    dt_ = task.dt;
    positions_.clear();
    velocities_.clear();
    for (const BodyView& body : task.bodies) {
        positions_.emplace_back(body.phyxels.position);
        velocities_.emplace_back(body.phyxels.velocity);
    }
    for (Fragment& fragment : fragments_)
        fragment.held = task.bodies[fragment.body].holds_rigid(fragment.index);
    measure_proxies(task);
    list_rows(task, parallel);
    if (rows_.empty()) return outcome;
    measure_supports();
    form_groups(task);
    const Outcome before = totals();
    correct_positions(task, Overlaps::keep);
    pay_debts(1);
    // Keeps nearly touching contacts, too: moving one corner of a fragment lifts all others.
    std::erase_if(rows_, [&](ContactRow& row) {
        const double left = remaining_gap(row, Overlaps::keep);
        row.min_normal_velocity = -std::max(left, 0.0) / task.dt;
        return !(left < tuning::fragments::support_share * spacing_) || !fragments_[row.upper].pushed;
    });
    for (std::uint32_t k = 0; k < fragments_.size(); ++k)
        if (fragments_[k].pushed) meet_obstacles(task, k);
    sort_rows(task);
    impulses_.reset(list_movers());
    for (const ContactRow& row : rows_) add_impulse(row);
    impulses_.solve(static_cast<std::uint32_t>(fragments_.size()), mover_count());
    outcome.contacts = impulses_.active();
    outcome.hold_work = push_fragments();
    reduce_overlaps(task);
    pay_for_lifts(task);
    const Outcome after = totals();
    outcome.kinetic_energy = after.kinetic_energy - before.kinetic_energy;
    outcome.momentum = after.momentum - before.momentum;
    outcome.angular_momentum = after.angular_momentum - before.angular_momentum;
    move_proxies();
    for (meshless::Phyxels* phyxels : phyxels_)
        if (!phyxels->rigid.empty()) meshless::write_phyxels(*phyxels);
    return outcome;
}

// Returns the sums over fragments and elastic pieces with the impulses so far. The kinetic energy of an
// elastic piece is counted up to a constant.
RigidContacts::Outcome RigidContacts::totals() const {
    Outcome sum;
    for (const Fragment& fragment : fragments_) {
        const RigidPiece& piece = piece_of(fragment);
        sum.kinetic_energy += piece.kinetic_energy();
        sum.momentum += piece.momentum;
        sum.angular_momentum += piece.centre.cross(piece.momentum) + piece.angular_momentum;
    }
    for (const PieceProxy& proxy : proxies_) {
        if (proxy.held) continue;
        const Vec3 &v = proxy.velocity, &w = proxy.angular_velocity;
        sum.kinetic_energy += proxy.momentum.dot(v) + 0.5 * proxy.mass * v.squaredNorm();
        sum.kinetic_energy += proxy.angular_momentum.dot(w) + 0.5 * w.dot(proxy.inertia * w);
        const Vec3 momentum = proxy.momentum + proxy.mass * v;
        sum.momentum += momentum;
        sum.angular_momentum +=
            proxy.moved_centre().cross(momentum) + proxy.angular_momentum + proxy.inertia * w;
    }
    return sum;
}

}  // namespace splitcubes::body
