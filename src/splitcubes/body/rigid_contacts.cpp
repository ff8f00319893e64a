#include <splitcubes/body/rigid_contacts.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace splitcubes::body {

namespace {

using meshless::ContactSide;
using meshless::RigidPiece;

// In phyxel spacings, as of ContactFinder: how far skin is looked for, how deep an overlap is
// believed, how far off a sample a point may lie along the face.
constexpr double reach_share = 1.25, deepest_share = 1, beside_share = 0.9, margin_share = 0.05;
// Of an overlap that was there before, what is undone in a step: in spacings, and in its depths.
constexpr double lift_share = 0.005, depth_share = 0.1;
// In lifts: passing by less is rounding.
constexpr double least_share = 1e-3;
// In spacings: how far skin or a rigid piece is believed to go in a step.
constexpr double most_way = 2;
// In spacings: from how far an obstacle bears what is pushed towards it.
constexpr double bearing_share = 0.02;
constexpr double one_face = 0.8;
constexpr int placing_rounds = 30, most_rounds = 200;

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

RigidPiece& RigidContacts::piece_of(const Crumb& crumb) const {
    return phyxels_[crumb.body]->rigid.bodies[crumb.index];
}

void RigidContacts::list_crumbs(const Task& task) {
    crumbs_.clear();
    phyxels_.clear();
    skin_way_ = spacing_ = 0;
    const double fall = task.dt * task.dt * task.gravity.norm();
    for (std::uint32_t b = 0; b < task.bodies.size(); ++b) {
        Body& body = *task.bodies[b];
        phyxels_.push_back(&body.phyxels());
        if (body.is_carried()) continue;
        spacing_ = std::max(spacing_, body.phyxel_spacing());
        double top = 0;
        for (const Vec3& v : body.phyxels().velocity) top = std::max(top, v.squaredNorm());
        skin_way_ = std::max(skin_way_, task.dt * std::sqrt(top) + fall);
        const meshless::RigidPieces& rigid = body.phyxels().rigid;
        for (std::uint32_t k = 0; k < rigid.bodies.size(); ++k) {
            const RigidPiece& piece = rigid.bodies[k];
            Crumb crumb;
            crumb.body = b;
            crumb.index = k;
            for (const Vec3& point : rigid.points_of(piece)) {
                crumb.radius = std::max(crumb.radius, point.norm());
                crumb.low = crumb.low.cwiseMin(point);
                crumb.high = crumb.high.cwiseMax(point);
            }
            const double speed = piece.velocity().norm() + piece.angular_velocity().norm() * crumb.radius;
            crumb.way = std::min(task.dt * speed + fall, most_way * body.phyxel_spacing());
            if (piece.centre.allFinite() && std::isfinite(speed)) crumbs_.push_back(std::move(crumb));
        }
    }
    skin_way_ = std::min(skin_way_, most_way * spacing_);
}

// By the cells that their centres are in, as wide as the farthest that two can meet.
void RigidContacts::sort_crumbs() {
    double widest = 0;
    around_ = {};
    for (const Crumb& crumb : crumbs_) widest = std::max(widest, crumb.radius + crumb.way);
    cell_ = widest + std::max(widest, reach_share * spacing_ + skin_way_);
    sorted_.clear();
    for (std::uint32_t k = 0; k < crumbs_.size(); ++k) {
        const Vec3& centre = piece_of(crumbs_[k]).centre;
        around_.add(centre);
        const Eigen::Array3d at = (centre / cell_).array().floor().max(-1e9).min(1e9);
        sorted_.push_back({{static_cast<int>(at[0]), static_cast<int>(at[1]), static_cast<int>(at[2])}, k});
    }
    std::sort(sorted_.begin(), sorted_.end());
    around_ = around_.grown(cell_);
}

template <class Visit>
void RigidContacts::visit_near(const Vec3& place, const Visit& visit) const {
    const Eigen::Array3d at = (place / cell_).array().floor().max(-1e9).min(1e9);
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y) {
            const std::array<int, 3> first = {static_cast<int>(at[0]) + x, static_cast<int>(at[1]) + y,
                                              static_cast<int>(at[2]) - 1};
            auto found = std::lower_bound(sorted_.begin(), sorted_.end(), std::pair{first, 0U});
            for (; found != sorted_.end(); ++found) {
                if (found->first[0] != first[0] || found->first[1] != first[1] ||
                    found->first[2] > first[2] + 2)
                    break;
                visit(found->second);
            }
        }
}

