// The middle stages of a step: what follows from newly cut edges.
#include <splitcubes/body/body.h>
#include <splitcubes/math/decompose.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace splitcubes::body {

namespace {

// One box per brick of changed cells: few boxes, none much larger than what changed.
std::vector<geometry::Box> boxes_of(const splitting::Surface& surface, std::span<const std::uint32_t> cells,
                                    std::span<const geometry::Box> changed) {
    std::map<std::array<int, 3>, geometry::Box> by_brick;
    for (std::size_t k = 0; k < cells.size(); ++k) {
        const Vec3i place = surface.cells()[cells[k]].place;
        by_brick[{place[2] >> 2, place[1] >> 2, place[0] >> 2}].add(changed[k]);
    }
    std::vector<geometry::Box> out;
    for (const auto& [brick, box] : by_brick) out.push_back(box);
    return out;
}

bool meets_any(const geometry::Box& box, std::span<const geometry::Box> boxes) {
    return std::any_of(boxes.begin(), boxes.end(), [&](const geometry::Box& b) { return b.meets(box); });
}

}  // namespace

void Body::retessellate(StepReport& report) {
    changed_boxes_.clear();
    const std::vector<std::uint32_t>& changed = surface_->retessellate(grid_, new_slots_);
    // What was there before and what is there now: both changed what is seen.
    std::vector<geometry::Box> boxes;
    for (const std::uint32_t c : changed) {
        if (c < occluder_box_.size()) {
            boxes.push_back(occluder_box_[c]);
        } else {
            boxes.emplace_back();
        }
        set_occluders(c);
        boxes.back().add(occluder_box_[c]);
    }
    changed_boxes_ = boxes_of(*surface_, changed, boxes);
    cut_edge_count_ += new_slots_.size();
    report.changed_cells += changed.size();
    track_surface_nodes();
}

void Body::track_surface_nodes() {
    const std::vector<Vec3i>& nodes = surface_->nodes();
    for (std::size_t k = surface_to_tracked_.size(); k < nodes.size(); ++k)
        surface_to_tracked_.push_back(tracker_.track(grid_, nodes[k]));
}

void Body::label_pieces(StepReport&) {
    splits_.clear();
    if (new_slots_.empty()) return;
    splits_ = pieces_->update(grid_, new_slots_);
    if (splits_.empty()) return;
    for (std::size_t i = 0; i < inside_nodes_.size(); ++i)
        inside_piece_[i] = pieces_->piece_of(grid_, inside_nodes_[i]);
    tracker_.mark_pieces_changed();
}

// A phyxel belongs to the piece of the nearest node that sees it; near a new cut
// that may be another node than before. It can go with a fragment that comes off
// its piece now, but never over to a piece that has parted earlier and moved away.
void Body::update_owners(std::span<const geometry::Box> boxes) {
    const double reach = 1.8 * grid_.rest().cell_size;  // to the farthest of the nodes around
    for (std::size_t i = 0; i < phyxels_.size(); ++i) {
        const Vec3& rest = phyxels_.rest_position[i];
        if (!meets_any(geometry::Box{rest, rest}.grown(reach), boxes)) continue;
        const std::int32_t own = phyxels_.piece[i];
        owner_[i] = owner_of(rest, owner_[i], [&](std::int32_t piece) {
            return piece == own ||
                   std::any_of(splits_.begin(), splits_.end(), [&](const splitting::PieceSplit& split) {
                       return split.parent == own && split.piece == piece;
                   });
        });
    }
}

void Body::evaluate_pairs(std::span<const std::uint32_t> pairs, const Parallel& parallel) {
    std::vector<occlusion::PairQuery> queries;
    std::vector<std::uint32_t> asked;
    for (const std::uint32_t k : pairs) {
        if (phyxels_.piece[pairs_.a[k]] != phyxels_.piece[pairs_.b[k]]) {
            pairs_.visibility[k] = 0;
            continue;
        }
        asked.push_back(k);
        queries.push_back({phyxels_.rest_position[pairs_.a[k]], phyxels_.rest_position[pairs_.b[k]]});
    }
    std::vector<float> visibility(queries.size());
    visibility_->evaluate(occluders_, queries, visibility, parallel);
    for (std::size_t q = 0; q < asked.size(); ++q) pairs_.visibility[asked[q]] = visibility[q];
}

