// Which skins of pieces and bodies may push on each other.
#include <splitcubes/body/contact_finder.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

namespace {

using meshless::Contact;

// In phyxel spacings: how far a contact is looked for beyond what speed asks for, the deepest
// overlap that is believed, how far along the face a sample may be from another piece's
// samples, and how much of an overlap is undone in a step.
constexpr double margin_share = 0.05, deepest_share = 1, beside_share = 0.9, lift_share = 0.02;
constexpr double reach_share = 1.25, most_reach_share = 3;
// Skins that lie opposite; normals of one face.
constexpr double opposite_skins = -0.8, one_face = 0.8;
// Points just below the skin, in cells; and the distance at rest, in spacings, beyond which two
// places of one piece may meet though no cut parts them.
constexpr double below_skin = 0.6, far_at_rest = 4;

}  // namespace

// Whether a surface stands between points just below two samples of a body. Only one thread asks for
// sample a at a time.
bool ContactFinder::are_parted(const Body& body, std::size_t a, std::size_t b) {
    const double below = below_skin * body.grid().rest().cell_size;
    const Vec3 from = samples_[a].rest - below * samples_[a].rest_normal;
    const Vec3 to = samples_[b].rest - below * samples_[b].rest_normal;
    if (!parted_[a]) parted_[a] = &take_known();
    KnownParted& known = *parted_[a];
    const std::uint32_t serial = samples_[b].serial;
    const auto found = std::find(known.other.begin(), known.other.end(), serial);
    const bool is_known = found != known.other.end();
    auto place = static_cast<std::size_t>(found - known.other.begin());
    if (!is_known) {
        // What is longest unasked gives way.
        const auto oldest = std::min_element(
            known.answer.begin(), known.answer.end(),
            [](const KnownParted::Answer& x, const KnownParted::Answer& y) { return x.when < y.when; });
        place = static_cast<std::size_t>(oldest - known.answer.begin());
        known.other[place] = serial;
    }
    look(body, from, to, is_known, known.answer[place]);
    return known.answer[place].is_parted != 0;
}

// Brings an answer up to date. What is known tells where to look first: at what parted the two, or, where
// nothing did, at what has come since.
void ContactFinder::look(const Body& body, const Vec3& from, const Vec3& to, bool is_known,
                         KnownParted::Answer& answer) {
    const SurfaceChanges& changes = body.surface_changes();
    const geometry::OccluderGrid& occluders = body.occluders();
    const std::uint32_t now = changes.now() & ~(1U << 31);
    const bool is_stale = is_known && changes.since({from.cwiseMin(to), from.cwiseMax(to)}, answer.when);
    const std::uint32_t when = answer.when;
    answer.when = now;
    if (is_known && (!is_stale || (answer.is_parted && occluders.blocks(answer.witness, from, to)))) return;
    // After all changed at once the occluders count anew.
    const bool was_open = is_known && !answer.is_parted && when >= changes.all_anew();
    const std::uint32_t by = occluders.blocker(from, to, was_open ? answer.witness : 0);
    answer.is_parted = by != geometry::OccluderGrid::no_triangle;
    answer.witness = answer.is_parted ? by : occluders.changes();
}

// Whether two samples that face each other can be of skins that meet.
bool ContactFinder::may_meet(const Task& task, std::size_t a, std::size_t b) {
    const Sample &one = samples_[a], &other = samples_[b];
    if (one.body != other.body || one.piece != other.piece) return true;
    if ((one.rest - other.rest).norm() > far_at_rest * one.spacing) return true;
    return are_parted(*task.bodies[one.body], a, b);
}

// The same, looked up once.
bool ContactFinder::may_meet(const Task& task, std::size_t k, Facing& other) {
    if (other.may == Facing::May::unknown)
        other.may = may_meet(task, k, other.index) ? Facing::May::yes : Facing::May::no;
    return other.may == Facing::May::yes;
}

