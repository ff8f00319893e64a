#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/collider_contact.h>
#include <splitcubes/contact/detection/contact_finder.h>
#include <splitcubes/contact/detection/contact_sides.h>
#include <splitcubes/contact/detection/quiet_motion.h>
#include <splitcubes/contact/detection/surface_changes.h>
#include <splitcubes/contact/detection/surface_sampler.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/node_motion/node_tracker.h>
#include <splitcubes/node_motion/surface_motion.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace splitcubes::body {

namespace {

using meshless::Contact;
using meshless::ContactSide;

// Markers of fresh samples in place of a previous index.
constexpr std::int32_t new_sample = -1, no_sample = -2;

}  // namespace

bool ContactFinder::is_listed(const Task& task) {
    fresh_.bodies.assign(task.bodies.size(), {});
    bool same = list_.bodies.size() == fresh_.bodies.size();
    for (std::size_t b = 0; b < fresh_.bodies.size(); ++b) {
        const BodyView& body = task.bodies[b];
        fresh_.bodies[b].surface_revision = body.surface.revision();
        fresh_.bodies[b].sample_revision = body.sampler.revision();
        fresh_.bodies[b].pieces = body.pieces.count();
        fresh_.bodies[b].rigid = body.phyxels.rigid.bodies.size();
        fresh_.bodies[b].full_change = body.surface_changes.last_full_change();
        same = same && fresh_.bodies[b].same_as(list_.bodies[b]);
    }
    return same;
}

void ContactFinder::list_samples(const Task& task, const Parallel& parallel) {
    if (is_listed(task)) return;
    relist(task, parallel);
    quiet_.forget();
    quiet_wait_ = steps_without_ = 0;
}

void ContactFinder::relist(const Task& task, const Parallel& parallel) {
    std::size_t count = 0;
    for (const BodyView& body : task.bodies)
        count += body.is_lattice_driven ? 0 : body.sampler.samples().size();
    fresh_.samples.resize(count);
    fresh_.opposite.resize(count);
    matching_.previous.assign(count, no_sample);
    matching_.is_kept.assign(list_.samples.size(), 0);
    std::size_t first = 0;
    for (std::uint32_t b = 0; b < task.bodies.size(); ++b) {
        fresh_.bodies[b].first = first;
        if (task.bodies[b].is_lattice_driven) continue;
        const std::size_t points = task.bodies[b].sampler.samples().size();
        const auto list = [&](std::size_t begin, std::size_t end) {
            list_points(task.bodies[b], b, first, begin, end);
        };
        parallel.for_chunks(points, list_grain, std::cref(list));
        first += points;
    }
    if (std::find(matching_.previous.begin(), matching_.previous.end(), no_sample) !=
        matching_.previous.end())
        compact();
    keep_slots();
    list_.samples.swap(fresh_.samples);
    list_.opposite.swap(fresh_.opposite);
    list_.bodies.swap(fresh_.bodies);
}

// Returns whether the sample `pushing` still represents the sample `vertex` after the cuts of this step.
// is_uncut: there were none. A cut may have given the number of a vertex to another one.
bool ContactFinder::pushes_for(const BodyView& body, std::uint32_t vertex, std::uint32_t pushing,
                               bool is_uncut) {
    const splitting::Surface& surface = body.surface;
    const splitting::SurfaceVertex &own = surface.vertices()[vertex],
                                   &representative = surface.vertices()[pushing];
    if (!representative.alive() || is_uncut) return representative.alive();
    const splitting::Pieces& pieces = body.pieces;
    return pieces.piece_of(body.grid, surface.influence(own)) ==
           pieces.piece_of(body.grid, surface.influence(representative));
}

