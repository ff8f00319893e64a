// Contacts between the surfaces of pieces and bodies.
#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/collider_contact.h>
#include <splitcubes/contact/detection/contact_finder.h>
#include <splitcubes/contact/detection/surface_changes.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/geometry/occluder_grid.h>
#include <splitcubes/node_motion/surface_motion.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/splitting/node_grid.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace splitcubes::body {

namespace {

using meshless::Contact;

constexpr double unlimited = std::numeric_limits<double>::infinity();

}  // namespace

// Updates the interval in which answers hold: those since known.from are valid at change `now`.
void ContactFinder::update_interval(const SurfaceChanges& changes, std::uint32_t now,
                                    KnownSeparations& known) {
    if (known.until == now) return;
    if (known.bounds.empty() || changes.since(known.bounds, known.until)) known.from = now;
    known.until = now;
}

// Returns whether a surface separates the points just below two samples of a body. At most one thread at a
// time may query a given sample a.
bool ContactFinder::are_separated(const BodyView& body, std::size_t a, std::size_t b) {
    KnownSeparations*& kept = slots_.separations[list_.samples[a].slot];
    if (!kept) kept = &take_known();
    KnownSeparations& known = *kept;
    const std::uint32_t serial = list_.samples[b].serial;
    // Without an early exit, so that the loop vectorises.
    std::size_t slot = KnownSeparations::size;
    for (std::size_t n = 0; n < KnownSeparations::size; ++n) slot = known.other[n] == serial ? n : slot;
    const bool is_known = slot < KnownSeparations::size;
    if (!is_known) {
        // Replaces the answer that was not used for the longest time.
        const auto oldest =
            std::min_element(known.answer.begin(), known.answer.end(),
                             [](const KnownSeparations::Answer& x, const KnownSeparations::Answer& y) {
                                 return x.last_change < y.last_change;
                             });
        slot = static_cast<std::size_t>(oldest - known.answer.begin());
        known.other[slot] = serial;
    }
    KnownSeparations::Answer& answer = known.answer[slot];
    const std::uint32_t now = body.surface_changes.now() & ~(1U << 31);
    update_interval(body.surface_changes, now, known);
    if (is_known && answer.last_change >= known.from) {
        answer.last_change = now;
        return answer.is_separated != 0;
    }
    const double below = tuning::contacts::depth_below_surface * body.grid.rest().cell_size;
    const Vec3 from = list_.samples[a].rest - below * list_.samples[a].rest_normal.cast<double>();
    const Vec3 to = list_.samples[b].rest - below * list_.samples[b].rest_normal.cast<double>();
    update_answer(body, from, to, is_known, answer);
    known.bounds.add(from);
    known.bounds.add(to);
    return answer.is_separated != 0;
}

// Updates an answer. Tests first what is likely to decide it: the occluder that separated the two, or else
// only the occluders that are newer than the answer.
void ContactFinder::update_answer(const BodyView& body, const Vec3& from, const Vec3& to, bool is_known,
                                  KnownSeparations::Answer& answer) {
    const SurfaceChanges& changes = body.surface_changes;
    const geometry::OccluderGrid& occluders = body.occluders;
    const std::uint32_t now = changes.now() & ~(1U << 31);
    const bool is_stale =
        is_known && changes.since({from.cwiseMin(to), from.cwiseMax(to)}, answer.last_change);
    const std::uint32_t last_change = answer.last_change;
    answer.last_change = now;
    if (is_known && (!is_stale || (answer.is_separated && occluders.blocks(answer.witness, from, to))))
        return;
    // After a full change the occluders restart their change counter.
    const bool was_open = is_known && !answer.is_separated && last_change >= changes.last_full_change();
    const std::uint32_t by = occluders.blocker(from, to, was_open ? answer.witness : 0);
    answer.is_separated = by != geometry::OccluderGrid::no_triangle;
    answer.witness = answer.is_separated ? by : occluders.changes();
}

