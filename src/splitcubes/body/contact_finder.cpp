#include <splitcubes/body/contact_finder.h>
#include <splitcubes/body/contact_sides.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace splitcubes::body {

namespace {

using meshless::Contact;
using meshless::ContactSide;

// In phyxel spacings: how far a contact is looked for beyond what speed asks for, and how much of an
// overlap is undone in a step.
constexpr double margin_share = 0.05, lift_share = 0.02;
constexpr double off_share = 0.5;  // of the drawn vertex off the point that its carriers move
constexpr double most_weight = 4;  // sum of the weights' sizes
// Of fresh samples, in place of the number of one before.
constexpr std::int64_t new_sample = -1, no_sample = -2;
constexpr std::size_t list_grain = 256;

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
        now_[b].anew = body.surface_changes().all_anew();
        same = same && now_[b].same_as(listed_[b]);
    }
    return same;
}

void ContactFinder::list_samples(const Task& task, const Parallel& parallel) {
    if (!is_listed(task)) relist(task, parallel);
}

void ContactFinder::relist(const Task& task, const Parallel& parallel) {
    std::size_t count = 0;
    for (const auto& body : task.bodies) count += body->is_carried() ? 0 : body->skin_points().size();
    fresh_.resize(count);
    old_.assign(count, no_sample);
    std::size_t first = 0;
    for (std::uint32_t b = 0; b < task.bodies.size(); ++b) {
        now_[b].first = first;
        if (task.bodies[b]->is_carried()) continue;
        const std::size_t points = task.bodies[b]->skin_points().size();
        const auto list = [&](std::size_t begin, std::size_t end) {
            list_points(*task.bodies[b], b, first, begin, end);
        };
        parallel.for_chunks(points, list_grain, std::cref(list));
        first += points;
    }
    if (std::find(old_.begin(), old_.end(), no_sample) != old_.end()) squeeze_out();
    fresh_carrying_.resize(fresh_.size());
    fresh_parted_.resize(fresh_.size());
    renumber();
    parallel.for_each(fresh_.size(), list_grain, [&](std::size_t k) { take_along(k); });
    samples_.swap(fresh_);
    carrying_.swap(fresh_carrying_);
    drop_known();
    parted_.swap(fresh_parted_);
    listed_.swap(now_);
}

// Samples of a body's points begin .. end - 1, and which of them were samples before: both lists are in
// order of vertices. first: of the body's fresh samples.
void ContactFinder::list_points(const Body& body, std::uint32_t number, std::size_t first, std::size_t begin,
                                std::size_t end) {
    const bool is_known = number < listed_.size();
    const std::size_t last_old = number + 1 < listed_.size() ? listed_[number + 1].first : samples_.size();
    auto old = samples_.begin() + static_cast<std::ptrdiff_t>(is_known ? listed_[number].first : last_old);
    const auto old_end = samples_.begin() + static_cast<std::ptrdiff_t>(last_old);
    const auto is_before = [](const Sample& sample, std::uint32_t vertex) { return sample.vertex < vertex; };
    if (begin < end) old = std::lower_bound(old, old_end, body.skin_points()[begin].vertex, is_before);
    const bool same_nodes = is_known && now_[number].same_nodes(listed_[number]);
    for (std::size_t k = begin; k < end; ++k) {
        const SkinPoint& point = body.skin_points()[k];
        // The list is of the last step: this one may have cut there.
        const splitting::SurfaceVertex& vertex = body.surface().vertices()[point.vertex];
        if (!vertex.alive()) continue;
        while (old != old_end && old->vertex < point.vertex) ++old;
        const bool was_one = old != old_end && old->vertex == point.vertex && old->rest == vertex.rest;
        Sample& sample = fresh_[first + k];
        sample = {number,
                  point.vertex,
                  0,
                  0,
                  vertex.rest,
                  vertex.normal.cast<double>(),
                  body.phyxel_spacing(),
                  vertex.cell,
                  vertex.corners};
        if (was_one && same_nodes && old->cell == vertex.cell && old->corners == vertex.corners) {
            sample.node = old->node;
            sample.piece = old->piece;
        } else {
            sample.piece = body.pieces().piece_of(body.grid(), body.surface().carrier(vertex));
            if (body.phyxels().rigid.index(sample.piece) >= 0) continue;
            sample.node = body.carrying_node(point.vertex);
        }
        old_[first + k] = new_sample;
        if (!was_one || old->node != sample.node || old->piece != sample.piece) continue;
        old_[first + k] = old - samples_.begin();
        // One that is turned is another one to those who know what it is parted from.
        if (old->rest_normal == sample.rest_normal) sample.serial = old->serial;
    }
}

// What is no sample.
void ContactFinder::squeeze_out() {
    std::size_t kept = 0;
    for (std::size_t b = 0, k = 0; b < now_.size(); ++b) {
        const std::size_t end = b + 1 < now_.size() ? now_[b + 1].first : fresh_.size();
        now_[b].first = kept;
        for (; k < end; ++k) {
            if (old_[k] == no_sample) continue;
            fresh_[kept] = fresh_[k];
            old_[kept++] = old_[k];
        }
    }
    fresh_.resize(kept);
    old_.resize(kept);
}

