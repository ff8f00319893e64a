#include <splitcubes/geometry/half_edges.h>
#include <splitcubes/geometry/repair.h>

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>
#include <vector>

namespace splitcubes::geometry {

namespace {

// Returns the triangle's vertices in ascending order; `even`: the orientation is unchanged.
Triangle sorted(Triangle t, bool& even) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    even = t[1] < t[2];
    if (!even) std::swap(t[1], t[2]);
    return t;
}

struct Neighbour {
    std::uint32_t triangle;
    bool agrees;  // uses the common edge in the opposite direction
};

// Returns the neighbours over the three edges of each triangle; empty if an edge does not
// have exactly two triangles.
std::vector<std::array<Neighbour, 3>> neighbours_of(const TriangleMesh& mesh) {
    const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
    const auto same = [&](std::size_t i, std::size_t j) {
        return j < edges.size() && edges[i].low == edges[j].low && edges[i].high == edges[j].high;
    };
    std::vector<std::array<Neighbour, 3>> out(mesh.triangles.size());
    std::vector<std::uint8_t> known(mesh.triangles.size(), 0);
    for (std::size_t i = 0; i < edges.size(); i += 2) {
        if (!same(i, i + 1) || same(i, i + 2)) return {};
        const HalfEdge &a = edges[i], &b = edges[i + 1];
        out[a.triangle][known[a.triangle]++] = {b.triangle, a.forward != b.forward};
        out[b.triangle][known[b.triangle]++] = {a.triangle, a.forward != b.forward};
    }
    return out;
}

double area_of(const TriangleMesh& mesh, const Triangle& t) {
    const Vec3& a = mesh.positions[t[0]];
    return (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a).norm();
}

enum Side : std::uint8_t { unknown, kept, flipped };

// Orients the part of `seed`; returns false if it is not orientable.
bool orient_part(const TriangleMesh& mesh, const std::vector<std::array<Neighbour, 3>>& neighbours,
                 std::uint32_t seed, std::vector<Side>& side) {
    std::vector<std::uint32_t> part{seed};
    side[seed] = kept;
    double kept_area = 0, flipped_area = 0;
    for (std::size_t i = 0; i < part.size(); ++i) {
        const std::uint32_t t = part[i];
        (side[t] == kept ? kept_area : flipped_area) += area_of(mesh, mesh.triangles[t]);
        for (const Neighbour& next : neighbours[t]) {
            const Side wanted = next.agrees ? side[t] : side[t] == kept ? flipped : kept;
            if (side[next.triangle] == unknown) {
                side[next.triangle] = wanted;
                part.push_back(next.triangle);
            } else if (side[next.triangle] != wanted) {
                return false;
            }
        }
    }
    if (flipped_area > kept_area)
        for (const std::uint32_t t : part) side[t] = side[t] == kept ? flipped : kept;
    return true;
}

}  // namespace

TriangleMesh without_duplicates(const TriangleMesh& mesh, std::size_t& dropped) {
    // Buckets by lowest vertex hold few triangles, or many equal ones.
    std::vector<std::uint32_t> begin(mesh.positions.size() + 1, 0);
    struct Entry {
        std::uint32_t second, third, triangle;
        bool even;
    };
    std::vector<Entry> entries(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) ++begin[*std::min_element(t.begin(), t.end()) + 1];
    for (std::size_t v = 0; v + 1 < begin.size(); ++v) begin[v + 1] += begin[v];
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        bool even = false;
        const Triangle t = sorted(mesh.triangles[i], even);
        entries[next[t[0]]++] = {t[1], t[2], i, even};
    }
    std::vector<std::uint8_t> keep(mesh.triangles.size(), 0);
    dropped = mesh.triangles.size();
    for (std::size_t v = 0; v + 1 < begin.size(); ++v) {
        const auto first = entries.begin() + begin[v], last = entries.begin() + begin[v + 1];
        std::sort(first, last, [](const Entry& a, const Entry& b) {
            return std::tie(a.second, a.third, a.triangle) < std::tie(b.second, b.third, b.triangle);
        });
        for (auto i = first; i != last;) {
            auto end = i;
            std::ptrdiff_t even = 0;
            for (; end != last && end->second == i->second && end->third == i->third; ++end)
                even += end->even ? 1 : -1;
            // The first triangle with the majority's orientation.
            const auto chosen =
                std::find_if(i, end, [&](const Entry& e) { return even != 0 && e.even == (even > 0); });
            if (chosen != end) {
                keep[chosen->triangle] = 1;
                --dropped;
            }
            i = end;
        }
    }
    if (dropped == 0) return mesh;
    TriangleMesh out{mesh.positions, {}};
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        if (keep[t]) out.triangles.push_back(mesh.triangles[t]);
    return out;
}

TriangleMesh consistently_oriented(const TriangleMesh& mesh, std::size_t& turned) {
    turned = 0;
    const std::vector<std::array<Neighbour, 3>> neighbours = neighbours_of(mesh);
    if (neighbours.empty()) return mesh;
    std::vector<Side> side(mesh.triangles.size(), unknown);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
        if (side[t] == unknown && !orient_part(mesh, neighbours, t, side)) return mesh;
    TriangleMesh out = mesh;
    for (std::size_t t = 0; t < side.size(); ++t) {
        if (side[t] != flipped) continue;
        std::swap(out.triangles[t][1], out.triangles[t][2]);
        ++turned;
    }
    return out;
}

}  // namespace splitcubes::geometry
