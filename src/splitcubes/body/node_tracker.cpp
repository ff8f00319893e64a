#include <splitcubes/body/node_tracker.h>
#include <splitcubes/geometry/segment_fan.h>
#include <splitcubes/meshless/kernel.h>

#include <algorithm>
#include <deque>
#include <set>

namespace splitcubes::body {

using splitting::GridEdge;

namespace {

// A segment that many boxes are compared with.
class BoxSegment {
  public:
    BoxSegment(const Vec3& a, const Vec3& b) : a_(a) {
        for (int k = 0; k < 3; ++k) {
            const double way = b[k] - a[k];
            // On an axis along which it does not go, it is far within or far without: boxes that it is
            // compared with have a little room around what they hold.
            inverse_[k] = way == 0 ? 1e300 : 1 / way;
        }
    }
    bool meets(const geometry::Box& box) const {
        const Vec3 t0 = (box.min - a_).cwiseProduct(inverse_), t1 = (box.max - a_).cwiseProduct(inverse_);
        return std::max(t0.cwiseMin(t1).maxCoeff(), 0.0) <= std::min(t0.cwiseMax(t1).minCoeff(), 1.0);
    }

  private:
    Vec3 a_, inverse_;  // m, 1/m
};

bool within(const Vec3& point, const geometry::Box& box, double radius) {
    const Vec3 outside = (box.min - point).cwiseMax(point - box.max).cwiseMax(0);
    return outside.squaredNorm() <= radius * radius;
}

}  // namespace

std::uint32_t NodeTracker::track(const splitting::NodeGrid& grid, const Vec3i& node) {
    std::int32_t index = index_.get(node, 0);
    if (index < 0) {
        index = static_cast<std::int32_t>(places_.size());
        index_.set(node, 0, index);
        places_.push_back(node);
        rest_.push_back(grid.rest().node_position(node));
        piece_.push_back(-1);
        task_.push_back(Task::build);
        use_.push_back(Use::lately);
        links_.emplace_back();
    }
    const auto i = static_cast<std::uint32_t>(index);
    if (use_[i] == Use::none) task_[i] = Task::build;
    use_[i] = std::max(use_[i], Use::lately);
    return i;
}

std::uint32_t NodeTracker::hold(const splitting::NodeGrid& grid, const Vec3i& node) {
    const std::uint32_t index = track(grid, node);
    use_[index] = Use::always;
    return index;
}

void NodeTracker::let_sleep() {
    // Who takes the frame of another needs it for as long as it has none.
    for (const Fallback& fallback : fallbacks_)
        use_[fallback.source] = std::max(use_[fallback.source], Use::lately);
    for (std::size_t i = 0; i < use_.size(); ++i) {
        if (use_[i] == Use::lately) {
            use_[i] = Use::before;
        } else if (use_[i] == Use::before) {
            use_[i] = Use::none;
            task_[i] = Task::none;
            links_[i].clear();
            if (i < kernels_.size()) kernels_.rows[i].count = 0;
        }
    }
    std::erase_if(fallbacks_, [&](const Fallback& f) { return use_[f.node] == Use::none; });
}

void NodeTracker::mark_all() {
    for (std::size_t i = 0; i < task_.size(); ++i)
        if (use_[i] != Use::none) task_[i] = Task::build;
}

void NodeTracker::mark_near(std::span<const geometry::Box> boxes, double radius, std::uint32_t changes,
                            const Parallel& parallel) {
    marked_changes_ = changes;
    boxes_.insert(boxes_.end(), boxes.begin(), boxes.end());
    geometry::Box all;
    for (const geometry::Box& box : boxes) all.add(box);
    if (all.empty()) return;
    all = all.grown(radius);
    parallel.for_each(rest_.size(), 2048, [&](std::size_t i) {
        if (use_[i] == Use::none || task_[i] >= Task::look || !all.contains(rest_[i])) return;
        const auto near = [&](const geometry::Box& box) { return within(rest_[i], box, radius); };
        if (std::any_of(boxes.begin(), boxes.end(), near)) task_[i] = Task::look;
    });
}

void NodeTracker::refresh(const TrackerContext& context) {
    if (pieces_changed_) {
        for (std::size_t i = 0; i < places_.size(); ++i) {
            if (use_[i] == Use::none) continue;
            piece_[i] = context.pieces.piece_of(context.grid, places_[i]);
            if (task_[i] == Task::none) task_[i] = Task::filter;
        }
        pieces_changed_ = false;
    }
    work_.clear();
    for (std::uint32_t i = 0; i < task_.size(); ++i)
        if (task_[i] != Task::none) work_.push_back(i);
    if (work_.empty()) return;
    reach_ = 0;
    for (const double h : context.phyxels.support_radius) reach_ = std::max(reach_, h);
    do_tasks(context);
    boxes_.clear();
    known_changes_ = marked_changes_;
    find_fallbacks(context);
}

// The nodes of work_. Rows get their place in the pool first, one after the
// other; then nothing is shared.
void NodeTracker::do_tasks(const TrackerContext& context) {
    kernels_.rows.resize(places_.size());
    row_revision_.resize(places_.size(), 0);
    ++writings_;
    for (const std::uint32_t i : work_)
        if (task_[i] == Task::build) fresh_.push_back(i);
    context.parallel.for_chunks(work_.size(), 32, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> near;
        std::vector<geometry::Box> near_boxes;
        for (std::size_t k = begin; k < end; ++k) {
            const std::uint32_t i = work_[k];
            piece_[i] = context.pieces.piece_of(context.grid, places_[i]);
            if (task_[i] == Task::build) build_links(context, i, near);
            if (task_[i] == Task::look) look_again(context, i, near_boxes);
            task_[i] = Task::none;
        }
    });
    for (const std::uint32_t i : work_) {
        meshless::NodeKernels::Row& row = kernels_.rows[i];
        // Room for one at least: a node may be bound to a phyxel that does not reach it.
        const auto wanted = static_cast<std::uint32_t>(std::max<std::size_t>(links_[i].size(), 1));
        if (wanted <= row.capacity) continue;
        kernels_.unused += row.capacity;
        row.begin = static_cast<std::uint32_t>(kernels_.phyxel.size());
        row.capacity = wanted;
        kernels_.phyxel.resize(kernels_.phyxel.size() + wanted);
        kernels_.weight.resize(kernels_.weight.size() + wanted);
    }
    context.parallel.for_each(work_.size(), 64, [&](std::size_t k) { write_row(context, work_[k]); });
}

