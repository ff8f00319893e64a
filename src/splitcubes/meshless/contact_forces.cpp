#include <splitcubes/meshless/contact_forces.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace splitcubes::meshless {

namespace {

// Stiffness of a contact over that of what it touches.
constexpr double hardness = 2.5;
// A spring keeps its stiffness unless that of what it touches changes by more than this factor.
constexpr double most_stiffness_change = 4;
// Springs a chunk.
constexpr std::size_t spring_grain = 128;
// Share of all contact forces that may be wrong at the end of a step.
constexpr double force_slack = 0.03;
// What goes deeper by more than this share of the lift in a step (a hit) is solved for again, with a harder
// push. Skins that give are measured anew in each step, on other skin where they roll: what they go deeper by
// then is no hit, and to be pushed back from it would make them give in steps, by turns, with energy.
constexpr double deep_share = 0.02, deep_share_of_skins = 1;
// Share of that which it is left at.
constexpr double kept_share = 0.5;
// Shares of the lift: by how much a contact may be found deeper than it was left, and how much of an
// overlap that no spring holds is undone in a step at most.
constexpr double jump_share = 0.05, depenetration_share = 0.25;
// A guess that stretches a slider to so many times what friction bears slides surely.
constexpr double surely_sliding = 2;
// What a slider's friction changes with its length, over the secant. Zero by the law; without any,
// what all slides at once would be thrown to and fro from solve to solve.
constexpr double slide_share = 0.5;
// An approach by less than this share of the lift is resting, not hitting.
constexpr double impact_share = 0.5;

Vec3 along_plane(const Vec3& normal, const Vec3& v) {
    return v - normal * normal.dot(v);
}

// Friction of a slider about a length: the limit, as a given force, and a little of a spring.
void slide(const Vec3& tangential_displacement, double limit, double& tangent, Vec3& friction_force) {
    tangent = slide_share * limit / tangential_displacement.norm();
    friction_force =
        tangent * tangential_displacement - limit / tangential_displacement.norm() * tangential_displacement;
}

// m, what a contact may go deeper by in a step.
double slack_of(const Contact& contact) {
    return (contact.lower.is_collider() ? deep_share : deep_share_of_skins) * contact.max_depenetration;
}

// out[side] += sign * weight * force.
void add_to_side(const ContactSide& side, double sign, const Vec3& force, Field out) {
    for (std::uint32_t k = 0; k < side.count; ++k)
        out[side.part][side.phyxel[k]] += (sign * side.weight[k]) * force;
}

}  // namespace

const CachedContact* CachedContactFinder::find(std::uint64_t key) {
    if (is_placed_ && key >= last_) {
        while (at_ < all_.size() && all_[at_].key < key) ++at_;
    } else {
        const auto below = [](const CachedContact& m, std::uint64_t wanted) { return m.key < wanted; };
        at_ = static_cast<std::size_t>(std::lower_bound(all_.begin(), all_.end(), key, below) - all_.begin());
    }
    is_placed_ = true;
    last_ = key;
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
            const Vec3 way =
                dt * (side_value(contact.upper, velocity) - side_value(contact.lower, velocity)) -
                contact.surface_displacement;
            const double closing = -contact.normal.dot(way);
            impact[c] = closing > impact_share * contact.max_depenetration && contact.gap - closing < 0;
        }
    };
    parallel.for_chunks(input.contacts.size(), spring_grain, std::cref(find));
}

double ContactForces::load_of(const ContactSide& side) const {
    double sum = 0;
    for (std::uint32_t k = 0; k < side.count; ++k) {
        const std::uint32_t i = side.phyxel[k];
        const Part& part = parts_[side.part];
        if (!part.fixed.empty() && part.fixed[i] != 0) continue;
        // Contacts that share a phyxel share its stiffness.
        const double shared = std::max(1.0, load_[side.part][i]);
        sum += side.weight[k] * side.weight[k] * shared * part.mobility[i];
    }
    return sum;
}

