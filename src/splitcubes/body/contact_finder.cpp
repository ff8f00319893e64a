#include <splitcubes/body/contact_finder.h>
#include <splitcubes/body/contact_sides.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>

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
// Normals' product below which skins face each other: an edge or a corner on a face does.
constexpr double facing = -0.4;
// Skins that lie opposite; normals of one face.
constexpr double opposite_skins = -0.8, one_face = 0.8;
// Points just below the skin, in cells; and the distance at rest, in spacings, beyond which two
// places of one piece may meet though no cut parts them.
constexpr double below_skin = 0.6, far_at_rest = 4;

// Contacts of one chunk after the other.
template <class Find>
void collect(const Parallel& parallel, std::size_t count, std::vector<Contact>& out, const Find& find) {
    std::vector<std::vector<Contact>> found((count + grain - 1) / grain);
    parallel.for_chunks(count, grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) find(i, found[begin / grain]);
    });
    for (const auto& part : found) out.insert(out.end(), part.begin(), part.end());
}

std::uint64_t key_of(std::uint32_t body, std::size_t other, std::uint32_t vertex) {
    return static_cast<std::uint64_t>(body) << 48 | static_cast<std::uint64_t>(other) << 32 | vertex;
}

}  // namespace

void ContactFinder::list_samples(const Task& task) {
    samples_.clear();
    for (std::uint32_t b = 0; b < task.bodies.size(); ++b) {
        const Body& body = *task.bodies[b];
        if (body.is_carried()) continue;
        for (const SkinPoint& point : body.skin_points()) {
            // The list is of the last step: this one may have cut there.
            const splitting::SurfaceVertex& vertex = body.surface().vertices()[point.vertex];
            if (!vertex.alive()) continue;
            const std::int32_t piece = body.pieces().piece_of(body.grid(), body.surface().carrier(vertex));
            if (body.phyxels().rigid.index(piece) >= 0) continue;
            samples_.push_back({b,
                                point.vertex,
                                piece,
                                vertex.rest,
                                vertex.normal.cast<double>(),
                                body.vertex_positions()[point.vertex],
                                body.vertex_normals()[point.vertex],
                                body.phyxel_spacing(),
                                {}});
        }
    }
}

// Who carries a sample, and where they take it: the point whose way the solve knows, so that what
// pushes it does the work that its way says. The drawn vertex is a little off, by how much the strain
// changes between the two; a gap to it would make energy where a body rolls.
void ContactFinder::find_carriers(const Task& task, Sample& sample) {
    if (sample.side.count > 0) return;
    const Body& body = *task.bodies[sample.body];
    const meshless::Phyxels& phyxels = body.phyxels();
    sample.side = body.carriers_of(sample.vertex, sample.piece, sample.body);
    if (sample.side.count == 0) return;
    Vec3 rest = Vec3::Zero();
    sample.position.setZero();
    for (std::uint32_t k = 0; k < sample.side.count; ++k) {
        const std::uint32_t i = sample.side.phyxel[k];
        rest += sample.side.weight[k] * phyxels.rest_position[i];
        sample.position += sample.side.weight[k] * phyxels.position[i];
    }
    // Not zero only where few phyxels lie in one plane.
    sample.position += phyxels.deformation[sample.side.phyxel[0]] * (sample.rest - rest);
}

void ContactFinder::meet_colliders(const Task& task, const Parallel& parallel) {
    // Bounds of the ways of samples in the step; weights have both signs.
    std::vector<double> way;
    for (const auto& body : task.bodies) {
        double top = 0;
        for (const Vec3& v : body->phyxels().velocity) top = std::max(top, v.squaredNorm());
        way.push_back(task.dt * (most_weight * std::sqrt(top) + task.dt * task.gravity.norm()));
    }
    for (std::size_t c = 0; c < task.colliders.size(); ++c) {
        const Collider& collider = task.colliders[c];
        const Isometry before = collider.at(task.time), after = collider.at(task.time + task.dt);
        const Isometry to_before = before.inverse(), to_after = after.inverse();
        collect(parallel, samples_.size(), contacts_, [&](std::size_t k, std::vector<Contact>& out) {
            Sample& s = samples_[k];
            const Body& body = *task.bodies[s.body];
            const double moved = (to_after * s.position - to_before * s.position).norm();
            const double far = moved + way[s.body] + off_share * s.spacing;
            if (collider.solid->at(to_before * s.position).distance > far) return;
            find_carriers(task, s);
            const Vec3 from = to_before * s.position;
            const std::array<std::span<const Vec3>, 1> velocity = {body.phyxels().velocity};
            ContactSide own = s.side;
            own.part = 0;
            const Vec3 v = meshless::side_value(own, velocity);
            const Vec3 to = to_after * (s.position + task.dt * (v + task.dt * task.gravity));
            const double margin = margin_share * s.spacing;
            if (!(collider.solid->at(from).distance < (to - from).norm() + 2 * margin)) return;
            const double share = geometry::first_contact(*collider.solid, from, to, margin);
            if (!(share <= 1)) return;
            const Vec3 place = from + share * (to - from);
            const geometry::SignedDistance::Sample at = collider.solid->at(place);
            const Vec3 touched = place - at.distance * at.normal;
            Contact contact;
            contact.key = key_of(s.body, c + 1, s.vertex);
            contact.upper = s.side;
            contact.normal = after.linear() * at.normal;
            contact.gap = contact.normal.dot(s.position - before * touched);
            contact.drive = after * touched - before * touched;
            contact.friction = collider.friction;
            contact.lift = lift_share * s.spacing;
            if (contact.normal.allFinite() && std::isfinite(contact.gap)) out.push_back(contact);
        });
    }
}

