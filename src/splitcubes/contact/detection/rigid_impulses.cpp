// Impulses between rigid bodies.
#include <splitcubes/contact/detection/rigid_impulses.h>
#include <splitcubes/contact/detection/rigid_motion.h>
#include <splitcubes/contact/detection/tuning.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::body {

void RigidImpulses::reset(std::vector<Mover> movers) {
    movers_ = std::move(movers);
    reach_.assign(movers_.size(), 0);
    changes_.assign(movers_.size(), 0);
    watches_.clear();
    contacts_.clear();
    rows_.clear();
    active_rows_.clear();
    fastest_ = 0;
}

// Returns the velocity per impulse at the contact, 1/kg.
Mat3 RigidImpulses::mobility_of(const Contact& contact) const {
    const Mover &upper = movers_[contact.upper], &lower = movers_[contact.lower];
    return mobility_at(upper.mobility, upper.inverse_inertia, contact.arm) +
           mobility_at(lower.mobility, lower.inverse_inertia, contact.lower_arm);
}

void RigidImpulses::add(const Contact& contact) {
    const Mover &upper = movers_[contact.upper], &lower = movers_[contact.lower];
    Row row;
    row.normal = contact.normal;
    row.torque = contact.arm.cross(contact.normal);
    row.lower_torque = contact.lower_arm.cross(contact.normal);
    row.min_velocity = contact.min_normal_velocity + contact.normal.dot(contact.lower_velocity);
    const double normal = contact.normal.dot(mobility_of(contact) * contact.normal);
    row.mass = normal > 0 ? 1 / normal : 0;
    watches_.push_back({contact.upper, contact.lower, 0});
    reach_[contact.upper] = std::max(reach_[contact.upper], contact.arm.norm());
    reach_[contact.lower] = std::max(reach_[contact.lower], contact.lower_arm.norm());
    rows_.push_back(row);
    contacts_.push_back(contact);
    const Vec3 velocity =
        upper.velocity_at(contact.arm) - lower.velocity_at(contact.lower_arm) - contact.lower_velocity;
    fastest_ = std::max(fastest_, velocity.norm());
}

Vec3 RigidImpulses::impulse(std::size_t contact) const {
    const Row& row = rows_[contact];
    if (row.active < 0) return Vec3::Zero();
    return row.impulse * row.normal + active_rows_[static_cast<std::size_t>(row.active)].impulse;
}

std::size_t RigidImpulses::active() const {
    return static_cast<std::size_t>(
        std::count_if(rows_.begin(), rows_.end(), [](const Row& row) { return row.impulse > 0; }));
}

// Returns the row of a contact that gets its first impulse.
RigidImpulses::ActiveRow& RigidImpulses::activate(std::size_t k) {
    const Contact& contact = contacts_[k];
    const Row& row = rows_[k];
    const Mover &upper = movers_[contact.upper], &lower = movers_[contact.lower];
    rows_[k].active = static_cast<std::int32_t>(active_rows_.size());
    ActiveRow& active = active_rows_.emplace_back();
    active.turn = upper.inverse_inertia * row.torque;
    active.lower_turn = lower.inverse_inertia * row.lower_torque;
    active.arm = contact.arm;
    active.lower_arm = contact.lower_arm;
    active.velocity = contact.lower_velocity;
    active.friction = contact.friction;
    const Mat3 mobility = mobility_of(contact);
    // Overestimates the mobility along both tangents: too small an impulse still only removes energy.
    const double along = mobility.trace() - contact.normal.dot(mobility * contact.normal);
    active.tangential_mass = along > 0 ? 1 / along : 0;
    // The trace of a matrix without negative eigenvalues bounds its norm.
    const double reach = reach_[contact.upper], lower_reach = reach_[contact.lower];
    active.gain = {upper.mobility + reach * active.turn.norm(),
                   lower.mobility + lower_reach * active.lower_turn.norm()};
    active.friction_gain = {
        upper.mobility + reach * upper.inverse_inertia.trace() * active.arm.norm(),
        lower.mobility + lower_reach * lower.inverse_inertia.trace() * active.lower_arm.norm()};
    return active;
}

