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
// Changes of velocity below this share of the largest end the rounds.
constexpr double enough = 1e-5;

Mat3 cross_matrix(const Vec3& v) {
    Mat3 out;
    out << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return out;
}

// 1/kg, velocity of a piece's matter at a place for an impulse there.
Mat3 mobility_at(const RigidPiece& piece, const Vec3& place) {
    const Mat3 arm = cross_matrix(place - piece.centre);
    return Mat3::Identity() / piece.mass - arm * piece.inverse_inertia() * arm;
}

}  // namespace

// What is carried beside a point of the skin turns with its piece.
Vec3 RigidContacts::lower_place(const Row& row) const {
    if (row.lower >= 0) return piece_of(crumbs_[static_cast<std::size_t>(row.lower)]).place_of(row.lower_own);
    const Vec3 turn = dt_ * wholes_[static_cast<std::size_t>(row.whole)].turns;
    return meshless::side_value(row.side, positions_) + row.lower_own + turn.cross(row.lower_own);
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

void RigidContacts::weigh(Row& row) const {
    const Crumb& upper = crumbs_[row.upper];
    row.place = piece_of(upper).place_of(row.own);
    row.mobility.setZero();
    if (!upper.held) row.mobility += mobility_at(piece_of(upper), row.place);
    if (row.lower >= 0 && !crumbs_[static_cast<std::size_t>(row.lower)].held)
        row.mobility += mobility_at(piece_of(crumbs_[static_cast<std::size_t>(row.lower)]), row.place);
    if (row.whole >= 0) {
        const Whole& whole = wholes_[static_cast<std::size_t>(row.whole)];
        const Mat3 arm = cross_matrix(row.place - whole.centre);
        if (!whole.held && whole.mass > 0)
            row.mobility += Mat3::Identity() / whole.mass - arm * whole.turning * arm;
        row.skin_velocity = meshless::side_value(row.side, velocities_) + whole.turns.cross(row.lower_own);
    }
    const double normal = row.normal.dot(row.mobility * row.normal);
    // No more than the slowest of the two ways along the face needs: the rounds only take energy.
    const double along = row.mobility.trace() - normal;
    row.normal_mass = normal > 0 ? 1 / normal : 0;
    row.slide_mass = along > 0 ? 1 / along : 0;
}

// m/s, upper's less lower's at the place, without the drive.
Vec3 RigidContacts::velocity_of(const Row& row) const {
    Vec3 out = piece_of(crumbs_[row.upper]).velocity_at(row.place) - row.skin_velocity;
    if (row.lower >= 0) out -= piece_of(crumbs_[static_cast<std::size_t>(row.lower)]).velocity_at(row.place);
    if (row.whole >= 0) {
        const Whole& whole = wholes_[static_cast<std::size_t>(row.whole)];
        out -= whole.velocity + whole.angular_velocity.cross(row.place - whole.centre);
    }
    return out;
}

void RigidContacts::apply(const Row& row, const Vec3& impulse) {
    if (!crumbs_[row.upper].held) piece_of(crumbs_[row.upper]).push(row.place, impulse);
    if (row.lower >= 0 && !crumbs_[static_cast<std::size_t>(row.lower)].held)
        piece_of(crumbs_[static_cast<std::size_t>(row.lower)]).push(row.place, -impulse);
    if (row.whole < 0) return;
    Whole& whole = wholes_[static_cast<std::size_t>(row.whole)];
    if (whole.held || !(whole.mass > 0)) return;
    whole.velocity -= impulse / whole.mass;
    whole.angular_velocity -= whole.turning * (row.place - whole.centre).cross(impulse);
}

// Returns the largest change of velocity, m/s.
double RigidContacts::solve(Row& row) {
    if (!(row.normal_mass > 0)) return 0;
    const double approach = row.allowed - row.normal.dot(velocity_of(row) - row.drive);
    const double pressure = std::max(0.0, row.pressure + row.normal_mass * approach);
    const double change = pressure - row.pressure;
    row.pressure = pressure;
    if (change != 0) apply(row, change * row.normal);
    const double largest = std::abs(change) / row.normal_mass;
    if ((pressure == 0 && row.rubbing.isZero(0)) || !(row.slide_mass > 0)) return largest;
    Vec3 slip = velocity_of(row) - row.drive;
    slip -= row.normal * row.normal.dot(slip);
    Vec3 rubbing = row.rubbing - row.slide_mass * slip;
    const double limit = row.friction * pressure, size = rubbing.norm();
    if (size > limit) rubbing *= limit / size;
    const Vec3 push = rubbing - row.rubbing;
    row.rubbing = rubbing;
    apply(row, push);
    return std::max(largest, push.norm() / row.slide_mass);
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
        whole.velocity.setZero();
        whole.centre += whole.shift;
        whole.angular_velocity = whole.turning * whole.owed;
    }
    double fastest = 0;
    for (Row& row : rows_) {
        weigh(row);
        row.before = velocity_of(row);
        fastest = std::max(fastest, (row.before - row.drive).norm());
    }
    // Up and down in turn: what bears a heap is at its bottom.
    std::stable_sort(rows_.begin(), rows_.end(), [&](const Row& a, const Row& b) {
        return task.gravity.dot(a.place) > task.gravity.dot(b.place);
    });
    for (int round = 0; round < most_rounds; ++round) {
        double largest = 0;
        for (std::size_t k = 0; k < rows_.size(); ++k)
            largest = std::max(largest, solve(rows_[round % 2 == 0 ? k : rows_.size() - 1 - k]));
        if (!(largest > enough * fastest)) break;
    }
    outcome.kinetic_energy = exchanged_energy();
    for (const Row& row : rows_) outcome.contacts += row.pressure > 0;
    move_wholes();
    for (meshless::Phyxels* phyxels : phyxels_)
        if (!phyxels->rigid.empty()) meshless::write_phyxels(*phyxels);
    return outcome;
}

// J: each impulse times the mean of the velocities before and after all of them.
double RigidContacts::exchanged_energy() const {
    double sum = 0;
    for (const Row& row : rows_)
        sum += 0.5 * (row.pressure * row.normal + row.rubbing).dot(row.before + velocity_of(row));
    return sum;
}

}  // namespace splitcubes::body
