#include <splitcubes/geometry/segment_fan.h>
#include <splitcubes/node_motion/node_tracker.h>
#include <splitcubes/node_motion/tuning.h>
#include <splitcubes/samples/kernel.h>

#include <algorithm>
#include <deque>
#include <set>

namespace splitcubes::body {

using splitting::GridEdge;

namespace {

// Segment, prepared for tests against many boxes.
class BoxSegment {
  public:
    BoxSegment(const Vec3& a, const Vec3& b) : a_(a) {
        for (int k = 0; k < 3; ++k) {
            const double extent = b[k] - a[k];
            // Along an axis without extent the slab test decides inside or outside; the tested boxes are
            // slightly enlarged, so that rounding does not matter.
            inverse_[k] = extent == 0 ? 1e300 : 1 / extent;
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
        index = static_cast<std::int32_t>(nodes_.size());
        index_.set(node, 0, index);
        nodes_.push_back(node);
        rest_.push_back(grid.rest().node_position(node));
        piece_.push_back(-1);
        pending_.push_back(KernelUpdate::build);
        use_.push_back(Use::lately);
        links_.emplace_back();
    }
    const auto i = static_cast<std::uint32_t>(index);
    if (use_[i] == Use::none) pending_[i] = KernelUpdate::build;
    use_[i] = std::max(use_[i], Use::lately);
    return i;
}

std::uint32_t NodeTracker::hold(const splitting::NodeGrid& grid, const Vec3i& node) {
    const std::uint32_t index = track(grid, node);
    use_[index] = Use::always;
    return index;
}

void NodeTracker::let_sleep() {
    // Sources of fallback frames stay awake as long as they are needed.
    for (const Fallback& fallback : fallbacks_)
        use_[fallback.source] = std::max(use_[fallback.source], Use::lately);
    for (std::size_t i = 0; i < use_.size(); ++i) {
        if (use_[i] == Use::lately) {
            use_[i] = Use::before;
        } else if (use_[i] == Use::before) {
            use_[i] = Use::none;
            pending_[i] = KernelUpdate::none;
            links_[i].clear();
            if (i < kernels_.size()) kernels_.rows[i].count = 0;
        }
    }
    std::erase_if(fallbacks_, [&](const Fallback& f) { return use_[f.node] == Use::none; });
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
        if (use_[i] == Use::none || pending_[i] >= KernelUpdate::look || !all.contains(rest_[i])) return;
        const auto near = [&](const geometry::Box& box) { return within(rest_[i], box, radius); };
        if (std::any_of(boxes.begin(), boxes.end(), near)) pending_[i] = KernelUpdate::look;
    });
}

// Marks the nodes whose rows depend on what changed piece: the node itself, a phyxel that it sees, or, for a
// node without such a phyxel, any phyxel.
void NodeTracker::find_changed_pieces(const TrackerContext& context) {
    const meshless::Phyxels& phyxels = context.phyxels;
    phyxel_moved_.assign(phyxels.size(), 0);
    for (std::size_t i = 0; i < phyxel_piece_.size(); ++i)
        phyxel_moved_[i] = phyxels.piece[i] != phyxel_piece_[i];
    context.parallel.for_each(nodes_.size(), 1024, [&](std::size_t i) {
        if (use_[i] == Use::none) return;
        const std::int32_t before = piece_[i];
        piece_[i] = context.pieces.piece_of(context.grid, nodes_[i]);
        if (pending_[i] != KernelUpdate::none) return;
        const auto decides = [&](const Link& link) {
            return link.visible && phyxel_moved_[link.phyxel] != 0;
        };
        if (piece_[i] != before || kernels_.rows[i].count <= 1 ||
            std::any_of(links_[i].begin(), links_[i].end(), decides))
            pending_[i] = KernelUpdate::filter;
    });
}

// Links the awake nodes to the phyxels that were added since the last refresh. Nodes that are to be built
// find them by themselves.
void NodeTracker::add_new_phyxels(const TrackerContext& context) {
    const meshless::Phyxels& phyxels = context.phyxels;
    const geometry::RestGrid& rest = context.grid.rest();
    struct NewLink {
        std::uint32_t node;
        Link link;
    };
    std::vector<NewLink> found;
    for (auto i = static_cast<std::uint32_t>(phyxel_piece_.size()); i < phyxels.size(); ++i) {
        const Vec3 at = rest.to_grid(phyxels.rest_position[i]);
        const double reach = phyxels.support_radius[i] / rest.cell_size + 1e-6;
        const Vec3i low = (at.array() - reach).ceil().max(0).matrix().cast<int>();
        const Vec3i high =
            (at.array() + reach).floor().min(rest.node_count.array().cast<double>() - 1).matrix().cast<int>();
        for (int z = low.z(); z <= high.z(); ++z)
            for (int y = low.y(); y <= high.y(); ++y)
                for (int x = low.x(); x <= high.x(); ++x) {
                    const std::int32_t node = find({x, y, z});
                    if (node < 0) continue;
                    const auto n = static_cast<std::size_t>(node);
                    if (pending_[n] == KernelUpdate::build) continue;
                    const double weight = meshless::kernel(
                        (phyxels.rest_position[i] - rest_[n]).squaredNorm(), phyxels.support_radius[i]);
                    if (weight > 0) found.push_back({static_cast<std::uint32_t>(node), {i, false, weight}});
                }
    }
    context.parallel.for_each(found.size(), 64, [&](std::size_t k) {
        found[k].link.visible = !context.occluders.segment_blocked(
            rest_[found[k].node], phyxels.rest_position[found[k].link.phyxel]);
    });
    // The links of a node stay in the order of phyxels.
    for (const NewLink& added : found) {
        links_[added.node].push_back(added.link);
        pending_[added.node] = std::max(pending_[added.node], KernelUpdate::filter);
    }
}

void NodeTracker::refresh(const TrackerContext& context) {
    if (pieces_changed_) find_changed_pieces(context);
    if (phyxel_piece_.size() < context.phyxels.size()) add_new_phyxels(context);
    if (pieces_changed_ || phyxel_piece_.size() < context.phyxels.size())
        phyxel_piece_ = context.phyxels.piece;
    pieces_changed_ = false;
    work_.clear();
    for (std::uint32_t i = 0; i < pending_.size(); ++i)
        if (pending_[i] != KernelUpdate::none) work_.push_back(i);
    if (work_.empty()) return;
    reach_ = 0;
    for (const double h : context.phyxels.support_radius) reach_ = std::max(reach_, h);
    update_kernels(context);
    boxes_.clear();
    known_changes_ = marked_changes_;
    find_fallbacks(context);
}

// Updates the kernels of the nodes of work_. Rows are allocated in the pool serially, then filled in
// parallel.
void NodeTracker::update_kernels(const TrackerContext& context) {
    kernels_.rows.resize(nodes_.size());
    row_revision_.resize(nodes_.size(), 0);
    ++revision_;
    for (const std::uint32_t i : work_)
        if (pending_[i] == KernelUpdate::build) fresh_.push_back(i);
    context.parallel.for_chunks(work_.size(), 32, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> near;
        std::vector<geometry::Box> near_boxes;
        for (std::size_t k = begin; k < end; ++k) {
            const std::uint32_t i = work_[k];
            piece_[i] = context.pieces.piece_of(context.grid, nodes_[i]);
            if (pending_[i] == KernelUpdate::build) build_links(context, i, near);
            if (pending_[i] == KernelUpdate::look) update_visibility(context, i, near_boxes);
            pending_[i] = KernelUpdate::none;
        }
    });
    for (const std::uint32_t i : work_) {
        meshless::NodeKernels::Row& row = kernels_.rows[i];
        // At least one entry: a node may be bound to a phyxel that does not reach it.
        const auto capacity = static_cast<std::uint32_t>(std::max<std::size_t>(links_[i].size(), 1));
        if (capacity <= row.capacity) continue;
        kernels_.unused += row.capacity;
        row.begin = static_cast<std::uint32_t>(kernels_.phyxel.size());
        row.capacity = capacity;
        kernels_.phyxel.resize(kernels_.phyxel.size() + capacity);
        kernels_.weight.resize(kernels_.weight.size() + capacity);
    }
    context.parallel.for_each(work_.size(), 64, [&](std::size_t k) { write_row(context, work_[k]); });
}