// Returns the vertex of the opposite cut face that searches for this sample too, if it still exists after the
// cuts of this step; else the sample's own vertex.
std::uint32_t ContactFinder::opposite_of(const BodyView& body, const ContactSample& point) {
    if (point.opposite == point.vertex) return point.vertex;
    const splitting::Surface& surface = body.surface;
    const splitting::SurfaceVertex &own = surface.vertices()[point.vertex],
                                   &opposite = surface.vertices()[point.opposite];
    const bool is_there =
        opposite.alive() && opposite.kind == splitting::VertexKind::centre &&
        opposite.lowest_node == own.lowest_node &&
        body.phyxels.rigid.index(body.pieces.piece_of(body.grid, surface.influence(opposite))) < 0;
    return is_there ? point.opposite : point.vertex;
}

// Fills the fresh samples of points begin .. end - 1 of a body and matches them with the previous samples;
// both lists are sorted by vertex. first: index of the body's first fresh sample.
void ContactFinder::list_points(const BodyView& body, std::uint32_t body_index, std::size_t first,
                                std::size_t begin, std::size_t end) {
    const bool is_known = body_index < list_.bodies.size();
    const std::size_t last_old =
        body_index + 1 < list_.bodies.size() ? list_.bodies[body_index + 1].first : list_.samples.size();
    auto old = list_.samples.begin() +
               static_cast<std::ptrdiff_t>(is_known ? list_.bodies[body_index].first : last_old);
    const auto old_end = list_.samples.begin() + static_cast<std::ptrdiff_t>(last_old);
    const auto is_before = [](const Sample& sample, std::uint32_t vertex) { return sample.vertex < vertex; };
    if (begin < end) old = std::lower_bound(old, old_end, body.sampler.samples()[begin].vertex, is_before);
    const bool is_uncut = body.sampler.revision() == body.surface.revision();
    const bool same_nodes = is_known && fresh_.bodies[body_index].same_nodes(list_.bodies[body_index]);
    const bool same_indices =
        is_known && fresh_.bodies[body_index].full_change == list_.bodies[body_index].full_change;
    for (std::size_t k = begin; k < end; ++k) {
        const ContactSample& point = body.sampler.samples()[k];
        // The list dates from the last step: a cut of this step may have removed the vertex.
        const splitting::SurfaceVertex& vertex = body.surface.vertices()[point.vertex];
        if (!vertex.alive()) continue;
        while (old != old_end && old->vertex < point.vertex) ++old;
        const bool was_sample = old != old_end && old->vertex == point.vertex && old->rest == vertex.rest;
        Sample& sample = fresh_.samples[first + k];
        sample.rest = vertex.rest;
        sample.rest_normal = vertex.normal;
        sample.vertex = point.vertex;
        sample.cell = vertex.cell;
        sample.body = static_cast<std::uint16_t>(body_index);
        sample.corners = vertex.corners;
        sample.serial = 0;
        const bool same_place =
            was_sample && same_indices && old->cell == vertex.cell && old->corners == vertex.corners;
        if (same_place && same_nodes) {
            sample.piece = old->piece;
        } else {
            sample.piece = body.pieces.piece_of(body.grid, body.surface.influence(vertex));
            if (body.phyxels.rigid.index(sample.piece) >= 0) continue;
        }
        sample.node = same_place ? old->node : body.dominant_node(point.vertex);
        const auto pushes = [&](std::uint32_t representative) {
            return representative == point.vertex ||
                   !pushes_for(body, point.vertex, representative, is_uncut);
        };
        sample.pushes = pushes(point.representative);
        sample.searches_own_body = sample.pushes && pushes(point.face_delegate);
        fresh_.opposite[first + k] = opposite_of(body, point);
        matching_.previous[first + k] = new_sample;
        if (!was_sample || old->node != sample.node || old->piece != sample.piece) continue;
        const auto before = static_cast<std::size_t>(old - list_.samples.begin());
        matching_.previous[first + k] = static_cast<std::int32_t>(before);
        matching_.is_kept[before] = 1;
        sample.slot = old->slot;
        // A changed normal invalidates known separations: the sample gets a new serial number.
        if (old->rest_normal == sample.rest_normal) sample.serial = old->serial;
    }
}

