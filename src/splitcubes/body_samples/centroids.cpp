#include <splitcubes/body_samples/centroids.h>
#include <splitcubes/body_samples/elastic_samples.h>
#include <splitcubes/body_samples/material_nodes.h>
#include <splitcubes/body_samples/placement.h>
#include <splitcubes/body_samples/tuning.h>
#include <splitcubes/geometry/box.h>
#include <splitcubes/splitting/node_grid.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

namespace {

using geometry::Box;

// Material that belongs to a phyxel.
struct Share {
    std::uint32_t phyxel = 0;
    double volume = 0;           // m^3
    Vec3 moment = Vec3::Zero();  // m^4, first moment
};

// Divides boxes of material among the nearest of some points. Not for use on several threads at once.
class Division {
  public:
    // largest_part: m; smaller parts that several points share are divided by the distance of their centres
    // from the planes half way between the points.
    Division(std::span<const Vec3> points, double largest_part, std::vector<Share>& out)
        : points_(points), largest_part_(largest_part), out_(out) {}

    // Adds the shares of the points `among` in the box.
    void divide(const Box& box, std::span<const std::uint32_t> among) {
        candidates_.assign(among.begin(), among.end());
        divide(box, 0, candidates_.size());
    }
    // Returns whether all of the box is nearer to point `near` than to point `other`.
    bool is_nearer(const Box& box, std::uint32_t near, std::uint32_t other) const {
        return side(box, near, other) >= 1 - 1e-9;
    }

  private:
    // Place of a box beside the plane half way between two points: 1 if it touches the plane from the side of
    // `near`, 0 if its centre lies in it, -1 if it touches it from the other side. It is linear in the
    // centre.
    double side(const Box& box, std::uint32_t near, std::uint32_t other) const {
        const Vec3 apart = points_[other] - points_[near];
        const Vec3 middle = 0.5 * (points_[other] + points_[near]);
        return 2 * apart.dot(middle - box.center()) / apart.cwiseAbs().dot(box.size());
    }
    void divide(const Box& box, std::size_t begin, std::size_t end);
    void give_parts(const Box& box, std::size_t begin, std::size_t end);
    void give(const Box& box, std::uint32_t to, double share);

    std::span<const Vec3> points_;
    double largest_part_;
    std::vector<Share>& out_;
    std::vector<std::uint32_t> candidates_;  // a stack: those of a part behind those of the box it is part of
    std::vector<std::uint32_t> nearest_;     // scratch
    std::vector<double> weight_;             // scratch
};

void Division::give(const Box& box, std::uint32_t to, double share) {
    auto of = std::find_if(out_.begin(), out_.end(), [&](const Share& s) { return s.phyxel == to; });
    if (of == out_.end()) of = out_.insert(of, {to});
    const double volume = share * box.size().prod();
    of->volume += volume;
    of->moment += volume * box.center();
}

void Division::divide(const Box& box, std::size_t begin, std::size_t end) {
    const Vec3 centre = box.center();
    const auto distance = [&](std::uint32_t i) { return (points_[i] - centre).squaredNorm(); };
    std::uint32_t nearest = candidates_[begin];
    for (std::size_t k = begin; k < end; ++k)
        if (distance(candidates_[k]) < distance(nearest)) nearest = candidates_[k];
    for (std::size_t k = begin; k < end; ++k) {
        const std::uint32_t i = candidates_[k];
        if (i == nearest || !is_nearer(box, nearest, i)) candidates_.push_back(i);
    }
    const std::size_t last = candidates_.size();
    if (last == end + 1) {
        give(box, nearest, 1);
    } else if (box.size().maxCoeff() <= largest_part_) {
        give_parts(box, end, last);
    } else {
        for (int k = 0; k < 8; ++k) {
            Box part = box;
            for (int axis = 0; axis < 3; ++axis)
                ((k >> axis & 1) != 0 ? part.min : part.max)[axis] = centre[axis];
            divide(part, end, last);
        }
    }
    candidates_.resize(end);
}

// Only points to which some of the box may be nearest count, whatever point is the nearest to its centre.
void Division::give_parts(const Box& box, std::size_t begin, std::size_t end) {
    const std::span<const std::uint32_t> all(candidates_.data() + begin, end - begin);
    nearest_.clear();
    for (const std::uint32_t i : all)
        if (std::none_of(all.begin(), all.end(), [&](std::uint32_t j) { return is_nearer(box, j, i); }))
            nearest_.push_back(i);
    weight_.assign(nearest_.size(), 1);
    double total = 0;
    for (std::size_t a = 0; a < nearest_.size(); ++a) {
        for (std::size_t b = 0; b < nearest_.size(); ++b)
            if (a != b) weight_[a] *= std::min(1.0, 0.5 * (1 + side(box, nearest_[a], nearest_[b])));
        total += weight_[a];
    }
    for (std::size_t a = 0; a < nearest_.size(); ++a) give(box, nearest_[a], weight_[a] / total);
}

// The rounds of one body.
class Rounds {
  public:
    Rounds(const SampleContext& context, double spacing, std::vector<Vec3>& positions);

    // Moves the phyxels once; returns whether any moved.
    bool run();

  private:
    void share_node(std::size_t node, const meshless::PhyxelLocator& locator, std::vector<Share>& out) const;
    void move(std::size_t i, const Vec3& centroid);
    Vec3 snapped(const Vec3& point) const { return unit_ * (point / unit_).array().round().matrix(); }

    static constexpr std::size_t grain = 256;