void NodeTracker::build_links(const TrackerContext& context, std::size_t node,
                              std::vector<std::uint32_t>& near) {
    links_[node].clear();
    context.locator.near(rest_[node], reach_, near);
    links_[node].reserve(near.size());
    geometry::SegmentFan segments(context.occluders, rest_[node], reach_);
    for (const std::uint32_t i : near) {
        const Vec3& phyxel = context.phyxels.rest_position[i];
        const double weight =
            meshless::kernel((phyxel - rest_[node]).squaredNorm(), context.phyxels.support_radius[i]);
        if (weight > 0) links_[node].push_back({i, !segments.blocked(phyxel), weight});
    }
}

void NodeTracker::update_visibility(const TrackerContext& context, std::size_t node,
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
        // Cheap test first: most segments miss all boxes.
        if (!all.meets({rest_[node].cwiseMin(phyxel), rest_[node].cwiseMax(phyxel)})) continue;
        const BoxSegment segment(rest_[node], phyxel);
        if (segment.meets(all) &&
            std::any_of(near.begin(), near.end(), [&](const auto& box) { return segment.meets(box); }))
            // A visible phyxel can only be hidden by occluders changed since the last test.
            link.visible =
                !context.occluders.segment_blocked(rest_[node], phyxel, link.visible ? known_changes_ : 0);
    }
}