// Whether two samples can be of skins that face each other.
bool ContactFinder::may_meet(const Task& task, const Sample& a, const Sample& b) const {
    const double facing_each_other = a.normal.dot(b.normal);
    if (a.body != b.body || a.piece != b.piece) return facing_each_other < facing;
    if (!(facing_each_other < facing)) return false;
    if ((a.rest - b.rest).norm() > far_at_rest * a.spacing) return true;
    const double below = below_skin * task.bodies[a.body]->grid().rest().cell_size;
    return task.bodies[a.body]->parted_at_rest(a.rest - below * a.rest_normal,
                                               b.rest - below * b.rest_normal);
}

bool ContactFinder::meet(const Task& task, const Sample& sample, std::span<const std::uint32_t> near,
                         double reach, Contact& out) const {
    // The nearest sample whose skin lies opposite; only where there is none, an edge's or a corner's.
    const Sample* partner = nullptr;
    double nearest = 1e300;
    bool opposite = false;
    std::vector<std::uint32_t> facing_it;
    for (const std::uint32_t k : near) {
        const Sample& other = samples_[k];
        if (&other == &sample || !may_meet(task, sample, other)) continue;
        facing_it.push_back(k);
        const bool lies_opposite = sample.normal.dot(other.normal) < opposite_skins;
        const double distance = (other.position - sample.position).squaredNorm();
        if (opposite && !lies_opposite) continue;
        if (opposite == lies_opposite && distance >= nearest) continue;
        opposite = lies_opposite;
        nearest = distance;
        partner = &other;
    }
    if (!partner) return false;
    const double width = std::sqrt(nearest) + 0.75 * partner->spacing;
    double distance = 0, rest_distance = 0, total = 0;
    Vec3 normal = Vec3::Zero(), middle = Vec3::Zero(), rest_middle = Vec3::Zero();
    std::vector<ContactSide> sides;
    std::vector<double> weights;
    for (const std::uint32_t k : facing_it) {
        const Sample& other = samples_[k];
        if (other.body != partner->body || other.piece != partner->piece) continue;
        const Vec3 way = sample.position - other.position;
        const double share = 1 - way.squaredNorm() / (width * width);
        if (!(share > 0) || !(other.normal.dot(partner->normal) > one_face)) continue;
        const double weight = share * share;
        distance += weight * other.normal.dot(way);
        rest_distance += weight * other.rest_normal.dot(sample.rest - other.rest);
        normal += weight * other.normal;
        middle += weight * other.position;
        rest_middle += weight * other.rest;
        total += weight;
        sides.push_back(other.side);
        weights.push_back(weight);
    }
    if (!(total > 0) || !(normal.norm() > 0)) return false;
    distance /= total;
    normal.normalize();
    // What is pushed on is the point of the face that the sample lies before: what the planes' mean says of
    // its distance then is what the two sides' ways say.
    const meshless::Phyxels& phyxels = task.bodies[partner->body]->phyxels();
    const Vec3 foot = sample.position - distance * normal - middle / total;
    Vec3 rest_foot = phyxels.deformation[partner->side.phyxel[0]].inverse() * foot;
    if (!(rest_foot.norm() < 2 * beside_share * partner->spacing)) rest_foot.setZero();
    out.lower = side_between(sides, weights, phyxels.rest_position, rest_middle / total + rest_foot,
                             partner->spacing);
    // Faces that a cut parted lie on each other at rest, however curved: what looks like an overlap there is
    // none.
    if (sample.body == partner->body && (sample.rest - partner->rest).norm() < 2 * sample.spacing)
        distance -= std::min(0.0, rest_distance / total);
    const double spacing = std::max(sample.spacing, partner->spacing);
    const Vec3 way = sample.position - partner->position;
    if (distance < -deepest_share * spacing || distance > reach) return false;
    if ((way - normal.dot(way) * normal).norm() > beside_share * spacing) return false;
    out.key = key_of(sample.body, 0, sample.vertex);
    out.upper = sample.side;
    out.normal = normal;
    out.gap = distance;
    out.friction = task.options.friction;
    out.lift = lift_share * std::min(sample.spacing, partner->spacing);
    return true;
}

