#include <splitcubes/contact/detection/contact_finder.h>
#include <splitcubes/contact/detection/rigid_motion.h>
#include <splitcubes/contact/detection/touching_pairs.h>
#include <splitcubes/core/disjoint_sets.h>
#include <splitcubes/splitting/pieces.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace splitcubes::body {

namespace {

using meshless::CachedContact;
using meshless::Contact;
using meshless::ContactSide;

// Returns the point of a side, m, world; zero for a collider.
Vec3 point_of_side(const HitTask& task, const ContactIsland& island, const ContactSide& side) {
    Vec3 sum = Vec3::Zero();
    if (side.is_collider()) return sum;
    const meshless::Phyxels& phyxels = task.bodies[island.bodies[side.part]].phyxels;
    for (std::uint32_t k = 0; k < side.count; ++k) sum += side.weight[k] * phyxels.position[side.phyxel[k]];
    return sum;
}

// Returns the energy of a contact spring at a gap, J. Its force may be more than that of the overlap: what
// pushes a hit back is not stored.
double spring_energy(const CachedContact& cached, double gap) {
    const double overlap = std::max(0.0, cached.rest_gap - gap);
    return 0.5 * cached.stiffness * (overlap * overlap + cached.tangential_displacement.squaredNorm());
}

std::pair<std::uint32_t, std::uint32_t> body_and_piece(const HitTask& task, const ContactIsland& island,
                                                       const ContactSide& side) {
    const std::size_t body = island.bodies[side.part];
    return {static_cast<std::uint32_t>(body),
            static_cast<std::uint32_t>(task.bodies[body].phyxels.piece[side.phyxel[0]])};
}

std::uint32_t collider_of(const Contact& contact) {
    return static_cast<std::uint32_t>(contact.key >> 32 & 0xffff) - 1;
}

void merge(PairInStep& sum, const PairInStep& other) {
    sum.impulse += other.impulse;
    sum.normal += other.normal;
    sum.point += other.point;
    sum.surface += other.surface;
    sum.gap = std::min(sum.gap, other.gap);
    sum.friction = std::max(sum.friction, other.friction);
    sum.spring += other.spring;
    sum.work += other.work;
    sum.pushes = sum.pushes || other.pushes;
}

}  // namespace

std::size_t TouchingPairs::slot(const HitPair& pair, std::size_t side) const {
    const std::uint32_t body = side == 0 ? pair.body : pair.other_body;
    const std::uint32_t piece = side == 0 ? pair.piece : pair.other;
    if (body >= first_.size() - 1) return no_slot;
    const std::size_t index = first_[body] + piece;
    return index < first_[body + 1] ? index : no_slot;
}

void TouchingPairs::begin(const HitTask& task, const Parallel& parallel) {
    first_.assign(1, 0);
    for (const BodyView& body : task.bodies) first_.push_back(first_.back() + body.pieces.count());
    pieces_.assign(first_.back(), PieceInStep{});
    read_motions(task, true, parallel);
    add_energies(task, true);
    starts_.clear();
    for (const ContactIsland& island : task.islands)
        for (const Contact& contact : island.contacts)
            starts_.push_back(
                {point_of_side(task, island, contact.upper), point_of_side(task, island, contact.lower)});
}

void TouchingPairs::leave_out(std::size_t body, std::int32_t piece) {
    const HitPair of{static_cast<std::uint32_t>(body), static_cast<std::uint32_t>(piece), 0, 0};
    if (const std::size_t index = slot(of, 0); index != no_slot) pieces_[index].left_out = true;
}

void TouchingPairs::read_motions(const HitTask& task, bool before, const Parallel& parallel) {
    for (std::size_t b = 0; b < task.bodies.size(); ++b) {
        meshless::momenta_of_pieces(task.bodies[b].phyxels, static_cast<int>(task.bodies[b].pieces.count()),
                                    momenta_, partial_, parallel);
        for (std::size_t k = 0; k < momenta_.size(); ++k) {
            const meshless::Momenta& sum = momenta_[k];
            PieceInStep& piece = pieces_[first_[b] + k];
            piece.mass = sum.mass;
            if (!(sum.mass > 0)) continue;
            const Twist twist{sum.linear / sum.mass,
                              meshless::angular_velocity(sum.inertia, sum.angular_momentum)};
            piece.centre = sum.centre;
            if (before) {
                piece.start = sum.centre;
                piece.before = twist;
                continue;
            }
            piece.solved = piece.after = twist;
            piece.inertia = sum.inertia;
            piece.inverse_inertia = inverse_of_inertia(sum.inertia);
            piece.inner -= 0.5 * (sum.linear.dot(twist.velocity) + sum.angular_momentum.dot(twist.spin));
        }
    }
}

