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
    rows_.clear();
    active_rows_.clear();
    fastest_ = 0;
}

void RigidImpulses::add(const Contact& contact) {
    const Mover &upper = movers_[contact.upper], &lower = movers_[contact.lower];
    Row row;
    ActiveRow active;
    row.upper = contact.upper;
    row.lower = contact.lower;
    row.normal = contact.normal;
    row.torque = contact.arm.cross(contact.normal);
    row.lower_torque = contact.lower_arm.cross(contact.normal);
    active.turn = upper.inverse_inertia * row.torque;
    active.lower_turn = lower.inverse_inertia * row.lower_torque;
    active.arm = contact.arm;
    active.lower_arm = contact.lower_arm;
    active.velocity = contact.lower_velocity;
    active.friction = contact.friction;
    row.min_velocity = contact.min_normal_velocity + contact.normal.dot(active.velocity);
    const Mat3 mobility = mobility_at(upper.mobility, upper.inverse_inertia, contact.arm) +
                          mobility_at(lower.mobility, lower.inverse_inertia, contact.lower_arm);
    const double normal = contact.normal.dot(mobility * contact.normal);
    // Overestimates the mobility along both tangents: too small an impulse still only removes energy.
    const double along = mobility.trace() - normal;
    row.mass = normal > 0 ? 1 / normal : 0;
    active.tangential_mass = along > 0 ? 1 / along : 0;
    rows_.push_back(row);
    active_rows_.push_back(active);
    const Vec3 velocity =
        upper.velocity_at(contact.arm) - lower.velocity_at(contact.lower_arm) - active.velocity;
    fastest_ = std::max(fastest_, velocity.norm());
}

Vec3 RigidImpulses::impulse(std::size_t contact) const {
    return rows_[contact].impulse * rows_[contact].normal + active_rows_[contact].impulse;
}

std::size_t RigidImpulses::active() const {
    return static_cast<std::size_t>(
        std::count_if(rows_.begin(), rows_.end(), [](const Row& row) { return row.impulse > 0; }));
}

// Applies friction after the normal impulse is known. Returns the change of velocity, m/s.
double RigidImpulses::apply_friction(const Row& row, ActiveRow& active) {
    Mover &upper = movers_[row.upper], &lower = movers_[row.lower];
    Vec3 sliding = upper.velocity_at(active.arm) - lower.velocity_at(active.lower_arm) - active.velocity;
    sliding -= row.normal * row.normal.dot(sliding);
    Vec3 impulse = active.impulse - active.tangential_mass * sliding;
    const double limit = active.friction * row.impulse, square = impulse.squaredNorm();
    if (square > limit * limit) impulse *= limit / std::sqrt(square);
    const Vec3 change = impulse - active.impulse;
    active.impulse = impulse;
    upper.push(active.arm, change);
    lower.push(active.lower_arm, -change);
    return change.norm() / active.tangential_mass;
}

// Solves one contact and returns its largest change of velocity, m/s.
double RigidImpulses::solve(std::size_t k) {
    Row& row = rows_[k];
    if (!(row.mass > 0)) return 0;
    Mover &upper = movers_[row.upper], &lower = movers_[row.lower];
    const double velocity = row.normal.dot(upper.velocity - lower.velocity) +
                            row.torque.dot(upper.angular_velocity) -
                            row.lower_torque.dot(lower.angular_velocity);
    const double impulse = std::max(0.0, row.impulse + row.mass * (row.min_velocity - velocity));
    // An impulse of friction ends in the sweep in which the normal one does.
    if (impulse == 0 && row.impulse == 0) return 0;
    ActiveRow& active = active_rows_[k];
    const double change = impulse - row.impulse;
    row.impulse = impulse;
    if (change != 0) {
        upper.velocity += change * upper.mobility * row.normal;
        upper.angular_velocity += change * active.turn;
        lower.velocity -= change * lower.mobility * row.normal;
        lower.angular_velocity -= change * active.lower_turn;
    }
    const double largest = std::abs(change) / row.mass;
    return active.tangential_mass > 0 ? std::max(largest, apply_friction(row, active)) : largest;
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
            double& max_change = is_piece(rows_[at].lower) ? piece_change : other_change;
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
