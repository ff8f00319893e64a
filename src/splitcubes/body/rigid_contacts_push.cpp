// How rigid pieces, and what they meet, push each other after a step.
#include <splitcubes/body/rigid_contacts.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace splitcubes::body {

namespace {

using meshless::RigidPiece;

// In lifts: passing by less is rounding.
constexpr double least_share = 1e-3;
// In spacings: from how far an obstacle bears what is pushed towards it.
constexpr double bearing_share = 0.02;
constexpr int placing_rounds = 30, most_rounds = 200;
// Shares of the fastest approach: changes of velocity below this end the rounds; and below this, where so
// many rounds do not bring them down to that share of what they were.
constexpr double enough = 1e-3, little = 0.02, least_help = 0.75;
constexpr int few_rounds = 10;

Mat3 cross_matrix(const Vec3& v) {
    Mat3 out;
    out << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return out;
}

// 1/kg, velocity of a mover's matter at a place for an impulse there.
template <class Mover>
Mat3 mobility_at(const Mover& mover, const Vec3& place) {
    const Mat3 arm = cross_matrix(place);
    return mover.mobility * Mat3::Identity() - arm * mover.turning * arm;
}

}  // namespace

// Where the skin of the rows has gone; what is carried beside a point of it turns with its piece.
void RigidContacts::carry_rows() {
    for (Row& row : rows_) {
        if (row.whole < 0) continue;
        const Vec3 turn = dt_ * wholes_[static_cast<std::size_t>(row.whole)].turns;
        row.carried = meshless::side_value(row.side, positions_) + row.lower_own + turn.cross(row.lower_own);
    }
}

Vec3 RigidContacts::lower_place(const Row& row) const {
    if (row.lower >= 0) return piece_of(crumbs_[static_cast<std::size_t>(row.lower)]).place_of(row.lower_own);
    return row.carried + wholes_[static_cast<std::size_t>(row.whole)].shift;
}

// 1/kg, of the two sides' centres.
double RigidContacts::linear_mobility(const Row& row) const {
    const auto of = [](bool held, double mass) { return held || !(mass > 0) ? 0 : 1 / mass; };
    double sum = of(crumbs_[row.upper].held, piece_of(crumbs_[row.upper]).mass);
    if (row.lower >= 0) {
        const Crumb& lower = crumbs_[static_cast<std::size_t>(row.lower)];
        sum += of(lower.held, piece_of(lower).mass);
    } else if (row.whole >= 0) {
        const Whole& whole = wholes_[static_cast<std::size_t>(row.whole)];
        sum += of(whole.held, whole.mass);
    }
    return sum;
}

// m, negative inside, of the deepest point, and the normal there.
geometry::SignedDistance::Sample RigidContacts::deepest(const meshless::Obstacle& obstacle,
                                                        const Crumb& crumb) const {
    const RigidPiece& piece = piece_of(crumb);
    const Isometry to_own = obstacle.after.inverse();
    geometry::SignedDistance::Sample lowest;
    lowest.distance = std::numeric_limits<double>::infinity();
    for (const Vec3& own : phyxels_[crumb.body]->rigid.points_of(piece)) {
        const geometry::SignedDistance::Sample at = obstacle.solid->at(to_own * piece.place_of(own));
        if (at.distance < lowest.distance) lowest = at;
    }
    lowest.normal = obstacle.after.linear() * lowest.normal;
    return lowest;
}

void RigidContacts::note_depth(const Task& task, Crumb& crumb) const {
    crumb.depth.clear();
    for (const meshless::Obstacle& obstacle : task.obstacles)
        crumb.depth.push_back(std::min(deepest(obstacle, crumb).distance, 0.0));
}

// Obstacles give no way to what is put apart. Returns whether one was in it.
bool RigidContacts::lift_out(const Task& task, Crumb& crumb) {
    bool any = false;
    for (std::size_t k = 0; k < task.obstacles.size(); ++k) {
        const geometry::SignedDistance::Sample at = deepest(task.obstacles[k], crumb);
        const double missing = crumb.depth[k] - at.distance;
        if (!(missing > 1e-9 * crumb.radius)) continue;
        piece_of(crumb).centre += missing * at.normal;
        any = true;
    }
    return any;
}

// m, how far the sides are from where they may be at least, now.
double RigidContacts::room(const Row& row) const {
    const Vec3 way = piece_of(crumbs_[row.upper]).place_of(row.own) - lower_place(row) - row.start;
    return row.gap + row.normal.dot(way) - std::min(row.gap + row.lift, 0.0);
}

