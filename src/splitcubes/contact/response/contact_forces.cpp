#include <splitcubes/contact/response/contact_forces.h>
#include <splitcubes/contact/response/tuning.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace splitcubes::meshless {

namespace {

Vec3 along_plane(const Vec3& normal, const Vec3& v) {
    return v - normal * normal.dot(v);
}

// Linearises the friction of a slider about its stretch: the limit as a constant force, plus a small
// stiffness.
void slide(const Vec3& tangential_displacement, double limit, double& tangent, Vec3& friction_force) {
    tangent = tuning::contact::sliding_stiffness_share * limit / tangential_displacement.norm();
    friction_force =
        tangent * tangential_displacement - limit / tangential_displacement.norm() * tangential_displacement;
}

// Returns the penetration per step that is tolerated, m.
double slack_of(const Contact& contact) {
    return (contact.lower.is_collider() ? tuning::contact::impact_share_of_colliders
                                        : tuning::contact::impact_share_between_bodies) *
           contact.max_depenetration;
}

// out[side] += sign * weight * force.
void add_to_side(const ContactSide& side, double sign, const Vec3& force, Field out) {
    for (std::uint32_t k = 0; k < side.count; ++k)
        out[side.part][side.phyxel[k]] += (sign * side.weight[k]) * force;
}

}  // namespace

const CachedContact* CachedContactFinder::find(std::uint64_t key) {
    if (is_placed_ && key >= last_key_) {
        while (at_ < all_.size() && all_[at_].key < key) ++at_;
    } else {
        const auto below = [](const CachedContact& m, std::uint64_t wanted) { return m.key < wanted; };
        at_ = static_cast<std::size_t>(std::lower_bound(all_.begin(), all_.end(), key, below) - all_.begin());
    }
    is_placed_ = true;
    last_key_ = key;
    return at_ < all_.size() && all_[at_].key == key ? &all_[at_] : nullptr;
}

void find_impacts(const ContactInput& input, ConstField velocity, double dt, const Parallel& parallel,
                  std::vector<std::uint8_t>& known, std::vector<std::uint8_t>& impact) {
    known.assign(input.contacts.size(), 0);
    impact.assign(input.contacts.size(), 0);
    const auto find = [&](std::size_t begin, std::size_t end) {
        CachedContactFinder finder(input.cached);
        for (std::size_t c = begin; c < end; ++c) {
            const Contact& contact = input.contacts[c];
            known[c] = finder.find(contact.key) != nullptr;
            if (known[c] != 0) continue;
            const Vec3 displacement =
                dt * (side_value(contact.upper, velocity) - side_value(contact.lower, velocity)) -
                contact.surface_displacement - contact.turn_displacement;
            const double closing = -contact.normal.dot(displacement);
            impact[c] = closing > tuning::contact::approach_share * contact.max_depenetration &&
                        contact.gap - closing < 0;
        }
    };
    parallel.for_chunks(input.contacts.size(), tuning::grains::contact_springs, std::cref(find));
}

// Displacement of the upper relative to the lower side in the step at their current velocities.
Vec3 ContactForces::free_displacement(const Contact& contact, std::span<const Part> parts) {
    Vec3 displacement = -contact.surface_displacement - contact.turn_displacement;
    double sign = 1;
    for (const ContactSide* side : {&contact.upper, &contact.lower}) {
        for (std::uint32_t k = 0; k < side->count; ++k)
            displacement +=
                sign * side->weight[k] * parts[side->part].dt * parts[side->part].velocity[side->phyxel[k]];
        sign = -1;
    }
    return displacement;
}