void Body::update_visibility(const StepContext& context, StepReport& report) {
    changed_pairs_.clear();
    if (changed_boxes_.empty()) return;
    const std::vector<std::int32_t> piece_before = phyxels_.piece;
    update_owners(changed_boxes_);
    for (std::size_t i = 0; i < phyxels_.size(); ++i) phyxels_.piece[i] = pieces_->piece_of(grid_, owner_[i]);
    if (phyxels_.piece != piece_before) tracker_.mark_pieces_changed();

    geometry::Box all;
    for (const geometry::Box& box : changed_boxes_) all.add(box);
    std::vector<std::uint32_t> asked;
    for (std::uint32_t k = 0; k < pairs_.size(); ++k) {
        const std::uint32_t a = pairs_.a[k], b = pairs_.b[k];
        const bool moved = phyxels_.piece[a] != piece_before[a] || phyxels_.piece[b] != piece_before[b];
        if (!moved) {
            const geometry::Box cone =
                occlusion::double_cone_bounds({phyxels_.rest_position[a], phyxels_.rest_position[b]});
            if (!cone.meets(all) || !meets_any(cone, changed_boxes_)) continue;
        }
        asked.push_back(k);
    }
    std::vector<float> before;
    for (const std::uint32_t k : asked) before.push_back(pairs_.visibility[k]);
    evaluate_pairs(asked, context.parallel);
    for (std::size_t q = 0; q < asked.size(); ++q)
        if (pairs_.visibility[asked[q]] != before[q]) changed_pairs_.push_back(asked[q]);
    report.disks += asked.size();

    double reach = 0;
    for (const double h : phyxels_.support_radius) reach = std::max(reach, h);
    tracker_.mark_near(changed_boxes_, reach);
}

// New phyxels for a piece, at its own nodes, each as far as can be from those it
// has (farthest-point order); they start from the frame that carries the node.
void Body::add_samples(std::int32_t piece, std::size_t wanted) {
    std::vector<std::uint32_t> nodes;
    for (std::uint32_t n = 0; n < inside_nodes_.size(); ++n)
        if (inside_piece_[n] == piece) nodes.push_back(n);
    std::vector<double> distance(nodes.size(), 1e300);
    std::size_t have = 0;
    const auto take_in = [&](const Vec3& rest) {
        ++have;
        for (std::size_t k = 0; k < nodes.size(); ++k)
            distance[k] = std::min(distance[k], (inside_rest_[nodes[k]] - rest).squaredNorm());
    };
    for (std::size_t i = 0; i < phyxels_.size(); ++i)
        if (phyxels_.piece[i] == piece) take_in(phyxels_.rest_position[i]);
    const double least = 0.25 * grid_.rest().cell_size * grid_.rest().cell_size;
    while (have < wanted) {
        const auto far = std::max_element(distance.begin(), distance.end());
        if (far == distance.end() || *far < least) return;
        const std::uint32_t n = nodes[static_cast<std::size_t>(far - distance.begin())];
        const Vec3& rest = inside_rest_[n];
        // The old field at the node: its frame as the last step left it where it was
        // followed, else the nearest phyxel's.
        const std::int32_t tracked = tracker_.find(inside_nodes_[n]);
        std::size_t nearest = 0;
        for (std::size_t i = 1; i < phyxels_.size(); ++i)
            if ((phyxels_.rest_position[i] - rest).squaredNorm() <
                (phyxels_.rest_position[nearest] - rest).squaredNorm())
                nearest = i;
        meshless::PhyxelStart start;
        start.rest_position = rest;
        start.piece = piece;
        start.contact_radius = 0.5 * grid_.rest().cell_size;
        if (tracked >= 0 && static_cast<std::size_t>(tracked) < frames_.size()) {
            start.position = frames_[static_cast<std::size_t>(tracked)].position;
            start.deformation = frames_[static_cast<std::size_t>(tracked)].jacobian;
        } else {
            start.deformation = phyxels_.deformation[nearest];
            start.position =
                phyxels_.position[nearest] + start.deformation * (rest - phyxels_.rest_position[nearest]);
        }
        start.velocity = phyxels_.velocity[nearest];
        start.plastic_strain = phyxels_.plastic_strain[nearest];
        phyxels_.append(start);
        owner_.push_back(inside_nodes_[n]);
        previous_deformation_.push_back(start.deformation);
        take_in(rest);
    }
}