// One contact that has been passed in the step; returns whether it was.
bool RigidContacts::put_back(const Task& task, const Row& row) {
    const double mobility = linear_mobility(row);
    const double missing = -room(row);
    if (!(missing > least_share * row.lift) || !(mobility > 0) || !std::isfinite(missing)) return false;
    const Vec3 push = missing / mobility * row.normal;
    const auto shift = [&](Crumb& crumb, double sign) {
        if (!crumb.pushed) note_depth(task, crumb);
        crumb.pushed = true;
        if (!crumb.held) piece_of(crumb).centre += sign / piece_of(crumb).mass * push;
    };
    shift(crumbs_[row.upper], 1);
    if (row.lower >= 0) {
        shift(crumbs_[static_cast<std::size_t>(row.lower)], -1);
    } else {
        Whole& whole = wholes_[static_cast<std::size_t>(row.whole)];
        if (whole.held || !(whole.mass > 0)) return true;
        whole.shift -= push / whole.mass;
        if (!crumbs_[row.upper].held)
            whole.owed -= push.cross(piece_of(crumbs_[row.upper]).velocity() - whole.velocity);
    }
    return true;
}

// What has passed by in the step goes back to where it was; positions only. Of elastic
// pieces the whole goes: what moves skin alone would strain them by energy that nothing put in.
void RigidContacts::put_apart(const Task& task) {
    bool any = true;
    for (int round = 0; round < placing_rounds && any; ++round) {
        any = false;
        for (const Row& row : rows_) any = put_back(task, row) || any;
        for (Crumb& crumb : crumbs_)
            if (crumb.pushed && !crumb.held) any = lift_out(task, crumb) || any;
    }
}

// After the step. `velocity` is that of the centre until the pushes begin.
void RigidContacts::weigh_wholes(const Task& task) {
    std::vector<meshless::Momenta> momenta;
    std::size_t summed = task.bodies.size();  // the body whose momenta these are
    for (Whole& whole : wholes_) {
        const Body& body = *task.bodies[whole.body];
        const meshless::Phyxels& phyxels = body.phyxels();
        if (summed != whole.body)
            meshless::piece_momenta(phyxels, static_cast<int>(body.pieces().count()), momenta);
        summed = whole.body;
        const meshless::Momenta& now = momenta[static_cast<std::size_t>(whole.piece)];
        for (std::size_t i = 0; i < body.held().size(); ++i)
            whole.held = whole.held || (phyxels.piece[i] == whole.piece && body.held()[i] != 0);
        if (!(now.mass > 0)) continue;
        whole.mass = now.mass;
        whole.centre = now.centre;
        whole.velocity = now.linear / now.mass;
        whole.momentum = now.linear;
        whole.spin = now.spin;
        whole.inertia = now.inertia;
        for (int axis = 0; axis < 3; ++axis)
            whole.turning.col(axis) = meshless::angular_velocity(now.inertia, Vec3::Unit(axis));
        whole.turning = (0.5 * (whole.turning + whole.turning.transpose())).eval();
        whole.turns = whole.turning * now.spin;
    }
}

// The phyxels of elastic pieces go along. Their last step is moved with them: a push is no
// acceleration that goes on.
void RigidContacts::move_wholes() {
    for (const Whole& whole : wholes_) {
        if (whole.held) continue;
        meshless::Phyxels& phyxels = *phyxels_[whole.body];
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            if (phyxels.piece[i] != whole.piece) continue;
            phyxels.position[i] += whole.shift;
            phyxels.previous_position[i] += whole.shift;
            const Vec3 change =
                whole.velocity + whole.angular_velocity.cross(phyxels.position[i] - whole.centre);
            phyxels.velocity[i] += change;
            phyxels.previous_velocity[i] += change;
        }
    }
}

// What bears a rigid piece while others push it.
void RigidContacts::meet_obstacles(const Task& task, std::uint32_t number) {
    const Crumb& crumb = crumbs_[number];
    if (crumb.held) return;
    const RigidPiece& piece = piece_of(crumb);
    const meshless::RigidPieces& rigid = phyxels_[crumb.body]->rigid;
    const double near = bearing_share * task.bodies[crumb.body]->phyxel_spacing();
    for (const meshless::Obstacle& obstacle : task.obstacles) {
        const Isometry to_own = obstacle.after.inverse();
        for (const Vec3& own : rigid.points_of(piece)) {
            const Vec3 place = to_own * piece.place_of(own);
            const geometry::SignedDistance::Sample at = obstacle.solid->at(place);
            if (!(at.distance < near)) continue;
            Row row;
            row.upper = number;
            row.own = own;
            row.normal = obstacle.after.linear() * at.normal;
            row.friction = obstacle.friction;
            row.drive = (obstacle.after * place - obstacle.before * place) / task.dt;
            row.allowed = -std::max(at.distance, 0.0) / task.dt;
            rows_.push_back(row);
        }
    }
}