// The nearest sample whose skin lies opposite, of equally near ones the first; only where there is none, an
// edge's or a corner's.
ContactFinder::Facing* ContactFinder::partner_of(const Task& task, std::size_t k,
                                                 std::vector<Facing>& facing) {
    for (;;) {
        Facing* best = nullptr;
        bool opposite = false;
        for (Facing& other : facing) {
            if (other.may == Facing::May::no) continue;
            const bool lies_opposite = other.cosine < opposite_skins;
            if (opposite && !lies_opposite) continue;
            if (best && opposite == lies_opposite &&
                (other.distance > best->distance ||
                 (other.distance == best->distance && other.index > best->index)))
                continue;
            opposite = lies_opposite;
            best = &other;
        }
        // Few are looked at so: whether a cut parts the two is dear to know.
        if (!best || may_meet(task, k, *best)) return best;
    }
}

// The samples that face this one; false where no contact can come of them.
bool ContactFinder::find_facing(std::size_t place, const Reach& reach, Chunk& chunk) const {
    const std::size_t k = grid_.number(place);
    const Sample& sample = samples_[k];
    const Vec3 &position = grid_.point(place), &normal = grid_.normal(place);
    // The gap will be a mean of heights above planes: where none of them is low enough to be
    // met within the step, nothing is.
    const double enough = margin_share * sample.spacing + reach.fall +
                          reach.gain * (carrying_[k].weight_sum + reach.widest) + 1e-6 * reach.radius;
    chunk.facing.clear();
    grid_.find_facing(place, reach.radius, enough, chunk.near);
    bool low = false;
    for (const std::uint32_t other : chunk.near) {
        const Vec3 way = position - grid_.point(other);
        const double along = grid_.normal(other).dot(way);
        low = low || !(along > enough);
        chunk.facing.push_back({grid_.number(other), other, way.squaredNorm(),
                                normal.dot(grid_.normal(other)), along, 0, Facing::May::unknown});
    }
    return low;
}

// Keeps, in order, the samples of the face that the partner is of, with their weights, and returns the
// partner; nullptr where there is none.
const ContactFinder::Sample* ContactFinder::find_face(const Task& task, std::size_t k, Chunk& chunk,
                                                      Facing& chosen) {
    std::vector<Facing>& facing = chunk.facing;
    const Facing* const best = partner_of(task, k, facing);
    if (!best) return nullptr;
    chosen = *best;
    const Sample& partner = samples_[chosen.index];
    const Vec3& partner_normal = grid_.normal(chosen.place);
    const double width = std::sqrt(chosen.distance) + 0.75 * partner.spacing;
    std::erase_if(facing, [&](Facing& near) {
        const double share = 1 - near.distance / (width * width);
        near.weight = share * share;
        // What is told by what lies side by side in memory first.
        if (!(share > 0) || !(grid_.normal(near.place).dot(partner_normal) > one_face)) return true;
        const Sample& other = samples_[near.index];
        return other.body != partner.body || other.piece != partner.piece || !may_meet(task, k, near);
    });
    std::sort(facing.begin(), facing.end(),
              [](const Facing& a, const Facing& b) { return a.index < b.index; });
    return &partner;
}

bool ContactFinder::meet(const Task& task, std::size_t place, const Reach& reach, Chunk& chunk,
                         Contact& out) {
    const std::size_t k = grid_.number(place);
    const Sample& sample = samples_[k];
    const Vec3& position = grid_.point(place);
    Facing chosen{};
    if (!find_facing(place, reach, chunk)) return false;
    const Sample* const found = find_face(task, k, chunk, chosen);
    if (!found) return false;
    const Sample& partner = *found;
    double distance = 0, rest_distance = 0, total = 0;
    Vec3 normal = Vec3::Zero();
    for (const Facing& near : chunk.facing) {
        const Sample& other = samples_[near.index];
        distance += near.weight * near.along;
        rest_distance += near.weight * other.rest_normal.dot(sample.rest - other.rest);
        normal += near.weight * grid_.normal(near.place);
        total += near.weight;
    }
    if (!(total > 0) || !(normal.norm() > 0)) return false;
    distance /= total;
    normal.normalize();
    out.gap = distance;
    out.normal = normal;
    // Faces that a cut parted lie on each other at rest, however curved: what looks like an overlap there is
    // none.
    if (sample.body == partner.body && (sample.rest - partner.rest).norm() < 2 * sample.spacing)
        out.gap -= std::min(0.0, rest_distance / total);
    const double spacing = std::max(sample.spacing, partner.spacing);
    const Vec3 way = position - grid_.point(chosen.place);
    if (out.gap < -deepest_share * spacing || out.gap > reach.radius) return false;
    if ((way - normal.dot(way) * normal).norm() > beside_share * spacing) return false;
    out.upper = carrying_[k].side;
    out.friction = task.options.friction;
    out.lift = lift_share * std::min(sample.spacing, partner.spacing);
    return push_on(task, position - distance * normal, total, chosen, chunk, out);
}