    const SampleContext& context_;
    double spacing_;  // m
    double unit_;     // m; places are multiples of it, so that symmetric bodies get no offsets from rounding
    std::vector<Vec3>& positions_;            // m
    std::vector<std::uint8_t> can_move_;      // per phyxel
    std::vector<std::uint8_t> has_moved_;     // per phyxel: in the last round?
    std::vector<std::uint32_t> nodes_;        // whose material the moving phyxels may share
    std::vector<std::vector<Share>> shares_;  // per entry of nodes_
};

Rounds::Rounds(const SampleContext& context, double spacing, std::vector<Vec3>& positions)
    : context_(context),
      spacing_(spacing),
      unit_(std::ldexp(1.0, std::ilogb(spacing) - 32)),
      positions_(positions),
      can_move_(positions.size(), 0) {
    const std::vector<Vec3> boundary = boundary_points(context);
    const double reach = tuning::lloyd::reach * spacing;
    const meshless::PhyxelLocator near_boundary(boundary, reach);
    const auto none = [](std::uint32_t) { return false; };
    context.parallel.for_each(positions.size(), grain, [&](std::size_t i) {
        can_move_[i] = near_boundary.visit(positions[i], reach, none) ? 0 : 1;
    });
    has_moved_ = can_move_;
    std::vector<Vec3> moving;
    for (std::size_t i = 0; i < positions.size(); ++i)
        if (can_move_[i] != 0) moving.push_back(positions[i]);
    const double around = 2 * spacing;
    const meshless::PhyxelLocator near_moving(moving, around);
    std::vector<std::uint8_t> is_near(context.nodes.size(), 0);
    context.parallel.for_each(is_near.size(), grain, [&](std::size_t n) {
        is_near[n] = near_moving.visit(context.nodes.rest_position[n], around, none) ? 0 : 1;
    });
    for (std::uint32_t n = 0; n < is_near.size(); ++n)
        if (is_near[n] != 0) nodes_.push_back(n);
    shares_.resize(nodes_.size());
}

// Writes the shares of the phyxels that see a node in its material, unless they are as in the last round.
void Rounds::share_node(std::size_t node, const meshless::PhyxelLocator& locator,
                        std::vector<Share>& out) const {
    const Vec3& at = context_.nodes.rest_position[node];
    const double cell = context_.grid.rest().cell_size;
    std::vector<std::uint32_t> near;
    locator.near(at, spacing_ + cell, near);
    const auto has_moved = [&](std::uint32_t i) { return has_moved_[i] != 0; };
    const auto changed = [&](const Share& share) { return has_moved(share.phyxel); };
    if (std::none_of(near.begin(), near.end(), has_moved) && std::none_of(out.begin(), out.end(), changed))
        return;
    out.clear();
    const NodeExtents extents = node_extents(context_.grid, context_.nodes.node[node]);
    const Box box{at - cell * extents.below, at + cell * extents.above};
    std::stable_sort(near.begin(), near.end(), [&](std::uint32_t a, std::uint32_t b) {
        return (positions_[a] - at).squaredNorm() < (positions_[b] - at).squaredNorm();
    });
    Division division(positions_, tuning::lloyd::largest_part * spacing_, out);
    std::vector<std::uint32_t> among;
    for (const std::uint32_t i : near) {
        const bool is_far = std::any_of(among.begin(), among.end(),
                                        [&](std::uint32_t seen) { return division.is_nearer(box, seen, i); });
        if (!is_far && !context_.occluders.segment_blocked(at, positions_[i])) among.push_back(i);
    }
    if (!among.empty()) division.divide(box, among);
}

// Beyond the centroid, which converges in fewer rounds, if that is in the material and in sight.
void Rounds::move(std::size_t i, const Vec3& centroid) {
    const Vec3 from = positions_[i];
    const Vec3 to = snapped(from + tuning::lloyd::relaxation * (centroid - from));
    has_moved_[i] = (to - from).norm() > tuning::lloyd::converged * spacing_ &&
                    point_in_material(context_, to) == to && !context_.occluders.segment_blocked(from, to);
    if (has_moved_[i] != 0) positions_[i] = to;
}

bool Rounds::run() {
    const meshless::PhyxelLocator locator(positions_, spacing_);
    context_.parallel.for_each(nodes_.size(), grain,
                               [&](std::size_t k) { share_node(nodes_[k], locator, shares_[k]); });
    std::vector<double> volume(positions_.size(), 0);
    std::vector<Vec3> moment(positions_.size(), Vec3::Zero());
    for (const std::vector<Share>& of_node : shares_)
        for (const Share& share : of_node) {
            volume[share.phyxel] += share.volume;
            moment[share.phyxel] += share.moment;
        }
    context_.parallel.for_each(positions_.size(), grain, [&](std::size_t i) {
        has_moved_[i] = 0;
        if (can_move_[i] != 0 && volume[i] > 0) move(i, moment[i] / volume[i]);
    });
    return std::any_of(has_moved_.begin(), has_moved_.end(), [](std::uint8_t moved) { return moved != 0; });
}

}  // namespace

void move_to_centroids(const SampleContext& context, double spacing, std::vector<Vec3>& positions) {
    const std::vector<Vec3> lattice = positions;
    Rounds rounds(context, spacing, positions);
    for (int round = 0; round < tuning::lloyd::max_rounds; ++round)
        if (!rounds.run()) break;
    for (std::size_t i = 0; i < positions.size(); ++i)
        if ((positions[i] - lattice[i]).norm() < tuning::lloyd::still * spacing) positions[i] = lattice[i];
}

}  // namespace splitcubes::body