// Samples of elastic skin that rigid pieces may meet.
void RigidContacts::list_samples(const Task& task) {
    samples_.clear();
    for (std::uint32_t b = 0; b < task.bodies.size(); ++b) {
        const Body& body = *task.bodies[b];
        if (body.is_carried()) continue;
        const double reach = reach_share * body.phyxel_spacing() + skin_way_;
        for (const SkinPoint& point : body.skin_points()) {
            const Vec3& position = body.vertex_positions()[point.vertex];
            if (!around_.contains(position)) continue;
            // The list is of the last step: this one may have cut there.
            const splitting::SurfaceVertex& vertex = body.surface().vertices()[point.vertex];
            if (!vertex.alive()) continue;
            bool listed = false, elastic = false;
            visit_near(position, [&](std::uint32_t k) {
                Crumb& crumb = crumbs_[k];
                const double far = crumb.radius + crumb.way + reach;
                if ((position - piece_of(crumb).centre).squaredNorm() > far * far) return;
                if (!listed) {
                    listed = true;
                    const std::int32_t piece =
                        body.pieces().piece_of(body.grid(), body.surface().carrier(vertex));
                    elastic = body.phyxels().rigid.index(piece) < 0;
                    if (elastic)
                        samples_.push_back(
                            {b, point.vertex, piece, position, body.vertex_normals()[point.vertex], {}});
                }
                if (elastic) crumb.near.push_back(static_cast<std::uint32_t>(samples_.size() - 1));
            });
        }
    }
}

void RigidContacts::find(const Task& task) {
    rows_.clear();
    wholes_.clear();
    list_crumbs(task);
    if (crumbs_.empty()) return;
    sort_crumbs();
    list_samples(task);
    for (std::uint32_t k = 0; k < crumbs_.size(); ++k) {
        const meshless::RigidPieces& rigid = phyxels_[crumbs_[k].body]->rigid;
        if (!crumbs_[k].near.empty())
            for (const Vec3& own : rigid.points_of(rigid.bodies[crumbs_[k].index])) meet_skin(task, k, own);
        std::vector<std::uint32_t> others;
        visit_near(piece_of(crumbs_[k]).centre, [&](std::uint32_t other) {
            if (other > k) others.push_back(other);
        });
        std::sort(others.begin(), others.end());
        for (const std::uint32_t other : others) meet_crumb(task, k, other);
    }
}

// A point against the mean of the planes through the samples around the one that it lies before.
void RigidContacts::meet_skin(const Task& task, std::uint32_t number, const Vec3& own) {
    const Crumb& crumb = crumbs_[number];
    const RigidPiece& piece = piece_of(crumb);
    const Vec3 place = piece.place_of(own);
    const Vec3 outwards = piece.rotation * own;
    Sample* partner = nullptr;
    double nearest = 1e300;
    for (const std::uint32_t k : crumb.near) {
        Sample& sample = samples_[k];
        const double distance = (sample.position - place).squaredNorm();
        if (distance >= nearest || !(sample.normal.dot(outwards) <= 0)) continue;
        nearest = distance;
        partner = &sample;
    }
    if (!partner) return;
    const Body& body = *task.bodies[partner->body];
    const double spacing = body.phyxel_spacing();
    const double width = std::sqrt(nearest) + 0.75 * spacing;
    double distance = 0, total = 0;
    Vec3 normal = Vec3::Zero();
    for (const std::uint32_t k : crumb.near) {
        const Sample& sample = samples_[k];
        if (sample.body != partner->body || sample.piece != partner->piece) continue;
        const double share = 1 - (sample.position - place).squaredNorm() / (width * width);
        if (!(share > 0) || !(sample.normal.dot(partner->normal) > one_face)) continue;
        distance += share * share * sample.normal.dot(place - sample.position);
        normal += share * share * sample.normal;
        total += share * share;
    }
    if (!(total > 0) || !(normal.norm() > 0)) return;
    distance /= total;
    normal.normalize();
    const Vec3 off = place - partner->position;
    if (distance < -deepest_share * spacing ||
        (off - normal.dot(off) * normal).norm() > beside_share * spacing)
        return;
    if (distance > margin_share * spacing + crumb.way + skin_way_) return;
    Row row;
    row.upper = number;
    if (partner->side.count == 0)
        partner->side = body.carriers_of(partner->vertex, partner->piece, partner->body);
    row.side = partner->side;
    row.whole = whole_of(partner->body, partner->piece);
    row.own = own;
    row.normal = normal;
    row.gap = distance;
    row.lift = lift_share * spacing + depth_share * std::max(-distance, 0.0);
    row.friction = task.friction;
    Vec3 lower = Vec3::Zero();
    for (std::uint32_t k = 0; k < row.side.count; ++k)
        lower += row.side.weight[k] * body.phyxels().position[row.side.phyxel[k]];
    row.lower_own = place - lower;
    if (row.side.count > 0 && normal.allFinite() && row.lower_own.allFinite()) rows_.push_back(row);
}

// The face of the lower's box that the upper's points are farthest out of, or least within.
RigidContacts::Face RigidContacts::face_between(const Crumb& upper, const Crumb& lower) const {
    const RigidPiece& moving = piece_of(upper);
    const RigidPiece& box = piece_of(lower);
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const Vec3& own : phyxels_[upper.body]->rigid.points_of(moving)) {
        const Vec3 place = box.rotation.transpose() * (moving.place_of(own) - box.centre);
        low = low.cwiseMin(place);
        high = high.cwiseMax(place);
    }
    Face best;
    for (int axis = 0; axis < 3; ++axis)
        for (const int sign : {-1, 1}) {
            const double gap = sign > 0 ? low[axis] - lower.high[axis] : lower.low[axis] - high[axis];
            if (gap > best.gap) best = {axis, sign, gap};
        }
    return best;
}

