#include <splitcubes/body/contact_finder.h>
#include <splitcubes/body/contact_sides.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>

namespace splitcubes::body {

namespace {

using meshless::Contact;
using meshless::ContactSide;

// Samples a work chunk; part of no result.
constexpr std::size_t grain = 64;
// In phyxel spacings: how far a contact is looked for beyond what speed asks for, the deepest
// overlap that is believed, how far along the face a sample may be from another piece's
// samples, and how much of an overlap is undone in a step.
constexpr double margin_share = 0.05, deepest_share = 1, beside_share = 0.9, lift_share = 0.02;
constexpr double off_share = 0.5;  // of the drawn vertex off the point that its carriers move
constexpr double most_weight = 4;  // sum of the weights' sizes
constexpr double reach_share = 1.25, most_reach_share = 3;
// Skins that lie opposite; normals of one face.
constexpr double opposite_skins = -0.8, one_face = 0.8;
// Points just below the skin, in cells; and the distance at rest, in spacings, beyond which two
// places of one piece may meet though no cut parts them.
constexpr double below_skin = 0.6, far_at_rest = 4;

// By reference: a function object of its own would be allocated.
template <class Work>
void in_chunks(const Parallel& parallel, std::size_t count, const Work& work) {
    parallel.for_chunks(count, grain, std::cref(work));
}

std::uint64_t key_of(std::uint32_t body, std::size_t other, std::uint32_t vertex) {
    return static_cast<std::uint64_t>(body) << 48 | static_cast<std::uint64_t>(other) << 32 | vertex;
}

}  // namespace

bool ContactFinder::is_listed(const Task& task) {
    now_.assign(task.bodies.size(), {});
    bool same = listed_.size() == now_.size();
    for (std::size_t b = 0; b < now_.size(); ++b) {
        const Body& body = *task.bodies[b];
        now_[b].surface = body.surface().revision();
        now_[b].skin = body.skin_revision();
        now_[b].pieces = body.pieces().count();
        now_[b].rigid = body.phyxels().rigid.bodies.size();
        same = same && now_[b].same_as(listed_[b]);
    }
    return same;
}

void ContactFinder::list_samples(const Task& task, const Parallel& parallel) {
    if (!is_listed(task)) relist(task, parallel);
    place_samples(task, parallel);
}

void ContactFinder::relist(const Task& task, const Parallel& parallel) {
    std::size_t count = 0;
    for (const auto& body : task.bodies) count += body->is_carried() ? 0 : body->skin_points().size();
    fresh_.resize(count);
    old_.assign(count, -2);
    std::size_t first = 0;
    for (std::uint32_t b = 0; b < task.bodies.size(); ++b) {
        const Body& body = *task.bodies[b];
        if (body.is_carried()) continue;
        const auto list = [&](std::size_t k) {
            const SkinPoint& point = body.skin_points()[k];
            // The list is of the last step: this one may have cut there.
            const splitting::SurfaceVertex& vertex = body.surface().vertices()[point.vertex];
            if (!vertex.alive()) return;
            const std::int32_t piece = body.pieces().piece_of(body.grid(), body.surface().carrier(vertex));
            if (body.phyxels().rigid.index(piece) >= 0) return;
            old_[first + k] = -1;
            fresh_[first + k] = {b,
                                 point.vertex,
                                 body.carrying_node(point.vertex),
                                 piece,
                                 vertex.rest,
                                 vertex.normal.cast<double>(),
                                 body.phyxel_spacing()};
        };
        parallel.for_each(body.skin_points().size(), grain, list);
        take_over(b, first, first + body.skin_points().size());
        first += body.skin_points().size();
    }
    // Squeezes out what is no sample.
    std::size_t kept = 0;
    for (std::size_t b = 0, k = 0; b < now_.size(); ++b) {
        now_[b].first = kept;
        for (; k < count && (old_[k] == -2 || fresh_[k].body == b); ++k) {
            if (old_[k] == -2) continue;
            fresh_[kept] = fresh_[k];
            old_[kept++] = old_[k];
        }
    }
    fresh_.resize(kept);
    fresh_carrying_.resize(kept);
    in_chunks(parallel, kept, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
            fresh_carrying_[k] = old_[k] < 0 ? Carrying{} : carrying_[static_cast<std::size_t>(old_[k])];
    });
    samples_.swap(fresh_);
    carrying_.swap(fresh_carrying_);
    listed_.swap(now_);
}

