// This part of RigidContacts accounts for the angular momentum and the energy that position corrections cost.
#include <splitcubes/contact/detection/rigid_contacts.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/core/disjoint_sets.h>
#include <splitcubes/samples/phyxels.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

using meshless::Momenta;

// Fragments come first, then elastic pieces.
std::uint32_t RigidContacts::lower_mover(const ContactRow& row) const {
    return row.lower >= 0
               ? static_cast<std::uint32_t>(row.lower)
               : static_cast<std::uint32_t>(fragments_.size()) + static_cast<std::uint32_t>(row.proxy);
}

bool RigidContacts::is_held(std::uint32_t mover) const {
    if (mover < fragments_.size()) return fragments_[mover].held;
    const PieceProxy& proxy = proxies_[mover - fragments_.size()];
    return proxy.held || !(proxy.mass > 0);
}

// Returns mass, centre and momenta as they are now.
Momenta RigidContacts::momenta_of(std::uint32_t mover) const {
    if (mover < fragments_.size()) {
        const meshless::RigidPiece& piece = piece_of(fragments_[mover]);
        return {piece.mass, piece.centre, piece.momentum, piece.angular_momentum, piece.world_inertia()};
    }
    const PieceProxy& proxy = proxies_[mover - fragments_.size()];
    return {proxy.mass, proxy.moved_centre(), proxy.momentum + proxy.mass * proxy.velocity,
            proxy.angular_momentum + proxy.inertia * proxy.angular_velocity, proxy.inertia};
}

double RigidContacts::mass_of(std::uint32_t mover) const {
    return mover < fragments_.size() ? piece_of(fragments_[mover]).mass
                                     : proxies_[mover - fragments_.size()].mass;
}

Vec3 RigidContacts::centre_of(std::uint32_t mover) const {
    return mover < fragments_.size() ? piece_of(fragments_[mover]).centre
                                     : proxies_[mover - fragments_.size()].moved_centre();
}

Vec3 RigidContacts::velocity_of(std::uint32_t mover) const {
    if (mover < fragments_.size()) return piece_of(fragments_[mover]).velocity();
    const PieceProxy& proxy = proxies_[mover - fragments_.size()];
    return proxy.momentum / proxy.mass + proxy.velocity;
}

Vec3 RigidContacts::angular_velocity_of(std::uint32_t mover) const {
    if (mover < fragments_.size()) return piece_of(fragments_[mover]).angular_velocity();
    const PieceProxy& proxy = proxies_[mover - fragments_.size()];
    return proxy.inverse_inertia * proxy.angular_momentum + proxy.angular_velocity;
}

void RigidContacts::shift(std::uint32_t mover, const Vec3& by) {
    shifted_[mover].by += by;
    ways_[mover] += by.norm();
    if (mover < fragments_.size())
        piece_of(fragments_[mover]).centre += by;
    else
        proxies_[mover - fragments_.size()].shift += by;
}

// Adds a velocity of the centre (m/s) and an angular velocity (rad/s).
void RigidContacts::accelerate(std::uint32_t mover, const Vec3& velocity, const Vec3& angular_velocity) {
    if (mover < fragments_.size()) {
        meshless::RigidPiece& piece = piece_of(fragments_[mover]);
        piece.momentum += piece.mass * velocity;
        piece.angular_momentum += piece.world_inertia() * angular_velocity;
    } else {
        proxies_[mover - fragments_.size()].velocity += velocity;
        proxies_[mover - fragments_.size()].angular_velocity += angular_velocity;
    }
}

// Returns kinetic energy of the rigid motion plus potential energy, J.
double RigidContacts::energy_of(const Task& task, std::uint32_t mover) const {
    const Momenta now = momenta_of(mover);
    return 0.5 * now.linear.squaredNorm() / now.mass +
           0.5 * now.angular_momentum.dot(angular_velocity_of(mover)) -
           now.mass * task.gravity.dot(now.centre);
}