// Returns whether two samples that face each other can touch.
bool ContactFinder::may_meet(const Task& task, std::size_t a, std::size_t b) {
    const Sample &one = list_.samples[a], &other = list_.samples[b];
    if (one.body != other.body || one.piece != other.piece) return true;
    // The two faces of a cut through a cell.
    if (one.cell == other.cell && (one.corners & other.corners) == 0) return true;
    if ((one.rest - other.rest).norm() > tuning::contacts::far_at_rest * spacing_of(one)) return true;
    return are_separated(task.bodies[one.body], a, b);
}

// Returns the same for entry n of chunk.faced, evaluated once per sample k.
bool ContactFinder::may_meet(const Task& task, std::size_t k, std::size_t n, Chunk& chunk) {
    if (chunk.may[n] == May::unknown)
        chunk.may[n] = may_meet(task, k, grid_.index(chunk.faced[n].entry)) ? May::yes : May::no;
    return chunk.may[n] == May::yes;
}

// Returns the nearest sample whose surface lies opposite, the first of equally near ones; samples of edges
// and corners count only if there is none. nullptr if no sample can meet sample k.
const SampleGrid::FacingPoint* ContactFinder::partner_of(const Task& task, std::size_t k, Chunk& chunk) {
    const auto is_worse = [&](std::uint64_t a, std::uint64_t b) {
        const SampleGrid::FacingPoint &one = chunk.faced[a], &other = chunk.faced[b];
        const bool lies_opposite = one.cosine < tuning::contacts::opposite_cosine;
        if (lies_opposite != (other.cosine < tuning::contacts::opposite_cosine)) return !lies_opposite;
        if (one.squared_distance != other.squared_distance)
            return one.squared_distance > other.squared_distance;
        return grid_.index(one.entry) > grid_.index(other.entry);
    };
    if (chunk.faced.empty()) return nullptr;
    // The best candidate mostly passes; testing for separation and sorting are both expensive.
    std::uint64_t best = 0;
    for (std::uint64_t n = 1; n < chunk.faced.size(); ++n)
        if (is_worse(best, n)) best = n;
    if (may_meet(task, k, best, chunk)) return &chunk.faced[best];
    chunk.order.resize(chunk.faced.size());
    std::iota(chunk.order.begin(), chunk.order.end(), std::uint64_t{0});
    std::erase(chunk.order, best);
    std::make_heap(chunk.order.begin(), chunk.order.end(), is_worse);
    while (!chunk.order.empty()) {
        best = chunk.order.front();
        if (may_meet(task, k, best, chunk)) return &chunk.faced[best];
        std::pop_heap(chunk.order.begin(), chunk.order.end(), is_worse);
        chunk.order.pop_back();
    }
    return nullptr;
}

// Returns the gap (m) at the end of the step, by the predicted displacements, below which a contact is
// listed.
double ContactFinder::speculative_gap(std::size_t k, const SearchRange& range) const {
    return tuning::contacts::speculative_share * spacing_of(list_.samples[k]) + range.fall;
}

// Finds the samples within `radius` (m) that face this one. Returns false if they can make no contact.
bool ContactFinder::find_facing(std::size_t entry, double radius, const SearchRange& range,
                                Chunk& chunk) const {
    const std::size_t k = grid_.index(entry);
    // The gap will be a mean of heights above planes: without one that is low enough there is no contact.
    const double limit = speculative_gap(k, range) + 1e-6 * range.radius;
    grid_.find_facing(entry, radius, limit, chunk.near, chunk.faced);
    chunk.may.assign(chunk.faced.size(), May::unknown);
    return std::any_of(chunk.faced.begin(), chunk.faced.end(),
                       [&](const SampleGrid::FacingPoint& other) { return !(other.end_height > limit); });
}

// Returns how far from a sample the partner's face is followed, m.
double ContactFinder::width_of(std::size_t k, const SampleGrid::FacingPoint& partner,
                               const SearchRange& range) const {
    const double width =
        std::sqrt(partner.squared_distance) +
        tuning::contacts::face_reach_share * spacing_of(list_.samples[grid_.index(partner.entry)]);
    return std::min(width, range.radius + motions_[k].extra_reach);
}

