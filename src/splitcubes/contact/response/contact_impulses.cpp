#include <splitcubes/contact/response/contact_impulses.h>
#include <splitcubes/contact/response/tuning.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::meshless {

void ContactImpulses::begin(const ContactInput& input, std::span<const Part> parts, double dt) {
    input_ = input;
    dt_ = last_duration_ = dt;
    parts_.assign(parts.begin(), parts.end());
    rows_.clear();
    incidences_.clear();
    add_loads();
    CachedContactFinder finder(input.cached);
    double needed = 0, available = 0;
    for (std::uint32_t c = 0; c < input.contacts.size(); ++c) {
        const Contact& contact = input.contacts[c];
        ImpulseRow row = make_row(c);
        if (!(row.mass > 0) || !std::isfinite(row.mass) || !std::isfinite(contact.gap)) continue;
        make_spring(row);
        if (const CachedContact* const cached = finder.find(contact.key)) {
            continue_row(row, *cached);
            if (!contact.lower.is_collider()) {
                // Lifting loads the spring further.
                needed +=
                    contact.normal.dot(cached->force) * row.lift + 0.5 * row.stiffness * row.lift * row.lift;
                // Less what the spring took, which it may still give back.
                const double overlap = std::max(0.0, row.rest_gap - contact.gap);
                available += cached->energy - 0.5 * row.stiffness * overlap * overlap;
            }
        }
        rows_.push_back(row);
    }
    limit_lift(needed, available);
    if (input_.handle_forces) input_.handle_forces->assign(input_.handle_force_limits.size(), Vec3::Zero());
}

// Contacts that share a phyxel share its mass and its stiffness.
void ContactImpulses::add_loads() {
    load_.resize(parts_.size());
    touched_.resize(parts_.size());
    for (std::size_t p = 0; p < parts_.size(); ++p) {
        load_[p].assign(parts_[p].start.size(), 0);
        touched_[p].clear();
    }
    for (const Contact& contact : input_.contacts)
        for (const ContactSide* side : {&contact.upper, &contact.lower})
            for (std::uint32_t k = 0; k < side->count; ++k) {
                double& load = load_[side->part][side->phyxel[k]];
                if (load == 0 && side->weight[k] != 0) touched_[side->part].push_back(side->phyxel[k]);
                load += std::abs(side->weight[k]);
            }
}

// Returns a row without mass if neither side can move.
ContactImpulses::ImpulseRow ContactImpulses::make_row(std::uint32_t index) {
    const Contact& contact = input_.contacts[index];
    ImpulseRow row;
    row.contact = index;
    row.normal = contact.normal;
    row.friction = contact.friction;
    row.surface_velocity = (contact.surface_displacement + contact.turn_displacement) / dt_;
    row.rest_gap = std::min(contact.gap, 0.0);
    row.first = static_cast<std::uint32_t>(incidences_.size());
    double sign = 1;
    for (const ContactSide* side : {&contact.upper, &contact.lower}) {
        for (std::uint32_t k = 0; k < side->count; ++k)
            add_incidence(row.first, side->part, side->phyxel[k], sign * side->weight[k]);
        sign = -1;
    }
    row.end = static_cast<std::uint32_t>(incidences_.size());
    double mobility = 0, free_mobility = 0;  // of the row; if its sides were free and apart
    for (std::uint32_t e = row.first; e < row.end; ++e) {
        Incidence& at = incidences_[e];
        const Part& part = parts_[at.part];
        row.start += at.weight * part.start[at.phyxel];
        at.mobility = part.fixed[at.phyxel] == 0 ? at.weight / part.effective_mass[at.phyxel] : 0;
        mobility += at.weight * at.mobility;
    }
    for (const ContactSide* side : {&contact.upper, &contact.lower})
        for (std::uint32_t k = 0; k < side->count; ++k)
            free_mobility +=
                side->weight[k] * side->weight[k] / parts_[side->part].effective_mass[side->phyxel[k]];
    // Sides that holds or shared phyxels all but prescribe cannot be parted: the rest would be thrown.
    const bool can_move = mobility > tuning::contact::least_mobility * free_mobility;
    row.mass = can_move ? 1 / mobility : 0;
    return row;
}

// Adds a phyxel to the row that begins at `first`; both sides may have it.
void ContactImpulses::add_incidence(std::uint32_t first, std::uint32_t part, std::uint32_t phyxel,
                                    double weight) {
    for (std::uint32_t e = first; e < incidences_.size(); ++e)
        if (incidences_[e].part == part && incidences_[e].phyxel == phyxel) {
            incidences_[e].weight += weight;
            return;
        }
    incidences_.push_back({part, phyxel, weight, 0});
}