void TouchingPairs::add_energies(const HitTask& task, bool before) {
    for (std::size_t b = 0; b < task.bodies.size(); ++b) {
        const meshless::Phyxels& phyxels = task.bodies[b].phyxels;
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            const std::size_t index = first_[b] + static_cast<std::size_t>(phyxels.piece[i]);
            if (phyxels.piece[i] < 0 || index >= first_[b + 1]) continue;
            PieceInStep& piece = pieces_[index];
            const double m = phyxels.mass[i];
            const double energy = 0.5 * m * phyxels.velocity[i].squaredNorm() + phyxels.elastic_energy[i] -
                                  m * task.gravity.dot(phyxels.position[i]);
            (before ? piece.energy_before : piece.energy) += energy;
            (before ? piece.elastic_before : piece.elastic) += phyxels.elastic_energy[i];
        }
    }
}

void TouchingPairs::measure(const HitTask& task) {
    for (PieceInStep& piece : pieces_) piece.energy = piece.elastic = 0;
    add_energies(task, false);
}

// Leaves out pieces whose motion something else decides, in this step.
void TouchingPairs::leave_out_held(const HitTask& task) {
    for (std::size_t b = 0; b < task.bodies.size(); ++b) {
        const BodyView& body = task.bodies[b];
        const std::vector<std::uint8_t> held = held_pieces(body);
        for (std::size_t k = 0; k < held.size(); ++k) {
            PieceInStep& piece = pieces_[first_[b] + k];
            if (held[k] != 0 || body.is_lattice_driven || !(piece.mass > 0) ||
                body.phyxels.rigid.index(static_cast<std::int32_t>(k)) >= 0)
                piece.left_out = true;
        }
    }
}

void TouchingPairs::finish(const HitTask& task, const Parallel& parallel) {
    for (std::size_t b = 0; b < task.bodies.size(); ++b) {
        const meshless::Phyxels& phyxels = task.bodies[b].phyxels;
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            const std::size_t index = first_[b] + static_cast<std::size_t>(phyxels.piece[i]);
            if (phyxels.piece[i] >= 0 && index < first_[b + 1])
                pieces_[index].inner += 0.5 * phyxels.mass[i] * phyxels.velocity[i].squaredNorm();
        }
    }
    read_motions(task, false, parallel);
    leave_out_held(task);
    list_pairs(task);
    sum_losses();
}

// Returns what a contact did in the step. cached: nothing if it did not push.
PairInStep TouchingPairs::pair_of(const HitTask& task, const ContactIsland& island, const Contact& contact,
                                  const CachedContact* cached, const Start& start) const {
    const bool on_collider = contact.lower.is_collider();
    const Vec3 upper = point_of_side(task, island, contact.upper);
    const Vec3 lower = point_of_side(task, island, contact.lower);
    const Vec3 shift = on_collider ? contact.surface_displacement : Vec3(lower - start.lower);
    auto first = body_and_piece(task, island, contact.upper);
    auto second = on_collider ? std::pair{HitPair::collider, collider_of(contact)}
                              : body_and_piece(task, island, contact.lower);
    const bool is_swapped = second < first;
    if (is_swapped) std::swap(first, second);
    PairInStep out;
    out.pair = {first.first, first.second, second.first, second.second};
    out.friction = contact.friction;
    if (!cached) return out;
    out.spring = spring_energy(*cached, contact.gap + contact.normal.dot(upper - start.upper - shift));
    const auto is_out = [&](std::size_t side) {
        const std::size_t index = slot(out.pair, side);
        return index == no_slot || pieces_[index].left_out;
    };
    const std::size_t upper_side = is_swapped ? 1 : 0;
    if (is_out(1 - upper_side)) out.work += cached->force.dot(shift);
    if (is_out(upper_side)) out.work -= cached->force.dot(upper - start.upper);
    const double force = contact.normal.dot(cached->force);
    if (!(force > 0)) return out;
    out.impulse = force * task.dt;
    out.normal = (is_swapped ? -out.impulse : out.impulse) * contact.normal;
    out.point = out.impulse * (on_collider ? upper : Vec3(0.5 * (upper + lower)));
    if (on_collider) out.surface = out.impulse / task.dt * shift;
    out.gap = contact.gap;
    out.pushes = cached->normal_force > 0;
    return out;
}