// Returns the partner of a sample, or nullptr; fills chunk.faced at least as far as the partner's face is
// followed.
const SampleGrid::FacingPoint* ContactFinder::find_partner(const Task& task, std::size_t entry,
                                                           const SearchRange& range, Chunk& chunk) {
    const std::size_t k = grid_.index(entry);
    const double near = tuning::contacts::first_reach_share * range.spacing;
    const SampleGrid::FacingPoint* const found =
        find_facing(entry, near, range, chunk) ? partner_of(task, k, chunk) : nullptr;
    // No farther sample can be a better partner.
    if (found && found->cosine < tuning::contacts::opposite_cosine)
        return widen(entry, *found, near, range, chunk);
    return find_facing(entry, unlimited, range, chunk) ? partner_of(task, k, chunk) : nullptr;
}

// Returns the same partner after extending chunk.faced to the width of its face, if that is more than `near`
// (m).
const SampleGrid::FacingPoint* ContactFinder::widen(std::size_t entry, const SampleGrid::FacingPoint& partner,
                                                    double near, const SearchRange& range,
                                                    Chunk& chunk) const {
    const double width = width_of(grid_.index(entry), partner, range);
    if (width <= near) return &partner;
    const std::uint32_t which = partner.entry;
    find_facing(entry, width, range, chunk);
    const auto found =
        std::find_if(chunk.faced.begin(), chunk.faced.end(),
                     [&](const SampleGrid::FacingPoint& other) { return other.entry == which; });
    return found == chunk.faced.end() ? nullptr : &*found;
}

// Lists the samples of the partner's face with their weights. A cut between the sample and its partner also
// separates the sample from the partner's neighbours, unless these lie farther behind: they may be the other
// side of the sample's own wall.
void ContactFinder::find_face(const Task& task, std::size_t k, const SampleGrid::FacingPoint& chosen,
                              const SearchRange& range, Chunk& chunk) {
    const double behind = chosen.height - tuning::contacts::behind_share * spacing_of(list_.samples[k]);
    const Sample& partner = list_.samples[grid_.index(chosen.entry)];
    const Vec3& partner_normal = grid_.normal(chosen.entry);
    const double width = width_of(k, chosen, range);
    chunk.face.clear();
    for (std::size_t n = 0; n < chunk.faced.size(); ++n) {
        // Cheap tests first, on data that is contiguous in memory.
        const SampleGrid::FacingPoint& near = chunk.faced[n];
        if (!(near.squared_distance < width * width) ||
            !(grid_.normal(near.entry).dot(partner_normal) > tuning::contacts::one_face_cosine))
            continue;
        const std::uint32_t index = grid_.index(near.entry);
        const Sample& other = list_.samples[index];
        if (other.body != partner.body || other.piece != partner.piece) continue;
        if (near.height < behind && !may_meet(task, k, n, chunk)) continue;
        const double share = 1 - near.squared_distance / (width * width);
        chunk.face.push_back({index, near.entry, near.height, near.end_height, share * share});
    }
}

bool ContactFinder::meet(const Task& task, std::size_t entry, const SearchRange& range, Chunk& chunk,
                         Contact& out) {
    const std::size_t k = grid_.index(entry);
    const Sample& sample = list_.samples[k];
    const Vec3& position = grid_.point(entry);
    const SampleGrid::FacingPoint* const chosen = find_partner(task, entry, range, chunk);
    if (!chosen) return false;
    find_face(task, k, *chosen, range, chunk);
    const Sample& partner = list_.samples[grid_.index(chosen->entry)];
    double distance = 0, approach = 0, rest_distance = 0, total = 0;
    Vec3 normal = Vec3::Zero();
    for (const FaceSample& near : chunk.face) {
        const Sample& other = list_.samples[near.index];
        distance += near.weight * near.height;
        approach += near.weight * (near.height - near.end_height);
        rest_distance += near.weight * other.rest_normal.cast<double>().dot(sample.rest - other.rest);
        normal += near.weight * grid_.normal(near.entry);
        total += near.weight;
    }
    if (!(total > 0) || !(normal.norm() > 0)) return false;
    distance /= total;
    normal.normalize();
    out.gap = distance;
    out.normal = normal;
    // The faces of a cut coincide at rest even where they are curved: an apparent overlap there is not real.
    if (sample.body == partner.body && (sample.rest - partner.rest).norm() < 2 * spacing_of(sample))
        out.gap -= std::min(0.0, rest_distance / total);
    const double spacing = std::max(spacing_of(sample), spacing_of(partner));
    const Vec3 offset = position - grid_.point(chosen->entry);
    if (out.gap < -tuning::contacts::max_overlap_share * spacing) return false;
    if (!(out.gap - approach / total < speculative_gap(k, range))) return false;
    if ((offset - normal.dot(offset) * normal).norm() > tuning::contacts::max_tangential_share * spacing)
        return false;
    out.key = contact_key(sample.body, 0, sample.vertex);
    out.upper = influence_of(k).side;
    out.friction = task.options.friction;
    out.max_depenetration =
        tuning::contacts::depenetration_share * std::min(spacing_of(sample), spacing_of(partner));
    return set_lower_side(task, position - distance * normal, total, grid_.index(chosen->entry), chunk, out);
}