// Removes the fresh entries that are no samples.
void ContactFinder::compact() {
    std::size_t kept = 0;
    for (std::size_t b = 0, k = 0; b < fresh_.bodies.size(); ++b) {
        const std::size_t end =
            b + 1 < fresh_.bodies.size() ? fresh_.bodies[b + 1].first : fresh_.samples.size();
        fresh_.bodies[b].first = kept;
        for (; k < end; ++k) {
            if (matching_.previous[k] == no_sample) continue;
            fresh_.samples[kept] = fresh_.samples[k];
            fresh_.opposite[kept] = fresh_.opposite[k];
            matching_.previous[kept++] = matching_.previous[k];
        }
    }
    fresh_.samples.resize(kept);
    fresh_.opposite.resize(kept);
    matching_.previous.resize(kept);
}

// Restarts the serial numbers before they overflow.
void ContactFinder::restart_serials() {
    if (last_serial_ <= std::numeric_limits<std::uint32_t>::max() - fresh_.samples.size() - 1) return;
    last_serial_ = 0;
    for (Sample& sample : fresh_.samples) sample.serial = 0;
}

// Keeps the slots (cached data) of samples whose influences stay the same, drops known separations of samples
// whose normal changed, and gives slots to new samples.
void ContactFinder::keep_slots() {
    restart_serials();
    for (std::size_t k = 0; k < list_.samples.size(); ++k) {
        if (matching_.is_kept[k]) continue;
        drop_known(list_.samples[k].slot);
        slots_.free.push_back(list_.samples[k].slot);
    }
    for (std::size_t k = 0; k < fresh_.samples.size(); ++k) {
        Sample& sample = fresh_.samples[k];
        if (sample.serial != 0) continue;
        sample.serial = ++last_serial_;
        if (matching_.previous[k] < 0)
            sample.slot = take_slot();
        else
            drop_known(sample.slot);
    }
}

std::uint32_t ContactFinder::take_slot() {
    if (slots_.free.empty()) {
        slots_.influences.emplace_back();
        slots_.separations.push_back(nullptr);
        return static_cast<std::uint32_t>(slots_.influences.size() - 1);
    }
    const std::uint32_t slot = slots_.free.back();
    slots_.free.pop_back();
    slots_.influences[slot] = {};
    return slot;
}

void ContactFinder::drop_known(std::uint32_t slot) {
    if (slots_.separations[slot]) known_.free.push_back(slots_.separations[slot]);
    slots_.separations[slot] = nullptr;
}

ContactFinder::KnownSeparations& ContactFinder::take_known() {
    const std::scoped_lock lock(mutex_);
    if (known_.free.empty()) return known_.all.emplace_back();
    KnownSeparations& known = *known_.free.back();
    known_.free.pop_back();
    known = {};
    return known;
}

// Measures the mean displacement and, per body, the maximum displacement of a sample in the step. The factor
// max_weight_sum accounts for weights of both signs.
void ContactFinder::measure_speeds(const Task& task, const Parallel& parallel) {
    bounds_.max_displacement.clear();
    bounds_.spacing.clear();
    bounds_.velocity.clear();
    bounds_.drift.resize(task.bodies.size());
    Vec3 sum = Vec3::Zero();
    double all = 0;
    for (std::size_t b = 0; b < task.bodies.size(); ++b) {
        const meshless::Phyxels& phyxels = task.bodies[b].phyxels;
        const std::size_t count = phyxels.size();
        bounds_.velocity.emplace_back(phyxels.velocity);
        bounds_.drift[b].resize(count);
        bounds_.speeds.assign((count + speed_grain - 1) / speed_grain, {});
        const auto measure = [&](std::size_t begin, std::size_t end) {
            Speeds& part = bounds_.speeds[begin / speed_grain];
            for (std::size_t i = begin; i < end; ++i) {
                bounds_.drift[b][i] = drift_of(phyxels, i, task.dt, task.gravity);
                part.sum += phyxels.velocity[i];
                part.max_square = std::max(part.max_square, phyxels.velocity[i].squaredNorm());
            }
        };
        parallel.for_chunks(count, speed_grain, std::cref(measure));
        double max_square = 0;
        for (const Speeds& part : bounds_.speeds) {
            sum += part.sum;
            max_square = std::max(max_square, part.max_square);
        }
        all += static_cast<double>(count);
        bounds_.max_displacement.push_back(
            task.dt *
            (tuning::contacts::max_weight_sum * std::sqrt(max_square) + task.dt * task.gravity.norm()));
        bounds_.spacing.push_back(task.bodies[b].spacing);
    }
    bounds_.mean_displacement = task.dt / std::max(all, 1.0) * sum;
}

