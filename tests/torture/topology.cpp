#include "topology.h"

#include <Eigen/Dense>

#include <algorithm>
#include <map>
#include <numeric>

namespace splitcubes::torture {

namespace {

// A directed edge of a triangle; `corner` is the corner at its beginning, 3 triangle + k.
struct Edge {
    int low, high;
    bool rising;
    std::size_t corner;
};

std::vector<Edge> sorted_edges(const Surface& surface) {
    std::vector<Edge> out;
    out.reserve(3 * surface.triangles.size());
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const int a = surface.triangles[t][k], b = surface.triangles[t][(k + 1) % 3];
            out.push_back({std::min(a, b), std::max(a, b), a < b, 3 * t + k});
        }
    std::sort(out.begin(), out.end(), [](const Edge& a, const Edge& b) {
        return std::tie(a.low, a.high, a.corner) < std::tie(b.low, b.high, b.corner);
    });
    return out;
}

std::size_t next_corner(std::size_t corner) {
    return corner - corner % 3 + (corner + 1) % 3;
}

struct Fans {
    std::vector<std::size_t> parent;
    explicit Fans(std::size_t count) : parent(count) { std::iota(parent.begin(), parent.end(), 0); }
    std::size_t root(std::size_t corner) {
        while (parent[corner] != corner) corner = parent[corner] = parent[parent[corner]];
        return corner;
    }
    void join(std::size_t a, std::size_t b) { parent[root(a)] = root(b); }
};

struct Moments {
    double volume = 0;
    Vec3 first = Vec3::Zero();

    // A tetrahedron to the origin.
    void add(const Vec3& a, const Vec3& b, const Vec3& c) {
        const double six = a.dot(b.cross(c));
        volume += six / 6;
        first += six / 24 * (a + b + c);
    }
};

// Sums over the surface of a piece, relative to its first vertex.
struct PieceSums {
    std::size_t triangles = 0;
    Vec3 origin = Vec3::Zero(), rest_origin = Vec3::Zero();
    Moments now, rest;
    double weight = 0;
    Vec3 mean = Vec3::Zero(), rest_mean = Vec3::Zero();
    Eigen::Matrix3d rest_square = Eigen::Matrix3d::Zero(), mixed = Eigen::Matrix3d::Zero();

    void fit(const Vec3& x, const Vec3& rest_x) {
        weight += 1;
        mean += x;
        rest_mean += rest_x;
        rest_square += rest_x * rest_x.transpose();
        mixed += x * rest_x.transpose();
    }
    // Image of a rest position, both relative to the origins.
    Vec3 image(const Vec3& rest_x) const {
        const Vec3 x0 = mean / weight, r0 = rest_mean / weight;
        Eigen::Matrix3d square = rest_square / weight - r0 * r0.transpose();
        const Eigen::Matrix3d across = mixed / weight - x0 * r0.transpose();
        square += 1e-9 * square.trace() * Eigen::Matrix3d::Identity();
        return x0 + across * square.inverse() * (rest_x - r0);
    }
    PieceMeasure measure(int piece, double largest) const;
};

PieceMeasure PieceSums::measure(int piece, double largest) const {
    PieceMeasure out;
    out.piece = piece;
    out.triangles = triangles;
    out.volume = now.volume;
    out.rest_volume = rest.volume;
    if (rest.volume == 0) {  // no positions at rest
        out.centre = origin + (now.volume > 0 ? Vec3(now.first / now.volume) : Vec3(mean / weight));
        out.affine_centre = out.centre;
        return out;
    }
    // The centre of a sliver's volume may be far outside of it.
    const bool solid = rest.volume > 1e-3 * largest && now.volume > 0.1 * rest.volume;
    out.centre = origin + (solid ? Vec3(now.first / now.volume) : Vec3(mean / weight));
    const Vec3 rest_centre = solid ? Vec3(rest.first / rest.volume) : Vec3(rest_mean / weight);
    out.affine_centre = origin + image(rest_centre);
    return out;
}

}  // namespace

Topology topology_of(const Surface& surface) {
    Topology out;
    const std::vector<Edge> edges = sorted_edges(surface);
    Fans fans(3 * surface.triangles.size());
    for (std::size_t first = 0; first < edges.size();) {
        std::size_t end = first + 1;
        while (end < edges.size() && edges[end].low == edges[first].low &&
               edges[end].high == edges[first].high)
            ++end;
        if (end - first == 2 && edges[first].rising != edges[first + 1].rising) {
            const std::size_t a = edges[first].corner, b = edges[first + 1].corner;
            fans.join(a, next_corner(b));
            fans.join(next_corner(a), b);
        } else {
            out.open_edges += end - first;
        }
        first = end;
    }
    std::vector<std::size_t> fan_of(surface.positions.size(), fans.parent.size());
    std::vector<bool> branches(surface.positions.size(), false);
    for (std::size_t corner = 0; corner < fans.parent.size(); ++corner) {
        const auto vertex = static_cast<std::size_t>(surface.triangles[corner / 3][corner % 3]);
        const std::size_t root = fans.root(corner);
        if (fan_of[vertex] == fans.parent.size()) fan_of[vertex] = root;
        if (fan_of[vertex] != root && !branches[vertex]) {
            branches[vertex] = true;
            ++out.branching_vertices;
        }
    }
    return out;
}

std::vector<PieceMeasure> measure_pieces(const Surface& surface) {
    std::map<int, PieceSums> sums;
    const bool has_rest = !surface.rest.empty();
    PieceSums* last = nullptr;  // triangles of a piece follow each other
    int last_piece = 0;
    for (const std::array<int, 3>& t : surface.triangles) {
        const auto a = static_cast<std::size_t>(t[0]), b = static_cast<std::size_t>(t[1]),
                   c = static_cast<std::size_t>(t[2]);
        if (last == nullptr || surface.piece[a] != last_piece) {
            last_piece = surface.piece[a];
            last = &sums[last_piece];
        }
        PieceSums& sum = *last;
        if (sum.triangles++ == 0) {
            sum.origin = surface.positions[a];
            if (has_rest) sum.rest_origin = surface.rest[a];
        }
        sum.now.add(surface.positions[a] - sum.origin, surface.positions[b] - sum.origin,
                    surface.positions[c] - sum.origin);
        if (has_rest)
            sum.rest.add(surface.rest[a] - sum.rest_origin, surface.rest[b] - sum.rest_origin,
                         surface.rest[c] - sum.rest_origin);
        for (const std::size_t v : {a, b, c})
            sum.fit(surface.positions[v] - sum.origin,
                    has_rest ? Vec3(surface.rest[v] - sum.rest_origin) : Vec3::Zero());
    }
    double largest = 0;
    for (const auto& [piece, sum] : sums) largest = std::max(largest, sum.rest.volume);
    std::vector<PieceMeasure> out;
    for (const auto& [piece, sum] : sums) out.push_back(sum.measure(piece, largest));
    return out;
}

}  // namespace splitcubes::torture