void RigidImpulses::add_change(const Watch& watch, double impulse, const Gain& gain) {
    changes_[watch.upper] += impulse * gain.upper;
    changes_[watch.lower] += impulse * gain.lower;
}

// Applies friction after the normal impulse is known. Returns the change of velocity, m/s.
double RigidImpulses::apply_friction(const Watch& watch, const Row& row, ActiveRow& active) {
    Mover &upper = movers_[watch.upper], &lower = movers_[watch.lower];
    Vec3 sliding = upper.velocity_at(active.arm) - lower.velocity_at(active.lower_arm) - active.velocity;
    sliding -= row.normal * row.normal.dot(sliding);
    Vec3 impulse = active.impulse - active.tangential_mass * sliding;
    const double limit = active.friction * row.impulse, square = impulse.squaredNorm();
    if (square > limit * limit) impulse *= limit / std::sqrt(square);
    const Vec3 change = impulse - active.impulse;
    active.impulse = impulse;
    upper.push(active.arm, change);
    lower.push(active.lower_arm, -change);
    const double size = change.norm();
    add_change(watch, size, active.friction_gain);
    return size / active.tangential_mass;
}

// Solves one contact and returns its largest change of velocity, m/s.
double RigidImpulses::solve(std::size_t k) {
    Watch& watch = watches_[k];
    const double changes = changes_[watch.upper] + changes_[watch.lower];
    if (changes < watch.until) return 0;
    Row& row = rows_[k];
    if (!(row.mass > 0)) return 0;
    Mover &upper = movers_[watch.upper], &lower = movers_[watch.lower];
    const double velocity = row.normal.dot(upper.velocity - lower.velocity) +
                            row.torque.dot(upper.angular_velocity) -
                            row.lower_torque.dot(lower.angular_velocity);
    const double impulse = std::max(0.0, row.impulse + row.mass * (row.min_velocity - velocity));
    // An impulse of friction ends in the sweep in which the normal one does.
    if (impulse == 0 && row.impulse == 0) {
        watch.until = changes + tuning::fragments::unchanged_share * (velocity - row.min_velocity);
        return 0;
    }
    ActiveRow& active = row.active < 0 ? activate(k) : active_rows_[static_cast<std::size_t>(row.active)];
    const double change = impulse - row.impulse;
    row.impulse = impulse;
    if (change != 0) {
        upper.velocity += change * upper.mobility * row.normal;
        upper.angular_velocity += change * active.turn;
        lower.velocity -= change * lower.mobility * row.normal;
        lower.angular_velocity -= change * active.lower_turn;
        add_change(watch, std::abs(change), active.gain);
    }
    const double largest = std::abs(change) / row.mass;
    return active.tangential_mass > 0 ? std::max(largest, apply_friction(watch, row, active)) : largest;
}

// Sweeps forwards and backwards in turn. Where surfaces close on a fragment from two sides, no impulse on
// whole pieces can separate them, and iterations would only increase the impulses: they end when they no
// longer help.
void RigidImpulses::solve(std::uint32_t first_piece, std::uint32_t end_piece) {
    const auto is_piece = [=](std::uint32_t mover) { return mover >= first_piece && mover < end_piece; };
    double piece_change = 0, other_change = 0, before = std::numeric_limits<double>::infinity();
    for (int iteration = 0; iteration < tuning::fragments::max_velocity_iterations; ++iteration) {
        double largest = 0;
        for (std::size_t k = 0; k < rows_.size(); ++k) {
            const std::size_t at = iteration % 2 == 0 ? k : rows_.size() - 1 - k;
            const double change = solve(at);
            double& max_change = is_piece(watches_[at].lower) ? piece_change : other_change;
            max_change = std::max(max_change, change);
            largest = std::max(largest, change);
        }
        if (!(largest > tuning::fragments::converged_share * fastest_)) break;
        if (iteration % tuning::fragments::stagnation_check_interval !=
            tuning::fragments::stagnation_check_interval - 1)
            continue;
        if (piece_change > tuning::fragments::stagnation_share * other_change &&
            piece_change > tuning::fragments::stagnation_ratio * before)
            break;
        before = piece_change;
        piece_change = other_change = 0;
    }
}

}  // namespace splitcubes::body
