#include <splitcubes/cutting/sweep.h>
#include <splitcubes/node_motion/blade_fronts.h>
#include <splitcubes/node_motion/node_ties.h>
#include <splitcubes/node_motion/rest_cut.h>
#include <splitcubes/node_motion/tuning.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace splitcubes::body {

namespace {

using geometry::Box;
using geometry::MovingSegment;
using splitting::GridEdge;
using splitting::NodeGrid;

// Collects the edges near the sweep of a blade. A moving segment sweeps a bilinear patch, which lies in the
// box of its four corners; patches are halved along their longer sides until their boxes are small.
class Candidates {
  public:
    enum class Wanted { uncut_inside, all_of_the_body };

    explicit Candidates(const NodeGrid& grid, Wanted wanted = Wanted::uncut_inside)
        : grid_(grid),
          wanted_(wanted),
          space_{Vec3::Zero(), (grid.rest().node_count - Vec3i::Ones()).cast<double>()} {}

    void add(const MovingSegment& s) {
        const geometry::RestGrid& rest = grid_.rest();
        MovingSegment in_cells{rest.to_grid(s.a0), rest.to_grid(s.b0), rest.to_grid(s.a1),
                               rest.to_grid(s.b1)};
        // geometry::first_hit has a tolerance of 1e-7 of the lengths.
        const double length = (in_cells.b0 - in_cells.a0).norm() + (in_cells.b1 - in_cells.a1).norm() + 1;
        margin_ = 1e-6 * length;
        add_patch(in_cells, 0);
    }

    // Returns the edges, each once, ascending by edge_id, and clears the collection.
    std::vector<cutting::CandidateEdge> take() {
        std::sort(ids_.begin(), ids_.end());
        ids_.erase(std::unique(ids_.begin(), ids_.end()), ids_.end());
        std::vector<cutting::CandidateEdge> out;
        out.reserve(ids_.size());
        for (const std::uint64_t id : ids_) {
            const GridEdge edge = splitting::edge_from_id(id);
            const Vec3 a = grid_.rest().node_position(edge.node);
            const Vec3 b = grid_.rest().node_position(edge.upper());
            out.push_back({id, {a, b, a, b}, Mat3::Identity()});
        }
        ids_.clear();
        return out;
    }

  private:
    void add_patch(const MovingSegment& s, int depth) {
        const Box box = geometry::bounds_of(s).grown(margin_);
        if (!box.meets(space_)) return;
        const double size = box.size().maxCoeff() - 2 * margin_;
        if (depth == tuning::cutting::rest_cut_max_depth ||
            size <= std::max(tuning::cutting::rest_cut_leaf_size, 4 * margin_))
            return add_edges(box);
        const double along = std::max((s.b0 - s.a0).norm(), (s.b1 - s.a1).norm());
        const double across = std::max((s.a1 - s.a0).norm(), (s.b1 - s.b0).norm());
        if (along >= across) {
            const Vec3 m0 = 0.5 * (s.a0 + s.b0), m1 = 0.5 * (s.a1 + s.b1);
            add_patch({s.a0, m0, s.a1, m1}, depth + 1);
            add_patch({m0, s.b0, m1, s.b1}, depth + 1);
        } else {
            const Vec3 a = 0.5 * (s.a0 + s.a1), b = 0.5 * (s.b0 + s.b1);
            add_patch({s.a0, s.b0, a, b}, depth + 1);
            add_patch({a, b, s.a1, s.b1}, depth + 1);
        }
    }

    void add_edges(const Box& box) {
        // The lower node of an edge that reaches into the box is not below the cell of the box's low corner.
        const Vec3i low = box.min.cwiseMax(space_.min).array().floor().cast<int>();
        const Vec3i high = box.max.cwiseMin(space_.max).array().floor().cast<int>();
        for (int z = low[2]; z <= high[2]; ++z)
            for (int y = low[1]; y <= high[1]; ++y)
                for (int x = low[0]; x <= high[0]; ++x) add_edges_of({x, y, z}, box);
    }

    void add_edges_of(const Vec3i& node, const Box& box) {
        if (wanted_ == Wanted::uncut_inside && !grid_.inside(node)) return;
        for (int axis = 0; axis < 3; ++axis) {
            const GridEdge edge{node, axis};
            if (!grid_.has_edge(edge) || !is_wanted(edge)) continue;
            if (box.meets({node.cast<double>(), edge.upper().cast<double>()}))
                ids_.push_back(splitting::edge_id(edge));
        }
    }

