#include <splitcubes/body/node_tracker.h>

#include <algorithm>
#include <deque>
#include <set>

namespace splitcubes::body {

using splitting::GridEdge;

std::uint32_t NodeTracker::track(const splitting::NodeGrid& grid, const Vec3i& node) {
    std::int32_t index = index_.get(node, 0);
    if (index < 0) {
        index = static_cast<std::int32_t>(places_.size());
        index_.set(node, 0, index);
        places_.push_back(node);
        rest_.push_back(grid.rest().node_position(node));
        piece_.push_back(-1);
        dirty_.push_back(1);
    }
    return static_cast<std::uint32_t>(index);
}

void NodeTracker::mark_all() {
    std::fill(dirty_.begin(), dirty_.end(), std::uint8_t{1});
}

void NodeTracker::mark_near(std::span<const geometry::Box> boxes, double radius) {
    geometry::Box all;
    for (const geometry::Box& box : boxes) all.add(box);
    if (all.empty()) return;
    all = all.grown(radius);
    for (std::size_t i = 0; i < rest_.size(); ++i) {
        if (dirty_[i] || !all.contains(rest_[i])) continue;
        for (const geometry::Box& box : boxes) {
            const Vec3 outside = (box.min - rest_[i]).cwiseMax(rest_[i] - box.max).cwiseMax(0);
            if (outside.squaredNorm() <= radius * radius) {
                dirty_[i] = 1;
                break;
            }
        }
    }
}

void NodeTracker::refresh(const TrackerContext& context) {
    if (pieces_changed_) {
        for (std::size_t i = 0; i < places_.size(); ++i) {
            piece_[i] = context.pieces.piece_of(context.grid, places_[i]);
            if (dirty_[i]) continue;
            const meshless::NodeKernels::Row& row = kernels_.rows[i];
            for (std::uint32_t k = row.begin; k < row.begin + row.count && !dirty_[i]; ++k)
                dirty_[i] = context.phyxels.piece[kernels_.phyxel[k]] != piece_[i];
            if (row.count == 0) dirty_[i] = 1;
        }
        pieces_changed_ = false;
    }
    rows_.clear();
    for (std::uint32_t i = 0; i < dirty_.size(); ++i)
        if (dirty_[i]) rows_.push_back(i);
    if (rows_.empty()) return;
    refresh_rows(context);
    find_fallbacks(context);
}

void NodeTracker::refresh_rows(const TrackerContext& context) {
    for (const std::uint32_t i : rows_) piece_[i] = context.pieces.piece_of(context.grid, places_[i]);
    const auto sees = [&](std::size_t node, std::uint32_t phyxel) {
        return context.occluders.segment_blocked(rest_[node], context.phyxels.rest_position[phyxel]) ? 0.0
                                                                                                     : 1.0;
    };
    meshless::rebuild_kernels(kernels_, rows_, rest_, piece_, context.phyxels, context.locator, sees,
                              context.parallel);
    for (const std::uint32_t i : rows_) dirty_[i] = 0;
}

// Sources may be nodes that were not tracked before; they are tracked from now on,
// and those of them that see nothing either are passed over.
void NodeTracker::find_fallbacks(const TrackerContext& context) {
    fallbacks_.clear();
    for (std::uint32_t i = 0; i < kernels_.rows.size(); ++i)
        if (kernels_.rows[i].count == 0) fallbacks_.push_back({i, i});
    for (std::size_t k = 0; k < fallbacks_.size(); ++k) {
        const std::uint32_t source = nearest_source(context, fallbacks_[k].node);
        fallbacks_[k].source = source;
    }
    std::erase_if(fallbacks_, [](const Fallback& f) { return f.source == f.node; });
}

// Breadth first over uncut edges, in a fixed order of directions.
std::uint32_t NodeTracker::nearest_source(const TrackerContext& context, std::uint32_t node) {
    const splitting::NodeGrid& grid = context.grid;
    std::deque<Vec3i> queue{places_[node]};
    std::set<std::uint64_t> seen{splitting::edge_id({places_[node], 0})};
    constexpr std::size_t search_limit = 4096;
    while (!queue.empty() && seen.size() < search_limit) {
        const Vec3i at = queue.front();
        queue.pop_front();
        for (int axis = 0; axis < 3; ++axis)
            for (const int step : {-1, 1}) {
                Vec3i next = at;
                next[axis] += step;
                const GridEdge edge{step > 0 ? at : next, axis};
                if (!grid.rest().contains(next) || !grid.inside(next) || grid.is_cut(edge)) continue;
                if (!seen.insert(splitting::edge_id({next, 0})).second) continue;
                queue.push_back(next);
                const std::uint32_t index = track(grid, next);
                if (dirty_[index]) {
                    rows_.assign(1, index);
                    refresh_rows(context);
                }
                if (kernels_.rows[index].count > 0) return index;
            }
    }
    bind_to_nearest(context, node);
    return node;
}

// No node of the piece sees a phyxel: the piece's nearest phyxel carries the node.
void NodeTracker::bind_to_nearest(const TrackerContext& context, std::uint32_t node) {
    const meshless::Phyxels& phyxels = context.phyxels;
    std::size_t best = phyxels.size();
    double best_distance = 0;
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (phyxels.piece[i] != piece_[node]) continue;
        const double distance = (phyxels.rest_position[i] - rest_[node]).squaredNorm();
        if (best == phyxels.size() || distance < best_distance) {
            best = i;
            best_distance = distance;
        }
    }
    if (best == phyxels.size()) return;  // no phyxel yet: resampling gives the piece one
    meshless::NodeKernels::Row& row = kernels_.rows[node];
    if (row.capacity == 0) {
        row.begin = static_cast<std::uint32_t>(kernels_.phyxel.size());
        row.capacity = 1;
        kernels_.phyxel.push_back(0);
        kernels_.weight.push_back(0);
    }
    row.count = 1;
    kernels_.phyxel[row.begin] = static_cast<std::uint32_t>(best);
    kernels_.weight[row.begin] = 1;
}

void NodeTracker::evaluate(const TrackerContext& context, std::span<const Vec3> position,
                           std::span<const Mat3> deformation, std::vector<geometry::Frame>& out) {
    out.resize(places_.size());
    evaluator_(kernels_, rest_, context.phyxels.rest_position, position, deformation, out, context.parallel);
    for (const Fallback& f : fallbacks_) {
        const geometry::Frame& source = out[f.source];
        out[f.node] = {source.position + source.jacobian * (rest_[f.node] - rest_[f.source]),
                       source.jacobian};
    }
}

}  // namespace splitcubes::body