// Returns a row of zero stiffness if neither side can move.
ContactForces::ContactRow ContactForces::make_row(std::uint32_t index, const CachedContact* cached,
                                                  ConstField guess, RowSums& sums) const {
    const Contact& contact = input_.contacts[index];
    Mobility mobility;
    for (const ContactSide* side : {&contact.upper, &contact.lower}) add_mobility(*side, mobility);
    ContactRow row;
    row.contact = index;
    // Sides that holds all but prescribe cannot be parted: the few free phyxels would be thrown.
    if (!(mobility.actual > tuning::contact::least_mobility * mobility.free) ||
        !std::isfinite(mobility.actual)) {
        ++sums.immovable;
        return row;
    }
    row.normal = stiffness(contact, cached, tuning::contact::stiffness_ratio / mobility.actual);
    // An overlap at first contact (faces of a fresh cut, bodies placed into each other) is no compressed
    // spring.
    row.rest_gap = std::min(0.0, contact.gap);
    for (std::uint32_t k = 0; k < contact.upper.count; ++k)
        row.start += contact.upper.weight[k] * parts_[contact.upper.part].start[contact.upper.phyxel[k]];
    for (std::uint32_t k = 0; k < contact.lower.count; ++k)
        row.start -= contact.lower.weight[k] * parts_[contact.lower.part].start[contact.lower.phyxel[k]];
    if (cached) {
        row.tangential_displacement = along_plane(contact.normal, cached->tangential_displacement);
        row.normal_force = cached->normal_force;
        row.last_force = cached->force;
        row.rest_gap = cached->rest_gap;
        if (cached->stiffness > 0) {
            const CachedContact::Rest rest = cached->rest_at(contact);
            row.rest_gap = rest.gap;
            row.drift = rest.drift;
        }
        // Stiffening a loaded spring would create energy. Where that is needed, the spring keeps its force
        // with a shorter stretch.
        if (cached->stiffness > row.normal / tuning::contact::max_stiffness_change &&
            cached->stiffness < row.normal * tuning::contact::max_stiffness_change) {
            row.normal = cached->stiffness;
        } else if (cached->stiffness < row.normal) {
            const double share = cached->stiffness / row.normal;
            row.rest_gap = std::min(row.rest_gap, contact.gap + share * (row.rest_gap - contact.gap));
            row.tangential_displacement *= share;
        }
    }
    const Vec3 displacement = relative(row, guess);
    // Active contacts stay active; others activate if the velocities alone close the gap. A guess that
    // includes gravity would activate the whole underside of a body that stands on a few points.
    const double free_overlap =
        row.rest_gap - contact.gap - contact.normal.dot(free_displacement(contact, parts_));
    row.active = row.normal_force > 0 || free_overlap > 0;
    row.tangent = contact.friction > 0 ? row.normal : 0;
    const Vec3 tangential_displacement =
        row.tangential_displacement + along_plane(contact.normal, displacement);
    const double stretch = row.tangent * tangential_displacement.norm();
    if (row.normal_force > 0) {
        const double limit = contact.friction * row.normal_force;
        if (stretch > tuning::contact::sliding_stretch * limit)
            slide(tangential_displacement, limit, row.tangent, row.friction_force);
    } else if (row.active) {
        const double overlap =
            std::max(free_overlap, row.rest_gap - contact.gap - contact.normal.dot(displacement));
        const double limit = contact.friction * row.normal * overlap;
        if (stretch > limit) row.tangent *= limit / stretch;
    }
    if (row.normal_force > 0) row.depenetration = contact.depenetration(row.drift - row.rest_gap);
    sums.depenetration += row.depenetration;
    if (cached && !contact.lower.is_collider()) {
        const double held = spring_energy(row, contact.gap, row.tangential_displacement);
        sums.energy_left += cached->energy;
        sums.energy_held += held;
        sums.energy_needed +=
            spring_energy(row, contact.gap - row.depenetration, row.tangential_displacement) - held;
    }
    return row;
}

// To lift a body out of a collider takes energy that nothing puts in, so what hardly shows is kept.
double Contact::depenetration(double overlap) const {
    const double kept = lower.is_collider() ? tuning::contact::kept_overlap * max_depenetration : 0;
    return std::clamp(overlap - kept, 0.0, tuning::contact::depenetration_share * max_depenetration);
}