// Way of the upper side against the lower one in the step, by their velocities.
Vec3 ContactForces::coasting(const Contact& contact, std::span<const Part> parts) {
    Vec3 way = -contact.surface_displacement;
    double sign = 1;
    for (const ContactSide* side : {&contact.upper, &contact.lower}) {
        for (std::uint32_t k = 0; k < side->count; ++k)
            way += sign * side->weight[k] * parts[side->part].coast *
                   parts[side->part].velocity[side->phyxel[k]];
        sign = -1;
    }
    return way;
}

// A spring of no stiffness where nothing that it holds moves.
ContactForces::Row ContactForces::make_row(std::uint32_t number, const CachedContact* cached,
                                           ConstField guess, OverlapSums& sums) const {
    const Contact& contact = input_.contacts[number];
    const double mobility = load_of(contact.upper) + load_of(contact.lower);
    Row row;
    row.contact = number;
    if (!(mobility > 0) || !std::isfinite(mobility)) {
        ++sums.none;
        return row;
    }
    row.normal = hardness / mobility;
    // What overlaps when it is first seen (faces of a fresh cut, things put into each other) is no compressed
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
        if (!contact.lower.is_collider() && cached->stiffness > 0) {
            // Found deeper than it was left, since other skin is nearest now: no compressed spring either.
            const double left = cached->rest_gap - cached->normal_force / cached->stiffness;
            row.rest_gap += std::min(0.0, contact.gap - left + jump_share * contact.max_depenetration);
        }
        // A spring that grew stiffer under load would make energy. Where it has to, it pushes as it did, and
        // is shorter.
        if (cached->stiffness > row.normal / most_stiffness_change &&
            cached->stiffness < row.normal * most_stiffness_change) {
            row.normal = cached->stiffness;
        } else if (cached->stiffness < row.normal) {
            const double share = cached->stiffness / row.normal;
            row.rest_gap = std::min(row.rest_gap, contact.gap + share * (row.rest_gap - contact.gap));
            row.tangential_displacement *= share;
        }
    }
    const Vec3 way = relative(row, guess);
    // What pushed goes on pushing, and what comes nearer by its own velocity begins to; a guess with gravity
    // in it would press the whole underside of a thing that stands on a few points.
    const double met = row.rest_gap - contact.gap - contact.normal.dot(coasting(contact, parts_));
    row.active = row.normal_force > 0 || met > 0;
    row.tangent = contact.friction > 0 ? row.normal : 0;
    const Vec3 tangential_displacement = row.tangential_displacement + along_plane(contact.normal, way);
    const double stretch = row.tangent * tangential_displacement.norm();
    if (row.normal_force > 0) {
        const double limit = contact.friction * row.normal_force;
        if (stretch > surely_sliding * limit)
            slide(tangential_displacement, limit, row.tangent, row.friction_force);
    } else if (row.active) {
        const double deep = std::max(met, row.rest_gap - contact.gap - contact.normal.dot(way));
        const double limit = contact.friction * row.normal * deep;
        if (stretch > limit) row.tangent *= limit / stretch;
    }
    if (row.normal_force > 0)
        row.depenetration = std::min(depenetration_share * contact.max_depenetration, -row.rest_gap);
    sums.depenetration += row.depenetration;
    if (cached && !contact.lower.is_collider()) {
        const double held = held_by(row, contact.gap, row.tangential_displacement);
        sums.left += cached->energy;
        sums.held += held;
        sums.wanted += held_by(row, contact.gap - row.depenetration, row.tangential_displacement) - held;
    }
    return row;
}

// J, of a spring at a gap.
double ContactForces::held_by(const Row& row, double gap, const Vec3& tangential_displacement) {
    const double overlap = std::max(0.0, row.rest_gap - gap);
    return 0.5 * row.normal * (overlap * overlap + tangential_displacement.squaredNorm());
}