void TouchingPairs::list_pairs(const HitTask& task) {
    pairs_.clear();
    meshless::CachedContactFinder finder(&task.contacts);
    auto start = starts_.begin();
    for (const ContactIsland& island : task.islands)
        for (const Contact& contact : island.contacts) {
            const PairInStep pair = pair_of(task, island, contact, finder.find(contact.key), *start++);
            const bool is_one_piece =
                pair.pair.body == pair.pair.other_body && pair.pair.piece == pair.pair.other;
            if (!is_one_piece) pairs_.push_back(pair);
        }
    std::stable_sort(pairs_.begin(), pairs_.end(),
                     [](const PairInStep& a, const PairInStep& b) { return a.pair < b.pair; });
    std::size_t kept = 0;
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
        if (kept > 0 && pairs_[kept - 1].pair == pairs_[k].pair)
            merge(pairs_[kept - 1], pairs_[k]);
        else
            pairs_[kept++] = pairs_[k];
    }
    pairs_.resize(kept);
}

void TouchingPairs::sum_losses() {
    DisjointSets sets(pieces_.size());
    const auto is_in = [&](std::size_t index) { return index != no_slot && !pieces_[index].left_out; };
    for (const PairInStep& pair : pairs_) {
        const std::size_t a = slot(pair.pair, 0), b = slot(pair.pair, 1);
        if (pair.impulse > 0 && is_in(a) && is_in(b))
            sets.join(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
    }
    group_.resize(pieces_.size());
    loss_.assign(pieces_.size(), 0);
    for (std::size_t k = 0; k < pieces_.size(); ++k) {
        group_[k] = sets.find(static_cast<std::uint32_t>(k));
        if (!pieces_[k].left_out) loss_[group_[k]] += pieces_[k].energy_before - pieces_[k].energy;
    }
    for (const PairInStep& pair : pairs_)
        if (const std::size_t index = group(pair.pair); index != no_slot) loss_[index] += pair.work;
}

std::size_t TouchingPairs::group(const HitPair& pair) const {
    for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
        const std::size_t index = slot(pair, side);
        if (index != no_slot && !pieces_[index].left_out) return group_[index];
    }
    return no_slot;
}

void TouchingPairs::apply(const HitTask& task) const {
    for (std::size_t b = 0; b < task.bodies.size(); ++b) {
        meshless::Phyxels& phyxels = task.bodies[b].phyxels;
        const auto from = pieces_.begin() + static_cast<std::ptrdiff_t>(first_[b]);
        const auto to = pieces_.begin() + static_cast<std::ptrdiff_t>(first_[b + 1]);
        if (std::none_of(from, to, [](const PieceInStep& piece) { return piece.pushed; })) continue;
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            const std::size_t index = first_[b] + static_cast<std::size_t>(phyxels.piece[i]);
            if (phyxels.piece[i] < 0 || index >= first_[b + 1] || !pieces_[index].pushed) continue;
            const PieceInStep& piece = pieces_[index];
            const Vec3 arm = phyxels.position[i] - piece.centre;
            const double kept =
                piece.damped > 0 ? std::sqrt(std::max(0.0, 1 - piece.damped / piece.inner)) : 1;
            const Vec3 solved = piece.solved.at(arm);
            const Vec3 change = piece.after.at(arm) - solved + (kept - 1) * (phyxels.velocity[i] - solved);
            if (!change.allFinite()) continue;
            phyxels.velocity[i] += change;
            phyxels.previous_velocity[i] += change;
            phyxels.restart_history[i] = 1;
        }
    }
}

}  // namespace splitcubes::body