// Computes the maximum displacement of each piece's phyxels in the step, relative to the mean of all, m.
void ContactFinder::measure_pieces(const Task& task, const Parallel& parallel) {
    bounds_.piece_displacement.resize(task.bodies.size());
    for (std::size_t b = 0; b < task.bodies.size(); ++b) {
        const meshless::Phyxels& phyxels = task.bodies[b].phyxels;
        const std::span<const Vec3> velocity = bounds_.velocity[b];
        bounds_.square.resize(velocity.size());
        parallel.for_each(velocity.size(), speed_grain, [&](std::size_t i) {
            bounds_.square[i] = (task.dt * velocity[i] - bounds_.mean_displacement).squaredNorm();
        });
        // A piece without phyxels gets the maximum of its body.
        std::vector<double>& displacement = bounds_.piece_displacement[b];
        displacement.assign(task.bodies[b].pieces.count(), -1);
        double max_square = 0;
        for (std::size_t i = 0; i < bounds_.square.size(); ++i) {
            const auto piece = static_cast<std::size_t>(phyxels.piece[i]);
            if (piece < displacement.size())
                displacement[piece] = std::max(displacement[piece], bounds_.square[i]);
            max_square = std::max(max_square, bounds_.square[i]);
        }
        for (double& square : displacement) square = std::sqrt(square < 0 ? max_square : square);
    }
}

// Returns the maximum displacement (m) of a sample in the step relative to the mean of all, without knowing
// its influences.
double ContactFinder::piece_displacement(const Sample& sample) const {
    const std::vector<double>& displacement = bounds_.piece_displacement[sample.body];
    const auto piece = static_cast<std::size_t>(sample.piece);
    return piece < displacement.size() ? displacement[piece] : std::numeric_limits<double>::infinity();
}

// Places samples at the rendered vertices. Those that may touch are placed exactly later (place_exactly).
void ContactFinder::place_samples(const Task& task, const Parallel& parallel) {
    placement_.position.resize(list_.samples.size());
    placement_.normal.resize(list_.samples.size());
    placement_.owner.resize(list_.samples.size());
    motions_.resize(list_.samples.size());
    placement_.placed.assign(list_.samples.size(), 0);
    placement_.patches.resize((list_.samples.size() + grain - 1) / grain);
    const auto place = [&](std::size_t begin, std::size_t end) {
        Patch& patch = placement_.patches[begin / grain] = {};
        for (std::size_t k = begin; k < end; ++k) {
            place_sample(task, k);
            motions_[k].extra_reach = piece_displacement(list_.samples[k]);
            patch.box.add(placement_.position[k]);
            patch.spacing = std::max(patch.spacing, spacing_of(list_.samples[k]));
            patch.max_displacement =
                std::max(patch.max_displacement,
                         bounds_.max_displacement[list_.samples[k].body] +
                             tuning::contacts::max_vertex_offset_share * spacing_of(list_.samples[k]));
        }
    };
    parallel.for_chunks(list_.samples.size(), grain, std::cref(place));
}