// Returns the energy of a spring at a gap, J.
double ContactForces::spring_energy(const ContactRow& row, double gap, const Vec3& tangential_displacement) {
    const double overlap = std::max(0.0, row.rest_gap - gap);
    return 0.5 * row.normal * (overlap * overlap + tangential_displacement.squaredNorm());
}

// Overlap with a collider is removed freely. Between deformable bodies that removal does work, and in
// experiments accelerated jammed fragments of a stiff plate until they flew off. It is limited to the energy
// that contact springs lost in the previous step to friction, damping and impacts; nothing is removed while
// nothing moves.
void ContactForces::limit_depenetration(const RowSums& sums, const Parallel& parallel) {
    if (sums.depenetration == 0) return;
    const double energy_available = std::max(0.0, sums.energy_left - sums.energy_held);
    // Zero if the energy needed is not finite.
    const double share = sums.energy_needed <= energy_available ? 1
                         : sums.energy_needed > 0               ? energy_available / sums.energy_needed
                                                                : 0;
    const auto undo = [&](std::size_t begin, std::size_t end) {
        for (std::size_t r = begin; r < end; ++r)
            if (rows_[r].depenetration != 0)
                rows_[r].rest_gap += (input_.contacts[rows_[r].contact].lower.is_collider() ? 1 : share) *
                                     rows_[r].depenetration;
    };
    parallel.for_chunks(rows_.size(), tuning::grains::contact_springs, std::cref(undo));
}

// Ignores zero weights.
void ContactForces::touch(std::uint32_t part, std::uint32_t phyxel, double weight) {
    if (weight == 0) return;
    double& load = load_[part][phyxel];
    if (load == 0) touched_[part].push_back(phyxel);
    load += std::abs(weight);
}

void ContactForces::begin(const ContactInput& input, std::span<const Part> parts) {
    for (std::size_t p = 0; p < touched_.size(); ++p) {
        for (const std::uint32_t i : touched_[p]) load_[p][i] = 0;
        touched_[p].clear();
    }
    input_ = input;
    parts_.assign(parts.begin(), parts.end());
    load_.resize(parts.size());
    touched_.resize(parts.size());
    for (std::size_t p = 0; p < parts.size(); ++p) load_[p].resize(parts[p].start.size(), 0);
    for (const Contact& contact : input.contacts)
        for (const ContactSide* side : {&contact.upper, &contact.lower})
            for (std::uint32_t k = 0; k < side->count; ++k)
                touch(side->part, side->phyxel[k], side->weight[k]);
    // The weight is too small to count as a load.
    for (const HandleSpring& given : input.handle_springs)
        touch(given.part, given.phyxel, std::numeric_limits<double>::min());
}

void ContactForces::make_springs(ConstField guess, double weight, const Parallel& parallel) {
    handle_springs_.clear();
    result_.pushing = 0;
    least_total_ = tuning::contact::least_weight_share * weight;
    listed_ = same_rows_ = false;
    rows_.resize(input_.contacts.size());
    const auto make = [&](std::size_t begin, std::size_t end) {
        CachedContactFinder finder(input_.cached);
        RowSums sums;
        for (std::size_t c = begin; c < end; ++c) {
            const Contact& contact = input_.contacts[c];
            rows_[c] = make_row(static_cast<std::uint32_t>(c), finder.find(contact.key), guess, sums);
            sums.max_depenetration = std::min(sums.max_depenetration, contact.max_depenetration);
        }
        return sums;
    };
    const RowSums sums = begin_sum_(parallel, rows_.size(), tuning::grains::contact_springs, make);
    min_depenetration_ = sums.max_depenetration;
    if (sums.immovable > 0) std::erase_if(rows_, [](const ContactRow& row) { return row.normal == 0; });
    limit_depenetration(sums, parallel);
    list_active();
    for (const HandleSpring& given : input_.handle_springs) {
        const Part& part = parts_[given.part];
        if (part.fixed.empty() || part.fixed[given.phyxel] == 0)
            handle_springs_.push_back({given, given.stiffness});
    }
    if (!handle_springs_.empty()) revise_handle_springs(guess);
}

