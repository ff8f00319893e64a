// The middle stages of a step, which update topology, visibility and neighbourhoods after edges were cut.
#include <splitcubes/body/body.h>

#include <algorithm>
#include <cassert>

namespace splitcubes::body {

namespace {

bool meets_any(const geometry::Box& box, std::span<const geometry::Box> boxes) {
    return std::any_of(boxes.begin(), boxes.end(), [&](const geometry::Box& b) { return b.meets(box); });
}

}  // namespace

void Body::retessellate(const Parallel& parallel, TopologyChange& change, StepReport& report) {
    const std::vector<std::uint32_t>& changed = surface_->retessellate(grid_, change.crossings);
    change.cells = changed;
    change.boxes = occluders_.update(grid_, *surface_, changed, parallel);
    cut_edge_count_ += change.crossings.size();
    // Checkpoints rely on all crossings being stored in the order in which they were cut.
    assert(solid_crossings_ + cut_edge_count_ == grid_.crossings().size());
    assert(std::is_sorted(change.crossings.begin(), change.crossings.end()));
    if (!change.crossings.empty()) cut_stage_ends_.push_back(static_cast<std::uint32_t>(cut_edge_count_));
    report.changed_cells += changed.size();
    surface_motion_.track_nodes(grid_, *surface_, tracker_);
}

void Body::label_pieces(TopologyChange& change) {
    last_splits_.clear();
    if (change.crossings.empty()) return;
    change.splits = pieces_->update(grid_, change.crossings);
    last_splits_ = change.splits;
    if (change.splits.empty()) return;
    inside_.label_pieces(grid_, *pieces_);
    tracker_.mark_pieces_changed();
}

// Updates the owner of phyxels near changes: the nearest node that sees the phyxel, which near a new cut may
// be another one than before. A phyxel can move to a piece that splits off its own piece in this step, but
// never to one that separated earlier and has moved away.
void Body::update_owners(const TopologyChange& change, const Parallel& parallel) {
    const double reach = 1.8 * grid_.rest().cell_size;  // > distance to the farthest candidate of owner_of
    geometry::Box all;
    for (const geometry::Box& box : change.boxes) all.add(box);
    all = all.grown(reach);
    parallel.for_each(phyxels_.size(), 512, [&](std::size_t i) {
        const Vec3& rest = phyxels_.rest_position[i];
        if (!all.contains(rest) || !meets_any(geometry::Box{rest, rest}.grown(reach), change.boxes)) return;
        const std::int32_t own = phyxels_.piece[i];
        owner_[i] = owner_of(rest, owner_[i], [&](std::int32_t piece) {
            return piece == own || std::any_of(change.splits.begin(), change.splits.end(),
                                               [&](const splitting::PieceSplit& split) {
                                                   return split.parent == own && split.piece == piece;
                                               });
        });
    });
}

void Body::evaluate_pairs(std::span<const std::uint32_t> pairs, const Parallel& parallel) {
    std::vector<std::uint32_t> queried;
    for (const std::uint32_t k : pairs) {
        const std::int32_t piece = phyxels_.piece[pairs_.a[k]];
        if (piece != phyxels_.piece[pairs_.b[k]] || phyxels_.rigid.index(piece) >= 0) {
            pairs_.visibility[k] = 0;
            continue;
        }
        queried.push_back(k);
    }
    std::vector<float> visibility(queried.size());
    criterion_->evaluate(occluders_.grid(), pair_set(), queried, visibility, parallel);
    for (std::size_t q = 0; q < queried.size(); ++q) pairs_.visibility[queried[q]] = visibility[q];
}

// Returns the pairs, ascending, whose phyxels changed piece or whose visibility the changes can affect.
std::vector<std::uint32_t> Body::pairs_to_reevaluate(std::span<const geometry::Box> changed_boxes,
                                                     std::span<const std::int32_t> piece_before,
                                                     const Parallel& parallel) const {
    constexpr std::size_t chunk = 1024;
    geometry::Box all;
    for (const geometry::Box& box : changed_boxes) all.add(box);
    double longest = 0;
    for (const double h : phyxels_.support_radius) longest = std::max(longest, h);
    const geometry::Box reached = all.grown(criterion_->range(longest));
    const occlusion::PairSet pairs = pair_set();
    const std::span<const std::uint32_t> offsets = neighbourhoods_.offsets();
    std::vector<std::vector<std::uint32_t>> found((phyxels_.size() + chunk - 1) / chunk);
    const auto find_pairs_of = [&](std::size_t a) {
        const bool moved = phyxels_.piece[a] != piece_before[a];
        const bool near = reached.contains(phyxels_.rest_position[a]);
        if (!moved && !near) return;
        for (std::uint32_t l = offsets[a]; l < offsets[a + 1]; ++l) {
            const std::uint32_t b = neighbourhoods_.neighbour()[l];
            const std::uint32_t pair = neighbourhoods_.pair()[l];
            bool changed = moved || phyxels_.piece[b] != piece_before[b];
            if (!changed && b > a) {
                const geometry::Box region = criterion_->region(pairs, pair);
                changed = region.meets(all) && meets_any(region, changed_boxes);
            }
            if (changed) found[a / chunk].push_back(pair);
        }
    };
    parallel.for_each(phyxels_.size(), chunk, find_pairs_of);
    std::vector<std::uint32_t> queried;
    for (const std::vector<std::uint32_t>& pairs_of : found)
        queried.insert(queried.end(), pairs_of.begin(), pairs_of.end());
    // Only pairs of phyxels that changed piece can be out of order.
    if (!std::is_sorted(queried.begin(), queried.end())) std::sort(queried.begin(), queried.end());
    queried.erase(std::unique(queried.begin(), queried.end()), queried.end());
    return queried;
}

void Body::update_visibility(const StepContext& context, TopologyChange& change, StepReport& report) {
    if (change.boxes.empty()) return;
    const std::vector<std::int32_t> piece_before = phyxels_.piece;
    update_owners(change, context.parallel);
    context.parallel.for_each(phyxels_.size(), 2048, [&](std::size_t i) {
        phyxels_.piece[i] = pieces_->piece_of(grid_, owner_[i]);
    });
    if (phyxels_.piece != piece_before) tracker_.mark_pieces_changed();

    const std::vector<std::uint32_t> queried =
        pairs_to_reevaluate(change.boxes, piece_before, context.parallel);
    std::vector<float> before;
    for (const std::uint32_t k : queried) before.push_back(pairs_.visibility[k]);
    // Pairs at zero visibility stay at zero; pairs that split off together, away from the changes, keep
    // theirs.
    const occlusion::PairSet pairs = pair_set();
    std::vector<std::uint8_t> must_evaluate(queried.size(), 0);
    context.parallel.for_each(queried.size(), 128, [&](std::size_t q) {
        const std::uint32_t k = queried[q];
        must_evaluate[q] =
            pairs_.visibility[k] > 0 && (phyxels_.piece[pairs_.a[k]] != phyxels_.piece[pairs_.b[k]] ||
                                         meets_any(criterion_->region(pairs, k), change.boxes));
    });
    std::vector<std::uint32_t> evaluated;
    for (std::size_t q = 0; q < queried.size(); ++q)
        if (must_evaluate[q] != 0) evaluated.push_back(queried[q]);
    evaluate_pairs(evaluated, context.parallel);
    // Visibility never grows, even if occluders shift within a cell that is cut again.
    for (std::size_t q = 0; q < queried.size(); ++q)
        pairs_.visibility[queried[q]] = std::min(pairs_.visibility[queried[q]], before[q]);
    bridge_ligaments(queried, change);
    for (std::size_t q = 0; q < queried.size(); ++q)
        if (pairs_.visibility[queried[q]] != before[q]) change.dirty_pairs.push_back(queried[q]);
    report.disks += evaluated.size();

    double reach = 0;
    for (const double h : phyxels_.support_radius) reach = std::max(reach, h);
    tracker_.mark_near(change.boxes, reach, occluders_.grid().changes(), context.parallel);
}

void Body::rebuild_neighbourhoods(const StepContext& context, TopologyChange& change) {
    if (deformation_) notify_cut_edges(change);
    if (!change.dirty_pairs.empty())
        neighbourhoods_.update(phyxels_, pairs_, change.dirty_pairs, settings_.material, context.parallel);
    if (change.volumes_changed)
        neighbourhoods_.refresh_volumes(phyxels_, settings_.material, context.parallel);
    change.dirty_pairs.clear();
    tracker_.let_sleep();
    tracker_.refresh(tracker_context(context.parallel));
}

}  // namespace splitcubes::body