void ContactFinder::place_sample(const Task& task, std::size_t k) {
    const Sample& sample = list_.samples[k];
    const BodyView& body = task.bodies[sample.body];
    placement_.normal[k] = body.surface_motion.normals()[sample.vertex];
    placement_.owner[k] = sample.body;
    placement_.position[k] = body.surface_motion.positions()[sample.vertex];
}

// Returns whether the phyxel that moves a sample without a kernel row is still the nearest of its piece.
// Pieces only separate and never join, so the nearest phyxel stays the nearest as long as it is in the same
// piece.
bool ContactFinder::is_still_nearest(const meshless::Phyxels& phyxels, const Sample& sample,
                                     const Influence& influence) {
    return influence.phyxel_count == phyxels.size() &&
           phyxels.piece[influence.side.phyxel[0]] == sample.piece;
}

// Finds a sample's influences and places it where they move it. The solver knows the motion of that point, so
// the work of a contact force equals force times displacement. The rendered vertex differs by the change of
// strain over the phyxels; measuring the gap there would create energy in a rolling body.
void ContactFinder::find_influences(const Task& task, std::size_t k) {
    if (placement_.placed[k]) return;
    const Sample& sample = list_.samples[k];
    Influence& influence = slots_.influences[sample.slot];
    const BodyView& body = task.bodies[sample.body];
    const meshless::Phyxels& phyxels = body.phyxels;
    const std::uint64_t row = body.nodes.row_revision(sample.node);
    ContactSide& side = influence.side;
    const bool has_row = body.nodes.has_row(sample.node);
    if (side.count == 0 || (has_row ? influence.row != row : !is_still_nearest(phyxels, sample, influence))) {
        side = body.influences_of(sample.vertex, sample.node, sample.piece, sample.body);
        influence.row = row;
        influence.phyxel_count = has_row ? 0 : phyxels.size();
        Vec3 rest = Vec3::Zero();
        for (std::uint32_t c = 0; c < side.count; ++c)
            rest += side.weight[c] * phyxels.rest_position[side.phyxel[c]];
        influence.offset = sample.rest - rest;
    }
    if (side.count == 0) return;
    placement_.placed[k] = 1;
    Vec3 position = Vec3::Zero();
    for (std::uint32_t c = 0; c < side.count; ++c)
        position += side.weight[c] * phyxels.position[side.phyxel[c]];
    // The offset is nonzero only if few phyxels lie in one plane.
    placement_.position[k] = position + phyxels.deformation[side.phyxel[0]] * influence.offset;
}

// Returns whether the solid is farther from all samples of the patch than they can move.
bool ContactFinder::is_far(const Collider& collider, const ColliderPoses& poses, const Patch& patch) const {
    const Vec3 centre = patch.box.center();
    const double radius = 0.5 * patch.box.size().norm();
    const double moved = (poses.to_after * centre - poses.to_before * centre).norm() +
                         (poses.to_after.linear() - poses.to_before.linear()).norm() * radius;
    const double distance = collider.solid->at(poses.to_before * centre).distance;
    return distance - collider.solid->lipschitz_constant() * radius >
           (1 + 1e-9) * (patch.max_displacement + moved);
}

void ContactFinder::meet_collider(const Task& task, std::size_t collider_index, const ColliderPoses& poses,
                                  std::size_t k, Chunk& chunk) {
    const Collider& collider = task.colliders[collider_index];
    const Sample& s = list_.samples[k];
    if (!s.pushes && collider.solid->is_flat()) return;
    const Vec3& position = placement_.position[k];
    const BodyView& body = task.bodies[s.body];
    const double moved = (poses.to_after * position - poses.to_before * position).norm();
    const double far =
        moved + bounds_.max_displacement[s.body] + tuning::contacts::max_vertex_offset_share * spacing_of(s);
    if (collider.solid->at(poses.to_before * position).distance > far) return;
    find_influences(task, k);
    const Vec3 displacement =
        task.dt * (side_value(influence_of(k).side, bounds_.velocity) + task.dt * task.gravity);
    const double margin = tuning::contacts::collider_speculative_share * spacing_of(s);
    const double max_error = tuning::contacts::max_drawn_error_share * spacing_of(s);
    std::optional<Contact> contact =
        touch(collider, poses, {position, body.surface_motion.positions()[s.vertex], displacement, max_error},
              margin);
    if (!contact) return;
    contact->key = contact_key(s.body, collider_index + 1, s.vertex);
    contact->upper = influence_of(k).side;
    contact->max_depenetration = tuning::contacts::collider_depenetration_share * spacing_of(s);
    chunk.found.push_back(*contact);
    chunk.keys.push_back(contact->key);
}