void RigidContacts::list_movers() {
    movers_.assign(crumbs_.size() + wholes_.size() + 1, {});
    for (std::size_t k = 0; k < crumbs_.size(); ++k) {
        const RigidPiece& piece = piece_of(crumbs_[k]);
        Mover& mover = movers_[k];
        const Mat3 turning = piece.inverse_inertia();
        mover.velocity = piece.velocity();
        mover.angular_velocity = turning * piece.spin;
        if (crumbs_[k].held) continue;
        mover.mobility = 1 / piece.mass;
        mover.turning = turning;
    }
    for (std::size_t k = 0; k < wholes_.size(); ++k) {
        const Whole& whole = wholes_[k];
        Mover& mover = movers_[crumbs_.size() + k];
        mover.angular_velocity = whole.turning * whole.owed;
        if (whole.held || !(whole.mass > 0)) continue;
        mover.mobility = 1 / whole.mass;
        mover.turning = whole.turning;
    }
}

void RigidContacts::weigh(Row& row) {
    Push push;
    push.upper = row.upper;
    push.lower = static_cast<std::uint32_t>(movers_.size() - 1);
    push.normal = row.normal;
    push.arm = row.place - piece_of(crumbs_[row.upper]).centre;
    if (row.lower >= 0) {
        push.lower = static_cast<std::uint32_t>(row.lower);
        push.lower_arm = row.place - piece_of(crumbs_[push.lower]).centre;
    } else if (row.whole >= 0) {
        const Whole& whole = wholes_[static_cast<std::size_t>(row.whole)];
        push.lower = static_cast<std::uint32_t>(crumbs_.size()) + static_cast<std::uint32_t>(row.whole);
        push.lower_arm = row.place - whole.centre;
        push.skin_velocity = meshless::side_value(row.side, velocities_) + whole.turns.cross(row.lower_own);
    }
    const Mover &upper = movers_[push.upper], &lower = movers_[push.lower];
    push.torque = push.arm.cross(row.normal);
    push.lower_torque = push.lower_arm.cross(row.normal);
    push.turn = upper.turning * push.torque;
    push.lower_turn = lower.turning * push.lower_torque;
    const Mat3 mobility = mobility_at(upper, push.arm) + mobility_at(lower, push.lower_arm);
    const double normal = row.normal.dot(mobility * row.normal);
    // No more than the slowest of the two ways along the face needs: the rounds only take energy.
    const double along = mobility.trace() - normal;
    push.normal_mass = normal > 0 ? 1 / normal : 0;
    push.slide_mass = along > 0 ? 1 / along : 0;
    push.drive = row.drive;
    push.allowed = row.allowed;
    push.friction = row.friction;
    pushes_.push_back(push);
}

// m/s, upper's less lower's at the place, without the drive.
Vec3 RigidContacts::velocity_of(const Push& push) const {
    return movers_[push.upper].velocity_at(push.arm) - movers_[push.lower].velocity_at(push.lower_arm) -
           push.skin_velocity;
}

// Friction, after the pressure was found. largest: m/s, change of velocity.
void RigidContacts::rub(Push& push, double& largest) {
    Vec3 slip = velocity_of(push) - push.drive;
    slip -= push.normal * push.normal.dot(slip);
    Vec3 rubbing = push.rubbing - push.slide_mass * slip;
    const double limit = push.friction * push.pressure, size = rubbing.norm();
    if (size > limit) rubbing *= limit / size;
    const Vec3 change = rubbing - push.rubbing;
    push.rubbing = rubbing;
    movers_[push.upper].push(push.arm, change);
    movers_[push.lower].push(push.lower_arm, -change);
    largest = std::max(largest, change.norm() / push.slide_mass);
}

// Returns the largest change of velocity, m/s.
double RigidContacts::solve(Push& push) {
    if (!(push.normal_mass > 0)) return 0;
    Mover &upper = movers_[push.upper], &lower = movers_[push.lower];
    const double velocity =
        push.normal.dot(upper.velocity - lower.velocity - push.skin_velocity - push.drive) +
        push.torque.dot(upper.angular_velocity) - push.lower_torque.dot(lower.angular_velocity);
    const double pressure = std::max(0.0, push.pressure + push.normal_mass * (push.allowed - velocity));
    const double change = pressure - push.pressure;
    push.pressure = pressure;
    if (change != 0) {
        upper.velocity += change * upper.mobility * push.normal;
        upper.angular_velocity += change * push.turn;
        lower.velocity -= change * lower.mobility * push.normal;
        lower.angular_velocity -= change * push.lower_turn;
    }
    double largest = std::abs(change) / push.normal_mass;
    if ((pressure > 0 || !push.rubbing.isZero(0)) && push.slide_mass > 0) rub(push, largest);
    return largest;
}