void NodeTracker::build_links(const TrackerContext& context, std::size_t node,
                              std::vector<std::uint32_t>& near) {
    links_[node].clear();
    context.locator.near(rest_[node], reach_, near);
    links_[node].reserve(near.size());
    geometry::SegmentFan sights(context.occluders, rest_[node], reach_);
    for (const std::uint32_t i : near) {
        const Vec3& phyxel = context.phyxels.rest_position[i];
        const double weight =
            meshless::kernel((phyxel - rest_[node]).squaredNorm(), context.phyxels.support_radius[i]);
        if (weight > 0) links_[node].push_back({i, !sights.blocked(phyxel), weight});
    }
}

void NodeTracker::look_again(const TrackerContext& context, std::size_t node,
                             std::vector<geometry::Box>& near) {
    near.clear();
    geometry::Box all;
    for (const geometry::Box& box : boxes_)
        if (within(rest_[node], box, reach_)) {
            near.push_back(box.grown(1e-9 * reach_));
            all.add(near.back());
        }
    for (Link& link : links_[node]) {
        const Vec3& phyxel = context.phyxels.rest_position[link.phyxel];
        // Most go another way.
        if (!all.meets({rest_[node].cwiseMin(phyxel), rest_[node].cwiseMax(phyxel)})) continue;
        const BoxSegment segment(rest_[node], phyxel);
        if (segment.meets(all) &&
            std::any_of(near.begin(), near.end(), [&](const auto& box) { return segment.meets(box); }))
            // What it saw through before, only what is new can stand in the way of.
            link.sees =
                !context.occluders.segment_blocked(rest_[node], phyxel, link.sees ? known_changes_ : 0);
    }
}

