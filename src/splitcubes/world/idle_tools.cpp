#include <splitcubes/body/body.h>
#include <splitcubes/node_motion/rest_cut.h>
#include <splitcubes/world/idle_tools.h>
#include <splitcubes/world/tuning.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

namespace splitcubes::body {

namespace {

bool may_cut(const Tool& tool, std::size_t body) {
    return tool.bodies.empty() ||
           std::find(tool.bodies.begin(), tool.bodies.end(), body) != tool.bodies.end();
}

geometry::Box bounds_of(const Body& body) {
    geometry::Box out;
    for (const Vec3& p : body.vertex_positions()) out.add(p);
    return out;
}

// Returns the rest position of a point of the world by the map of the nearest phyxel.
Vec3 rest_of(const meshless::Phyxels& phyxels, const Vec3& point) {
    std::size_t nearest = 0;
    double min_squared = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < phyxels.size(); ++i)
        if (const double d = (phyxels.position[i] - point).squaredNorm(); d < min_squared) {
            min_squared = d;
            nearest = i;
        }
    return phyxels.rest_position[nearest] +
           phyxels.deformation[nearest].inverse() * (point - phyxels.position[nearest]);
}

// Returns the blade's lines in rest space, sampled about every half phyxel spacing but not much finer than
// max_idle_points per line.
std::vector<std::vector<Vec3>> rest_pose(const Body& body, const std::vector<std::vector<Vec3>>& pose) {
    std::vector<std::vector<Vec3>> out;
    for (const std::vector<Vec3>& line : pose) {
        double length = 0;
        for (std::size_t i = 0; i + 1 < line.size(); ++i) length += (line[i + 1] - line[i]).norm();
        const double step = std::max(0.5 * body.phyxel_spacing(), length / tuning::cutting::max_idle_points);
        std::vector<Vec3>& points = out.emplace_back();
        for (std::size_t i = 0; i + 1 < line.size(); ++i) {
            const int parts = std::max(1, static_cast<int>(std::ceil((line[i + 1] - line[i]).norm() / step)));
            for (int k = 0; k < parts; ++k)
                points.push_back(rest_of(
                    body.phyxels(), line[i] + (k / static_cast<double>(parts)) * (line[i + 1] - line[i])));
        }
        points.push_back(rest_of(body.phyxels(), line.back()));
    }
    return out;
}

cutting::SweptBlade between(const std::vector<std::vector<Vec3>>& before,
                            const std::vector<std::vector<Vec3>>& after) {
    cutting::SweptBlade out;
    for (std::size_t line = 0; line < before.size(); ++line)
        for (std::size_t i = 0; i + 1 < before[line].size(); ++i) {
            out.segments.push_back(
                {before[line][i], before[line][i + 1], after[line][i], after[line][i + 1]});
            out.bounds.add(geometry::bounds_of(out.segments.back()));
        }
    return out;
}

// Rates how close a tool came to cutting: crossed uncut edges count more than cut ones, these more than edges
// at the boundary, and more edges more than fewer.
double nearness(const IdleTool& idle) {
    const auto share = [](std::size_t count) {
        return static_cast<double>(count) / (1 + static_cast<double>(count));
    };
    splitting::CrossedEdges all = idle.before;
    all.add(idle.last);
    return 4 * share(all.uncut) + 2 * share(all.cut) + share(all.boundary);
}

double distance(const geometry::Box& a, const geometry::Box& b) {
    return (a.min - b.max).cwiseMax(b.min - a.max).cwiseMax(Vec3::Zero()).norm();
}

}  // namespace

IdleTools::IdleTools(const World& world)
    : has_cut_(world.tools().size(), 0),
      sweep_(world.tools().size()),
      pairs_(world.tools().size() * world.bodies().size()) {
    for (const auto& body : world.bodies())
        for (const splitting::Crossing& crossing : body->grid().crossings())
            if (crossing.origin == splitting::Origin::cut && crossing.cut >= 0 &&
                static_cast<std::size_t>(crossing.cut) < has_cut_.size())
                has_cut_[static_cast<std::size_t>(crossing.cut)] = 1;
}

