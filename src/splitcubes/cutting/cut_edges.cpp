#include <splitcubes/cutting/sweep.h>
#include <splitcubes/cutting/tuning.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

namespace splitcubes::cutting {

namespace {

using geometry::Box;
using geometry::MovingSegment;
using geometry::SegmentHit;

// The first hit of a candidate.
struct Hit {
    std::size_t candidate;
    const SweptBlade* part;
    const MovingSegment* blade;
    SegmentHit at;  // its time is a fraction of the part's
    double time;    // fraction of the whole interval
};

// Boxes over runs of consecutive segments, which are close together because a blade is a polyline: a complete
// binary tree, node i above nodes 2i and 2i + 1, with leaves ordered by time.
class SegmentTree {
  public:
    explicit SegmentTree(std::span<const SweptBlade> swept) {
        for (const SweptBlade& part : swept)
            for (const MovingSegment& segment : part.segments)
                entries_.push_back({geometry::bounds_of(segment), &part, &segment});
        leaf_count_ = std::bit_ceil(std::max<std::size_t>(1, (entries_.size() + run - 1) / run));
        boxes_.resize(2 * leaf_count_);
        for (std::size_t e = 0; e < entries_.size(); ++e) boxes_[leaf_count_ + e / run].add(entries_[e].box);
        for (std::size_t node = leaf_count_ - 1; node > 0; --node) {
            boxes_[node].add(boxes_[2 * node]);
            boxes_[node].add(boxes_[2 * node + 1]);
        }
    }

    std::optional<Hit> first_hit(const MovingSegment& edge) const {
        const Box box = geometry::bounds_of(edge);
        std::optional<Hit> best;
        const SweptBlade* known_part = nullptr;
        MovingSegment edge_part{};
        std::size_t node = 1;
        while (node > 0) {
            if (boxes_[node].meets(box)) {
                if (node < leaf_count_) {
                    node *= 2;
                    continue;
                }
                const std::size_t first = (node - leaf_count_) * run;
                for (std::size_t e = first; e < std::min(first + run, entries_.size()); ++e) {
                    const Entry& entry = entries_[e];
                    if (best && best->time < entry.part->begin) return best;  // all that follow are later
                    if (!entry.box.meets(box)) continue;
                    if (entry.part != known_part) {
                        known_part = entry.part;
                        edge_part = geometry::part_of(edge, known_part->begin, known_part->end);
                    }
                    test(entry, edge_part, best);
                }
            }
            // Goes up while the node is a right child, then to its sibling; zero when done.
            while (node & 1U) node /= 2;
            if (node > 0) ++node;
        }
        return best;
    }

  private:
    static constexpr std::size_t run = 4;

    struct Entry {
        Box box;
        const SweptBlade* part;
        const MovingSegment* segment;
    };

    static void test(const Entry& entry, const MovingSegment& edge, std::optional<Hit>& best) {
        const std::optional<SegmentHit> at = geometry::first_hit(*entry.segment, edge);
        if (!at) return;
        const double time = (1 - at->time) * entry.part->begin + at->time * entry.part->end;
        if (!best || time < best->time) best = Hit{0, entry.part, entry.segment, *at, time};
    }

    std::vector<Entry> entries_;  // by time, then along the blade
    std::size_t leaf_count_ = 0;  // a power of two
    std::vector<Box> boxes_;      // m, world, by node; [0] is unused
};

// Returns a direction across the blade that separates the edge's ends best.
Vec3 separating_normal(const Vec3& blade, const Vec3& edge) {
    const Vec3 along = blade.stableNormalized();
    const Vec3 across = edge - along.dot(edge) * along;
    if (across.norm() > 1e-9 * edge.norm()) return across.normalized();
    return along.squaredNorm() > 0 ? Vec3(along.unitOrthogonal()) : Vec3::UnitX();
}

Vec3 world_normal(const Hit& hit, const MovingSegment& edge, Vec3& last_normal) {
    const MovingSegment& b = *hit.blade;
    const double s = hit.at.blade_parameter, r = hit.at.edge_parameter;
    const Vec3 direction = geometry::moving_point(b.b0 - b.a0, b.b1 - b.a1, hit.at.time);
    const Vec3 along_edge = geometry::moving_point(edge.b0 - edge.a0, edge.b1 - edge.a1, hit.time);
    // Displacements per whole interval.
    const Vec3 blade_velocity =
        ((1 - s) * (b.a1 - b.a0) + s * (b.b1 - b.b0)) / (hit.part->end - hit.part->begin);
    const Vec3 edge_velocity = (1 - r) * (edge.a1 - edge.a0) + r * (edge.b1 - edge.b0);
    const Vec3 normal = direction.cross(blade_velocity - edge_velocity);
    const double min_norm = tuning::cut_edges::standstill_share * direction.norm() * along_edge.norm();
    if (normal.norm() > min_norm && normal.allFinite()) {
        last_normal = normal.stableNormalized();
        return last_normal;
    }
    return last_normal.squaredNorm() > 0 ? last_normal : separating_normal(direction, along_edge);
}

}  // namespace

Vec3 pulled_back(const Mat3& world_from_rest, const Vec3& normal) {
    const Vec3 rest = world_from_rest.transpose() * normal;
    const double length = rest.stableNorm();
    if (!(length > 0) || !std::isfinite(length)) return normal;
    return (rest / length).normalized();
}

std::vector<EdgeCut> cut_edges(std::span<const SweptBlade> swept, std::span<const CandidateEdge> candidates,
                               Vec3& last_normal, const Parallel& parallel) {
    const SegmentTree tree(swept);
    std::vector<std::optional<Hit>> found(candidates.size());
    parallel.for_each(candidates.size(), 256,
                      [&](std::size_t i) { found[i] = tree.first_hit(candidates[i].motion); });
    std::vector<Hit> hits;
    for (std::size_t i = 0; i < found.size(); ++i)
        if (found[i]) {
            hits.push_back(*found[i]);
            hits.back().candidate = i;
        }
    // Ordered by time, so that each hit sees the last normal before it.
    std::sort(hits.begin(), hits.end(), [&](const Hit& a, const Hit& b) {
        return a.time != b.time ? a.time < b.time : candidates[a.candidate].id < candidates[b.candidate].id;
    });
    std::vector<EdgeCut> cuts;
    cuts.reserve(hits.size());
    for (const Hit& hit : hits) {
        const CandidateEdge& edge = candidates[hit.candidate];
        const Vec3 normal = world_normal(hit, edge.motion, last_normal);
        cuts.push_back({edge.id, hit.at.edge_parameter, pulled_back(edge.world_from_rest, normal), hit.time});
    }
    std::sort(cuts.begin(), cuts.end(), [](const EdgeCut& a, const EdgeCut& b) { return a.id < b.id; });
    return cuts;
}

}  // namespace splitcubes::cutting
