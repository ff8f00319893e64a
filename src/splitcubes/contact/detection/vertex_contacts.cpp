#include <splitcubes/contact/detection/collider_contact.h>
#include <splitcubes/contact/detection/surface_sampler.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/contact/detection/vertex_contacts.h>
#include <splitcubes/geometry/box.h>
#include <splitcubes/node_motion/node_tracker.h>
#include <splitcubes/node_motion/surface_motion.h>
#include <splitcubes/samples/phyxels.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <tuple>
#include <utility>

namespace splitcubes::body {

namespace {

constexpr std::size_t vertices_per_range = 256, phyxels_per_range = 64;

constexpr unsigned box_bits = 20;  // a grid has at most 2^20 nodes along an axis

// Returns the key of a box of side^3 cells.
std::uint64_t box_of(const Vec3i& cell, int side) {
    std::uint64_t key = 0;
    for (int k = 0; k < 3; ++k) key = key << box_bits | static_cast<std::uint64_t>(cell[k] / side + 1);
    return key;
}

// Returns how far a point of a box moves in the frame of a collider in the step at most, m.
double motion_of(const ColliderPoses& poses, const geometry::Box& box) {
    return (poses.to_after * box.center() - poses.to_before * box.center()).norm() +
           (poses.to_after.linear() - poses.to_before.linear()).norm() * 0.5 * box.size().norm();
}

// Returns whether all points of a box are farther from a collider than `reach`, m.
bool is_apart(const Collider& collider, const ColliderPoses& poses, const geometry::Box& box, double reach) {
    return collider.solid->at(poses.to_before * box.center()).distance >
           collider.solid->lipschitz_constant() * 0.5 * box.size().norm() + reach;
}

}  // namespace

void VertexContacts::begin(std::span<const BodyView> bodies) {
    contacts_.clear();
    caches_.resize(bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const BodyView& body = bodies[b];
        BodyCache& cache = caches_[b];
        cache.slot.resize(body.surface.vertices().size(), 0);
        if (cache.revision == body.sampler.revision() && cache.sample.size() == cache.slot.size()) continue;
        cache.revision = body.sampler.revision();
        cache.sample.assign(cache.slot.size(), 0);
        for (const ContactSample& sample : body.sampler.samples())
            cache.sample[sample.vertex] = sample.pushes() ? 2 : 1;
    }
}

// Lists the vertices that may touch the collider in the step, by piece and box, nearest first.
void VertexContacts::list_near(const BodyView& body, const BodyCache& cache, const Collider& collider,
                               const ColliderPoses& poses, double max_displacement,
                               const Parallel& parallel) {
    const std::span<const Vec3> positions = body.surface_motion.positions();
    const std::vector<splitting::SurfaceVertex>& vertices = body.surface.vertices();
    const double offset = max_displacement + tuning::contacts::collider_speculative_share * body.spacing;
    const int side = std::max(1, static_cast<int>(std::floor(tuning::samples::max_box_share * body.spacing /
                                                             body.grid.rest().cell_size)));
    const std::uint8_t touching = collider.solid->is_flat() ? 2 : 1;
    found_.resize((positions.size() + vertices_per_range - 1) / vertices_per_range);
    const auto list = [&](std::size_t begin, std::size_t end) {
        std::vector<Near>& found = found_[begin / vertices_per_range];
        found.clear();
        geometry::Box box;
        for (std::size_t v = begin; v < end; ++v)
            if (vertices[v].alive()) box.add(positions[v]);
        if (box.empty()) return;
        const double reach = offset + motion_of(poses, box);
        if (is_apart(collider, poses, box, reach)) return;
        for (std::size_t v = begin; v < end; ++v) {
            if (!vertices[v].alive()) continue;
            const double distance = collider.solid->at(poses.to_before * positions[v]).distance;
            if (!(distance < reach)) continue;
            const std::int32_t piece = body.pieces.piece_of(body.grid, body.surface.influence(vertices[v]));
            if (body.phyxels.rigid.index(piece) >= 0) continue;
            found.push_back({box_of(vertices[v].lowest_node, side), piece, static_cast<std::uint32_t>(v),
                             distance, cache.sample[v] >= touching});
        }
    };
    // Passed by reference because a copied function object would be allocated.
    parallel.for_chunks(positions.size(), vertices_per_range, std::cref(list));
    near_.clear();
    for (const std::vector<Near>& found : found_) near_.insert(near_.end(), found.begin(), found.end());
    std::sort(near_.begin(), near_.end(), [](const Near& a, const Near& b) {
        return std::tie(a.piece, a.box, a.distance, a.vertex) <
               std::tie(b.piece, b.box, b.distance, b.vertex);
    });
}

// Returns the phyxels that move a vertex.
const VertexContacts::Influence& VertexContacts::influence_of(const BodyView& body, std::uint32_t index,
                                                              std::uint32_t vertex, std::int32_t piece) {
    BodyCache& cache = caches_[index];
    if (cache.slot[vertex] == 0) {
        cache.influences.emplace_back();
        cache.slot[vertex] = static_cast<std::uint32_t>(cache.influences.size());
    }
    Influence& known = cache.influences[cache.slot[vertex] - 1];
    const Vec3& rest = body.surface.vertices()[vertex].rest;
    const std::uint32_t node = body.dominant_node(vertex);
    const std::uint64_t row = body.nodes.row_revision(node);
    if (known.side.count > 0 && body.nodes.has_row(node) && known.node == node && known.row == row &&
        known.piece == piece && known.rest == rest)
        return known;
    known = {node, piece, row, rest, body.influences_of(vertex, node, piece, index)};
    return known;
}

// Returns where the phyxels of a vertex move it; as drawn if it has none.
SurfacePoint VertexContacts::point_of(const Task& task, std::uint32_t body_index, const Near& near) {
    const BodyView& body = task.bodies[body_index];
    const meshless::Phyxels& phyxels = body.phyxels;
    const Influence& influence = influence_of(body, body_index, near.vertex, near.piece);
    const meshless::ContactSide& side = influence.side;
    const Vec3& drawn = body.surface_motion.positions()[near.vertex];
    SurfacePoint point{drawn, drawn, Vec3::Zero(), tuning::contacts::max_drawn_error_share * body.spacing};
    if (side.count == 0) return point;
    Vec3 rest = Vec3::Zero(), velocity = Vec3::Zero();
    point.position.setZero();
    for (std::uint32_t k = 0; k < side.count; ++k) {
        rest += side.weight[k] * phyxels.rest_position[side.phyxel[k]];
        point.position += side.weight[k] * phyxels.position[side.phyxel[k]];
        velocity += side.weight[k] * phyxels.velocity[side.phyxel[k]];
    }
    point.position += phyxels.deformation[side.phyxel[0]] * (influence.rest - rest);
    point.displacement = task.dt * (velocity + task.dt * task.gravity);
    return point;
}

// Returns the sample that is nearest to the collider, of those in the boxes around a vertex; nullptr if there
// is none. Ends at one that is nearer than the vertex by less than `tolerance`, m.
const VertexContacts::Near* VertexContacts::sample_near(const Near& vertex, double tolerance) const {
    const Near* nearest = nullptr;
    const auto look_in = [&](std::uint64_t box) {
        const auto is_before = [](const Near& near, const std::pair<std::int32_t, std::uint64_t>& of) {
            return std::tie(near.piece, near.box) < std::tie(of.first, of.second);
        };
        auto at = std::lower_bound(near_.begin(), near_.end(), std::pair{vertex.piece, box}, is_before);
        for (; at != near_.end() && at->piece == vertex.piece && at->box == box; ++at) {
            if (!at->is_sample) continue;
            if (nearest == nullptr || at->distance < nearest->distance) nearest = &*at;
            return;
        }
    };
    look_in(vertex.box);
    for (std::uint64_t k = 0; k < 27; ++k) {
        if (nearest != nullptr && nearest->distance - tolerance <= vertex.distance) break;
        const std::uint64_t x = k / 9, y = k / 3 % 3, z = k % 3;
        look_in(vertex.box + (x << 2 * box_bits) + (y << box_bits) + z -
                ((1ULL << 2 * box_bits) + (1ULL << box_bits) + 1));
    }
    return nearest;
}

void VertexContacts::add_contact(const Task& task, std::uint32_t body_index, const Near& near,
                                 const SurfacePoint& point, const Collider& collider, std::size_t index,
                                 const ColliderPoses& poses) {
    const BodyView& body = task.bodies[body_index];
    const meshless::ContactSide& side = influence_of(body, body_index, near.vertex, near.piece).side;
    if (side.count == 0) return;
    std::optional<meshless::Contact> contact =
        touch(collider, poses, point, tuning::contacts::collider_speculative_share * body.spacing);
    if (!contact) return;
    contact->key = contact_key(body_index, index + 1, near.vertex);
    contact->upper = side;
    contact->max_depenetration = tuning::contacts::collider_depenetration_share * body.spacing;
    contacts_.push_back(*contact);
}

// Adds the contacts of phyxels of elastic pieces.
void VertexContacts::meet_phyxels(const Task& task, std::uint32_t body_index, const Collider& collider,
                                  std::size_t index, const ColliderPoses& poses) {
    const BodyView& body = task.bodies[body_index];
    const meshless::Phyxels& phyxels = body.phyxels;
    const double margin = tuning::contacts::collider_speculative_share * body.spacing;
    const double offset = task.max_displacement[body_index] + margin;
    for (std::size_t begin = 0; begin < phyxels.size(); begin += phyxels_per_range) {
        const std::size_t end = std::min(begin + phyxels_per_range, phyxels.size());
        geometry::Box box;
        for (std::size_t i = begin; i < end; ++i) box.add(phyxels.position[i]);
        const double reach = offset + motion_of(poses, box);
        if (is_apart(collider, poses, box, reach)) continue;
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3& position = phyxels.position[i];
            const std::int32_t piece = phyxels.piece[i];
            if (piece < 0 || phyxels.rigid.index(piece) >= 0 || !position.allFinite()) continue;
            if (!(collider.solid->at(poses.to_before * position).distance < reach)) continue;
            const SurfacePoint point{position, position,
                                     task.dt * (phyxels.velocity[i] + task.dt * task.gravity), 0};
            std::optional<meshless::Contact> contact = touch(collider, poses, point, margin);
            if (!contact) continue;
            contact->key = contact_key(body_index, index + 1, phyxel_bit | static_cast<std::uint32_t>(i));
            contact->upper.part = body_index;
            contact->upper.count = 1;
            contact->upper.phyxel[0] = static_cast<std::uint32_t>(i);
            contact->upper.weight[0] = 1;
            contact->max_depenetration = tuning::contacts::collider_depenetration_share * body.spacing;
            contacts_.push_back(*contact);
        }
    }
}

void VertexContacts::meet(const Task& task, const Collider& collider, std::size_t index,
                          const ColliderPoses& poses, const Parallel& parallel) {
    for (std::uint32_t b = 0; b < task.bodies.size(); ++b) {
        const BodyView& body = task.bodies[b];
        if (body.is_lattice_driven) continue;
        meet_phyxels(task, b, collider, index, poses);
        list_near(body, caches_[b], collider, poses, task.max_displacement[b], parallel);
        const double tolerance = tuning::contacts::vertex_tolerance * body.grid.rest().cell_size;
        for (auto first = near_.begin(); first != near_.end();) {
            auto last = first;
            while (last != near_.end() && last->piece == first->piece && last->box == first->box) ++last;
            const Near* sample = sample_near(*first, tolerance);
            if (sample != nullptr && first->distance < sample->distance - tolerance) {
                const auto height = [&](const SurfacePoint& point) {
                    return collider.solid->at(poses.to_before * point.position).distance;
                };
                const SurfacePoint point = point_of(task, b, *first);
                if (height(point) < height(point_of(task, b, *sample)) - tolerance)
                    add_contact(task, b, *first, point, collider, index, poses);
            }
            first = last;
        }
    }
}

}  // namespace splitcubes::body