void ContactFinder::meet_colliders(const Task& task, const Parallel& parallel) {
    if (task.colliders.empty()) return;
    vertex_contacts_.begin(task.bodies);
    for (std::size_t c = 0; c < task.colliders.size(); ++c) {
        const Collider& collider = task.colliders[c];
        const ColliderPoses poses(collider, task.time, task.dt);
        vertex_contacts_.meet({task.bodies, task.dt, task.gravity, bounds_.max_displacement}, collider, c,
                              poses, parallel);
        in_chunks(parallel, list_.samples.size(), [&](Chunk& chunk, std::size_t begin, std::size_t end) {
            if (is_far(collider, poses, placement_.patches[begin / grain])) return;
            for (std::size_t k = begin; k < end; ++k) meet_collider(task, c, poses, k, chunk);
        });
    }
}

// The distribution of work over chunks is arbitrary. Each chunk gets capacity for everything found in the
// last step and for the largest neighbourhood of any sample, so later steps do not allocate.
void ContactFinder::reserve_chunks(std::size_t threads) {
    while (chunks_.all.size() < threads) {
        chunks_.all.push_back(std::make_unique<Chunk>());
        chunks_.free.push_back(chunks_.all.back().get());
    }
    std::size_t found = 0;
    Chunk::Capacity capacity;
    for (const auto& chunk : chunks_.all) {
        found += chunk->found.size();
        capacity.include(*chunk);
    }
    for (const auto& chunk : chunks_.all) {
        chunk->found.clear();
        chunk->keys.clear();
        chunk->found.reserve(std::bit_ceil(found + 1));
        chunk->keys.reserve(std::bit_ceil(found + 1));
        capacity.reserve_in(*chunk);
    }
}

ContactFinder::Chunk& ContactFinder::take_chunk() {
    const std::scoped_lock lock(mutex_);
    if (chunks_.free.empty()) {
        chunks_.all.push_back(std::make_unique<Chunk>());
        chunks_.free.reserve(chunks_.all.size());
        return *chunks_.all.back();
    }
    Chunk& chunk = *chunks_.free.back();
    chunks_.free.pop_back();
    return chunk;
}

void ContactFinder::give_back(Chunk& chunk) {
    const std::scoped_lock lock(mutex_);
    chunks_.free.push_back(&chunk);
}

void ContactFinder::find(const Task& task, const Parallel& parallel, std::vector<ContactIsland>& islands) {
    reserve_chunks(static_cast<std::size_t>(parallel.thread_count()));
    if (task.options.pieces || !task.colliders.empty()) {
        list_samples(task, parallel);
        const bool quiet = task.options.pieces && is_quiet(task);
        if (!quiet || !task.colliders.empty()) {
            measure_speeds(task, parallel);
            measure_pieces(task, parallel);
            place_samples(task, parallel);
            meet_colliders(task, parallel);
        }
        if (task.options.pieces && !quiet) {
            meet_pieces(task, parallel);
            find_quiet(task, parallel);
        }
    }
    found_.order.clear();
    for (const auto& chunk : chunks_.all)
        for (std::size_t n = 0; n < chunk->keys.size(); ++n)
            found_.order.push_back({chunk->keys[n], &chunk->found[n]});
    if (!task.colliders.empty())
        for (const Contact& contact : vertex_contacts_.contacts())
            found_.order.push_back({contact.key, &contact});
    sort_found();
    fill_islands(task, parallel, islands);
    turns_.turn(task.bodies, task.dt, parallel, islands);
}