void ContactForces::list_active() {
    active_.clear();
    for (std::uint32_t r = 0; r < rows_.size(); ++r)
        if (rows_[r].active) active_.push_back(r);
}

// Displacement of the upper relative to the lower side since the start of the step, minus that of the
// collider.
Vec3 ContactForces::relative(const ContactRow& row, ConstField position) const {
    const Contact& contact = input_.contacts[row.contact];
    return side_value(contact.upper, position) - side_value(contact.lower, position) - row.start -
           contact.surface_displacement - contact.turn_displacement;
}

Vec3 ContactForces::spring_force(const ContactRow& row, const Vec3& displacement) const {
    const Contact& contact = input_.contacts[row.contact];
    const double gap = contact.gap + contact.normal.dot(displacement);
    return contact.normal * (row.normal * (row.rest_gap + row.offset - gap)) -
           row.tangent * (row.tangential_displacement + along_plane(contact.normal, displacement)) +
           row.friction_force;
}

// Returns the force by the contact and friction laws; `tangent` becomes the secant stiffness of its friction.
Vec3 ContactForces::admissible_force(const ContactRow& row, const Vec3& displacement, double& tangent) const {
    const Contact& contact = input_.contacts[row.contact];
    const double gap = contact.gap + contact.normal.dot(displacement);
    const double normal_force = row.normal * (row.rest_gap + row.offset - gap);
    tangent = 0;
    if (!(normal_force > 0)) return Vec3::Zero();
    const Vec3 tangential_displacement =
        row.tangential_displacement + along_plane(contact.normal, displacement);
    const double length = tangential_displacement.norm();
    const double limit = contact.friction * normal_force;
    tangent = contact.friction > 0 ? row.normal : 0;
    if (tangent * length > limit) tangent = limit / length;
    return contact.normal * normal_force - tangent * tangential_displacement;
}

void ContactForces::add_diagonal(std::uint32_t part, std::span<double> diagonal) const {
    for (const std::uint32_t r : active_) {
        const ContactRow& row = rows_[r];
        const Contact& contact = input_.contacts[row.contact];
        for (const ContactSide* side : {&contact.upper, &contact.lower}) {
            if (side->part != part) continue;
            double sum = 0;
            for (std::uint32_t k = 0; k < side->count; ++k) sum += std::abs(side->weight[k]);
            for (std::uint32_t k = 0; k < side->count; ++k)
                diagonal[side->phyxel[k]] += sum * std::abs(side->weight[k]) * row.normal;
        }
    }
    for (const HandleRow& spring : handle_springs_)
        if (spring.given.part == part) diagonal[spring.given.phyxel] += spring.stiffness;
}

void ContactForces::add_forces(ConstField position, Field force, const Parallel& parallel) {
    force_.resize(active_.size());
    const auto find = [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const ContactRow& row = rows_[active_[k]];
            force_[k] = spring_force(row, relative(row, position));
        }
    };
    parallel.for_chunks(active_.size(), tuning::grains::contact_springs, std::cref(find));
    for (std::size_t k = 0; k < active_.size(); ++k) {
        if (!force_[k].allFinite()) continue;
        const Contact& contact = input_.contacts[rows_[active_[k]].contact];
        add_to_side(contact.upper, 1, force_[k], force);
        add_to_side(contact.lower, -1, force_[k], force);
    }
    for (const HandleRow& s : handle_springs_)
        force[s.given.part][s.given.phyxel] +=
            s.stiffness * (s.given.target - position[s.given.part][s.given.phyxel]);
}