void ContactFinder::meet_pieces(const Task& task, const Parallel& parallel) {
    bool any = task.bodies.size() > 1;
    for (const auto& body : task.bodies)
        any = any || body->cut_edge_count() > 0 || body->pieces().count() > 1;
    if (!any || samples_.empty()) return;
    parallel.for_chunks(samples_.size(), grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) find_carriers(task, samples_[k]);
    });
    std::vector<Vec3> positions;
    double spacing = 0, top_speed = 0;
    for (const Sample& s : samples_) {
        positions.push_back(s.position);
        spacing = std::max(spacing, s.spacing);
    }
    std::vector<std::span<const Vec3>> velocity;
    for (const auto& body : task.bodies) {
        velocity.emplace_back(body->phyxels().velocity);
        for (const Vec3& v : body->phyxels().velocity) top_speed = std::max(top_speed, v.norm());
    }
    const double moved = std::min(2 * task.dt * top_speed, (most_reach_share - reach_share) * spacing);
    const double reach = reach_share * spacing + moved;
    const meshless::PhyxelLocator locator(positions, reach);
    const double fall = task.gravity.norm() * task.dt * task.dt;
    collect(parallel, samples_.size(), contacts_, [&](std::size_t k, std::vector<Contact>& out) {
        const Sample& sample = samples_[k];
        std::vector<std::uint32_t> near;
        locator.near(sample.position, reach, near);
        Contact contact;
        if (!meet(task, sample, near, reach, contact)) return;
        const Vec3 v = side_value(contact.upper, velocity) - side_value(contact.lower, velocity);
        const double closing = std::max(0.0, -task.dt * contact.normal.dot(v));
        if (contact.gap - closing < margin_share * sample.spacing + fall) out.push_back(contact);
    });
}

std::vector<ContactGroup> ContactFinder::find(const Task& task, const Parallel& parallel) {
    contacts_.clear();
    samples_.clear();
    if (task.options.pieces || !task.colliders.empty()) list_samples(task);
    meet_colliders(task, parallel);
    if (task.options.pieces) meet_pieces(task, parallel);
    std::sort(contacts_.begin(), contacts_.end(),
              [](const Contact& a, const Contact& b) { return a.key < b.key; });
    return grouped(task);
}

std::vector<ContactGroup> ContactFinder::grouped(const Task& task) {
    std::vector<std::uint32_t> first(task.bodies.size());
    std::iota(first.begin(), first.end(), 0U);
    const auto root = [&](std::uint32_t b) {
        while (first[b] != b) b = first[b];
        return b;
    };
    for (const Contact& c : contacts_) {
        if (c.lower.is_collider() || c.lower.part == c.upper.part) continue;
        const std::uint32_t a = root(c.upper.part), b = root(c.lower.part);
        first[std::max(a, b)] = std::min(a, b);
    }
    std::vector<ContactGroup> groups;
    std::vector<std::size_t> group_of(first.size());
    std::vector<std::uint32_t> part_of(first.size());
    for (std::uint32_t b = 0; b < first.size(); ++b) {
        if (root(b) == b) {
            group_of[b] = groups.size();
            groups.emplace_back();
        }
        group_of[b] = group_of[root(b)];
        part_of[b] = static_cast<std::uint32_t>(groups[group_of[b]].bodies.size());
        groups[group_of[b]].bodies.push_back(b);
    }
    for (Contact c : contacts_) {
        ContactGroup& group = groups[group_of[c.upper.part]];
        c.upper.part = part_of[c.upper.part];
        if (!c.lower.is_collider()) c.lower.part = part_of[c.lower.part];
        group.contacts.push_back(c);
    }
    return groups;
}

}  // namespace splitcubes::body