// A collider undoes an overlap at its own cost. Between skins that bear something it is work, and jammed
// splinters of a stiff plate were pressed by it until they flew. It is paid for by what the springs lost in
// the last step, to friction, to damping and to pushing hits back: where nothing moves nothing is undone.
void ContactForces::limit_depenetration(const OverlapSums& sums, const Parallel& parallel) {
    if (sums.depenetration == 0) return;
    const double room = std::max(0.0, sums.left - sums.held);
    // Nothing where it is not known what it takes.
    const double share = sums.wanted <= room ? 1 : sums.wanted > 0 ? room / sums.wanted : 0;
    const auto undo = [&](std::size_t begin, std::size_t end) {
        for (std::size_t r = begin; r < end; ++r)
            if (rows_[r].depenetration != 0)
                rows_[r].rest_gap += (input_.contacts[rows_[r].contact].lower.is_collider() ? 1 : share) *
                                     rows_[r].depenetration;
    };
    parallel.for_chunks(rows_.size(), spring_grain, std::cref(undo));
}

// A weight of zero holds nothing.
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
    // Too little to count as a load.
    for (const HandleSpring& pull : input.handle_springs)
        touch(pull.part, pull.phyxel, std::numeric_limits<double>::min());
}

void ContactForces::make_springs(ConstField guess, const Parallel& parallel) {
    handle_springs_.clear();
    pushing_ = 0;
    listed_ = same_rows_ = false;
    rows_.resize(input_.contacts.size());
    const auto make = [&](std::size_t begin, std::size_t end) {
        CachedContactFinder finder(input_.cached);
        OverlapSums sums;
        for (std::size_t c = begin; c < end; ++c) {
            const Contact& contact = input_.contacts[c];
            rows_[c] = make_row(static_cast<std::uint32_t>(c), finder.find(contact.key), guess, sums);
            sums.max_depenetration = std::min(sums.max_depenetration, contact.max_depenetration);
        }
        return sums;
    };
    const OverlapSums sums = begin_sum_(parallel, rows_.size(), spring_grain, make);
    min_depenetration_ = sums.max_depenetration;
    if (sums.none > 0) std::erase_if(rows_, [](const Row& row) { return row.normal == 0; });
    limit_depenetration(sums, parallel);
    list_active();
    for (const HandleSpring& pull : input_.handle_springs) {
        const Part& part = parts_[pull.part];
        if (part.fixed.empty() || part.fixed[pull.phyxel] == 0)
            handle_springs_.push_back({pull, pull.stiffness});
    }
    if (!handle_springs_.empty()) revise_handle_springs(guess);
}

void ContactForces::list_active() {
    active_.clear();
    for (std::uint32_t r = 0; r < rows_.size(); ++r)
        if (rows_[r].active) active_.push_back(r);
}

// Way of the upper side against the lower one since the step began.
Vec3 ContactForces::relative(const Row& row, ConstField position) const {
    const Contact& contact = input_.contacts[row.contact];
    return side_value(contact.upper, position) - side_value(contact.lower, position) - row.start -
           contact.surface_displacement;
}

Vec3 ContactForces::spring_force(const Row& row, const Vec3& way) const {
    const Contact& contact = input_.contacts[row.contact];
    const double gap = contact.gap + contact.normal.dot(way);
    return contact.normal * (row.normal * (row.rest_gap + row.push - gap)) -
           row.tangent * (row.tangential_displacement + along_plane(contact.normal, way)) +
           row.friction_force;
}

// By the law of contact; `tangent` is the stiffness that gives its friction.
Vec3 ContactForces::admissible_force(const Row& row, const Vec3& way, double& tangent) const {
    const Contact& contact = input_.contacts[row.contact];
    const double gap = contact.gap + contact.normal.dot(way);
    const double normal_force = row.normal * (row.rest_gap + row.push - gap);
    tangent = 0;
    if (!(normal_force > 0)) return Vec3::Zero();
    const Vec3 tangential_displacement = row.tangential_displacement + along_plane(contact.normal, way);
    const double length = tangential_displacement.norm();
    const double limit = contact.friction * normal_force;
    tangent = contact.friction > 0 ? row.normal : 0;
    if (tangent * length > limit) tangent = limit / length;
    return contact.normal * normal_force - tangent * tangential_displacement;
}