// Most rows do not change when they are rewritten; then the revision stays, so that caches remain valid.
void NodeTracker::write_row(const TrackerContext& context, std::size_t node) {
    meshless::NodeKernels::Row& row = kernels_.rows[node];
    const auto is_influence = [&](const Link& link) { return is_influenced_by(context.phyxels, node, link); };
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
    if (is_new || count != row.count) row_revision_[node] = revision_;
    row.count = count;
}

// Finds the source of the frame of each node without a kernel. Nodes that the search reaches are tracked from
// now on; those without visible phyxels are skipped as sources.
void NodeTracker::find_fallbacks(const TrackerContext& context) {
    fallbacks_.clear();
    for (std::uint32_t i = 0; i < kernels_.rows.size(); ++i)
        if (use_[i] != Use::none && kernels_.rows[i].count == 0) fallbacks_.push_back({i, i});
    for (Fallback& fallback : fallbacks_) fallback.source = nearest_source(context, fallback.node);
    std::erase_if(fallbacks_, [](const Fallback& f) { return f.source == f.node; });
}

// Breadth-first search over uncut edges, in a fixed order of directions. Returns the node itself if it finds
// none.
std::uint32_t NodeTracker::nearest_source(const TrackerContext& context, std::uint32_t node) {
    const splitting::NodeGrid& grid = context.grid;
    std::deque<Vec3i> queue{nodes_[node]};
    std::set<std::uint64_t> visited{splitting::edge_id({nodes_[node], 0})};
    while (!queue.empty() && visited.size() < tuning::set_up::max_source_search) {
        const Vec3i at = queue.front();
        queue.pop_front();
        for (int axis = 0; axis < 3; ++axis)
            for (const int step : {-1, 1}) {
                Vec3i next = at;
                next[axis] += step;
                const GridEdge edge{step > 0 ? at : next, axis};
                if (!grid.rest().contains(next) || !grid.inside(next) || grid.is_cut(edge)) continue;
                if (!visited.insert(splitting::edge_id({next, 0})).second) continue;
                queue.push_back(next);
                const std::uint32_t index = track(grid, next);
                if (pending_[index] != KernelUpdate::none) {
                    work_.assign(1, index);
                    update_kernels(context);
                }
                if (kernels_.rows[index].count > 0) return index;
            }
    }
    bind_to_nearest(context, node);
    return node;
}

// Binds a node to the nearest phyxel of its piece, if no node of the piece sees one.
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
    if (best == phyxels.size()) return;  // a new piece without phyxels: resampling adds one
    meshless::NodeKernels::Row& row = kernels_.rows[node];
    row.count = 1;
    row_revision_.resize(kernels_.size(), 0);
    row_revision_[node] = ++revision_;
    kernels_.phyxel[row.begin] = static_cast<std::uint32_t>(best);
    kernels_.weight[row.begin] = 1;
}

void NodeTracker::evaluate(const TrackerContext& context, std::span<const Vec3> position,
                           std::span<const Mat3> deformation, std::vector<geometry::Frame>& out) {
    out.resize(nodes_.size());
    evaluator_(kernels_, rest_, context.phyxels.rest_position, position, deformation, out, context.parallel);
    for (const Fallback& fallback : fallbacks_) take_frame(fallback, out);
}

void NodeTracker::evaluate_some(const TrackerContext& context, std::span<const std::uint32_t> nodes,
                                std::span<const Vec3> position, std::span<const Mat3> deformation,
                                std::vector<geometry::Frame>& out) {
    out.resize(nodes_.size());
    const auto evaluate_of = [&](std::span<const std::uint32_t> some) {
        evaluator_.evaluate_some(some, kernels_, rest_, context.phyxels.rest_position, position, deformation,
                                 out, context.parallel);
    };
    evaluate_of(nodes);
    if (fallbacks_.empty()) return;
    std::vector<Fallback> needed;  // fallbacks_ is sorted by node
    std::vector<std::uint32_t> sources;
    for (const std::uint32_t node : nodes) {
        const auto found =
            std::lower_bound(fallbacks_.begin(), fallbacks_.end(), node,
                             [](const Fallback& f, std::uint32_t value) { return f.node < value; });
        if (found == fallbacks_.end() || found->node != node) continue;
        needed.push_back(*found);
        sources.push_back(found->source);
    }
    std::sort(sources.begin(), sources.end());
    sources.erase(std::unique(sources.begin(), sources.end()), sources.end());
    evaluate_of(sources);
    for (const Fallback& fallback : needed) take_frame(fallback, out);
}

void NodeTracker::take_frame(const Fallback& fallback, std::vector<geometry::Frame>& out) const {
    const geometry::Frame& source = out[fallback.source];
    out[fallback.node] = {source.position + source.jacobian * (rest_[fallback.node] - rest_[fallback.source]),
                          source.jacobian};
}

}  // namespace splitcubes::body