// Sets the lower side of the contact to the foot of the sample on the face, so that the change of the
// averaged distance equals the relative displacement of the two sides. foot: m, world; total: sum of the
// weights.
bool ContactFinder::set_lower_side(const Task& task, const Vec3& foot, double total, std::size_t partner,
                                   Chunk& chunk, Contact& out) const {
    Vec3 middle = Vec3::Zero(), rest_middle = Vec3::Zero();
    for (const FaceSample& near : chunk.face) {
        middle += near.weight * grid_.point(near.entry);
        rest_middle += near.weight * list_.samples[near.index].rest;
        chunk.blend.add(influence_of(near.index).side, near.weight);
    }
    if (chunk.blend.empty()) return false;
    const double spacing = spacing_of(list_.samples[partner]);
    const meshless::Phyxels& phyxels = task.bodies[list_.samples[partner].body].phyxels;
    Vec3 rest_foot =
        phyxels.deformation[influence_of(partner).side.phyxel[0]].inverse() * (foot - middle / total);
    if (!(rest_foot.norm() < 2 * tuning::contacts::max_tangential_share * spacing)) rest_foot.setZero();
    out.lower = chunk.blend.take(phyxels.rest_position, rest_middle / total + rest_foot, spacing);
    return true;
}

ContactFinder::SearchRange ContactFinder::search_range(const Task& task) const {
    SearchRange out{};
    for (const Patch& patch : placement_.patches) out.spacing = std::max(out.spacing, patch.spacing);
    out.radius = tuning::contacts::reach_share * out.spacing;
    out.max_radius = tuning::contacts::max_reach_share * out.spacing;
    out.fall = std::max(
        0.0, task.gravity.norm() * task.dt * task.dt - tuning::contacts::free_fall_allowance * out.spacing);
    return out;
}

// Returns whether contacts of the sample are searched. Cut faces fit each other, so on flat cut faces one
// sample per spacing is enough; against another body, whose features may be smaller, all samples search.
bool ContactFinder::searches(const Task& task, std::size_t entry) const {
    const std::uint32_t k = grid_.index(entry);
    const Sample& sample = list_.samples[k];
    if (grid_.is_among_own(entry) && (!sample.searches_own_body || is_covered_by_opposite(task, k)))
        return false;
    return grid_.may_face(entry) && !influence_of(k).side.is_collider();
}

// Returns whether the opposite sample is so close that it finds the same contacts.
bool ContactFinder::is_covered_by_opposite(const Task& task, std::size_t k) const {
    const Sample& sample = list_.samples[k];
    if (list_.opposite[k] == sample.vertex) return false;
    const BodyView& body = task.bodies[sample.body];
    const double nearest = tuning::contacts::opposite_share * spacing_of(sample);
    return (body.surface_motion.positions()[list_.opposite[k]] -
            body.surface_motion.positions()[sample.vertex])
               .squaredNorm() < nearest * nearest;
}

// Places the samples that may meet others where their influences move them, now and within the step.
void ContactFinder::place_exactly(const Task& task, std::span<const std::uint32_t> kept,
                                  const Parallel& parallel) {
    const auto place = [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            find_influences(task, kept[n]);
            const meshless::ContactSide& side = influence_of(kept[n]).side;
            SampleGrid::Motion& motion = motions_[kept[n]];
            motion.displacement = task.dt * side_value(side, bounds_.velocity);
            motion.drift = side_value(side, bounds_.drift);
            motion.extra_reach =
                std::min(motion.extra_reach, (motion.displacement - bounds_.mean_displacement).norm());
        }
    };
    parallel.for_chunks(kept.size(), grain, std::cref(place));
}