void ContactForces::add_diagonal(std::uint32_t part, std::span<double> diagonal) const {
    for (const std::uint32_t r : active_) {
        const Row& row = rows_[r];
        const Contact& contact = input_.contacts[row.contact];
        for (const ContactSide* side : {&contact.upper, &contact.lower}) {
            if (side->part != part) continue;
            double sum = 0;
            for (std::uint32_t k = 0; k < side->count; ++k) sum += std::abs(side->weight[k]);
            for (std::uint32_t k = 0; k < side->count; ++k)
                diagonal[side->phyxel[k]] += sum * std::abs(side->weight[k]) * row.normal;
        }
    }
    for (const Spring& spring : handle_springs_)
        if (spring.pull.part == part) diagonal[spring.pull.phyxel] += spring.stiffness;
}

void ContactForces::add_forces(ConstField position, Field force, const Parallel& parallel) {
    force_.resize(active_.size());
    const auto find = [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const Row& row = rows_[active_[k]];
            force_[k] = spring_force(row, relative(row, position));
        }
    };
    parallel.for_chunks(active_.size(), spring_grain, std::cref(find));
    for (std::size_t k = 0; k < active_.size(); ++k) {
        if (!force_[k].allFinite()) continue;
        const Contact& contact = input_.contacts[rows_[active_[k]].contact];
        add_to_side(contact.upper, 1, force_[k], force);
        add_to_side(contact.lower, -1, force_[k], force);
    }
    for (const Spring& s : handle_springs_)
        force[s.pull.part][s.pull.phyxel] +=
            s.stiffness * (s.pull.target - position[s.pull.part][s.pull.phyxel]);
}

double ContactForces::apply(ConstField in, Field out) const {
    double product = 0;
    for (const std::uint32_t r : active_) {
        const Row& row = rows_[r];
        const Contact& contact = input_.contacts[row.contact];
        const Vec3 way = side_value(contact.upper, in) - side_value(contact.lower, in);
        const double along = contact.normal.dot(way);
        const Vec3 force = row.tangent * way + ((row.normal - row.tangent) * along) * contact.normal;
        product += way.dot(force);
        add_to_side(contact.upper, 1, force, out);
        add_to_side(contact.lower, -1, force, out);
    }
    for (const Spring& s : handle_springs_) {
        const Vec3& way = in[s.pull.part][s.pull.phyxel];
        out[s.pull.part][s.pull.phyxel] += s.stiffness * way;
        product += s.stiffness * way.squaredNorm();
    }
    return product;
}

bool ContactForces::list_springs() {
    if (listed_) return false;
    listed_ = true;
    if (same_rows_) {
        std::size_t k = 0;
        for (const std::uint32_t r : active_) products_.set(k++, rows_[r].normal, rows_[r].tangent);
        for (const Spring& s : handle_springs_) products_.set(k++, s.stiffness, s.stiffness);
        return true;
    }
    same_rows_ = true;
    phyxel_count_.clear();
    for (const std::vector<double>& load : load_) phyxel_count_.push_back(load.size());
    products_.clear(phyxel_count_);
    for (const std::uint32_t r : active_)
        products_.add(input_.contacts[rows_[r].contact], rows_[r].normal, rows_[r].tangent);
    for (const Spring& s : handle_springs_) products_.add(s.pull, s.stiffness);
    products_.finish();
    return true;
}