// A crumb starts as an undeformed body: its nodes were carried by phyxels on both
// sides of what was cut, so their places may be far apart, and taken as they are
// they would be released as elastic energy. Keeps the centre, the mean rotation, the
// mean velocity and the mean plastic strain, in the shape of which it is without
// stress; rebook gives back the momenta.
void Body::make_rigid(std::int32_t piece) {
    std::vector<std::size_t> members;
    double total = 0;
    for (std::size_t i = 0; i < phyxels_.size(); ++i) {
        if (phyxels_.piece[i] != piece) continue;
        members.push_back(i);
        total += phyxels_.mass[i];
    }
    // By mass, which keeps the momentum; new phyxels have none yet.
    const bool all_new = !(total > 0);
    if (all_new) total = static_cast<double>(members.size());
    Vec3 rest = Vec3::Zero(), position = Vec3::Zero(), velocity = Vec3::Zero();
    Mat3 deformation = Mat3::Zero(), plastic_strain = Mat3::Zero();
    for (const std::size_t i : members) {
        const double weight = (all_new ? 1 : phyxels_.mass[i]) / total;
        rest += weight * phyxels_.rest_position[i];
        position += weight * phyxels_.position[i];
        velocity += weight * phyxels_.velocity[i];
        deformation += weight * phyxels_.deformation[i];
        plastic_strain += weight * phyxels_.plastic_strain[i];
    }
    const Mat3 rotation = rotation_of(deformation);
    const Mat3 shape = rotation * meshless::stretch_of(settings_.material, plastic_strain);
    for (const std::size_t i : members) {
        phyxels_.position[i] = position + shape * (phyxels_.rest_position[i] - rest);
        phyxels_.velocity[i] = velocity;
        phyxels_.previous_position[i] = phyxels_.position[i];
        phyxels_.previous_velocity[i] = phyxels_.velocity[i];
        phyxels_.deformation[i] = previous_deformation_[i] = shape;
        phyxels_.rotation[i] = rotation;
        phyxels_.plastic_strain[i] = plastic_strain;
        phyxels_.history_broken[i] = 1;
    }
}

// A piece that came off with too few phyxels to span space gets more of them.
void Body::resample(const StepContext& context, StepReport& report) {
    pairs_rebuilt_ = volumes_changed_ = false;
    if (splits_.empty()) return;
    constexpr std::size_t enough = 8;
    const std::size_t before = phyxels_.size();
    std::vector<std::size_t> count(pieces_->count(), 0);
    for (const std::int32_t piece : phyxels_.piece) ++count[static_cast<std::size_t>(piece)];
    for (std::size_t piece = 0; piece < count.size(); ++piece)
        if (count[piece] < std::min(enough, pieces_->node_counts()[piece])) {
            add_samples(static_cast<std::int32_t>(piece), std::min(enough, pieces_->node_counts()[piece]));
            make_rigid(static_cast<std::int32_t>(piece));
        }
    if (phyxels_.size() != before) {
        rebuild_samples(context.parallel);
        pairs_rebuilt_ = true;
        constrained_.clear();
        grabbed_.clear();
        tracker_.mark_all();
        report.new_phyxels += phyxels_.size() - before;
    }
    const meshless::NodeBook nodes{inside_rest_, inside_volume_, inside_piece_};
    meshless::rebook(booking_, nodes, settings_.material.density, locator_, phyxels_);
    volumes_changed_ = true;
}

void Body::rebuild_neighbourhoods(const StepContext& context) {
    if (pairs_rebuilt_) {
        neighbourhoods_.rebuild(phyxels_, pairs_, settings_.material, context.parallel);
    } else {
        if (!changed_pairs_.empty())
            neighbourhoods_.update(phyxels_, pairs_, changed_pairs_, settings_.material, context.parallel);
        if (volumes_changed_) neighbourhoods_.refresh_volumes(phyxels_, settings_.material, context.parallel);
    }
    tracker_.refresh(tracker_context(context.parallel));
    new_slots_.clear();
    changed_boxes_.clear();
    splits_.clear();
}

}  // namespace splitcubes::body
