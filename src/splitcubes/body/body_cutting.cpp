// The first stage of a step, which cuts the grid edges that blades crossed, and cuts at rest.
#include <splitcubes/body/body.h>
#include <splitcubes/body/step_context.h>
#include <splitcubes/body/step_report.h>
#include <splitcubes/body_samples/topology_change.h>
#include <splitcubes/node_motion/blade_fronts.h>
#include <splitcubes/node_motion/node_motion.h>
#include <splitcubes/node_motion/node_ties.h>
#include <splitcubes/node_motion/rest_cut.h>
#include <splitcubes/splitting/sheet_cut.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

namespace {

// Adds the edges that the blade, at rest where it begins, meets between two intervals, with the normal of the
// stroke.
void add_shifted_hits(const cutting::SweptBlade& first, std::span<const cutting::CandidateEdge> shifted,
                      const Vec3& last_normal, const Parallel& parallel,
                      std::vector<cutting::EdgeCut>& cuts) {
    if (shifted.empty()) return;
    cutting::SweptBlade still;
    for (const geometry::MovingSegment& s : first.segments) {
        still.segments.push_back({s.a0, s.b0, s.a0, s.b0});
        still.bounds.add(geometry::bounds_of(still.segments.back()));
    }
    const auto by_id = [](const auto& a, const auto& b) { return a.id < b.id; };
    std::vector<cutting::EdgeCut> hits;
    Vec3 normal = last_normal;
    for (cutting::EdgeCut& hit : cutting::cut_edges({&still, 1}, shifted, normal, parallel)) {
        if (std::binary_search(cuts.begin(), cuts.end(), hit, by_id)) continue;
        const auto edge = std::find_if(shifted.begin(), shifted.end(),
                                       [&](const cutting::CandidateEdge& e) { return e.id == hit.id; });
        if (last_normal.squaredNorm() > 0)
            hit.rest_normal = cutting::pulled_back(edge->world_from_rest, last_normal);
        hits.push_back(hit);
    }
    cuts.insert(cuts.end(), hits.begin(), hits.end());
    std::sort(cuts.begin(), cuts.end(), by_id);
}

}  // namespace

void Body::cut_edges(std::span<const cutting::SweptBlade> blades, std::int32_t cut_number, Vec3& last_normal,
                     const StepContext& context, TopologyChange& change, StepReport& report,
                     const Isometry& tool_before, const Isometry& tool_now, ToolForce& tool_force) {
    const std::size_t first_new = grid_.crossings().size();
    cut_edges_near(blades, cut_number, last_normal, context.parallel);
    for (std::size_t k = first_new; k < grid_.crossings().size(); ++k) {
        const auto slot = static_cast<std::int32_t>(k);
        change.crossings.push_back(slot);
        accumulate_cut_force(slot, context.dt, tool_before, tool_now, tool_force);
    }
    report.counts.new_cut_edges += grid_.crossings().size() - first_new;
    fronts_->add(grid_, std::span(change.crossings).last(grid_.crossings().size() - first_new));
    const std::vector<splitting::CutFront> moved =
        fronts_->advance(grid_, *motion_, tracker_context(context.parallel), blades, cut_number, first_new);
    change.fronts.insert(change.fronts.end(), moved.begin(), moved.end());
}

// Cuts the edges that the blades crossed during the last interval.
void Body::cut_edges_near(std::span<const cutting::SweptBlade> blades, std::int32_t cut_number,
                          Vec3& last_normal, const Parallel& parallel) {
    const std::vector<splitting::GridEdge> edges = motion_->edges_near(grid_, blades, parallel);
    if (edges.empty()) return;
    const NodeMotion::Candidates candidates = motion_->candidate_edges(edges, tracker_context(parallel));
    std::vector<cutting::EdgeCut> cuts = cutting::cut_edges(blades, candidates.moving, last_normal, parallel);
    add_shifted_hits(blades.front(), candidates.shifted, last_normal, parallel, cuts);
    resolve_node_ties(grid_, cuts);
    for (const cutting::EdgeCut& cut : cuts)
        grid_.cut(splitting::edge_from_id(cut.id), cut.parameter, cut.rest_normal, splitting::Origin::cut,
                  cut_number);
}

// Adds the resistance of one grid edge that the blade cut in the last interval of dt seconds.
void Body::accumulate_cut_force(std::int32_t slot, double dt, const Isometry& tool_before,
                                const Isometry& tool_now, ToolForce& tool_force) const {
    const splitting::Crossing& crossing = grid_.crossing(slot);
    const double cell = grid_.rest().cell_size;
    const double area = cell * cell * std::abs(crossing.normal[crossing.edge.axis]);
    const double work = settings_.material.cutting_resistance * area;
    tool_force.area += area;
    tool_force.work += work;
    const std::int32_t a = motion_->tracker().find(crossing.edge.node),
                       b = motion_->tracker().find(crossing.edge.upper());
    if (!(work > 0) || a < 0 || b < 0) return;
    const Vec3 point = (1 - crossing.parameter) * motion_->frames()[static_cast<std::size_t>(a)].position +
                       crossing.parameter * motion_->frames()[static_cast<std::size_t>(b)].position;
    const Vec3 displacement = point - tool_before * (tool_now.inverse() * point);
    // Below a micrometre per second there is no direction of motion to resist.
    if (displacement.norm() > 1e-6 * dt)
        tool_force.add_force(tool_now, point, -work / displacement.squaredNorm() * displacement);
}

std::size_t Body::cut_with_sheet(const geometry::TriangleMesh& sheet, std::int32_t cut_number,
                                 const Parallel& parallel) {
    TopologyChange change;
    geometry::TriangleMesh at_rest = sheet;
    for (Vec3& p : at_rest.positions) p = settings_.pose.inverse() * p;
    change.crossings = splitting::cut_with_sheet(grid_, at_rest, cut_number);
    settle_topology(parallel, change);
    return change.crossings.size();
}

std::size_t Body::cut_with_blade(const cutting::Blade& blade, std::int32_t cut_number,
                                 const Parallel& parallel) {
    TopologyChange change;
    change.crossings = body::cut_with_blade(grid_, blade, cut_number, parallel, {}, settings_.pose.inverse());
    settle_topology(parallel, change);
    return change.crossings.size();
}

void Body::settle_topology(const Parallel& parallel, TopologyChange& change) {
    StepReport report;
    const StepContext context{0, 0, Vec3::Zero(), {}, {}, {}, parallel};
    retessellate(parallel, change, report);
    label_pieces(change);
    update_visibility(context, change, report);
    resample(context, change, report);
    rebuild_neighbourhoods(context, change);
    update_node_frames(context, report);
    move_surface(context);
    finish_surface(context, report);
}

}  // namespace splitcubes::body
