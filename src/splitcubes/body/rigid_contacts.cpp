// What rigid pieces may meet in a step.
#include <splitcubes/body/rigid_contacts.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace splitcubes::body {

namespace {

using meshless::RigidPiece;

// In phyxel spacings, as of ContactFinder: how far skin is looked for, how deep an overlap is
// believed, how far off a sample a point may lie along the face.
constexpr double reach_share = 1.25, deepest_share = 1, beside_share = 0.9, margin_share = 0.05;
// Of an overlap that was there before, what is undone in a step: in spacings, and in its depths.
constexpr double lift_share = 0.005, depth_share = 0.1;
// In spacings: how far skin or a rigid piece is believed to go in a step.
constexpr double most_way = 2;
constexpr double one_face = 0.8;

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
        partner->side = body.carriers_of(partner->vertex, body.carrying_node(partner->vertex), partner->piece,
                                         partner->body);
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

std::int32_t RigidContacts::whole_of(std::uint32_t body, std::int32_t piece) {
    for (std::size_t k = 0; k < wholes_.size(); ++k)
        if (wholes_[k].body == body && wholes_[k].piece == piece) return static_cast<std::int32_t>(k);
    wholes_.emplace_back();
    wholes_.back().body = body;
    wholes_.back().piece = piece;
    return static_cast<std::int32_t>(wholes_.size() - 1);
}

}  // namespace splitcubes::body