// Where skin closes on a rigid piece from two sides, no impulse of whole pieces opens it again, and rounds
// would only press ever harder: they end where little is left and they no longer help.
void RigidContacts::solve_all(double fastest) {
    const auto is_skin = [this](const Push& push) {
        return push.lower >= crumbs_.size() && push.lower + 1 < movers_.size();
    };
    double skin = 0, others = 0, before = std::numeric_limits<double>::infinity();
    for (int round = 0; round < most_rounds; ++round) {
        double largest = 0;
        for (std::size_t k = 0; k < pushes_.size(); ++k) {
            Push& push = pushes_[round % 2 == 0 ? k : pushes_.size() - 1 - k];
            const double change = solve(push);
            double& most = is_skin(push) ? skin : others;
            most = std::max(most, change);
            largest = std::max(largest, change);
        }
        if (!(largest > enough * fastest)) break;
        if (round % few_rounds != few_rounds - 1) continue;
        if (skin > others && skin < little * fastest && skin > least_help * before) break;
        before = skin;
        skin = others = 0;
    }
}

// Both sides take the same impulse: momenta go from one to the other.
void RigidContacts::push_crumbs() {
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const Row& row = rows_[k];
        const Vec3 impulse = pushes_[k].impulse();
        if (!crumbs_[row.upper].held) piece_of(crumbs_[row.upper]).push(row.place, impulse);
        if (row.lower < 0) continue;
        const Crumb& lower = crumbs_[static_cast<std::size_t>(row.lower)];
        if (!lower.held) piece_of(lower).push(row.place, -impulse);
    }
    for (std::size_t k = 0; k < wholes_.size(); ++k) {
        wholes_[k].velocity = movers_[crumbs_.size() + k].velocity;
        wholes_[k].angular_velocity = movers_[crumbs_.size() + k].angular_velocity;
    }
}

RigidContacts::Outcome RigidContacts::push(const Task& task) {
    Outcome outcome;
    if (rows_.empty()) return outcome;
    dt_ = task.dt;
    positions_.clear();
    velocities_.clear();
    for (const auto& body : task.bodies) {
        positions_.emplace_back(body->phyxels().position);
        velocities_.emplace_back(body->phyxels().velocity);
    }
    for (Crumb& crumb : crumbs_) crumb.held = task.bodies[crumb.body]->holds_rigid(crumb.index);
    weigh_wholes(task);
    carry_rows();
    put_apart(task);
    // Those that others lie beside, too: one corner that was put back has lifted all.
    std::erase_if(rows_, [&](Row& row) {
        const double left = room(row);
        row.allowed = -std::max(left, 0.0) / task.dt;
        return !(left < bearing_share * spacing_) || !crumbs_[row.upper].pushed;
    });
    if (rows_.empty()) return outcome;
    for (std::uint32_t k = 0; k < crumbs_.size(); ++k)
        if (crumbs_[k].pushed) meet_obstacles(task, k);
    for (Whole& whole : wholes_) {
        whole.centre += whole.shift;
        whole.velocity.setZero();
    }
    // Up and down in turn: what bears a heap is at its bottom.
    for (Row& row : rows_) row.place = piece_of(crumbs_[row.upper]).place_of(row.own);
    std::stable_sort(rows_.begin(), rows_.end(), [&](const Row& a, const Row& b) {
        return task.gravity.dot(a.place) > task.gravity.dot(b.place);
    });
    list_movers();
    pushes_.clear();
    double fastest = 0;
    for (Row& row : rows_) {
        weigh(row);
        fastest = std::max(fastest, (velocity_of(pushes_.back()) - row.drive).norm());
    }
    solve_all(fastest);
    for (const Push& one : pushes_) outcome.contacts += one.pressure > 0;
    const double before = kinetic_energy();
    push_crumbs();
    outcome.kinetic_energy = kinetic_energy() - before;
    move_wholes();
    for (meshless::Phyxels* phyxels : phyxels_)
        if (!phyxels->rigid.empty()) meshless::write_phyxels(*phyxels);
    return outcome;
}

// J, of rigid pieces; and what the pushes add to that of elastic ones, whatever else these do.
double RigidContacts::kinetic_energy() const {
    double sum = 0;
    for (const Crumb& crumb : crumbs_) sum += piece_of(crumb).kinetic_energy();
    for (const Whole& whole : wholes_) {
        if (whole.held) continue;
        const Vec3 &v = whole.velocity, &w = whole.angular_velocity;
        sum += whole.momentum.dot(v) + 0.5 * whole.mass * v.squaredNorm();
        sum += whole.spin.dot(w) + 0.5 * w.dot(whole.inertia * w);
    }
    return sum;
}

}  // namespace splitcubes::body
