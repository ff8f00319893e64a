#include <splitcubes/occlusion/disk.h>
#include <splitcubes/occlusion/segment_criteria.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <queue>
#include <tuple>

namespace splitcubes::occlusion {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct Segment {
    Vec3 from, to;  // m, rest space
};

// Returns the same segment for (a, b) and (b, a).
Segment between(const PairQuery& pair) {
    const Disk disk = make_disk(pair);
    const Vec3 half = disk.axes.row(2).transpose() * (disk.radius * disk.radius);
    return {disk.apex + near_depth * half, disk.apex + (2 - near_depth) * half};
}

using Edge = std::array<Vec3, 2>;

bool before(const Vec3& p, const Vec3& q) {
    return std::tie(p[0], p[1], p[2]) < std::tie(q[0], q[1], q[2]);
}

struct Side {
    Edge edge;  // ends in order
    bool cut;

    bool same_edge(const Side& other) const { return edge[0] == other.edge[0] && edge[1] == other.edge[1]; }
};

// Returns the edges near the box that belong to one cut triangle and no other triangle.
std::vector<Edge> fronts(const geometry::OccluderGrid& occluders, const geometry::Box& box) {
    std::vector<Side> sides;
    occluders.visit(box, [&](const geometry::OccluderTriangle& t) {
        for (std::size_t k = 0; k < 3; ++k) {
            Edge edge{t.corner[k], t.corner[(k + 1) % 3]};
            if (before(edge[1], edge[0])) std::swap(edge[0], edge[1]);
            sides.push_back({edge, !t.boundary});
        }
    });
    std::sort(sides.begin(), sides.end(), [](const Side& s, const Side& t) {
        return before(s.edge[0], t.edge[0]) || (s.edge[0] == t.edge[0] && before(s.edge[1], t.edge[1]));
    });
    std::vector<Edge> out;
    for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
        while (end < sides.size() && sides[end].same_edge(sides[begin])) ++end;
        if (end == begin + 1 && sides[begin].cut) out.push_back(sides[begin].edge);
    }
    return out;
}

double distance_to(const Edge& edge, const Vec3& p) {
    const Vec3 along = edge[1] - edge[0];
    const double length = along.squaredNorm();
    const double t = length > 0 ? std::clamp(along.dot(p - edge[0]) / length, 0.0, 1.0) : 0.0;
    return (edge[0] + t * along - p).norm();
}

// Returns the point at which the segment crosses a triangle that it meets.
Vec3 crossing_of(const Segment& s, const std::array<Vec3, 3>& corner) {
    const Vec3 normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    const double slope = normal.dot(s.to - s.from);
    const double t = slope != 0 ? normal.dot(corner[0] - s.from) / slope : 0.5;
    return s.from + std::clamp(t, 0.0, 1.0) * (s.to - s.from);
}

// Returns the depth of the deepest crossing, exact below `limit`; -1 if there is none, infinity if the
// boundary is crossed.
double deepest_crossing(const geometry::OccluderGrid& occluders, const PairQuery& pair, double limit) {
    const Segment segment = between(pair);
    std::vector<Vec3> crossings;
    bool is_boundary = false;
    geometry::Box box;
    box.add(segment.from);
    box.add(segment.to);
    const double slack = 1e-9 * (segment.to - segment.from).norm();
    occluders.visit(box.grown(slack), [&](const geometry::OccluderTriangle& t) {
        if (!geometry::segment_meets_triangle(segment.from, segment.to, t.corner)) return;
        is_boundary = is_boundary || t.boundary;
        crossings.push_back(crossing_of(segment, t.corner));
    });
    if (crossings.empty()) return -1;
    if (is_boundary) return infinity;
    double deepest = 0;
    for (const Vec3& crossing : crossings) {
        double depth = infinity;
        for (const Edge& edge : fronts(occluders, geometry::Box{crossing, crossing}.grown(limit)))
            depth = std::min(depth, distance_to(edge, crossing));
        deepest = std::max(deepest, depth);
    }
    return deepest;
}

}  // namespace

bool segment_blocked(const geometry::OccluderGrid& occluders, const PairQuery& pair) {
    if (coincide(pair)) return false;
    const Segment segment = between(pair);
    return occluders.segment_blocked(segment.from, segment.to);
}

double transparency_factor(const geometry::OccluderGrid& occluders, const PairQuery& pair, double support) {
    if (!segment_blocked(occluders, pair)) return 1;
    const double opaque = transparent_share * support;
    const double depth = deepest_crossing(occluders, pair, opaque);
    if (depth < 0) return 1;
    if (!(depth < opaque)) return 0;
    const double r = (pair.b - pair.a).norm();
    return weight_ratio(r, r + support * (depth / opaque) * (depth / opaque), support);
}

LinkGraph::LinkGraph(const geometry::OccluderGrid& occluders, const PairSet& pairs)
    : occluders_(occluders),
      pairs_(pairs),
      offsets_(pairs.rest.size() + 1, 0),
      links_(2 * pairs.size()),
      state_(pairs.size(), 0) {
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        ++offsets_[pairs.a[k] + 1];
        ++offsets_[pairs.b[k] + 1];
    }
    for (std::size_t i = 0; i < pairs.rest.size(); ++i) offsets_[i + 1] += offsets_[i];
    std::vector<std::uint32_t> next(offsets_.begin(), offsets_.end() - 1);
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        const auto pair = static_cast<std::uint32_t>(k);
        links_[next[pairs.a[k]]++] = {pairs.b[k], pair};
        links_[next[pairs.b[k]]++] = {pairs.a[k], pair};
    }
}

bool LinkGraph::blocked(std::size_t pair) const {
    // Concurrent threads write the same value.
    std::atomic_ref<std::uint8_t> state(state_[pair]);
    if (const std::uint8_t known = state.load(std::memory_order_relaxed); known != 0) return known == 2;
    const std::uint32_t a = pairs_.a[pair], b = pairs_.b[pair];
    const bool separate = !pairs_.piece.empty() && pairs_.piece[a] != pairs_.piece[b];
    const bool found = separate || segment_blocked(occluders_, {pairs_.rest[a], pairs_.rest[b]});
    state.store(found ? 2 : 1, std::memory_order_relaxed);
    return found;
}

void LinkGraph::search(std::uint32_t from, double limit, Search& out, std::uint32_t to) const {
    out.distance.resize(pairs_.rest.size(), infinity);
    for (const std::uint32_t i : out.reached) out.distance[i] = infinity;
    out.reached.assign(1, from);
    out.distance[from] = 0;
    using Entry = std::pair<double, std::uint32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    open.emplace(0.0, from);
    while (!open.empty()) {
        const auto [length, here] = open.top();
        open.pop();
        if (here == to) return;
        if (length > out.distance[here]) continue;
        for (std::uint32_t l = offsets_[here]; l < offsets_[here + 1]; ++l) {
            const std::uint32_t there = links_[l].phyxel;
            const double longer = length + (pairs_.rest[there] - pairs_.rest[here]).norm();
            if (!(longer < limit) || !(longer < out.distance[there]) || blocked(links_[l].pair)) continue;
            if (out.distance[there] == infinity) out.reached.push_back(there);
            out.distance[there] = longer;
            open.emplace(longer, there);
        }
    }
}

}  // namespace splitcubes::occlusion