// Sets stiffness and damping by those of the phyxels.
void ContactImpulses::make_spring(ImpulseRow& row) const {
    double compliance = 0, mobility = 0;
    for (std::uint32_t e = row.first; e < row.end; ++e) {
        const Incidence& at = incidences_[e];
        const Part& part = parts_[at.part];
        if (part.fixed[at.phyxel] != 0) continue;
        const double square = at.weight * at.weight * std::max(1.0, load_[at.part][at.phyxel]);
        compliance += square / part.stiffness[at.phyxel];
        mobility += square / part.effective_mass[at.phyxel];
    }
    row.stiffness = tuning::impulses::stiffness_ratio / compliance;
    // A phyxel without links has no stiffness.
    if (!(compliance > 0) || !std::isfinite(row.stiffness)) row.stiffness = 0;
    row.damping =
        mobility > 0 ? 2 * tuning::impulses::damping_ratio * std::sqrt(row.stiffness / mobility) : 0;
}

// Continues a contact of the last step.
void ContactImpulses::continue_row(ImpulseRow& row, const CachedContact& cached) const {
    const Contact& contact = input_.contacts[row.contact];
    const CachedContact::Rest rest = cached.rest_at(contact);
    row.rest_gap = rest.gap;
    row.drift = rest.drift;
    // Stiffening a loaded spring would create energy.
    if (cached.stiffness > 0) row.stiffness = std::min(row.stiffness, cached.stiffness);
    row.lift = contact.depenetration(row.drift - row.rest_gap);
    // The impulses of the last step are the first guess.
    const double force = std::max(0.0, contact.normal.dot(cached.force));
    row.push = dt_ * force;
    row.drag = dt_ * (cached.force - contact.normal.dot(cached.force) * contact.normal);
}

// Between bodies, undoing overlaps does work: at most as much as the contacts took in the last step.
void ContactImpulses::limit_lift(double needed, double available) {
    const double share = needed <= available ? 1 : needed > 0 ? std::max(0.0, available) / needed : 0;
    for (ImpulseRow& row : rows_)
        if (!input_.contacts[row.contact].lower.is_collider()) row.lift *= share;
}

Vec3 ContactImpulses::relative_velocity(const ImpulseRow& row, ConstField velocity) const {
    Vec3 sum = -row.surface_velocity;
    for (std::uint32_t e = row.first; e < row.end; ++e)
        sum += incidences_[e].weight * velocity[incidences_[e].part][incidences_[e].phyxel];
    return sum;
}

void ContactImpulses::apply(const ImpulseRow& row, const Vec3& impulse, Field velocity) const {
    for (std::uint32_t e = row.first; e < row.end; ++e)
        velocity[incidences_[e].part][incidences_[e].phyxel] += incidences_[e].mobility * impulse;
}

// Returns the gap now, m. done: share of the step that is over.
double ContactImpulses::gap_of(const ImpulseRow& row, ConstField position, double done) const {
    Vec3 relative = -row.start - done * dt_ * row.surface_velocity;
    for (std::uint32_t e = row.first; e < row.end; ++e)
        relative += incidences_[e].weight * position[incidences_[e].part][incidences_[e].phyxel];
    return input_.contacts[row.contact].gap + row.normal.dot(relative);
}

// Gives a contact the impulse that it needs at the current velocities. Returns the change, N s.
double ContactImpulses::improve(ImpulseRow& row, Field velocity) const {
    const Vec3 before = row.push * row.normal + row.drag;
    const Vec3 relative = relative_velocity(row, velocity_);
    const double along = row.normal.dot(relative), share = row.resistance / row.mass;
    const double yielding =
        (row.spring - row.resistance * (along + row.closing_speed) + share * row.push) / (1 + share);
    const double rigid = row.push - row.mass * (along + row.limit_speed);
    row.push = std::max({0.0, yielding, rigid});
    // A point moves alike in all directions, so the normal impulse leaves the sliding as it is.
    const Vec3 wanted = row.drag - row.mass * (relative - along * row.normal);
    const double limit = row.friction * row.push, size = wanted.norm();
    row.drag = size > limit ? Vec3(limit / size * wanted) : wanted;
    const Vec3 change = row.push * row.normal + row.drag - before;
    if (change.isZero(0)) return 0;
    if (!change.allFinite()) {
        row.push = 0;
        row.drag.setZero();
        return 0;
    }
    apply(row, change, velocity);
    return change.norm();
}

// Finds the impulses, started from the given share of those that the rows have.
void ContactImpulses::solve(Field velocity, double warm_share) {
    velocity_.assign(velocity.begin(), velocity.end());
    for (ImpulseRow& row : rows_) row.velocity_before = relative_velocity(row, velocity_);
    for (ImpulseRow& row : rows_) {
        row.push *= warm_share;
        row.drag *= warm_share;
        if (row.push > 0) apply(row, row.push * row.normal + row.drag, velocity);
    }
    for (int k = 0; k < tuning::impulses::max_iterations; ++k) {
        double change = 0, total = 0;
        for (ImpulseRow& row : rows_) {
            change += improve(row, velocity);
            total += row.push;
        }
        if (!(change > tuning::impulses::converged_share * total)) return;
    }
}