// Which of a body's samples were samples before; both lists are in order of vertices.
void ContactFinder::take_over(std::size_t body, std::size_t first, std::size_t last) {
    if (body >= listed_.size()) return;
    std::size_t old = listed_[body].first;
    for (std::size_t k = first; k < last; ++k) {
        if (old_[k] == -2) continue;
        const Sample& sample = fresh_[k];
        while (old < samples_.size() && samples_[old].body == body && samples_[old].vertex < sample.vertex)
            ++old;
        if (old == samples_.size() || samples_[old].body != body) return;
        const Sample& before = samples_[old];
        if (before.vertex == sample.vertex && before.node == sample.node && before.piece == sample.piece &&
            before.rest == sample.rest)
            old_[k] = static_cast<std::int64_t>(old);
    }
}

// Where they are drawn.
void ContactFinder::place_samples(const Task& task, const Parallel& parallel) {
    position_.resize(samples_.size());
    normal_.resize(samples_.size());
    placed_.assign(samples_.size(), 0);
    parallel.for_each(samples_.size(), grain, [&](std::size_t k) {
        const Sample& sample = samples_[k];
        position_[k] = task.bodies[sample.body]->vertex_positions()[sample.vertex];
        normal_[k] = task.bodies[sample.body]->vertex_normals()[sample.vertex];
    });
}

// Who carries a sample, and where they take it: the point whose way the solve knows, so that what
// pushes it does the work that its way says. The drawn vertex is a little off, by how much the strain
// changes between the two; a gap to it would make energy where a body rolls.
void ContactFinder::find_carriers(const Task& task, std::size_t k) {
    if (placed_[k]) return;
    placed_[k] = 1;
    const Sample& sample = samples_[k];
    Carrying& carrying = carrying_[k];
    const Body& body = *task.bodies[sample.body];
    const meshless::Phyxels& phyxels = body.phyxels();
    const std::uint64_t row = body.nodes().row_revision(sample.node);
    ContactSide& side = carrying.side;
    // What no row tells, but the pieces' phyxels, is looked up again.
    if (side.count == 0 || carrying.row != row || !body.nodes().has_row(sample.node)) {
        side = body.carriers_of(sample.vertex, sample.piece, sample.body);
        carrying.row = row;
        Vec3 rest = Vec3::Zero();
        carrying.weight_sum = 0;
        for (std::uint32_t c = 0; c < side.count; ++c) {
            rest += side.weight[c] * phyxels.rest_position[side.phyxel[c]];
            carrying.weight_sum += std::abs(side.weight[c]);
        }
        carrying.offset = sample.rest - rest;
    }
    if (side.count == 0) return;
    position_[k].setZero();
    for (std::uint32_t c = 0; c < side.count; ++c)
        position_[k] += side.weight[c] * phyxels.position[side.phyxel[c]];
    // Not zero only where few phyxels lie in one plane.
    position_[k] += phyxels.deformation[side.phyxel[0]] * carrying.offset;
}

// Whether the solid is further from all of these samples than they go.
bool ContactFinder::is_far(const Collider& collider, const Isometry& to_before, const Isometry& to_after,
                           std::size_t begin, std::size_t end) const {
    Vec3 low = position_[begin], high = low;
    double most = 0;
    for (std::size_t k = begin; k < end; ++k) {
        low = low.cwiseMin(position_[k]);
        high = high.cwiseMax(position_[k]);
        most = std::max(most, way_[samples_[k].body] + off_share * samples_[k].spacing);
    }
    const Vec3 centre = 0.5 * (low + high);
    const double radius = 0.5 * (high - low).norm();
    const double moved = (to_after * centre - to_before * centre).norm() +
                         (to_after.linear() - to_before.linear()).norm() * radius;
    const double distance = collider.solid->at(to_before * centre).distance;
    return distance - collider.solid->steepness() * radius > (1 + 1e-9) * (most + moved);
}