// Gives serial numbers to those that have none yet.
void ContactFinder::renumber() {
    if (serials_ > std::numeric_limits<std::uint32_t>::max() - fresh_.size() - 1) {
        serials_ = 0;
        for (Sample& sample : samples_) sample.serial = 0;
        for (Sample& sample : fresh_) sample.serial = 0;
        drop_known();
    }
    for (Sample& sample : fresh_)
        if (sample.serial == 0) sample.serial = ++serials_;
}

// What was found out about a sample before.
void ContactFinder::take_along(std::size_t k) {
    fresh_carrying_[k] = {};
    fresh_parted_[k] = nullptr;
    if (old_[k] < 0) return;
    const auto before = static_cast<std::size_t>(old_[k]);
    fresh_carrying_[k] = carrying_[before];
    if (samples_[before].serial == fresh_[k].serial) std::swap(fresh_parted_[k], parted_[before]);
}

// What was known of samples that are none any more.
void ContactFinder::drop_known() {
    for (KnownParted*& known : parted_) {
        if (known) free_known_.push_back(known);
        known = nullptr;
    }
}

ContactFinder::KnownParted& ContactFinder::take_known() {
    const std::scoped_lock lock(mutex_);
    if (free_known_.empty()) return known_.emplace_back();
    KnownParted& known = *free_known_.back();
    free_known_.pop_back();
    known = {};
    return known;
}

// Where they are drawn; where skins push on each other, all where their carriers take them.
void ContactFinder::place_samples(const Task& task, const Parallel& parallel) {
    position_.resize(samples_.size());
    normal_.resize(samples_.size());
    placed_.assign(samples_.size(), 0);
    parallel.for_each(samples_.size(), grain, [&](std::size_t k) {
        const Sample& sample = samples_[k];
        position_[k] = task.bodies[sample.body]->vertex_positions()[sample.vertex];
        normal_[k] = task.bodies[sample.body]->vertex_normals()[sample.vertex];
        if (task.options.pieces) find_carriers(task, k);
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
        side = body.carriers_of(sample.vertex, sample.node, sample.piece, sample.body);
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

void ContactFinder::meet_collider(const Task& task, std::size_t number, const ColliderPlaces& places,
                                  std::size_t k, std::vector<Contact>& out) {
    const Collider& collider = task.colliders[number];
    const auto& [before, after, to_before, to_after] = places;
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
        const Isometry before = collider.at(task.time), after = collider.at(task.time + task.dt);
        const ColliderPlaces places{before, after, before.inverse(), after.inverse()};
        in_chunks(parallel, samples_.size(), [&](Chunk& chunk, std::size_t begin, std::size_t end) {
            if (is_far(collider, places.to_before, places.to_after, begin, end)) return;
            for (std::size_t k = begin; k < end; ++k) meet_collider(task, c, places, k, chunk.found);
        });
    }
}

ContactFinder::Chunk& ContactFinder::take_chunk() {
    const std::scoped_lock lock(mutex_);
    if (free_chunks_.empty()) {
        chunks_.push_back(std::make_unique<Chunk>());
        free_chunks_.reserve(chunks_.size());
        return *chunks_.back();
    }
    Chunk& chunk = *free_chunks_.back();
    free_chunks_.pop_back();
    return chunk;
}

void ContactFinder::give_back(Chunk& chunk) {
    const std::scoped_lock lock(mutex_);
    free_chunks_.push_back(&chunk);
}

void ContactFinder::find(const Task& task, const Parallel& parallel, std::vector<ContactGroup>& groups) {
    for (const auto& chunk : chunks_) chunk->found.clear();
    if (task.options.pieces || !task.colliders.empty()) {
        list_samples(task, parallel);
        place_samples(task, parallel);
        meet_colliders(task, parallel);
        if (task.options.pieces) meet_pieces(task, parallel);
    }
    order_.clear();
    for (const auto& chunk : chunks_)
        for (const Contact& contact : chunk->found) order_.push_back({contact.key, &contact});
    sort_found();
    group(task, groups);
}

// By keys, digit by digit (counting sort from the lowest on): they are many, and most of their digits agree.
void ContactFinder::sort_found() {
    constexpr unsigned bits = 11;
    std::uint64_t differ = 0;
    for (const Found& found : order_) differ |= found.key ^ order_[0].key;
    spare_order_.resize(order_.size());
    for (unsigned shift = 0; shift < 64 && differ >> shift != 0; shift += bits) {
        const auto digit = [shift](const Found& found) {
            return static_cast<std::size_t>(found.key >> shift & ((1U << bits) - 1));
        };
        if ((differ >> shift & ((1U << bits) - 1)) == 0) continue;
        std::array<std::uint32_t, (1U << bits) + 1> first{};
        for (const Found& found : order_) ++first[digit(found) + 1];
        std::partial_sum(first.begin(), first.end(), first.begin());
        for (const Found& found : order_) spare_order_[first[digit(found)]++] = found;
        order_.swap(spare_order_);
    }
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