void IdleTools::observe(const World& world, const StepReport& report) {
    const double until = world.time(), from = until - world.settings().time_step;
    std::vector<geometry::Box> bounds(world.bodies().size());
    for (std::size_t k = 0; k < has_cut_.size(); ++k) {
        if (k < report.tools.size() && report.tools[k].area > 0) has_cut_[k] = 1;
        if (has_cut_[k]) continue;
        const Tool& tool = world.tools()[k];
        geometry::Box swept;
        for (const cutting::SweptBlade& part : cutting::sweep(tool.blade, from, until))
            swept.add(part.bounds);
        sweep_[k].add(swept);
        for (std::size_t b = 0; b < bounds.size(); ++b) {
            if (!may_cut(tool, b)) continue;
            Pair& pair = pairs_[k * bounds.size() + b];
            std::vector<std::uint64_t> all;  // bounded by the number of the body's edges
            std::set_union(pair.before.begin(), pair.before.end(), pair.last.begin(), pair.last.end(),
                           std::back_inserter(all));
            pair.before = std::move(all);
            pair.last.clear();
            if (swept.empty()) {
                pair.pose.clear();
                continue;
            }
            if (bounds[b].empty()) bounds[b] = bounds_of(*world.bodies()[b]);
            pair.bounds.add(bounds[b]);
            // Close enough that tool and body may touch in the next step.
            const double near = 2 * world.bodies()[b]->grid().rest().cell_size + 0.5 * swept.size().norm();
            if (swept.grown(near).meets(bounds[b])) {
                follow(world, k, b);
            } else {
                pair.pose.clear();
            }
        }
    }
}

void IdleTools::follow(const World& world, std::size_t tool, std::size_t body) {
    const Body& of = *world.bodies()[body];
    Pair& pair = pairs_[tool * world.bodies().size() + body];
    std::vector<std::vector<Vec3>> now = rest_pose(of, world.tools()[tool].blade.pose(world.time()));
    bool same_points = pair.pose.size() == now.size();
    for (std::size_t i = 0; same_points && i < now.size(); ++i)
        same_points = pair.pose[i].size() == now[i].size();
    if (same_points) {
        const cutting::SweptBlade swept = between(pair.pose, now);
        append_edges_crossed(of.grid(), {&swept, 1}, world.parallel(), pair.last);
        std::sort(pair.last.begin(), pair.last.end());
    }
    pair.pose = std::move(now);
}

std::vector<IdleTool> IdleTools::idle(const World& world) const {
    // Also excludes tools with crossings in the grid: a cut parallel to its edge adds no area to the report.
    const std::vector<std::uint8_t> marked = IdleTools(world).has_cut_;
    std::vector<IdleTool> out;
    const std::size_t body_count = world.bodies().size();
    for (std::size_t k = 0; k < has_cut_.size(); ++k) {
        if (has_cut_[k] || marked[k]) continue;
        std::optional<IdleTool> best;
        for (std::size_t b = 0; b < body_count; ++b) {
            if (!may_cut(world.tools()[k], b)) continue;
            const Pair& pair = pairs_[k * body_count + b];
            const splitting::NodeGrid& grid = world.bodies()[b]->grid();
            std::vector<std::uint64_t> before = pair.before, last = pair.last;
            const IdleTool one{
                k, b, sweep_[k], pair.bounds, crossed_edges(grid, before), crossed_edges(grid, last)};
            const bool better = !best || nearness(one) > nearness(*best) ||
                                (nearness(one) == nearness(*best) &&
                                 distance(one.sweep, one.bounds) < distance(best->sweep, best->bounds));
            if (better) best = one;
        }
        if (best) out.push_back(*best);
    }
    return out;
}

}  // namespace splitcubes::body
