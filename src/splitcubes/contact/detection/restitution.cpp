#include <splitcubes/contact/detection/restitution.h>
#include <splitcubes/contact/detection/rigid_motion.h>
#include <splitcubes/contact/detection/tuning.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace splitcubes::body {

namespace {

constexpr std::array<std::size_t, 2> both_sides = {0, 1};

}  // namespace

Vec3 Hit::mean_arm(std::size_t side) const {
    const Vec3 mean = arm[side] / impulse, along = unit_normal();
    const Vec3 central = along * along.dot(mean);
    return (mean - central).norm() < blur ? central : mean;
}

double Hit::approach_speed() const {
    const Vec3 relative = approach[0].at(mean_arm(0)) - approach[1].at(mean_arm(1));
    const double along = unit_normal().dot(relative);
    return along < 0 ? std::sqrt(std::max(0.0, along * along + fall)) : 0;
}

void Restitution::begin(const HitTask& task, const Parallel& parallel) {
    step_.begin(task, parallel);
    is_measured_ = false;
    // What was cut, torn or is gone ends its hits.
    std::erase_if(hits_, [&](const Hit& hit) { return !is_whole(hit); });
    for (const Hit& hit : hits_)
        for (const std::size_t side : both_sides)
            if (const std::size_t index = step_.slot(hit.pair, side); index != TouchingPairs::no_slot)
                step_.piece(index).supported = true;
}

// Returns whether the sides of a hit have the masses with which they met.
bool Restitution::is_whole(const Hit& hit) const {
    for (const std::size_t side : both_sides) {
        const std::size_t index = step_.slot(hit.pair, side);
        const double mass = index == TouchingPairs::no_slot ? 0 : step_.piece(index).mass;
        if (std::abs(mass - hit.mass[side]) > tuning::restitution::same_mass_share * mass) return false;
        if (mass == 0 && (side == 0 || !hit.pair.has_collider())) return false;
    }
    return true;
}

void Restitution::measure(const HitTask& task) {
    step_.measure(task);
    is_measured_ = true;
}

Restitution::Outcome Restitution::finish(const HitTask& task, const Parallel& parallel) {
    if (!is_measured_) measure(task);
    step_.finish(task, parallel);
    match(task);
    credit_losses(task);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < hits_.size(); ++k)
        if (advance(task, hits_[k], pair_of_[k])) hits_[kept++] = hits_[k];
    hits_.resize(kept);
    step_.apply(task);
    return outcome();
}

// Matches the hits with the pairs that touch in this step: new pairs become hits. Hits of pieces that are
// left out end.
void Restitution::match(const HitTask& task) {
    next_.clear();
    pair_of_.clear();
    const auto is_out = [&](const HitPair& pair) {
        return std::any_of(both_sides.begin(), both_sides.end(), [&](std::size_t side) {
            const std::size_t index = step_.slot(pair, side);
            return index != TouchingPairs::no_slot && step_.piece(index).left_out;
        });
    };
    // Springs of contacts that are no longer found have lost what they held.
    const auto keep = [&](const Hit& hit, const PairInStep* pair) {
        const double spring = pair ? pair->spring : 0;
        step_.add_loss(hit.pair, hit.spring - spring);
        next_.push_back(hit);
        next_.back().spring = spring;
        add_depth(task, next_.back());
        pair_of_.push_back(pair);
    };
    std::size_t at = 0;
    for (const PairInStep& pair : step_.pairs()) {
        for (; at < hits_.size() && hits_[at].pair < pair.pair; ++at)
            if (!is_out(hits_[at].pair)) keep(hits_[at], nullptr);
        const bool is_known = at < hits_.size() && hits_[at].pair == pair.pair;
        Hit hit;
        hit.pair = pair.pair;
        if (is_known) hit = hits_[at++];
        if ((!is_known && !(pair.impulse > 0)) || is_out(pair.pair)) continue;
        if (pair.impulse > 0) {
            if (hit.phase == HitPhase::resting) meet(task, pair, hit);
            add_contacts(pair, hit);
        }
        keep(hit, &pair);
    }
    for (; at < hits_.size(); ++at)
        if (!is_out(hits_[at].pair)) keep(hits_[at], nullptr);
    hits_.swap(next_);
}