void ContactImpulses::push(ConstField position, Field velocity, double h, double duration, double done) {
    if (rows_.empty()) return;
    for (ImpulseRow& row : rows_) {
        const double gap = gap_of(row, position, done);
        const double limit = tuning::impulses::max_overlap * input_.contacts[row.contact].max_depenetration;
        // Lifting compresses the spring, at most up to the limit: beyond, it would take any force.
        const double lifted = row.rest_gap + std::min(1.0, done + h / dt_) * row.lift;
        const double rest = std::clamp(gap + limit, row.rest_gap, std::max(lifted, row.rest_gap));
        row.lifted_gap = rest;
        row.spring = duration * row.stiffness * std::max(0.0, rest - gap);
        row.resistance = duration * (row.damping + h * row.stiffness);
        row.closing_speed = std::max(0.0, gap - rest) / h;
        row.limit_speed = (gap - rest + limit) / h;
    }
    solve(velocity, duration / last_duration_);
    last_duration_ = duration;
    add_up();
}

// Counts what the impulses of the rows did.
void ContactImpulses::add_up() {
    for (ImpulseRow& row : rows_) {
        if (!(row.push > 0)) continue;
        const Vec3 impulse = row.push * row.normal + row.drag;
        row.taken -= 0.5 * impulse.dot(row.velocity_before + relative_velocity(row, velocity_));
        row.impulse += impulse;
        row.touched = true;
    }
}

void ContactImpulses::stop(ConstField position, Field velocity, double duration) {
    std::erase_if(rows_, [](const ImpulseRow& row) { return !row.touched; });
    if (rows_.empty()) return;
    constexpr double never = std::numeric_limits<double>::max();
    for (ImpulseRow& row : rows_) {
        row.gap = gap_of(row, position, 1);
        row.rest_gap = row.lifted_gap;
        const double limit = tuning::impulses::max_overlap * input_.contacts[row.contact].max_depenetration;
        row.spring = duration * row.stiffness * row.overlap();
        row.resistance = row.overlap() > 0 ? duration * row.damping : 0;
        row.closing_speed = 0;
        // A contact at its limit stops; others yield.
        row.limit_speed =
            row.push > 0 && row.overlap() >= (1 - tuning::impulses::limit_slack) * limit ? 0 : never;
    }
    solve(velocity, duration / last_duration_);
    add_up();
}

void ContactImpulses::finish(std::span<const std::span<std::uint8_t>> touching) {
    next_.clear();
    for (const ImpulseRow& row : rows_) {
        if (!row.touched) continue;
        const Contact& contact = input_.contacts[row.contact];
        const Vec3 force = row.impulse / dt_;
        CachedContact cached;
        cached.key = contact.key;
        cached.normal_force = row.stiffness * row.overlap();
        cached.stiffness = row.stiffness;
        cached.force = force;
        cached.rest_gap = row.rest_gap;
        cached.gap = row.gap;
        cached.drift = row.drift;
        cached.energy = row.taken;
        next_.push_back(cached);
        for (const ContactSide* side : {&contact.upper, &contact.lower})
            for (std::uint32_t k = 0; k < side->count; ++k) touching[side->part][side->phyxel[k]] = 1;
    }
    if (input_.cached) input_.cached->swap(next_);
}

double ContactImpulses::energy() const {
    double sum = 0;
    for (const ImpulseRow& row : rows_) sum += 0.5 * row.stiffness * row.overlap() * row.overlap();
    return sum;
}

void ContactImpulses::add_handle_springs(ConstField position, Field force) {
    std::vector<Vec3> total(input_.handle_force_limits.size(), Vec3::Zero());
    const auto force_of = [&](const HandleSpring& p) {
        return Vec3(p.stiffness * (p.target - position[p.part][p.phyxel]));
    };
    for (const HandleSpring& p : input_.handle_springs) total[p.handle] += force_of(p);
    spring_force_.clear();
    for (const HandleSpring& p : input_.handle_springs) {
        const double share = share_within_limit(total[p.handle], input_.handle_force_limits[p.handle]);
        spring_force_.push_back(share * force_of(p));
        force[p.part][p.phyxel] += spring_force_.back();
    }
    if (!input_.handle_forces) return;
    for (std::size_t h = 0; h < total.size(); ++h)
        (*input_.handle_forces)[h] = share_within_limit(total[h], input_.handle_force_limits[h]) * total[h];
}

double ContactImpulses::handle_power(Field velocity) const {
    double sum = 0;
    for (std::size_t k = 0; k < spring_force_.size(); ++k) {
        const HandleSpring& p = input_.handle_springs[k];
        if (parts_[p.part].fixed[p.phyxel] == 0) sum += spring_force_[k].dot(velocity[p.part][p.phyxel]);
    }
    return sum;
}

}  // namespace splitcubes::meshless