double ContactForces::apply(ConstField in, Field out) const {
    double product = 0;
    for (const std::uint32_t r : active_) {
        const ContactRow& row = rows_[r];
        const Contact& contact = input_.contacts[row.contact];
        const Vec3 displacement = side_value(contact.upper, in) - side_value(contact.lower, in);
        const double along = contact.normal.dot(displacement);
        const Vec3 force = row.tangent * displacement + ((row.normal - row.tangent) * along) * contact.normal;
        product += displacement.dot(force);
        add_to_side(contact.upper, 1, force, out);
        add_to_side(contact.lower, -1, force, out);
    }
    for (const HandleRow& s : handle_springs_) {
        const Vec3& displacement = in[s.given.part][s.given.phyxel];
        out[s.given.part][s.given.phyxel] += s.stiffness * displacement;
        product += s.stiffness * displacement.squaredNorm();
    }
    return product;
}

bool ContactForces::list_springs() {
    if (listed_) return false;
    listed_ = true;
    if (same_rows_) {
        std::size_t k = 0;
        for (const std::uint32_t r : active_) products_.set(k++, rows_[r].normal, rows_[r].tangent);
        for (const HandleRow& s : handle_springs_) products_.set(k++, s.stiffness, s.stiffness);
        return true;
    }
    same_rows_ = true;
    phyxel_count_.clear();
    for (const std::vector<double>& load : load_) phyxel_count_.push_back(load.size());
    products_.clear(phyxel_count_);
    for (const std::uint32_t r : active_)
        products_.add(input_.contacts[rows_[r].contact], rows_[r].normal, rows_[r].tangent);
    for (const HandleRow& s : handle_springs_) products_.add(s.given, s.stiffness);
    products_.finish();
    return true;
}

// Finds the spring state that the contact law demands at the positions of the last solve.
ContactForces::ForceSums ContactForces::revise_row(std::size_t r, ConstField position, bool keep_offset) {
    ContactRow& row = rows_[r];
    Revision& revision = revisions_[r];
    revision = Revision{};
    const Vec3 displacement = relative(row, position);
    const Vec3 force_before = row.active ? spring_force(row, displacement) : Vec3(Vec3::Zero());
    const Contact& contact = input_.contacts[row.contact];
    revision.displacement = displacement;
    if (force_before.allFinite()) revision.force_before = force_before;
    // The offset never exceeds the excess penetration and shrinks if it overshot: pushing a body out further
    // than it came in would add energy.
    const double excess = std::min(0.0, contact.gap) - contact.gap - contact.normal.dot(displacement);
    const double slack = slack_of(contact);
    const bool is_off = excess > slack || (row.offset > 0 && excess < 0);
    revision.offset = row.active && is_off && !keep_offset
                          ? std::max(0.0, row.offset + excess - tuning::contact::remaining_share * slack)
                          : row.offset;
    std::swap(row.offset, revision.offset);
    const Vec3 admissible = admissible_force(row, displacement, revision.tangent);
    const bool slides = contact.friction > 0 && revision.tangent < row.normal;
    std::swap(row.offset, revision.offset);
    revision.active = admissible.squaredNorm() > 0;
    // A newly active contact overlaps by an amount that the solve did not know. Its tangential stiffness is
    // that of friction at this normal force: full stiffness would stop a sliding body at new contacts in
    // every step, and a constant force would act without motion.
    if (row.active && revision.active && revision.tangent > 0 && revision.tangent < row.normal) {
        const Vec3 tangential_displacement =
            row.tangential_displacement + along_plane(contact.normal, displacement);
        slide(tangential_displacement, revision.tangent * tangential_displacement.norm(), revision.tangent,
              revision.friction_force);
    }
    if (!displacement.allFinite()) {
        revision.active = false;
        return {};
    }
    const Vec3 deviation = admissible - force_before;
    return {deviation.norm(), admissible.norm(),
            slides ? along_plane(contact.normal, deviation) : Vec3(Vec3::Zero())};
}

