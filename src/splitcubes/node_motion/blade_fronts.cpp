#include <splitcubes/node_motion/blade_fronts.h>
#include <splitcubes/node_motion/face_reach.h>
#include <splitcubes/node_motion/node_motion.h>
#include <splitcubes/node_motion/tuning.h>

#include <algorithm>
#include <array>

namespace splitcubes::body {

namespace {

using splitting::CutFront;
using splitting::GridEdge;
using splitting::NodeGrid;

// Corners of the ring of a face that has a motion per edge: of `crossed` and of the edge opposite to it.
MovingFace moving_face(const NodeGrid& grid, const CutFront& front, const geometry::MovingSegment& crossed,
                       const geometry::MovingSegment& opposite) {
    const GridEdge& edge = grid.crossing(front.slot).edge;
    const splitting::GridFace face = splitting::face_beside(edge, front.side);
    MovingFace out;
    out.ray = splitting::ray_of(grid, front);
    for (std::size_t k = 0; k < 4; ++k) {
        const Vec3i node = splitting::ring_node(face, static_cast<int>(k));
        const int across = 3 - face.axis - edge.axis;
        const geometry::MovingSegment& on = node[across] == edge.node[across] ? crossed : opposite;
        const bool is_lower = node[edge.axis] == edge.node[edge.axis];
        out.before[k] = is_lower ? on.a0 : on.b0;
        out.now[k] = is_lower ? on.a1 : on.b1;
    }
    return out;
}

geometry::MovingSegment at_rest(const NodeGrid& grid, const GridEdge& edge) {
    const Vec3 a = grid.rest().node_position(edge.node), b = grid.rest().node_position(edge.upper());
    return {a, b, a, b};
}

}  // namespace

void BladeFronts::add(const NodeGrid& grid, std::span<const std::int32_t> slots) {
    const std::vector<CutFront> fresh = splitting::fronts_beside(grid, slots);
    open_.insert(open_.end(), fresh.begin(), fresh.end());
}

std::vector<CutFront> BladeFronts::near(const NodeGrid& grid, const NodeMotion& motion,
                                        std::span<const cutting::SweptBlade> blades, std::int32_t cut_number,
                                        std::size_t first_new) {
    std::erase_if(open_, [&](const CutFront& front) { return !grid.ends_in(front); });
    geometry::Box swept;
    for (const cutting::SweptBlade& part : blades) swept.add(part.bounds);
    std::vector<CutFront> out;
    for (const CutFront& front : open_) {
        const splitting::Crossing& crossing = grid.crossing(front.slot);
        if (crossing.cut != cut_number) continue;
        geometry::Box box;
        bool is_tracked = static_cast<std::size_t>(front.slot) < first_new;
        const splitting::GridFace face = splitting::face_beside(crossing.edge, front.side);
        for (int k = 0; k < 4 && is_tracked; ++k) {
            const std::int32_t node = motion.tracker().find(splitting::ring_node(face, k));
            is_tracked = node >= 0 && static_cast<std::size_t>(node) < motion.frames().size();
            if (is_tracked) box.add(motion.frames()[static_cast<std::size_t>(node)].position);
        }
        if (!is_tracked || box.grown(tuning::cutting::front_margin * grid.rest().cell_size).meets(swept))
            out.push_back(front);
    }
    return out;
}

std::vector<CutFront> BladeFronts::advance(NodeGrid& grid, NodeMotion& motion, const TrackerContext& context,
                                           std::span<const cutting::SweptBlade> blades,
                                           std::int32_t cut_number, std::size_t first_new) {
    const std::vector<CutFront> fronts = near(grid, motion, blades, cut_number, first_new);
    if (fronts.empty()) return {};
    std::vector<GridEdge> edges;
    for (const CutFront& front : fronts) {
        edges.push_back(grid.crossing(front.slot).edge);
        edges.push_back(splitting::opposite_edge(edges.back(), front.side));
    }
    const std::vector<cutting::CandidateEdge> moving = motion.candidate_edges(edges, context).moving;
    std::vector<CutFront> moved;
    for (std::size_t k = 0; k < fronts.size(); ++k) {
        const std::optional<double> share =
            reach_in(moving_face(grid, fronts[k], moving[2 * k].motion, moving[2 * k + 1].motion), blades);
        if (!share) continue;
        const int step = splitting::moving_step_at(*share);
        if (static_cast<std::size_t>(fronts[k].slot) < first_new) {
            const int known = grid.crossing(fronts[k].slot).front[fronts[k].side];
            if (step <= (known > 0 ? known : splitting::front_steps / 2)) continue;
            moved.push_back(fronts[k]);
        }
        grid.move_front(fronts[k], step);
    }
    return moved;
}

void place_fronts_at_rest(NodeGrid& grid, std::span<const std::int32_t> slots,
                          std::span<const cutting::SweptBlade> blades) {
    for (const CutFront& front : splitting::fronts_beside(grid, slots)) {
        const GridEdge& edge = grid.crossing(front.slot).edge;
        const MovingFace face = moving_face(grid, front, at_rest(grid, edge),
                                            at_rest(grid, splitting::opposite_edge(edge, front.side)));
        if (const std::optional<double> share = reach_in(face, blades))
            grid.move_front(front, splitting::step_at(*share));
    }
}

}  // namespace splitcubes::body