void ContactFinder::meet_collider(const Task& task, std::size_t number, std::size_t k,
                                  std::vector<Contact>& out) {
    const Collider& collider = task.colliders[number];
    const Isometry before = collider.at(task.time), after = collider.at(task.time + task.dt);
    const Isometry to_before = before.inverse(), to_after = after.inverse();
    const Sample& s = samples_[k];
    const Vec3& position = position_[k];
    const Body& body = *task.bodies[s.body];
    const double moved = (to_after * position - to_before * position).norm();
    const double far = moved + way_[s.body] + off_share * s.spacing;
    if (collider.solid->at(to_before * position).distance > far) return;
    find_carriers(task, k);
    const Vec3 from = to_before * position;
    const std::array<std::span<const Vec3>, 1> velocity = {body.phyxels().velocity};
    ContactSide own = carrying_[k].side;
    own.part = 0;
    const Vec3 v = meshless::side_value(own, velocity);
    const Vec3 to = to_after * (position + task.dt * (v + task.dt * task.gravity));
    const double margin = margin_share * s.spacing;
    if (!(collider.solid->at(from).distance < (to - from).norm() + 2 * margin)) return;
    const double share = geometry::first_contact(*collider.solid, from, to, margin);
    if (!(share <= 1)) return;
    const Vec3 place = from + share * (to - from);
    const geometry::SignedDistance::Sample at = collider.solid->at(place);
    const Vec3 touched = place - at.distance * at.normal;
    Contact contact;
    contact.key = key_of(s.body, number + 1, s.vertex);
    contact.upper = carrying_[k].side;
    contact.normal = after.linear() * at.normal;
    contact.gap = contact.normal.dot(position - before * touched);
    contact.drive = after * touched - before * touched;
    contact.friction = collider.friction;
    contact.lift = lift_share * s.spacing;
    if (contact.normal.allFinite() && std::isfinite(contact.gap)) out.push_back(contact);
}

void ContactFinder::meet_colliders(const Task& task, const Parallel& parallel) {
    // Bounds of the ways of samples in the step; weights have both signs.
    way_.clear();
    for (const auto& body : task.bodies) {
        double top = 0;
        for (const Vec3& v : body->phyxels().velocity) top = std::max(top, v.squaredNorm());
        way_.push_back(task.dt * (most_weight * std::sqrt(top) + task.dt * task.gravity.norm()));
    }
    for (std::size_t c = 0; c < task.colliders.size(); ++c) {
        const Collider& collider = task.colliders[c];
        const Isometry to_before = collider.at(task.time).inverse();
        const Isometry to_after = collider.at(task.time + task.dt).inverse();
        in_chunks(parallel, samples_.size(), [&](std::size_t begin, std::size_t end) {
            if (is_far(collider, to_before, to_after, begin, end)) return;
            for (std::size_t k = begin; k < end; ++k) meet_collider(task, c, k, chunks_[begin / grain].found);
        });
    }
}

// Whether two samples that face each other can be of skins that meet.
bool ContactFinder::may_meet(const Task& task, const Sample& a, const Sample& b) const {
    if (a.body != b.body || a.piece != b.piece) return true;
    if ((a.rest - b.rest).norm() > far_at_rest * a.spacing) return true;
    const double below = below_skin * task.bodies[a.body]->grid().rest().cell_size;
    return task.bodies[a.body]->parted_at_rest(a.rest - below * a.rest_normal,
                                               b.rest - below * b.rest_normal);
}

// The same, looked up once.
bool ContactFinder::may_meet(const Task& task, std::size_t k, Facing& other) const {
    if (other.may == Facing::May::unknown)
        other.may = may_meet(task, samples_[k], samples_[other.index]) ? Facing::May::yes : Facing::May::no;
    return other.may == Facing::May::yes;
}

// The nearest sample whose skin lies opposite; only where there is none, an edge's or a corner's.
ContactFinder::Facing* ContactFinder::partner_of(const Task& task, std::size_t k,
                                                 std::vector<Facing>& facing) const {
    for (;;) {
        Facing* best = nullptr;
        bool opposite = false;
        for (Facing& other : facing) {
            if (other.may == Facing::May::no) continue;
            const bool lies_opposite = other.cosine < opposite_skins;
            if (opposite && !lies_opposite) continue;
            if (best && opposite == lies_opposite && other.distance >= best->distance) continue;
            opposite = lies_opposite;
            best = &other;
        }
        // Few are looked at so: whether a cut parts the two is dear to know.
        if (!best || may_meet(task, k, *best)) return best;
    }
}