// Points of one against a face of the other's box, of that which tells them apart best.
void RigidContacts::meet_crumb(const Task& task, std::uint32_t first, std::uint32_t second) {
    const Crumb& a = crumbs_[first];
    const Crumb& b = crumbs_[second];
    const double ways = a.way + b.way, far = a.radius + b.radius + ways;
    if ((piece_of(a).centre - piece_of(b).centre).squaredNorm() > far * far) return;
    const double spacing =
        std::min(task.bodies[a.body]->phyxel_spacing(), task.bodies[b.body]->phyxel_spacing());
    const double near = margin_share * spacing + ways;
    const Face of_second = face_between(a, b), of_first = face_between(b, a);
    const bool takes_second = of_second.gap >= of_first.gap;
    const Face face = takes_second ? of_second : of_first;
    if (face.gap > near) return;
    const std::uint32_t upper = takes_second ? first : second, lower = takes_second ? second : first;
    const RigidPiece& moving = piece_of(crumbs_[upper]);
    const RigidPiece& box = piece_of(crumbs_[lower]);
    const Vec3 normal = face.sign * Vec3::Unit(face.axis);
    const Vec3 low = crumbs_[lower].low - Vec3::Constant(margin_share * spacing);
    const Vec3 high = crumbs_[lower].high + Vec3::Constant(margin_share * spacing);
    const std::size_t before = rows_.size();
    // Where no point lies before the face itself, all do: edges cross.
    for (const bool strict : {true, false}) {
        if (rows_.size() > before) break;
        for (const Vec3& own : phyxels_[crumbs_[upper].body]->rigid.points_of(moving)) {
            const Vec3 place = moving.place_of(own);
            const Vec3 in_box = box.rotation.transpose() * (place - box.centre);
            const double extent =
                face.sign > 0 ? crumbs_[lower].high[face.axis] : -crumbs_[lower].low[face.axis];
            const double distance = normal.dot(in_box) - extent;
            bool beside = false;
            for (int axis = 0; axis < 3; ++axis)
                beside =
                    beside || (axis != face.axis && (in_box[axis] < low[axis] || in_box[axis] > high[axis]));
            if (distance > near || (strict && beside)) continue;
            Row row;
            row.upper = upper;
            row.lower = static_cast<std::int32_t>(lower);
            row.own = own;
            row.lower_own = in_box - distance * normal;
            row.normal = box.rotation * normal;
            row.gap = distance;
            row.lift = lift_share * spacing + depth_share * std::max(-distance, 0.0);
            row.friction = task.friction;
            row.start = place - box.place_of(row.lower_own);
            if (row.start.allFinite()) rows_.push_back(row);
        }
    }
}

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

std::int32_t RigidContacts::whole_of(std::uint32_t body, std::int32_t piece) {
    for (std::size_t k = 0; k < wholes_.size(); ++k)
        if (wholes_[k].body == body && wholes_[k].piece == piece) return static_cast<std::int32_t>(k);
    wholes_.emplace_back();
    wholes_.back().body = body;
    wholes_.back().piece = piece;
    return static_cast<std::int32_t>(wholes_.size() - 1);
}

// After the step. `velocity` is that of the centre until the pushes begin.
void RigidContacts::weigh_wholes(const Task& task) {
    for (Whole& whole : wholes_) {
        const meshless::Phyxels& phyxels = *phyxels_[whole.body];
        const std::span<const std::uint8_t> held = task.bodies[whole.body]->held();
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            if (phyxels.piece[i] != whole.piece) continue;
            whole.held = whole.held || (!held.empty() && held[i] != 0);
            whole.mass += phyxels.mass[i];
            whole.centre += phyxels.mass[i] * phyxels.position[i];
            whole.velocity += phyxels.mass[i] * phyxels.velocity[i];
        }
        if (!(whole.mass > 0)) continue;
        whole.centre /= whole.mass;
        whole.velocity /= whole.mass;
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            if (phyxels.piece[i] != whole.piece) continue;
            const Vec3 arm = phyxels.position[i] - whole.centre;
            whole.inertia += phyxels.mass[i] * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
        }
        for (int axis = 0; axis < 3; ++axis)
            whole.turning.col(axis) = meshless::angular_velocity(whole.inertia, Vec3::Unit(axis));
        whole.turning = (0.5 * (whole.turning + whole.turning.transpose())).eval();
        Vec3 spin = Vec3::Zero();
        for (std::size_t i = 0; i < phyxels.size(); ++i)
            if (phyxels.piece[i] == whole.piece)
                spin += phyxels.mass[i] * (phyxels.position[i] - whole.centre).cross(phyxels.velocity[i]);
        whole.turns = whole.turning * spin;
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
        if (!(largest > 1e-5 * fastest)) break;
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
