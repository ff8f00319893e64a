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

// Returns the pairs, ascending, whose phyxels changed piece or whose visibility the changes can affect.
std::vector<std::uint32_t> pairs_to_reevaluate(const SampleContext& context, const ElasticSamples& samples,
                                               std::span<const geometry::Box> changed_boxes,
                                               std::span<const std::int32_t> piece_before) {
    constexpr std::size_t chunk = 1024;
    geometry::Box all;
    for (const geometry::Box& box : changed_boxes) all.add(box);
    const geometry::Box reached = all.grown(samples.criterion->range(samples.largest_support()));
    const meshless::Phyxels& phyxels = samples.phyxels;
    const occlusion::PairSet pairs = samples.pair_set();
    const std::span<const std::uint32_t> offsets = samples.neighbourhoods.offsets();
    std::vector<std::vector<std::uint32_t>> found((phyxels.size() + chunk - 1) / chunk);
    const auto find_pairs_of = [&](std::size_t a) {
        const bool moved = phyxels.piece[a] != piece_before[a];
        const bool near = reached.contains(phyxels.rest_position[a]);
        if (!moved && !near) return;
        for (std::uint32_t l = offsets[a]; l < offsets[a + 1]; ++l) {
            const std::uint32_t b = samples.neighbourhoods.neighbour()[l];
            const std::uint32_t pair = samples.neighbourhoods.pair()[l];
            bool changed = moved || phyxels.piece[b] != piece_before[b];
            if (!changed && b > a) {
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
    // Only pairs of phyxels that changed piece can be out of order.
    if (!std::is_sorted(queried.begin(), queried.end())) std::sort(queried.begin(), queried.end());
    queried.erase(std::unique(queried.begin(), queried.end()), queried.end());
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

    const std::vector<std::uint32_t> queried =
        pairs_to_reevaluate(context, *this, change.boxes, piece_before);
    std::vector<float> before;
    for (const std::uint32_t k : queried) before.push_back(pairs.visibility[k]);
    // Pairs at zero visibility stay at zero; pairs that split off together, away from the changes, keep
    // theirs.
    const occlusion::PairSet all_pairs = pair_set();
    std::vector<std::uint8_t> must_evaluate(queried.size(), 0);
    context.parallel.for_each(queried.size(), 128, [&](std::size_t q) {
        const std::uint32_t k = queried[q];
        must_evaluate[q] =
            pairs.visibility[k] > 0 && (phyxels.piece[pairs.a[k]] != phyxels.piece[pairs.b[k]] ||
                                        meets_any(criterion->region(all_pairs, k), change.boxes));
    });
    std::vector<std::uint32_t> evaluated;
    for (std::size_t q = 0; q < queried.size(); ++q)
        if (must_evaluate[q] != 0) evaluated.push_back(queried[q]);
    evaluate_pairs(context, evaluated);
    // Visibility never grows, even if occluders shift within a cell that is cut again.
    for (std::size_t q = 0; q < queried.size(); ++q)
        pairs.visibility[queried[q]] = std::min(pairs.visibility[queried[q]], before[q]);
    bridge_ligaments(context.grid, context.pieces.count(), *this, queried, change);
    for (std::size_t q = 0; q < queried.size(); ++q)
        if (pairs.visibility[queried[q]] != before[q]) change.dirty_pairs.push_back(queried[q]);
    return {phyxels.piece != piece_before, evaluated.size()};
}

}  // namespace splitcubes::body
