// Pieces of the phyxels and visibility of their pairs after the occluders changed.
#include <splitcubes/body_samples/elastic_samples.h>
#include <splitcubes/body_samples/ligaments.h>
#include <splitcubes/body_samples/topology_change.h>
#include <splitcubes/splitting/pieces.h>

#include <algorithm>

namespace splitcubes::body {

namespace {

bool meets_any(const geometry::Box& box, std::span<const geometry::Box> boxes) {
    return std::any_of(boxes.begin(), boxes.end(), [&](const geometry::Box& b) { return b.meets(box); });
}

// Updates the owner of phyxels near changes: the nearest node that sees the phyxel, which near a new cut may
// be another one than before. A phyxel can move to a piece that splits off its own piece in this step, but
// never to one that separated earlier and has moved away.
void update_owners(const SampleContext& context, const TopologyChange& change, ElasticSamples& samples) {
    const double reach =
        1.8 * context.grid.rest().cell_size;  // > distance to the farthest candidate of owner_of
    geometry::Box all;
    for (const geometry::Box& box : change.boxes) all.add(box);
    all = all.grown(reach);
    context.parallel.for_each(samples.phyxels.size(), 512, [&](std::size_t i) {
        const Vec3& rest = samples.phyxels.rest_position[i];
        if (!all.contains(rest) || !meets_any(geometry::Box{rest, rest}.grown(reach), change.boxes)) return;
        const std::int32_t own = samples.phyxels.piece[i];
        samples.owner[i] = owner_of(context, rest, samples.owner[i], [&](std::int32_t piece) {
            return piece == own || std::any_of(change.splits.begin(), change.splits.end(),
                                               [&](const splitting::PieceSplit& split) {
                                                   return split.parent == own && split.piece == piece;
                                               });
        });
    });
}

// Returns the pairs, ascending, that separated in this step or whose visibility the changes can affect.
// separated: whether phyxels changed piece.
std::vector<std::uint32_t> pairs_to_reevaluate(const SampleContext& context, const ElasticSamples& samples,
                                               std::span<const geometry::Box> changed_boxes, bool separated) {
    constexpr std::size_t chunk = 1024;
    geometry::Box all;
    for (const geometry::Box& box : changed_boxes) all.add(box);
    const geometry::Box reached = all.grown(samples.criterion->range(samples.largest_support()));
    const meshless::Phyxels& phyxels = samples.phyxels;
    const meshless::Neighbourhoods& links = samples.neighbourhoods;
    const occlusion::PairSet pairs = samples.pair_set();
    std::vector<std::vector<std::uint32_t>> found((phyxels.size() + chunk - 1) / chunk);
    const auto find_pairs_of = [&](std::size_t a) {
        const bool near = reached.contains(phyxels.rest_position[a]);
        if (!separated && !near) return;
        for (std::uint32_t l = links.links_begin(a); l < links.links_end(a); ++l) {
            const std::uint32_t b = links.neighbour()[l], pair = links.pair()[l];
            if (b < a) continue;
            const bool together = phyxels.piece[a] == phyxels.piece[b];
            bool changed = !together && samples.pairs.visibility[pair] > 0;
            if (together && near) {
                const geometry::Box region = samples.criterion->region(pairs, pair);
                changed = region.meets(all) && meets_any(region, changed_boxes);
            }
            if (changed) found[a / chunk].push_back(pair);
        }
    };
    context.parallel.for_each(phyxels.size(), chunk, find_pairs_of);
    std::vector<std::uint32_t> queried;
    for (const std::vector<std::uint32_t>& pairs_of : found)
        queried.insert(queried.end(), pairs_of.begin(), pairs_of.end());
    // Pairs with phyxels that were added later follow the others.
    if (!std::is_sorted(queried.begin(), queried.end())) std::sort(queried.begin(), queried.end());
    return queried;
}

}  // namespace

void ElasticSamples::evaluate_pairs(const SampleContext& context, std::span<const std::uint32_t> requested) {
    std::vector<std::uint32_t> queried;
    for (const std::uint32_t k : requested) {
        const std::int32_t piece = phyxels.piece[pairs.a[k]];
        if (piece != phyxels.piece[pairs.b[k]] || phyxels.rigid.index(piece) >= 0) {
            pairs.visibility[k] = 0;
            continue;
        }
        queried.push_back(k);
    }
    std::vector<float> visibility(queried.size());
    criterion->evaluate(context.occluders, pair_set(), queried, visibility, context.parallel);
    for (std::size_t q = 0; q < queried.size(); ++q) pairs.visibility[queried[q]] = visibility[q];
}

ElasticSamples::VisibilityUpdate ElasticSamples::update_visibility(const SampleContext& context,
                                                                   TopologyChange& change) {
    const std::vector<std::int32_t> piece_before = phyxels.piece;
    update_owners(context, change, *this);
    context.parallel.for_each(phyxels.size(), 2048, [&](std::size_t i) {
        phyxels.piece[i] = context.pieces.piece_of(context.grid, owner[i]);
    });

    const bool separated = phyxels.piece != piece_before;
    const std::vector<std::uint32_t> queried = pairs_to_reevaluate(context, *this, change.boxes, separated);
    std::vector<float> before;
    for (const std::uint32_t k : queried) before.push_back(pairs.visibility[k]);
    // Pairs at zero visibility stay at zero.
    std::vector<std::uint32_t> evaluated;
    for (const std::uint32_t k : queried)
        if (pairs.visibility[k] > 0) evaluated.push_back(k);
    evaluate_pairs(context, evaluated);
    // Visibility never grows, even if occluders shift within a cell that is cut again.
    for (std::size_t q = 0; q < queried.size(); ++q)
        pairs.visibility[queried[q]] = std::min(pairs.visibility[queried[q]], before[q]);
    std::vector<std::uint32_t> unlinked;
    for (std::size_t q = 0; q < queried.size(); ++q)
        if (before[q] > 0 && !(pairs.visibility[queried[q]] > 0)) {
            unlinked.push_back(pairs.a[queried[q]]);
            unlinked.push_back(pairs.b[queried[q]]);
        }
    bridge_ligaments(context.grid, context.pieces.count(), *this, unlinked, change);
    for (std::size_t q = 0; q < queried.size(); ++q)
        if (pairs.visibility[queried[q]] != before[q]) change.dirty_pairs.push_back(queried[q]);
    return {separated, evaluated.size()};
}

}  // namespace splitcubes::body
