#include <splitcubes/geometry/nearest_point.h>
#include <splitcubes/geometry/tuning.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace splitcubes::geometry {

namespace {

double distance2(const Box& box, const Vec3& point) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        const double off = std::max({box.min[k] - point[k], 0.0, point[k] - box.max[k]});
        sum += off * off;
    }
    return sum;
}

/// Returns the parameter from a to b of the segment's point nearest to the origin.
double nearest_parameter(const Vec3& a, const Vec3& b) {
    const Vec3 ab = b - a;
    const double length2 = ab.squaredNorm();
    return length2 > 0 ? std::clamp(-a.dot(ab) / length2, 0.0, 1.0) : 0.0;
}

Vec3 point_of(const std::array<double, 3>& w, const Vec3& a, const Vec3& b, const Vec3& c) {
    return w[0] * a + w[1] * b + w[2] * c;
}

/// Returns the weights of the nearest point on the three sides; corners relative to the point.
std::array<double, 3> nearest_on_sides(const Vec3& a, const Vec3& b, const Vec3& c) {
    const double ab = nearest_parameter(a, b), bc = nearest_parameter(b, c), ca = nearest_parameter(c, a);
    const std::array<std::array<double, 3>, 3> sides = {{{1 - ab, ab, 0}, {0, 1 - bc, bc}, {ca, 0, 1 - ca}}};
    std::size_t best = 0;
    double min_square = point_of(sides[0], a, b, c).squaredNorm();
    for (std::size_t k = 1; k < 3; ++k) {
        const double here = point_of(sides[k], a, b, c).squaredNorm();
        if (here < min_square) {
            min_square = here;
            best = k;
        }
    }
    return sides[best];
}

/// Returns the weights of the point nearest to the origin: its projection if that is within
/// the triangle, else a point on a side.
std::array<double, 3> nearest_to_origin(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 n = (b - a).cross(c - a);
    // Weights of the projection times |n|^2: areas of the triangles that it forms with each side.
    const double u = n.dot(b.cross(c)), v = n.dot(c.cross(a)), w = n.dot(a.cross(b));
    const double sum = u + v + w;
    if (u >= 0 && v >= 0 && w >= 0 && sum > 0 && std::isfinite(sum)) return {u / sum, v / sum, w / sum};
    return nearest_on_sides(a, b, c);
}

}  // namespace

std::array<double, 3> nearest_weights(const Vec3& point, const Vec3& a, const Vec3& b, const Vec3& c) {
    return nearest_to_origin(a - point, b - point, c - point);
}

NearestPoint::NearestPoint(const TriangleMesh& mesh) : order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    if (order_.empty()) return;
    std::vector<Vec3> centroids;
    centroids.reserve(order_.size());
    for (const Triangle& t : mesh.triangles)
        centroids.emplace_back((mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3);
    nodes_.reserve(order_.size());
    build(0, static_cast<std::uint32_t>(order_.size()), centroids, 0);
    corners_.reserve(order_.size());
    slot_of_.resize(order_.size());
    for (std::uint32_t slot = 0; slot < order_.size(); ++slot) {
        const Triangle& t = mesh.triangles[order_[slot]];
        corners_.push_back({mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]});
        slot_of_[order_[slot]] = slot;
    }
    // Computes boxes bottom-up: children come after their parents.
    for (std::size_t n = nodes_.size(); n-- > 0;) {
        Node& node = nodes_[n];
        for (std::uint32_t slot = node.begin; slot < node.end; ++slot)
            for (const Vec3& p : {corners_[slot].a, corners_[slot].b, corners_[slot].c}) node.box.add(p);
        if (node.begin == node.end) {
            node.box.add(nodes_[n + 1].box);
            node.box.add(nodes_[node.second].box);
        }
    }
    const Box& all = nodes_.front().box;
    slack_ = 1e-13 * std::max(all.min.cwiseAbs().maxCoeff(), all.max.cwiseAbs().maxCoeff());
}

std::uint32_t NearestPoint::build(std::uint32_t begin, std::uint32_t end, std::span<const Vec3> centroids,
                                  int depth) {
    const auto index = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back({Box{}, begin, end, 0});
    if (end - begin <= tuning::distance::nearest_leaf_size || depth == tuning::distance::nearest_max_depth)
        return index;
    Box box;
    for (std::uint32_t i = begin; i < end; ++i) box.add(centroids[order_[i]]);
    int axis = 0;
    box.size().maxCoeff(&axis);
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                         const double x = centroids[a][axis], y = centroids[b][axis];
                         return x != y ? x < y : a < b;
                     });
    build(begin, middle, centroids, depth + 1);
    const std::uint32_t second = build(middle, end, centroids, depth + 1);
    nodes_[index].begin = nodes_[index].end = 0;
    nodes_[index].second = second;
    return index;
}

void NearestPoint::consider(std::uint32_t slot, const Query& query, Hit& best, double& best_value) const {
    const std::uint32_t triangle = order_[slot];
    if (!query.labels.empty() && query.labels[triangle] != query.label) return;
    // Computes relative to the point, so that a mesh far from the origin loses no digits.
    const Vec3 a = corners_[slot].a - query.point;
    const Vec3 b = corners_[slot].b - query.point;
    const Vec3 c = corners_[slot].c - query.point;
    const std::array<double, 3> weights = nearest_to_origin(a, b, c);
    const double distance = point_of(weights, a, b, c).norm();
    double value = distance;
    if (query.back_side_penalty > 0 && (b - a).cross(c - a).dot(query.normal) < 0)
        value += query.back_side_penalty;
    if (value > best_value || (value == best_value && triangle >= best.triangle)) return;
    best_value = value;
    best = {triangle, weights, distance};
}

NearestPoint::Hit NearestPoint::at(const Query& query) const {
    Hit best;
    double best_value = std::numeric_limits<double>::infinity();
    if (nodes_.empty()) return best;
    if (query.guess != none) consider(slot_of_[query.guess], query, best, best_value);
    struct Entry {
        std::uint32_t node;
        double distance2;
    };
    std::array<Entry, tuning::distance::nearest_max_depth + 4> stack;
    std::size_t height = 0;
    const auto too_far = [&](double d2) {
        const double reach = best_value + slack_;
        return d2 > reach * reach * (1 + 1e-9);
    };
    stack[height++] = {0, distance2(nodes_[0].box, query.point)};
    while (height > 0) {
        const Entry entry = stack[--height];
        if (too_far(entry.distance2)) continue;
        const Node& node = nodes_[entry.node];
        for (std::uint32_t slot = node.begin; slot < node.end; ++slot)
            consider(slot, query, best, best_value);
        if (node.begin < node.end) continue;
        Entry near{entry.node + 1, distance2(nodes_[entry.node + 1].box, query.point)};
        Entry far{node.second, distance2(nodes_[node.second].box, query.point)};
        if (far.distance2 < near.distance2) std::swap(near, far);
        if (!too_far(far.distance2)) stack[height++] = far;
        stack[height++] = near;
    }
    return best;
}

}  // namespace splitcubes::geometry