// Sorts by key with an LSD radix sort: there are many keys, and most of their digits agree.
void ContactFinder::sort_found() {
    constexpr unsigned bits = 11;
    std::uint64_t differ = 0;
    for (const Found& found : found_.order) differ |= found.key ^ found_.order[0].key;
    found_.spare.resize(found_.order.size());
    for (unsigned shift = 0; shift < 64 && differ >> shift != 0; shift += bits) {
        const auto digit = [shift](const Found& found) {
            return static_cast<std::size_t>(found.key >> shift & ((1U << bits) - 1));
        };
        if ((differ >> shift & ((1U << bits) - 1)) == 0) continue;
        std::array<std::uint32_t, (1U << bits) + 1> first{};
        for (const Found& found : found_.order) ++first[digit(found) + 1];
        std::partial_sum(first.begin(), first.end(), first.begin());
        for (const Found& found : found_.order) found_.spare[first[digit(found)]++] = found;
        found_.order.swap(found_.spare);
    }
}

// Groups bodies that push on each other (union-find); fills islands_ but for its sizes and indices.
void ContactFinder::form_islands(std::size_t bodies, std::vector<ContactIsland>& islands) {
    islands_.parent.resize(bodies);
    std::iota(islands_.parent.begin(), islands_.parent.end(), 0U);
    const auto root = [&](std::uint32_t b) {
        while (islands_.parent[b] != b) b = islands_.parent[b];
        return b;
    };
    if (bodies > 1)
        for (const Found& f : found_.order) {
            const Contact& c = *f.contact;
            if (c.lower.is_collider() || c.lower.part == c.upper.part) continue;
            const std::uint32_t a = root(c.upper.part), b = root(c.lower.part);
            islands_.parent[std::max(a, b)] = std::min(a, b);
        }
    for (ContactIsland& island : islands) island.bodies.clear();
    std::size_t count = 0;
    islands_.island_of.resize(bodies);
    islands_.part_of.resize(bodies);
    for (std::uint32_t b = 0; b < bodies; ++b) {
        if (root(b) == b) islands_.island_of[b] = count++;
        islands_.island_of[b] = islands_.island_of[root(b)];
        if (islands.size() < count) islands.emplace_back();
        ContactIsland& island = islands[islands_.island_of[b]];
        islands_.part_of[b] = static_cast<std::uint32_t>(island.bodies.size());
        island.bodies.push_back(b);
    }
    islands.resize(count);
}

void ContactFinder::fill_islands(const Task& task, const Parallel& parallel,
                                 std::vector<ContactIsland>& islands) {
    form_islands(task.bodies.size(), islands);
    const auto island_of = [this](const Found& found) { return islands_.island_of[body_of(found.key)]; };
    islands_.size.assign(islands.size(), 0);
    islands_.index_in_island.resize(found_.order.size());
    for (std::size_t k = 0; k < found_.order.size(); ++k)
        islands_.index_in_island[k] = static_cast<std::uint32_t>(islands_.size[island_of(found_.order[k])]++);
    // Need not be cleared: every element is written below.
    for (std::size_t g = 0; g < islands.size(); ++g) islands[g].contacts.resize(islands_.size[g]);
    parallel.for_each(found_.order.size(), 2 * grain, [&](std::size_t k) {
        Contact& c = islands[island_of(found_.order[k])].contacts[islands_.index_in_island[k]] =
            *found_.order[k].contact;
        c.upper.part = islands_.part_of[c.upper.part];
        if (!c.lower.is_collider()) c.lower.part = islands_.part_of[c.lower.part];
    });
}

}  // namespace splitcubes::body