    bool is_wanted(const GridEdge& edge) const {
        const bool lower = grid_.inside(edge.node), upper = grid_.inside(edge.upper());
        return wanted_ == Wanted::uncut_inside ? lower && upper && !grid_.is_cut(edge) : lower || upper;
    }

    const NodeGrid& grid_;
    Wanted wanted_;
    Box space_;  // cells, bounds of the grid
    double margin_ = 0;
    std::vector<std::uint64_t> ids_;
};

// Returns the ends of the path's spans, s: the ends of the active interval and the keyframes within it.
std::vector<double> span_times(const cutting::Blade& blade) {
    std::vector<double> times = {blade.active_from()};
    for (const cutting::Keyframe& key : blade.keyframes())
        if (key.time > times.back() && key.time < blade.active_until()) times.push_back(key.time);
    times.push_back(blade.active_until());
    return times;
}

void move(cutting::SweptBlade& part, const Isometry& to) {
    part.bounds = {};
    for (MovingSegment& s : part.segments) {
        s = {to * s.a0, to * s.b0, to * s.a1, to * s.b1};
        part.bounds.add(geometry::bounds_of(s));
    }
}

}  // namespace

std::vector<std::int32_t> cut_with_blade(NodeGrid& grid, const cutting::Blade& blade, std::int32_t cut_number,
                                         const Parallel& parallel, const std::function<bool()>& stop,
                                         const Isometry& rest_from_world) {
    std::vector<std::int32_t> slots;
    Vec3 last_normal = Vec3::Zero();
    Candidates near(grid);
    const Box in_grid{grid.rest().node_position(Vec3i::Zero()),
                      grid.rest().node_position(grid.rest().node_count - Vec3i::Ones())};
    std::vector<cutting::SweptBlade> all;  // in the grid
    const std::vector<double> times = span_times(blade);
    for (std::size_t k = 0; k + 1 < times.size(); ++k) {
        if (stop && stop()) break;
        std::vector<cutting::SweptBlade> swept = cutting::sweep(blade, times[k], times[k + 1]);
        for (cutting::SweptBlade& part : swept) move(part, rest_from_world);
        for (const cutting::SweptBlade& part : swept)
            for (const MovingSegment& segment : part.segments) near.add(segment);
        const std::vector<cutting::CandidateEdge> candidates = near.take();
        std::copy_if(swept.begin(), swept.end(), std::back_inserter(all),
                     [&](const cutting::SweptBlade& part) { return part.bounds.meets(in_grid); });
        if (candidates.empty()) continue;
        std::vector<cutting::EdgeCut> cuts = cutting::cut_edges(swept, candidates, last_normal, parallel);
        resolve_node_ties(grid, cuts);
        for (const cutting::EdgeCut& cut : cuts) {
            const std::int32_t slot = grid.cut(splitting::edge_from_id(cut.id), cut.parameter,
                                               cut.rest_normal, splitting::Origin::cut, cut_number);
            if (slot >= 0) slots.push_back(slot);
        }
    }
    place_fronts_at_rest(grid, slots, all);
    return slots;
}

void append_edges_crossed(const NodeGrid& grid, std::span<const cutting::SweptBlade> swept,
                          const Parallel& parallel, std::vector<std::uint64_t>& ids) {
    Candidates near(grid, Candidates::Wanted::all_of_the_body);
    for (const cutting::SweptBlade& part : swept)
        for (const MovingSegment& segment : part.segments) near.add(segment);
    const std::vector<cutting::CandidateEdge> candidates = near.take();
    Vec3 normal = Vec3::Zero();
    for (const cutting::EdgeCut& cut : cutting::cut_edges(swept, candidates, normal, parallel))
        ids.push_back(cut.id);
}

splitting::CrossedEdges crossed_edges(const NodeGrid& grid, std::vector<std::uint64_t>& ids) {
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    splitting::CrossedEdges out;
    for (const std::uint64_t id : ids) out.add(grid, splitting::edge_from_id(id));
    return out;
}

splitting::CrossedEdges edges_crossed_by_blade(const NodeGrid& grid, const cutting::Blade& blade,
                                               const Parallel& parallel) {
    std::vector<std::uint64_t> ids;
    const std::vector<double> times = span_times(blade);
    for (std::size_t k = 0; k + 1 < times.size(); ++k)
        append_edges_crossed(grid, cutting::sweep(blade, times[k], times[k + 1]), parallel, ids);
    return crossed_edges(grid, ids);
}

}  // namespace splitcubes::body