// What is pushed on is the point of the face that the sample lies before: what the planes' mean says of
// its distance then is what the two sides' ways say. foot: m, world; total: of the weights.
bool ContactFinder::push_on(const Task& task, const Vec3& foot, double total, const Facing& chosen,
                            Chunk& chunk, Contact& out) const {
    Vec3 middle = Vec3::Zero(), rest_middle = Vec3::Zero();
    for (const Facing& near : chunk.facing) {
        middle += near.weight * grid_.point(near.place);
        rest_middle += near.weight * samples_[near.index].rest;
        chunk.between.add(carrying_[near.index].side, near.weight);
    }
    if (chunk.between.empty()) return false;
    const Sample& partner = samples_[chosen.index];
    const meshless::Phyxels& phyxels = task.bodies[partner.body]->phyxels();
    Vec3 rest_foot =
        phyxels.deformation[carrying_[chosen.index].side.phyxel[0]].inverse() * (foot - middle / total);
    if (!(rest_foot.norm() < 2 * beside_share * partner.spacing)) rest_foot.setZero();
    out.lower = chunk.between.take(phyxels.rest_position, rest_middle / total + rest_foot, partner.spacing);
    return true;
}

ContactFinder::Reach ContactFinder::reach_of(const Task& task) const {
    double top_speed = 0, count = 0, apart = 0;
    Reach out{};
    for (std::size_t k = 0; k < samples_.size(); ++k) {
        out.spacing = std::max(out.spacing, samples_[k].spacing);
        out.widest = std::max(out.widest, carrying_[k].weight_sum);
    }
    Vec3 mean = Vec3::Zero();
    for (const std::span<const Vec3> velocity : velocity_)
        for (const Vec3& v : velocity) {
            top_speed = std::max(top_speed, v.squaredNorm());
            mean += v;
            ++count;
        }
    top_speed = std::sqrt(top_speed);
    mean /= std::max(count, 1.0);
    for (const std::span<const Vec3> velocity : velocity_)
        for (const Vec3& v : velocity) apart = std::max(apart, (v - mean).squaredNorm());
    const double moved = std::min(2 * task.dt * top_speed, (most_reach_share - reach_share) * out.spacing);
    out.radius = reach_share * out.spacing + moved;
    out.fall = task.gravity.norm() * task.dt * task.dt;
    // A side's velocity is the mean and no more than so much of what is off it: weights sum to 1.
    out.gain = task.dt * std::sqrt(apart);
    return out;
}

void ContactFinder::meet_pieces(const Task& task, const Parallel& parallel) {
    if (samples_.empty()) return;
    velocity_.clear();
    for (const auto& body : task.bodies) velocity_.emplace_back(body->phyxels().velocity);
    const Reach reach = reach_of(task);
    grid_.build(position_, normal_, reach.radius, reach.radius, parallel);
    in_chunks(parallel, samples_.size(), [&](Chunk& chunk, std::size_t begin, std::size_t end) {
        for (std::size_t place = begin; place < end; ++place) {
            if (!grid_.may_face(place, reach.radius)) continue;
            const std::size_t k = grid_.number(place);
            Contact contact;
            if (carrying_[k].side.is_collider() || !meet(task, place, reach, chunk, contact)) continue;
            const Vec3 v = side_value(contact.upper, velocity_) - side_value(contact.lower, velocity_);
            const double closing = std::max(0.0, -task.dt * contact.normal.dot(v));
            if (!(contact.gap - closing < margin_share * samples_[k].spacing + reach.fall)) continue;
            contact.key = key_of(samples_[k].body, 0, samples_[k].vertex);
            chunk.found.push_back(contact);
        }
    });
}

}  // namespace splitcubes::body