// Begins a hit if the pair approached fast enough before the step.
void Restitution::meet(const HitTask& task, const PairInStep& pair, Hit& hit) const {
    const double spacing = task.bodies[pair.pair.body].spacing;
    Hit next;
    next.pair = pair.pair;
    next.friction = pair.friction;
    if (pair.pair.has_collider()) next.blur = tuning::restitution::blur_share * spacing;
    Vec3 fall = Vec3::Zero();  // m/s^2, relative acceleration
    for (const std::size_t side : both_sides) {
        const std::size_t index = step_.slot(pair.pair, side);
        if (index == TouchingPairs::no_slot) {
            next.approach[side].velocity = pair.surface / pair.impulse;
            continue;
        }
        const PieceInStep& piece = step_.piece(index);
        next.mass[side] = piece.mass;
        next.approach[side] = piece.before;
        next.strain += piece.elastic_before;
        if (!piece.supported) fall += (side == 0 ? 1.0 : -1.0) * task.gravity;
    }
    Hit first = next;
    add_contacts(pair, first);
    const double gap = std::max(0.0, pair.gap);
    next.depth = -gap;
    next.spring = hit.spring;
    first.fall = next.fall = -2 * gap * first.unit_normal().dot(fall);
    const double resting = std::max(tuning::restitution::resting_steps * task.gravity.norm() * task.dt,
                                    tuning::restitution::resting_share * spacing / task.dt);
    next.last_speed = -first.approach_speed();
    if (first.approach_speed() > resting) next.phase = HitPhase::closing;
    hit = next;
}

void Restitution::add_contacts(const PairInStep& pair, Hit& hit) const {
    hit.impulse += pair.impulse;
    hit.normal += pair.normal;
    hit.surface = pair.surface / pair.impulse;
    for (const std::size_t side : both_sides)
        if (const std::size_t index = step_.slot(pair.pair, side); index != TouchingPairs::no_slot)
            hit.arm[side] += pair.point - pair.impulse * step_.piece(index).centre;
}

void Restitution::add_depth(const HitTask& task, Hit& hit) const {
    Vec3 nearer = hit.surface * task.dt;
    for (const std::size_t side : both_sides)
        if (const std::size_t index = step_.slot(hit.pair, side); index != TouchingPairs::no_slot)
            nearer += (side == 0 ? -1.0 : 1.0) * (step_.piece(index).centre - step_.piece(index).start);
    hit.depth += hit.unit_normal().dot(nearer);
}

// Returns the energy of the rebound that the sides part with, J.
double Restitution::rebound(const HitTask& task, const Hit& hit) const {
    return parting_energy(hit, task.coefficient * hit.approach_speed());
}

// Returns the work that takes a piece up to where it met a collider, J.
double Restitution::climb(const HitTask& task, const Hit& hit) const {
    if (!hit.pair.has_collider()) return 0;
    return std::max(0.0, -hit.depth * hit.mass[0] * task.gravity.dot(hit.unit_normal()));
}

// Shares the losses of each group of pieces among its hits, by what these may give back.
void Restitution::credit_losses(const HitTask& task) {
    share_.assign(step_.groups(), 0);
    const auto each = [&](const auto& act) {
        for (Hit& hit : hits_)
            if (hit.phase != HitPhase::resting)
                act(hit, step_.group(hit.pair), rebound(task, hit) + climb(task, hit));
    };
    each([&](const Hit&, std::size_t group, double most) { share_[group] += most; });
    each([&](Hit& hit, std::size_t group, double most) {
        const double share = share_[group] > 0 ? most / share_[group] : 0;
        hit.held = std::min({hit.held + share * step_.loss(group), most, 2 * most - hit.given});
    });
}

// Returns the arm of the point at which an impulse acts, m. Both sides of a pair of pieces have one point, so
// that it conserves angular momentum.
Vec3 Restitution::arm(const Hit& hit, std::size_t side) const {
    if (hit.pair.has_collider()) return hit.mean_arm(side);
    const std::array<Vec3, 2> centre = {step_.piece(step_.slot(hit.pair, 0)).centre,
                                        step_.piece(step_.slot(hit.pair, 1)).centre};
    return 0.5 * (centre[0] + hit.mean_arm(0) + centre[1] + hit.mean_arm(1)) - centre[side];
}

