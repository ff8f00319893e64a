// The first stages of a step: which grid edges the blades crossed.
#include <splitcubes/body/body.h>
#include <splitcubes/splitting/sheet_cut.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace splitcubes::body {

using splitting::GridEdge;

// World box of everything within `radius` (max norm) of a rest point, now and a step ago. A
// node's place is a convex combination of where its phyxels would carry it, so
// the union of these holds it.
geometry::Box Body::bounds_of_brick(const Vec3& centre, double radius,
                                    std::vector<std::uint32_t>& near) const {
    double reach = 0;
    for (const double h : phyxels_.support_radius) reach = std::max(reach, h);
    locator_.near(centre, reach + std::sqrt(3.0) * radius, near);
    geometry::Box box;
    for (const std::uint32_t i : near) {
        const Vec3 offset = centre - phyxels_.rest_position[i];
        const auto add = [&](const Vec3& position, const Mat3& deformation) {
            const Vec3 at = position + deformation * offset;
            const Vec3 spread = radius * deformation.cwiseAbs().rowwise().sum();
            box.add(geometry::Box{at - spread, at + spread});
        };
        add(phyxels_.position[i], phyxels_.deformation[i]);
        add(phyxels_.previous_position[i], previous_deformation_[i]);
    }
    return box;
}

// Bricks of grid nodes that the blades may have reached: blocks of 4^3 bricks
// first, then the bricks of those that are hit.
std::vector<std::uint32_t> Body::candidate_bricks(std::span<const cutting::SweptBlade> blades) const {
    geometry::Box blade;
    for (const cutting::SweptBlade& swept : blades) blade.add(swept.bounds);
    std::vector<std::uint32_t> out;
    if (blade.empty()) return out;
    const splitting::BrickLayout& layout = grid_.bricks();
    const double h = grid_.rest().cell_size;
    // A node without a kernel of its own follows a neighbour: one more cell of reach.
    const auto hit = [&](const Vec3i& first_brick, int bricks, std::vector<std::uint32_t>& near) {
        const double half = 0.5 * splitting::brick_side * bricks;
        const Vec3 centre = grid_.rest().origin +
                            h * (first_brick.cast<double>() * splitting::brick_side + Vec3::Constant(half));
        return bounds_of_brick(centre, h * (half + 1), near).meets(blade);
    };
    constexpr int block = 4;
    std::vector<std::uint32_t> near;
    for (int z = 0; z < layout.brick_count[2]; z += block)
        for (int y = 0; y < layout.brick_count[1]; y += block)
            for (int x = 0; x < layout.brick_count[0]; x += block) {
                if (!hit({x, y, z}, block, near)) continue;
                for (int k = 0; k < block * block * block; ++k) {
                    const Vec3i brick(x + k % block, y + k / block % block, z + k / (block * block));
                    if ((brick.array() >= layout.brick_count.array()).any()) continue;
                    const std::size_t index = layout.brick_of(splitting::brick_side * brick);
                    if (grid_.inside_word(index) && hit(brick, 1, near))
                        out.push_back(static_cast<std::uint32_t>(index));
                }
            }
    std::sort(out.begin(), out.end());
    return out;
}

// The uncut edges between inside nodes of the bricks, each with its motion over
// the last interval.
std::vector<cutting::CandidateEdge> Body::candidate_edges(std::span<const std::uint32_t> bricks,
                                                          const StepContext& context) {
    std::vector<GridEdge> edges;
    for (const std::uint32_t brick : bricks) {
        const Vec3i base = grid_.bricks().base(brick);
        for (unsigned local = 0; local < splitting::brick_places; ++local) {
            if (!(grid_.inside_word(brick) >> local & 1U)) continue;
            const Vec3i node = base + splitting::BrickLayout::local_place(local);
            for (int axis = 0; axis < 3; ++axis) {
                const GridEdge edge{node, axis};
                if (!grid_.has_edge(edge) || grid_.is_cut(edge)) continue;
                edges.push_back(edge);
                tracker_.track(grid_, edge.node);
                tracker_.track(grid_, edge.upper());
            }
        }
    }
    const TrackerContext tracker = tracker_context(context.parallel);
    const std::size_t known = frames_.size();
    tracker_.refresh(tracker);
    if (tracker_.size() != known)
        tracker_.evaluate(tracker, phyxels_.position, phyxels_.deformation, frames_);
    cut_position_.resize(tracker_.size());
    cut_step_.resize(tracker_.size(), -2);
    // Where a node was at the start of the interval: as the last step saw it, so
    // that intervals join without a gap; from the last state of the phyxels where
    // it was not looked at.
    std::vector<geometry::Frame> before;
    tracker_.evaluate(tracker, phyxels_.previous_position, previous_deformation_, before);
    std::vector<cutting::CandidateEdge> out;
    out.reserve(edges.size());
    const auto start_of = [&](std::uint32_t node) {
        return cut_step_[node] == step_ - 1 ? cut_position_[node] : before[node].position;
    };
    for (const GridEdge& edge : edges) {
        const auto a = static_cast<std::uint32_t>(tracker_.find(edge.node));
        const auto b = static_cast<std::uint32_t>(tracker_.find(edge.upper()));
        cutting::CandidateEdge candidate;
        candidate.id = splitting::edge_id(edge);
        candidate.motion = {start_of(a), start_of(b), frames_[a].position, frames_[b].position};
        candidate.world_from_rest = 0.5 * (frames_[a].jacobian + frames_[b].jacobian);
        out.push_back(candidate);
    }
    for (const GridEdge& edge : edges)
        for (const Vec3i& node : {edge.node, edge.upper()}) {
            const auto index = static_cast<std::size_t>(tracker_.find(node));
            cut_position_[index] = frames_[index].position;
            cut_step_[index] = step_;
        }
    return out;
}

void Body::cut_edges(std::span<const cutting::SweptBlade> blades, std::int32_t cut_number, Vec3& last_normal,
                     const StepContext& context, StepReport& report, const Isometry& tool_before,
                     const Isometry& tool_now, ToolForce& felt) {
    const std::vector<std::uint32_t> bricks = candidate_bricks(blades);
    if (bricks.empty()) return;
    const std::vector<cutting::CandidateEdge> candidates = candidate_edges(bricks, context);
    const std::vector<cutting::EdgeCut> cuts =
        cutting::cut_edges(blades, candidates, last_normal, context.parallel);
    for (const cutting::EdgeCut& cut : cuts) {
        const std::int32_t slot = grid_.cut(splitting::edge_from_id(cut.id), cut.parameter, cut.rest_normal,
                                            splitting::Origin::cut, cut_number);
        if (slot < 0) continue;
        new_slots_.push_back(slot);
        feel_cut(slot, context.dt, tool_before, tool_now, felt);
    }
    report.new_cut_edges += cuts.size();
}

std::size_t Body::cut_with_sheet(const geometry::TriangleMesh& sheet, std::int32_t cut_number,
                                 const Parallel& parallel) {
    StepReport report;
    new_slots_ = splitting::cut_with_sheet(grid_, sheet, cut_number);
    const std::size_t count = new_slots_.size();
    settle_topology(parallel, report);
    return count;
}

void Body::settle_topology(const Parallel& parallel, StepReport& report) {
    const StepContext context{0, 0, Vec3::Zero(), {}, parallel};
    retessellate(report);
    label_pieces(report);
    update_visibility(context, report);
    resample(context, report);
    rebuild_neighbourhoods(context);
    update_node_frames(context, report);
    update_surface(context, report);
}

}  // namespace splitcubes::body