bool ContactFinder::meet(const Task& task, std::size_t k, const Reach& reach, Chunk& chunk,
                         Contact& out) const {
    std::vector<Facing>& facing = chunk.facing;
    const Sample& sample = samples_[k];
    const Vec3& position = position_[k];
    // The gap will be a mean of heights above planes: where none of them is low enough to be
    // met within the step, nothing is.
    const double enough = margin_share * sample.spacing + reach.fall +
                          reach.gain * (carrying_[k].weight_sum + reach.widest) + 1e-6 * reach.radius;
    facing.clear();
    bool low = false;
    grid_.visit_facing(k, reach.radius, [&](std::uint32_t other) {
        const Vec3 way = position - position_[other];
        const double along = normal_[other].dot(way);
        low = low || !(along > enough);
        facing.push_back(
            {other, way.squaredNorm(), normal_[k].dot(normal_[other]), along, Facing::May::unknown});
    });
    if (!low) return false;
    std::sort(facing.begin(), facing.end(),
              [](const Facing& a, const Facing& b) { return a.index < b.index; });
    const Facing* const chosen = partner_of(task, k, facing);
    if (!chosen) return false;
    const Sample& partner = samples_[chosen->index];
    const Vec3& partner_normal = normal_[chosen->index];
    const double width = std::sqrt(chosen->distance) + 0.75 * partner.spacing;
    double distance = 0, rest_distance = 0, total = 0;
    Vec3 normal = Vec3::Zero(), middle = Vec3::Zero(), rest_middle = Vec3::Zero();
    chunk.between.clear();
    for (Facing& near : facing) {
        const Sample& other = samples_[near.index];
        if (other.body != partner.body || other.piece != partner.piece) continue;
        const double share = 1 - near.distance / (width * width);
        if (!(share > 0) || !(normal_[near.index].dot(partner_normal) > one_face)) continue;
        if (!may_meet(task, k, near)) continue;
        const double weight = share * share;
        distance += weight * near.along;
        rest_distance += weight * other.rest_normal.dot(sample.rest - other.rest);
        normal += weight * normal_[near.index];
        middle += weight * position_[near.index];
        rest_middle += weight * other.rest;
        total += weight;
        chunk.between.add(carrying_[near.index].side, weight);
    }
    if (!(total > 0) || !(normal.norm() > 0) || chunk.between.empty()) return false;
    distance /= total;
    normal.normalize();
    // What is pushed on is the point of the face that the sample lies before: what the planes' mean says of
    // its distance then is what the two sides' ways say.
    const meshless::Phyxels& phyxels = task.bodies[partner.body]->phyxels();
    const Vec3 foot = position - distance * normal - middle / total;
    Vec3 rest_foot = phyxels.deformation[carrying_[chosen->index].side.phyxel[0]].inverse() * foot;
    if (!(rest_foot.norm() < 2 * beside_share * partner.spacing)) rest_foot.setZero();
    out.lower = chunk.between.take(phyxels.rest_position, rest_middle / total + rest_foot, partner.spacing);
    // Faces that a cut parted lie on each other at rest, however curved: what looks like an overlap there is
    // none.
    if (sample.body == partner.body && (sample.rest - partner.rest).norm() < 2 * sample.spacing)
        distance -= std::min(0.0, rest_distance / total);
    const double spacing = std::max(sample.spacing, partner.spacing);
    const Vec3 way = position - position_[chosen->index];
    if (distance < -deepest_share * spacing || distance > reach.radius) return false;
    if ((way - normal.dot(way) * normal).norm() > beside_share * spacing) return false;
    out.key = key_of(sample.body, 0, sample.vertex);
    out.upper = carrying_[k].side;
    out.normal = normal;
    out.gap = distance;
    out.friction = task.options.friction;
    out.lift = lift_share * std::min(sample.spacing, partner.spacing);
    return true;
}