ContactForces::ForceSums ContactForces::revise_rows(ConstField position, bool keep_offsets,
                                                    const Parallel& parallel) {
    constexpr std::size_t grain = tuning::grains::contact_springs;
    ForceSums sums = revise_sum_(parallel, rows_.size(), grain, [&](std::size_t begin, std::size_t end) {
        ForceSums sum;
        for (std::size_t r = begin; r < end; ++r) sum += revise_row(r, position, keep_offsets);
        return sum;
    });
    sums.total = std::max(sums.total, least_total_);
    return sums;
}

bool ContactForces::revise(ConstField position, Field change, const Parallel& parallel) {
    revisions_.resize(rows_.size());
    ForceSums sums = revise_rows(position, true, parallel);
    if (sums.deviation < tuning::contact::settled_share * sums.total)
        sums = revise_rows(position, false, parallel);
    handle_stiffness_before_.clear();
    for (const HandleRow& s : handle_springs_) handle_stiffness_before_.push_back(s.stiffness);
    const bool handle_springs = !handle_springs_.empty() && revise_handle_springs(position);
    if (!(sums.deviation > tuning::contact::force_slack * sums.total) &&
        !(sums.sliding.norm() > tuning::contact::sliding_slack * sums.total) && !handle_springs)
        return false;
    listed_ = false;
    apply_revisions(position, change, parallel);
    return true;
}

void ContactForces::begin_search(ConstField from, ConstField to, const Parallel& parallel) {
    search_.start.resize(rows_.size());
    search_.change.resize(rows_.size());
    const auto find = [&](std::size_t begin, std::size_t end) {
        for (std::size_t r = begin; r < end; ++r) {
            search_.start[r] = relative(rows_[r], from);
            search_.change[r] = relative(rows_[r], to) - search_.start[r];
        }
    };
    parallel.for_chunks(rows_.size(), tuning::grains::contact_springs, std::cref(find));
}

double ContactForces::excess_power(double t, const Parallel& parallel) {
    const auto power_of = [&](std::size_t r) {
        const Vec3 displacement = search_.start[r] + t * search_.change[r];
        double tangent = 0;
        Vec3 excess = admissible_force(rows_[r], displacement, tangent);
        if (rows_[r].active) excess -= spring_force(rows_[r], displacement);
        const double power = excess.dot(search_.change[r]);
        return std::isfinite(power) ? power : 0;
    };
    constexpr std::size_t grain = tuning::grains::contact_springs;
    return search_.sum(parallel, rows_.size(), grain, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t r = begin; r < end; ++r) sum += power_of(r);
        return sum;
    });
}

void ContactForces::apply_revision(std::size_t r) {
    ContactRow& row = rows_[r];
    Revision& revision = revisions_[r];
    revision.is_same = row.active == revision.active;
    row.offset = revision.offset;
    if (!row.active && !revision.active) return;
    row.active = revision.active;
    row.tangent = revision.tangent;
    row.friction_force = revision.friction_force;
    Vec3 force = row.active ? spring_force(row, revision.displacement) : Vec3(Vec3::Zero());
    if (!force.allFinite()) force.setZero();
    revision.force_change = force - revision.force_before;
}

void ContactForces::apply_revisions(ConstField position, Field change, const Parallel& parallel) {
    const auto take = [&](std::size_t begin, std::size_t end) {
        for (std::size_t r = begin; r < end; ++r) apply_revision(r);
    };
    parallel.for_chunks(rows_.size(), tuning::grains::contact_springs, std::cref(take));
    bool same = true;
    for (std::size_t r = 0; r < rows_.size(); ++r) {
        const Vec3& force_change = revisions_[r].force_change;
        same = same && revisions_[r].is_same;
        if (force_change.isZero(0)) continue;
        const Contact& contact = input_.contacts[rows_[r].contact];
        add_to_side(contact.upper, 1, force_change, change);
        add_to_side(contact.lower, -1, force_change, change);
    }
    if (!same) {
        list_active();
        same_rows_ = false;
    }
    for (std::size_t k = 0; k < handle_springs_.size(); ++k) {
        const HandleSpring& given = handle_springs_[k].given;
        change[given.part][given.phyxel] += (handle_springs_[k].stiffness - handle_stiffness_before_[k]) *
                                            (given.target - position[given.part][given.phyxel]);
    }
}