// Groups what contacts connect. What is held connects nothing. An integrator that damps lets an elastic piece
// fall farther than its parabola, and what lifts it back costs nothing.
void RigidContacts::form_groups(const Task& task) {
    DisjointSets sets(mover_count());
    for (const ContactRow& row : rows_)
        if (!is_held(row.upper) && !is_held(lower_mover(row))) sets.join(row.upper, lower_mover(row));
    groups_.clear();
    group_of_.assign(mover_count(), mover_count());
    for (std::uint32_t mover = 0; mover < mover_count(); ++mover) {
        const std::uint32_t root = sets.find(mover);
        if (group_of_[root] == mover_count()) {
            group_of_[root] = static_cast<std::uint32_t>(groups_.size());
            groups_.emplace_back();
        }
        group_of_[mover] = group_of_[root];
        if (is_held(mover)) continue;
        Group& group = groups_[group_of_[mover]];
        group.movers.push_back(mover);
        const double energy = energy_of(task, mover);
        group.energy += energy;
        group.potential -= mass_of(mover) * task.gravity.dot(centre_of(mover));
        if (mover < fragments_.size()) continue;
        const PieceProxy& proxy = proxies_[mover - fragments_.size()];
        const double step_velocity = task.dt * task.gravity.norm();
        group.energy +=
            std::clamp(proxy.start_energy - energy, 0.0, 0.5 * proxy.mass * step_velocity * step_velocity);
    }
    const auto drives = [this](std::uint32_t mover) {
        return is_held(mover) && mass_of(mover) > 0 && !velocity_of(mover).isZero(0);
    };
    for (const ContactRow& row : rows_) {
        if (drives(row.upper)) groups_[group_of_[lower_mover(row)]].is_driven = true;
        if (drives(lower_mover(row))) groups_[group_of_[row.upper]].is_driven = true;
    }
}

// Returns the momenta of a group together.
Momenta RigidContacts::momenta_of(const Group& group) const {
    std::vector<Momenta> parts;
    for (const std::uint32_t mover : group.movers) parts.push_back(momenta_of(mover));
    return meshless::together(parts);
}

double RigidContacts::energy_of(const Task& task, const Group& group) const {
    double sum = 0;
    for (const std::uint32_t mover : group.movers) sum += energy_of(task, mover);
    return sum;
}

// Gives a share of the angular momentum that corrections of positions took back to each group, as a rotation
// of the whole.
void RigidContacts::pay_debts(double share) {
    for (Group& group : groups_) {
        if (group.angular_momentum_debt.isZero(0)) continue;
        const Momenta all = momenta_of(group);
        const Vec3 rate = meshless::angular_velocity(all.inertia, share * group.angular_momentum_debt);
        for (const std::uint32_t mover : group.movers)
            accelerate(mover, rate.cross(centre_of(mover) - all.centre), rate);
        group.angular_momentum_debt.setZero();
    }
}

// Reduces overlaps that the step began with, as far as lifting what lies on them costs no more than a share
// of what impulses and corrections took. So what rests is not lifted, and heaps gain no energy.
void RigidContacts::reduce_overlaps(const Task& task) {
    double budget = 0, before = 0, after = 0;
    for (const Group& group : groups_) {
        const double now = energy_of(task, group);
        before += now;
        budget += tuning::fragments::lifting_share * (group.energy - now);
    }
    if (!(budget > 0)) return;
    correct_positions(task, Overlaps::reduce);
    for (const Group& group : groups_) after += energy_of(task, group);
    const double share = after - before > budget ? budget / (after - before) : 1;
    for (std::uint32_t mover = 0; mover < mover_count(); ++mover)
        if (!is_held(mover)) shift(mover, (share - 1) * (centre_of(mover) - shifted_[mover].start));
    pay_debts(share);
}

// Takes energy that corrections gave to a group from what it moves against its common rigid motion, then from
// the common fall: only colliders and what is held can lift a whole group, and these also stop it. What does
// not move is lifted for nothing: it would sink in.
void RigidContacts::pay_for_lifts(const Task& task) {
    for (const Group& group : groups_) {
        const double owed = energy_of(task, group) - group.energy;
        if (group.is_driven || !(owed > 0)) continue;
        const Momenta all = momenta_of(group);
        const Vec3 velocity = all.linear / all.mass;
        const Vec3 rate = meshless::angular_velocity(all.inertia, all.angular_momentum);
        double deviating = -0.5 * (all.linear.dot(velocity) + all.angular_momentum.dot(rate));
        for (const std::uint32_t mover : group.movers)
            deviating += energy_of(task, mover) + mass_of(mover) * task.gravity.dot(centre_of(mover));
        deviating = std::max(deviating, 0.0);
        const double share = owed < deviating ? std::sqrt(1 - owed / deviating) : 0;
        for (const std::uint32_t mover : group.movers) {
            const Vec3 common = velocity + rate.cross(centre_of(mover) - all.centre);
            accelerate(mover, (share - 1) * (velocity_of(mover) - common),
                       (share - 1) * (angular_velocity_of(mover) - rate));
        }
        const Vec3 down = task.gravity.normalized();
        const double lifted = -all.mass * task.gravity.dot(all.centre) - group.potential;
        const double left = std::min(owed - deviating, lifted), fall = velocity.dot(down);
        if (!(left > 0) || !(fall > 0)) continue;
        const double slower = std::sqrt(std::max(fall * fall - 2 * left / all.mass, 0.0));
        for (const std::uint32_t mover : group.movers)
            accelerate(mover, (slower - fall) * down, Vec3::Zero());
    }
}

}  // namespace splitcubes::body