ContactFinder::Reach ContactFinder::reach_of(const Task& task) const {
    double spacing = 0, top_speed = 0, count = 0, apart = 0;
    Reach out{};
    for (std::size_t k = 0; k < samples_.size(); ++k) {
        spacing = std::max(spacing, samples_[k].spacing);
        out.widest = std::max(out.widest, carrying_[k].weight_sum);
    }
    Vec3 mean = Vec3::Zero();
    for (const std::span<const Vec3> velocity : velocity_)
        for (const Vec3& v : velocity) {
            top_speed = std::max(top_speed, v.norm());
            mean += v;
            ++count;
        }
    mean /= std::max(count, 1.0);
    for (const std::span<const Vec3> velocity : velocity_)
        for (const Vec3& v : velocity) apart = std::max(apart, (v - mean).squaredNorm());
    const double moved = std::min(2 * task.dt * top_speed, (most_reach_share - reach_share) * spacing);
    out.radius = reach_share * spacing + moved;
    out.fall = task.gravity.norm() * task.dt * task.dt;
    // A side's velocity is the mean and no more than so much of what is off it: weights sum to 1.
    out.gain = task.dt * std::sqrt(apart);
    return out;
}

void ContactFinder::meet_pieces(const Task& task, const Parallel& parallel) {
    if (samples_.empty()) return;
    in_chunks(parallel, samples_.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) find_carriers(task, k);
    });
    velocity_.clear();
    for (const auto& body : task.bodies) velocity_.emplace_back(body->phyxels().velocity);
    const Reach reach = reach_of(task);
    grid_.build(position_, normal_, reach.radius);
    in_chunks(parallel, samples_.size(), [&](std::size_t begin, std::size_t end) {
        Chunk& chunk = chunks_[begin / grain];
        for (std::size_t k = begin; k < end; ++k) {
            Contact contact;
            if (!grid_.may_face(k) || !meet(task, k, reach, chunk, contact)) continue;
            const Vec3 v = side_value(contact.upper, velocity_) - side_value(contact.lower, velocity_);
            const double closing = std::max(0.0, -task.dt * contact.normal.dot(v));
            if (contact.gap - closing < margin_share * samples_[k].spacing + reach.fall)
                chunk.found.push_back(contact);
        }
    });
}

void ContactFinder::find(const Task& task, const Parallel& parallel, std::vector<ContactGroup>& groups) {
    for (Chunk& chunk : chunks_) chunk.found.clear();
    if (task.options.pieces || !task.colliders.empty()) {
        list_samples(task, parallel);
        chunks_.resize(std::max(chunks_.size(), (samples_.size() + grain - 1) / grain));
        meet_colliders(task, parallel);
        if (task.options.pieces) meet_pieces(task, parallel);
    }
    order_.clear();
    for (const Chunk& chunk : chunks_)
        for (const Contact& contact : chunk.found) order_.push_back({contact.key, &contact});
    std::sort(order_.begin(), order_.end(), [](const Found& a, const Found& b) { return a.key < b.key; });
    group(task, groups);
}

void ContactFinder::group(const Task& task, std::vector<ContactGroup>& groups) {
    first_.resize(task.bodies.size());
    std::iota(first_.begin(), first_.end(), 0U);
    const auto root = [&](std::uint32_t b) {
        while (first_[b] != b) b = first_[b];
        return b;
    };
    for (const Found& f : order_) {
        const Contact& c = *f.contact;
        if (c.lower.is_collider() || c.lower.part == c.upper.part) continue;
        const std::uint32_t a = root(c.upper.part), b = root(c.lower.part);
        first_[std::max(a, b)] = std::min(a, b);
    }
    for (ContactGroup& group : groups) {
        group.bodies.clear();
        group.contacts.clear();
    }
    std::size_t count = 0;
    group_of_.resize(first_.size());
    part_of_.resize(first_.size());
    for (std::uint32_t b = 0; b < first_.size(); ++b) {
        if (root(b) == b) group_of_[b] = count++;
        group_of_[b] = group_of_[root(b)];
        if (groups.size() < count) groups.emplace_back();
        ContactGroup& group = groups[group_of_[b]];
        part_of_[b] = static_cast<std::uint32_t>(group.bodies.size());
        group.bodies.push_back(b);
    }
    groups.resize(count);
    for (const Found& f : order_) {
        ContactGroup& group = groups[group_of_[f.contact->upper.part]];
        Contact& c = group.contacts.emplace_back(*f.contact);
        c.upper.part = part_of_[c.upper.part];
        if (!c.lower.is_collider()) c.lower.part = part_of_[c.lower.part];
    }
}

}  // namespace splitcubes::body