// Most rows that are looked at again stay as they are: who keeps something by the revision keeps it then.
void NodeTracker::write_row(const TrackerContext& context, std::size_t node) {
    meshless::NodeKernels::Row& row = kernels_.rows[node];
    const auto is_influence = [&](const Link& link) { return carries(context.phyxels, node, link); };
    double total = 0;
    for (const Link& link : links_[node])
        if (is_influence(link)) total += link.weight;
    std::uint32_t count = 0;
    bool is_new = false;
    for (const Link& link : links_[node]) {
        if (!is_influence(link)) continue;
        std::uint32_t& phyxel = kernels_.phyxel[row.begin + count];
        double& weight = kernels_.weight[row.begin + count];
        const double share = link.weight / total;
        is_new = is_new || phyxel != link.phyxel || weight != share;
        phyxel = link.phyxel;
        weight = share;
        ++count;
    }
    if (is_new || count != row.count) row_revision_[node] = writings_;
    row.count = count;
}

// Sources may be nodes that were not tracked before; they are tracked from now on,
// and those of them that see nothing either are passed over.
void NodeTracker::find_fallbacks(const TrackerContext& context) {
    fallbacks_.clear();
    for (std::uint32_t i = 0; i < kernels_.rows.size(); ++i)
        if (use_[i] != Use::none && kernels_.rows[i].count == 0) fallbacks_.push_back({i, i});
    for (Fallback& fallback : fallbacks_) fallback.source = nearest_source(context, fallback.node);
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
                if (task_[index] != Task::none) {
                    work_.assign(1, index);
                    do_tasks(context);
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
    row.count = 1;
    row_revision_.resize(kernels_.size(), 0);
    row_revision_[node] = ++writings_;
    kernels_.phyxel[row.begin] = static_cast<std::uint32_t>(best);
    kernels_.weight[row.begin] = 1;
}

void NodeTracker::evaluate(const TrackerContext& context, std::span<const Vec3> position,
                           std::span<const Mat3> deformation, std::vector<geometry::Frame>& out) {
    out.resize(places_.size());
    evaluator_(kernels_, rest_, context.phyxels.rest_position, position, deformation, out, context.parallel);
    for (const Fallback& fallback : fallbacks_) take_frame(fallback, out);
}

void NodeTracker::evaluate_some(const TrackerContext& context, std::span<const std::uint32_t> nodes,
                                std::span<const Vec3> position, std::span<const Mat3> deformation,
                                std::vector<geometry::Frame>& out) {
    out.resize(places_.size());
    const auto evaluate_of = [&](std::span<const std::uint32_t> some) {
        evaluator_.evaluate_some(some, kernels_, rest_, context.phyxels.rest_position, position, deformation,
                                 out, context.parallel);
    };
    evaluate_of(nodes);
    if (fallbacks_.empty()) return;
    std::vector<Fallback> asked;  // fallbacks_ is in the order of its nodes
    std::vector<std::uint32_t> sources;
    for (const std::uint32_t node : nodes) {
        const auto found =
            std::lower_bound(fallbacks_.begin(), fallbacks_.end(), node,
                             [](const Fallback& f, std::uint32_t wanted) { return f.node < wanted; });
        if (found == fallbacks_.end() || found->node != node) continue;
        asked.push_back(*found);
        sources.push_back(found->source);
    }
    std::sort(sources.begin(), sources.end());
    sources.erase(std::unique(sources.begin(), sources.end()), sources.end());
    evaluate_of(sources);
    for (const Fallback& fallback : asked) take_frame(fallback, out);
}

void NodeTracker::take_frame(const Fallback& fallback, std::vector<geometry::Frame>& out) const {
    const geometry::Frame& source = out[fallback.source];
    out[fallback.node] = {source.position + source.jacobian * (rest_[fallback.node] - rest_[fallback.source]),
                          source.jacobian};
}

}  // namespace splitcubes::body