void ContactFinder::meet_pieces(const Task& task, const Parallel& parallel) {
    if (list_.samples.empty()) return;
    const SearchRange range = search_range(task);
    const auto place_kept = [&](std::span<const std::uint32_t> kept) { place_exactly(task, kept, parallel); };
    grid_.build(placement_.position, placement_.normal, motions_, placement_.owner,
                {range.radius, range.max_radius}, parallel, std::cref(place_kept));
    in_chunks(parallel, grid_.size(), [&](Chunk& chunk, std::size_t begin, std::size_t end) {
        for (std::size_t entry = begin; entry < end; ++entry) {
            if (!searches(task, entry)) continue;
            Contact& contact = chunk.found.emplace_back();
            if (meet(task, entry, range, chunk, contact))
                chunk.keys.push_back(contact.key);
            else
                chunk.found.pop_back();
        }
    });
}

// Returns whether the step needs no search for contacts between surfaces.
bool ContactFinder::is_quiet(const Task& task) {
    if (!quiet_.remembers()) return false;
    if (quiet_.holds(task.bodies, {task.dt, task.gravity})) {
        ++quiet_steps_;
        return true;
    }
    quiet_.forget();
    quiet_wait_ = quiet_steps_ > 2 * quiet_wait_ ? tuning::quiet::first_wait
                                                 : std::min(2 * quiet_wait_, tuning::quiet::max_wait);
    steps_without_ = 0;
    return false;
}

// Remembers the state if nothing has touched for some steps and nothing is near to it.
void ContactFinder::find_quiet(const Task& task, const Parallel& parallel) {
    const bool has_fragments = std::any_of(task.bodies.begin(), task.bodies.end(), [](const BodyView& body) {
        return !body.phyxels.rigid.bodies.empty();
    });
    if (list_.samples.empty() || has_fragments) return;
    const bool any = std::any_of(chunks_.all.begin(), chunks_.all.end(), [](const auto& chunk) {
        return std::any_of(chunk->keys.begin(), chunk->keys.end(),
                           [](std::uint64_t key) { return (key >> 32 & 0xffff) == 0; });
    });
    quiet_wait_ = std::max(quiet_wait_, tuning::quiet::first_wait);
    steps_without_ = any ? 0 : steps_without_ + 1;
    if (steps_without_ < quiet_wait_) return;
    steps_without_ = quiet_steps_ = 0;
    if (is_clear(task, parallel))
        quiet_.remember(task.bodies);
    else
        quiet_wait_ = std::min(2 * quiet_wait_, tuning::quiet::max_wait);
}

// Returns whether no samples of a piece that may meet are near each other.
bool ContactFinder::is_clear(const Task& task, const Parallel& parallel) {
    const double clearance = tuning::quiet::clearance_share * search_range(task).spacing;
    const double radius = search_range(task).radius + clearance;
    const double limit = tuning::contacts::speculative_share * search_range(task).spacing + clearance;
    const std::vector<SampleGrid::Motion> at_rest(list_.samples.size());
    clear_grid_.build(placement_.position, placement_.normal, at_rest, placement_.owner,
                      {radius, radius, tuning::quiet::clear_cosine}, parallel);
    std::vector<std::uint32_t> scratch;
    std::vector<SampleGrid::FacingPoint> faced;
    for (std::size_t entry = 0; entry < clear_grid_.size(); ++entry) {
        clear_grid_.find_facing(entry, unlimited, limit, scratch, faced);
        const std::uint32_t k = clear_grid_.index(entry);
        for (const SampleGrid::FacingPoint& other : faced) {
            const std::uint32_t n = clear_grid_.index(other.entry);
            const Sample &one = list_.samples[k], &two = list_.samples[n];
            // Pieces are kept apart by their boxes.
            if (one.body == two.body && one.piece == two.piece && may_meet(task, k, n)) return false;
        }
    }
    return true;
}

}  // namespace splitcubes::body