// Scales the springs of each handle so that they pull by no more than its limit.
bool ContactForces::revise_handle_springs(ConstField position) {
    handle_forces_.assign(input_.handle_force_limits.size(), Vec3::Zero());
    const auto stretch = [&](const Spring& s) {
        return Vec3(s.pull.target - position[s.pull.part][s.pull.phyxel]);
    };
    for (const Spring& s : handle_springs_) handle_forces_[s.pull.handle] += s.pull.stiffness * stretch(s);
    bool changed = false;
    for (Spring& s : handle_springs_) {
        const double limit = input_.handle_force_limits[s.pull.handle];
        const double force = handle_forces_[s.pull.handle].norm();
        const double wanted = s.pull.stiffness * (force > limit ? limit / force : 1);
        changed = changed || std::abs(wanted - s.stiffness) > force_slack * wanted;
        s.stiffness = wanted;
    }
    return changed;
}

// What a spring is to be after a solve that led to these places.
ContactForces::ForceSums ContactForces::revise_row(std::size_t r, ConstField position, bool only_add) {
    Row& row = rows_[r];
    Revision& now = revisions_[r];
    now = Revision{};
    const Vec3 way = relative(row, position);
    const Vec3 used = row.active ? spring_force(row, way) : Vec3(Vec3::Zero());
    const Contact& contact = input_.contacts[row.contact];
    now.way = way;
    if (used.allFinite()) now.used = used;
    // Never more than that, and less where that was too much: pushed out of where it was, it would be
    // given energy.
    const double deeper = std::min(0.0, contact.gap) - contact.gap - contact.normal.dot(way);
    const double slack = slack_of(contact);
    const bool off = deeper > slack || (row.push > 0 && deeper < 0);
    now.push = row.active && off ? std::max(0.0, row.push + deeper - kept_share * slack) : row.push;
    std::swap(row.push, now.push);
    const Vec3 right = admissible_force(row, way, now.tangent);
    std::swap(row.push, now.push);
    now.active = right.squaredNorm() > 0 || (row.active && only_add);
    if (row.active && only_add && !(right.squaredNorm() > 0)) now.tangent = 0;
    // One that begins to push overlaps by what the solve did not know of. The spring that friction at such a
    // pressure stretches neither holds what slides, as a full one would in each step again, nor pushes
    // by itself, as a given force would.
    if (row.active && now.active && now.tangent > 0 && now.tangent < row.normal) {
        const Vec3 tangential_displacement = row.tangential_displacement + along_plane(contact.normal, way);
        slide(tangential_displacement, now.tangent * tangential_displacement.norm(), now.tangent,
              now.friction_force);
    }
    if (!way.allFinite()) {
        now.active = false;
        return {};
    }
    return {(right - used).norm(), right.norm()};
}

bool ContactForces::revise(ConstField position, bool only_add, Field change, const Parallel& parallel) {
    revisions_.resize(rows_.size());
    const ForceSums sums =
        revise_sum_(parallel, rows_.size(), spring_grain, [&](std::size_t begin, std::size_t end) {
            ForceSums sum;
            for (std::size_t r = begin; r < end; ++r) sum += revise_row(r, position, only_add);
            return sum;
        });
    handle_stiffness_before_.clear();
    for (const Spring& s : handle_springs_) handle_stiffness_before_.push_back(s.stiffness);
    const bool handle_springs = !handle_springs_.empty() && revise_handle_springs(position);
    if (!(sums.wrong > force_slack * sums.all) && !handle_springs) return false;
    listed_ = false;
    take_revisions(position, change, parallel);
    return true;
}

void ContactForces::take_revision(std::size_t r) {
    Row& row = rows_[r];
    Revision& now = revisions_[r];
    now.is_same = row.active == now.active;
    row.push = now.push;
    if (!row.active && !now.active) return;
    row.active = now.active;
    row.tangent = now.tangent;
    row.friction_force = now.friction_force;
    Vec3 force = row.active ? spring_force(row, now.way) : Vec3(Vec3::Zero());
    if (!force.allFinite()) force.setZero();
    now.more = force - now.used;
}