// Returns the change of the relative velocity, m/s, by an impulse, N s, at the point of a hit.
Vec3 Restitution::velocity_change(const Hit& hit, const Vec3& impulse) const {
    Vec3 change = Vec3::Zero();
    for (const std::size_t side : both_sides)
        if (const std::size_t index = step_.slot(hit.pair, side); index != TouchingPairs::no_slot) {
            const PieceInStep& piece = step_.piece(index);
            change += mobility_at(1 / piece.mass, piece.inverse_inertia, arm(hit, side)) * impulse;
        }
    return change;
}

// Returns the velocity of the first side relative to the second, m/s.
Vec3 Restitution::parting_velocity(const Hit& hit) const {
    const std::size_t a = step_.slot(hit.pair, 0), b = step_.slot(hit.pair, 1);
    const Vec3 second = b == TouchingPairs::no_slot ? hit.surface : step_.piece(b).after.at(arm(hit, 1));
    return step_.piece(a).after.at(arm(hit, 0)) - second;
}

double Restitution::parting_speed(const Hit& hit) const {
    return hit.unit_normal().dot(parting_velocity(hit));
}

// Returns the energy, J, of sides that part at a speed, m/s.
double Restitution::parting_energy(const Hit& hit, double speed) const {
    const Vec3 normal = hit.unit_normal();
    const double mobility = normal.dot(velocity_change(hit, normal));  // 1/kg
    return mobility > 0 ? 0.5 * speed * speed / mobility : 0;
}

// Returns the elastic energy of the pieces of a hit, J.
double Restitution::strain(const Hit& hit) const {
    double sum = 0;
    for (const std::size_t side : both_sides)
        if (const std::size_t index = step_.slot(hit.pair, side); index != TouchingPairs::no_slot)
            sum += step_.piece(index).elastic;
    return sum;
}

// Returns whether the pair is still to be known after the step.
bool Restitution::advance(const HitTask& task, Hit& hit, const PairInStep* pair) {
    const bool pushes = pair && pair->pushes;
    if (hit.phase == HitPhase::resting) return pushes;
    const double speed = parting_speed(hit), met = hit.approach_speed();
    const double turned = -tuning::restitution::turned_share * met;
    if (!pushes) {
        // Contacts can end before the sides have stopped: a piece slides off an edge.
        if (!(speed > -tuning::restitution::stopped_share * met)) return false;
        // Gravity acts on what the centre is above or below where it was when the sides met.
        const double fall = hit.pair.has_collider() ? -task.gravity.dot(hit.unit_normal()) : 0;
        const double wanted = task.coefficient * met;
        const double left = wanted * wanted + 2 * hit.depth * fall;
        set_speed(hit, std::sqrt(std::max(0.0, left)), true);
        return false;
    }
    if (hit.phase == HitPhase::closing && speed > turned) hit.phase = HitPhase::opening;
    if (hit.phase == HitPhase::opening) open(task, hit);
    hit.last_speed = parting_speed(hit);
    return true;
}

// Pushes the sides apart once the strain between them no longer does.
void Restitution::open(const HitTask& task, Hit& hit) {
    const double strained = std::max(0.0, strain(hit) - hit.strain), least = rebound(task, hit);
    const double missing = std::max(0.0, climb(task, hit) - strained);  // of what lifts the piece
    const double speed = parting_speed(hit), met = hit.approach_speed();
    const double wanted = least > 0 ? task.coefficient * met * std::sqrt(1 + missing / least) : 0;
    const bool is_weak = strained < tuning::restitution::weak_share * least;
    const bool slows = speed <= hit.last_speed + tuning::restitution::rising_share * met;
    // In the step in which it parts, a piece would rise with what it has in excess.
    const double excess = parting_energy(hit, speed) - parting_energy(hit, wanted);
    if (speed > wanted && strained < tuning::restitution::weak_share * excess) set_speed(hit, wanted, false);
    if (!is_weak && !slows) return;
    if (speed < wanted) set_speed(hit, wanted, false);
    // Nothing that pushes is left: the hit is over.
    const double moving =
        std::max(tuning::restitution::turned_share * met, tuning::restitution::moving_share * wanted);
    if (parting_speed(hit) < moving && ++hit.stalled > tuning::restitution::stalled_steps)
        hit.phase = HitPhase::resting;
}