ContactForces::Ended ContactForces::end_row(ContactRow& row, ConstField position) const {
    const Contact& contact = input_.contacts[row.contact];
    const Vec3 displacement = relative(row, position);
    double tangent = 0;
    row.force = admissible_force(row, displacement, tangent);
    if (!row.force.allFinite()) row.force.setZero();
    if (!(row.force.squaredNorm() > 0)) return {};
    // A sliding contact keeps only the stretch that friction supports.
    const Vec3 tangential_displacement =
        row.tangential_displacement + along_plane(contact.normal, displacement);
    const double kept_share = contact.friction > 0 ? tangent / row.normal : 0;
    const double remaining_energy =
        spring_energy(row, contact.gap, row.tangential_displacement) - row.force.dot(displacement);
    return {{contact.key, kept_share * tangential_displacement, contact.normal.dot(row.force), row.force,
             row.normal, row.rest_gap, contact.gap + contact.normal.dot(displacement), row.drift,
             remaining_energy},
            spring_energy(row, contact.gap + contact.normal.dot(displacement),
                          kept_share * tangential_displacement)};
}

void ContactForces::finish(ConstField position, std::span<const std::span<std::uint8_t>> touching,
                           const Parallel& parallel) {
    ended_.resize(active_.size());
    const auto end_rows = [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) ended_[k] = end_row(rows_[active_[k]], position);
    };
    parallel.for_chunks(active_.size(), tuning::grains::contact_springs, std::cref(end_rows));
    next_.clear();
    result_.energy = 0;
    pushes_.assign(input_.contacts.size(), 0);
    for (std::size_t k = 0; k < active_.size(); ++k) {
        if (!(ended_[k].cached.force.squaredNorm() > 0)) continue;
        result_.energy += ended_[k].energy;
        next_.push_back(ended_[k].cached);
        const std::uint32_t index = rows_[active_[k]].contact;
        pushes_[index] = 1;
        const Contact& contact = input_.contacts[index];
        for (const ContactSide* side : {&contact.upper, &contact.lower})
            for (std::uint32_t p = 0; p < side->count; ++p) touching[side->part][side->phyxel[p]] = 1;
    }
    result_.pushing = next_.size();
    if (input_.cached) input_.cached->swap(next_);
    result_.handle_work = work_of_handles(position);
    if (input_.handle_forces) input_.handle_forces->assign(input_.handle_force_limits.size(), Vec3::Zero());
    for (const HandleRow& s : handle_springs_) {
        const Vec3& end = position[s.given.part][s.given.phyxel];
        if (input_.handle_forces)
            (*input_.handle_forces)[s.given.handle] += s.stiffness * (s.given.target - end);
    }
}

void ContactForces::add_changes(std::uint32_t part, std::span<const std::int32_t> piece,
                                std::span<Vec3> change) const {
    for (const ContactRow& row : rows_) {
        if (!row.active && !(row.normal_force > 0)) continue;
        const Contact& contact = input_.contacts[row.contact];
        const Vec3 force_change = row.force - row.last_force;
        const auto add = [&](const ContactSide& side, double sign) {
            if (side.is_collider() || side.part != part) return;
            const std::int32_t k = piece[side.phyxel[0]];
            if (k >= 0 && static_cast<std::size_t>(k) < change.size())
                change[static_cast<std::size_t>(k)] += sign * force_change;
        };
        add(contact.upper, 1);
        add(contact.lower, -1);
    }
}

}  // namespace splitcubes::meshless