void ContactForces::take_revisions(ConstField position, Field change, const Parallel& parallel) {
    const auto take = [&](std::size_t begin, std::size_t end) {
        for (std::size_t r = begin; r < end; ++r) take_revision(r);
    };
    parallel.for_chunks(rows_.size(), spring_grain, std::cref(take));
    bool same = true;
    for (std::size_t r = 0; r < rows_.size(); ++r) {
        const Vec3& more = revisions_[r].more;
        same = same && revisions_[r].is_same;
        if (more.isZero(0)) continue;
        const Contact& contact = input_.contacts[rows_[r].contact];
        add_to_side(contact.upper, 1, more, change);
        add_to_side(contact.lower, -1, more, change);
    }
    if (!same) {
        list_active();
        same_rows_ = false;
    }
    for (std::size_t k = 0; k < handle_springs_.size(); ++k) {
        const HandleSpring& pull = handle_springs_[k].pull;
        change[pull.part][pull.phyxel] += (handle_springs_[k].stiffness - handle_stiffness_before_[k]) *
                                          (pull.target - position[pull.part][pull.phyxel]);
    }
}

ContactForces::Ended ContactForces::end_row(Row& row, ConstField position) const {
    const Contact& contact = input_.contacts[row.contact];
    const Vec3 way = relative(row, position);
    double tangent = 0;
    row.force = admissible_force(row, way, tangent);
    if (!row.force.allFinite()) row.force.setZero();
    if (!(row.force.squaredNorm() > 0)) return {};
    // What slid stays behind: the spring keeps the length that friction bears.
    const Vec3 tangential_displacement = row.tangential_displacement + along_plane(contact.normal, way);
    const double kept = contact.friction > 0 ? tangent / row.normal : 0;
    const double left = held_by(row, contact.gap, row.tangential_displacement) - row.force.dot(way);
    return {{contact.key, kept * tangential_displacement, contact.normal.dot(row.force), row.force,
             row.normal, row.rest_gap, left},
            held_by(row, contact.gap + contact.normal.dot(way), kept * tangential_displacement)};
}

void ContactForces::finish(ConstField position, std::span<const std::span<std::uint8_t>> touching,
                           const Parallel& parallel) {
    ended_.resize(active_.size());
    const auto end_rows = [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) ended_[k] = end_row(rows_[active_[k]], position);
    };
    parallel.for_chunks(active_.size(), spring_grain, std::cref(end_rows));
    next_.clear();
    energy_ = 0;
    pushes_.assign(input_.contacts.size(), 0);
    for (std::size_t k = 0; k < active_.size(); ++k) {
        if (!(ended_[k].cached.force.squaredNorm() > 0)) continue;
        energy_ += ended_[k].energy;
        next_.push_back(ended_[k].cached);
        const std::uint32_t number = rows_[active_[k]].contact;
        pushes_[number] = 1;
        const Contact& contact = input_.contacts[number];
        for (const ContactSide* side : {&contact.upper, &contact.lower})
            for (std::uint32_t p = 0; p < side->count; ++p) touching[side->part][side->phyxel[p]] = 1;
    }
    pushing_ = next_.size();
    if (input_.cached) input_.cached->swap(next_);
    if (!input_.handle_forces) return;
    input_.handle_forces->assign(input_.handle_force_limits.size(), Vec3::Zero());
    for (const Spring& s : handle_springs_)
        (*input_.handle_forces)[s.pull.handle] +=
            s.stiffness * (s.pull.target - position[s.pull.part][s.pull.phyxel]);
}

void ContactForces::add_changes(std::uint32_t part, std::span<const std::int32_t> piece,
                                std::span<Vec3> change) const {
    for (const Row& row : rows_) {
        if (!row.active && !(row.normal_force > 0)) continue;
        const Contact& contact = input_.contacts[row.contact];
        const Vec3 more = row.force - row.last_force;
        const auto add = [&](const ContactSide& side, double sign) {
            if (side.is_collider() || side.part != part) return;
            const std::int32_t k = piece[side.phyxel[0]];
            if (k >= 0 && static_cast<std::size_t>(k) < change.size())
                change[static_cast<std::size_t>(k)] += sign * more;
        };
        add(contact.upper, 1);
        add(contact.lower, -1);
    }
}

}  // namespace splitcubes::meshless