// Sets the speed at which the sides part, m/s, or as much of it as the energy allows.
void Restitution::set_speed(Hit& hit, double speed, bool may_damp) {
    const Vec3 normal = hit.unit_normal();
    const double mobility = normal.dot(velocity_change(hit, normal));  // 1/kg
    const double now = parting_speed(hit);
    if (!(mobility > 0) || !std::isfinite(now)) return;
    if (speed > now) {
        const double parting = std::max(0.0, now);
        const double needed = 0.5 * (speed * speed - parting * parting) / mobility;
        const double held = std::max(0.0, hit.held);
        double given = std::min(needed, held);
        if (may_damp && needed > held) given += damp(hit, needed - held);
        if (given < needed) speed = std::sqrt(parting * parting + 2 * mobility * given);
        hit.held -= std::min(given, held);
        hit.given += given;
    }
    const double impulse = (speed - now) / mobility;
    push(hit, impulse * normal);
    if (!(impulse > 0)) return;
    // Overestimates the mobility along both tangents: too small an impulse still only removes energy.
    Vec3 sliding = parting_velocity(hit);
    sliding -= normal * normal.dot(sliding);
    double tangential = 0;  // 1/kg
    for (int axis = 0; axis < 3; ++axis) tangential += velocity_change(hit, Vec3::Unit(axis))[axis];
    Vec3 friction = -sliding / (tangential - mobility);
    const double limit = hit.friction * impulse, size = friction.norm();
    if (size > limit) friction *= limit / size;
    if (friction.allFinite()) push(hit, friction);
}

// Takes up to this energy, J, from the vibrations of the pieces of a hit. Returns what was taken.
double Restitution::damp(const Hit& hit, double energy) {
    double there = 0;
    for (const std::size_t side : both_sides)
        if (const std::size_t index = step_.slot(hit.pair, side); index != TouchingPairs::no_slot)
            there += std::max(0.0, step_.piece(index).inner - step_.piece(index).damped);
    const double taken = std::min(energy, there);
    if (!(taken > 0)) return 0;
    for (const std::size_t side : both_sides)
        if (const std::size_t index = step_.slot(hit.pair, side); index != TouchingPairs::no_slot) {
            PieceInStep& piece = step_.piece(index);
            piece.damped += taken / there * std::max(0.0, piece.inner - piece.damped);
        }
    return taken;
}

void Restitution::push(const Hit& hit, const Vec3& impulse) {
    for (const std::size_t side : both_sides)
        if (const std::size_t index = step_.slot(hit.pair, side); index != TouchingPairs::no_slot) {
            PieceInStep& piece = step_.piece(index);
            const Vec3 on_it = side == 0 ? impulse : Vec3(-impulse);
            piece.after.velocity += on_it / piece.mass;
            piece.after.spin += piece.inverse_inertia * arm(hit, side).cross(on_it);
            piece.pushed = true;
        }
}

Restitution::Outcome Restitution::outcome() const {
    Outcome out;
    for (const Hit& hit : hits_)
        if (hit.phase != HitPhase::resting) out.held_energy += std::max(0.0, hit.held);
    for (std::size_t k = 0; k < step_.groups(); ++k) {
        const PieceInStep& piece = step_.piece(k);
        if (!piece.pushed) continue;
        const Vec3 linear = piece.mass * (piece.after.velocity - piece.solved.velocity);
        const Vec3 angular = piece.inertia * (piece.after.spin - piece.solved.spin);
        out.momentum += linear;
        out.angular_momentum += piece.centre.cross(linear) + angular;
        out.kinetic_energy += 0.5 * linear.dot(piece.after.velocity + piece.solved.velocity) +
                              0.5 * angular.dot(piece.after.spin + piece.solved.spin) - piece.damped;
    }
    return out;
}

}  // namespace splitcubes::body
