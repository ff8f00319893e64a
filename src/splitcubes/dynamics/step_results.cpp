#include <splitcubes/core/error.h>
#include <splitcubes/dynamics/step_results.h>
#include <splitcubes/dynamics/tuning.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numeric>
#include <string>

namespace splitcubes::meshless {

namespace {

void check_length(std::size_t length, std::size_t expected, const char* name) {
    if (length == expected) return;
    throw InputError(
        std::string("StepInput.") + name,
        "has " + std::to_string(length) + " entries for " + std::to_string(expected) + " phyxels",
        "give one a phyxel");
}

}  // namespace

void check_step_input(const Phyxels& phyxels, const StepInput& input) {
    if (!(input.dt > 0) || !std::isfinite(input.dt))
        throw InputError("StepInput.dt", "is not positive (" + std::to_string(input.dt) + ")",
                         "give the step in seconds");
    if (input.held.empty()) return;
    check_length(input.held.size(), phyxels.size(), "held");
    check_length(input.held_position.size(), phyxels.size(), "held_position");
}

double find_rotation_rates(const Phyxels& phyxels, std::span<const Momenta> pieces,
                           std::vector<double>& rates) {
    rates.assign(pieces.size(), 0);
    double largest = 0;
    for (std::size_t k = 0; k < pieces.size(); ++k) {
        if (!(pieces[k].mass > 0) || phyxels.rigid.index(static_cast<std::int32_t>(k)) >= 0) continue;
        rates[k] = angular_velocity(pieces[k].inertia, pieces[k].angular_momentum).norm();
        largest = std::max(largest, rates[k]);
    }
    return largest;
}

void MomentumKeeper::begin(const Phyxels& phyxels, int piece_count, const Parallel& parallel) {
    momenta_of_pieces(phyxels, piece_count, before_, partial_, parallel);
    largest_rate_ = find_rotation_rates(phyxels, before_, rate_);
    bound_.assign(static_cast<std::size_t>(piece_count) + 1, 0);
    bound_.back() = 1;
    joined_.resize(bound_.size());
    std::iota(joined_.begin(), joined_.end(), std::size_t{0});
}

std::size_t MomentumKeeper::root(std::size_t slot) const {
    while (joined_[slot] != slot) slot = joined_[slot];
    return slot;
}

void MomentumKeeper::join(std::int32_t a, std::int32_t b) {
    const std::size_t first = root(slot(a)), second = root(slot(b));
    joined_[std::max(first, second)] = std::min(first, second);
}

void MomentumKeeper::join_touching(const Phyxels& phyxels, const ContactInput& contacts, std::uint32_t part) {
    CachedContactFinder finder(contacts.cached);
    for (const Contact& contact : contacts.contacts) {
        if (!finder.find(contact.key)) continue;
        const std::array<const ContactSide*, 2> sides = {&contact.upper, &contact.lower};
        std::int32_t first = -1;
        for (const ContactSide* side : sides)
            for (std::uint32_t k = 0; k < side->count; ++k) {
                if (side->part != part) continue;
                const std::int32_t piece = phyxels.piece[side->phyxel[k]];
                if (first >= 0 && first != piece) join(first, piece);
                first = piece;
            }
        const bool alone = !contact.upper.is_collider() && !contact.lower.is_collider() &&
                           contact.upper.part == part && contact.lower.part == part;
        if (first >= 0 && !alone) bind(first);
    }
}

// Replaces each piece's entry by that of its group.
void MomentumKeeper::sum_groups(std::vector<Momenta>& momenta) {
    group_sum_.assign(momenta.size(), Momenta{});
    for (std::size_t k = 0; k < momenta.size(); ++k) {
        Momenta& sum = group_sum_[root(k)];
        sum.mass += momenta[k].mass;
        sum.centre += momenta[k].mass * momenta[k].centre;
        sum.linear += momenta[k].linear;
    }
    for (Momenta& sum : group_sum_)
        if (sum.mass > 0) sum.centre /= sum.mass;
    for (std::size_t k = 0; k < momenta.size(); ++k) {
        Momenta& sum = group_sum_[root(k)];
        const double m = momenta[k].mass;
        if (!(m > 0)) continue;
        const Vec3 arm = momenta[k].centre - sum.centre;
        sum.angular_momentum +=
            momenta[k].angular_momentum + arm.cross(momenta[k].linear - m / sum.mass * sum.linear);
        sum.inertia +=
            momenta[k].inertia + m * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
    }
    for (std::size_t k = 0; k < momenta.size(); ++k) momenta[k] = group_sum_[root(k)];
}

void MomentumKeeper::restore(Phyxels& phyxels, double factor, const Vec3& velocity,
                             std::span<const double> shift, double dt, const Parallel& parallel) {
    for (std::size_t k = 0; k < bound_.size(); ++k)
        if (bound_[k] != 0) bound_[root(k)] = 1;
    for (std::size_t k = 0; k < bound_.size(); ++k) bound_[k] = bound_[root(k)];
    if (std::find(bound_.begin(), bound_.end(), 0) == bound_.end()) return;
    group_ = before_;
    sum_groups(group_);
    // First by moving (the error of the solver), then by velocities, to rounding.
    if (!shift.empty()) correct(phyxels, factor, velocity, shift, 0, parallel);
    correct(phyxels, factor, velocity, {}, dt, parallel);
}

// Applies a correction. dt: 0 leaves the centres where they are.
void MomentumKeeper::correct(Phyxels& phyxels, double factor, const Vec3& velocity,
                             std::span<const double> shift, double dt, const Parallel& parallel) {
    momenta_of_pieces(phyxels, static_cast<int>(before_.size()), after_, partial_, parallel);
    sum_groups(after_);
    centre_shift_.assign(before_.size() + 1, Vec3::Zero());
    mean_.assign(before_.size() + 1, Vec3::Zero());
    for (std::size_t k = 0; k < before_.size(); ++k) {
        if (!(after_[k].mass > 0)) bound_[k] = 1;
        if (bound_[k] != 0) continue;
        const Vec3 linear = factor * (group_[k].linear + group_[k].mass * velocity);
        const Vec3 angular_momentum = factor * group_[k].angular_momentum;
        if (dt > 0)
            centre_shift_[k] =
                group_[k].centre - after_[k].centre + 0.5 * dt / group_[k].mass * (group_[k].linear + linear);
        mean_[k] = after_[k].linear / after_[k].mass;
        // The velocity correction replaces the momenta it was computed from.
        after_[k].linear = (linear - after_[k].linear) / after_[k].mass;
        after_[k].angular_momentum =
            angular_velocity(after_[k].inertia, angular_momentum - after_[k].angular_momentum);
    }
    for_phyxels(parallel, phyxels.size(), [&](std::size_t i) {
        const std::size_t k = slot(phyxels.piece[i]);
        if (bound_[k] != 0) return;
        const Vec3 rate = after_[k].angular_momentum;
        Vec3 arm = phyxels.position[i] - after_[k].centre;
        if (!shift.empty()) {
            const double angle = shift[i] * rate.norm();
            if (angle > tuning::guess::min_rotation) {
                const Eigen::AngleAxisd turn(angle, rate.normalized());
                arm = turn * arm;
                phyxels.velocity[i] = mean_[k] + turn * (phyxels.velocity[i] - mean_[k]);
            } else {
                arm += shift[i] * rate.cross(arm);
            }
            phyxels.position[i] = after_[k].centre + arm + shift[i] * after_[k].linear;
        }
        phyxels.velocity[i] += after_[k].linear + rate.cross(arm);
        phyxels.position[i] += centre_shift_[k];
    });
}

DeformationChange deform_and_flow(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                  const Material& material, double dt, SlicedElasticity& elastic,
                                  const Parallel& parallel, bool has_state) {
    DeformationChange out;
    // The energy is only final if no plastic flow follows.
    if (!has_state && is_frame_sufficient(material))
        out.non_finite =
            elastic.take_state_and_energy(neighbourhoods, material, configuration_of(phyxels), parallel);
    else if (!has_state)
        out.non_finite = elastic.take_state(neighbourhoods, material, configuration_of(phyxels), parallel);
    elastic.read_deformation(phyxels.deformation, phyxels.rotation, parallel);
    if (!material.plasticity) return out;
    std::atomic<bool> flowed = false;
    for_phyxels(parallel, phyxels.size(), [&](std::size_t i) {
        Mat3& plastic = phyxels.plastic_strain[i];
        const Mat3 projector = neighbourhoods.kept_directions(i);
        const Mat3 projected = projector * plastic * projector;
        const Mat3 total = strain(material, phyxels.deformation[i], phyxels.rotation[i]);
        const Mat3 after = flow(*material.plasticity, projector * total * projector, projected, dt);
        if (after == projected) return;
        plastic += after - projected;
        flowed.store(true, std::memory_order_relaxed);
    });
    out.flowed = flowed;
    return out;
}

StateSums& StateSums::operator+=(const StateSums& other) {
    inverted += other.inverted;
    rank_deficient += other.rank_deficient;
    kinetic_energy += other.kinetic_energy;
    top_speed = std::max(top_speed, other.top_speed);
    linear += other.linear;
    angular += other.angular;
    return *this;
}

namespace {

void add_state(const Phyxels& phyxels, const Neighbourhoods& neighbourhoods, std::size_t i, StateSums& sums) {
    if (phyxels.rigid.index(phyxels.piece[i]) >= 0) return;
    const Vec3& v = phyxels.velocity[i];
    sums.inverted += !(phyxels.deformation[i].determinant() > 0);
    sums.rank_deficient += neighbourhoods.rank()[i] < 3;
    sums.kinetic_energy += 0.5 * phyxels.mass[i] * v.squaredNorm();
    sums.top_speed = std::max(sums.top_speed, v.squaredNorm());
    sums.linear += phyxels.mass[i] * v;
    sums.angular += phyxels.mass[i] * phyxels.position[i].cross(v);
}

}  // namespace

void StateDescriber::operator()(Phyxels& phyxels, const Neighbourhoods& neighbourhoods,
                                SlicedElasticity& elastic, SolverReport& report, const Parallel& parallel) {
    StateSums sums = sums_(parallel, phyxels.size(), phyxel_grain, [&](std::size_t begin, std::size_t end) {
        StateSums sum;
        for (std::size_t i = begin; i < end; ++i) add_state(phyxels, neighbourhoods, i, sum);
        return sum;
    });
    for (const RigidPiece& body : phyxels.rigid.bodies) {
        const Momenta momenta = momenta_of(body);
        sums.kinetic_energy += body.kinetic_energy();
        sums.top_speed = std::max(sums.top_speed, body.velocity().squaredNorm());
        sums.linear += momenta.linear;
        sums.angular += momenta.angular();
    }
    report.inverted += sums.inverted;
    report.rank_deficient += sums.rank_deficient;
    report.kinetic_energy += sums.kinetic_energy;
    report.elastic_energy = elastic.energy(configuration_of(phyxels), parallel, phyxels.elastic_energy);
    report.top_speed = std::sqrt(sums.top_speed);
    report.momentum = sums.linear;
    report.angular_momentum = sums.angular;
}

}  // namespace splitcubes::meshless
