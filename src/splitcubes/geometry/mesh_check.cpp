#include <splitcubes/core/disjoint_sets.h>
#include <splitcubes/geometry/mesh_check.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::geometry {

namespace {

struct HalfEdge {
    std::uint32_t low, high;  // the undirected edge
    bool forward;             // runs low to high
    std::uint32_t triangle;
};

bool is_degenerate(const Triangle& t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh) {
    std::vector<HalfEdge> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        if (is_degenerate(t)) continue;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = t[k], b = t[(k + 1) % 3];
            edges.push_back({std::min(a, b), std::max(a, b), a < b, i});
        }
    }
    std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
        return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
    });
    return edges;
}

void count_edges(const std::vector<HalfEdge>& edges, MeshCheck& check) {
    for (std::size_t i = 0; i < edges.size();) {
        std::size_t end = i;
        std::size_t forward = 0;
        for (; end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high;
             ++end)
            forward += edges[end].forward;
        const std::size_t count = end - i;
        check.boundary_edges += count == 1;
        check.non_manifold_edges += count > 2;
        check.misoriented_edges += count == 2 && forward != 1;
        check.unbalanced_edges += 2 * forward != count;
        i = end;
    }
}

// A vertex is manifold when its triangle corners hang together through shared
// edges: joins the two corners on each side of an edge with two triangles.
void count_vertex_fans(const TriangleMesh& mesh, const std::vector<HalfEdge>& edges, MeshCheck& check) {
    DisjointSets corners(3 * mesh.triangles.size());
    const auto corner_of = [&](std::uint32_t triangle, std::uint32_t vertex) {
        const Triangle& t = mesh.triangles[triangle];
        return 3 * triangle + (t[0] == vertex ? 0U : t[1] == vertex ? 1U : 2U);
    };
    for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
        const HalfEdge& e = edges[i];
        const HalfEdge& f = edges[i + 1];
        if (e.low != f.low || e.high != f.high) continue;
        for (const std::uint32_t v : {e.low, e.high})
            corners.join(corner_of(e.triangle, v), corner_of(f.triangle, v));
    }
    std::vector<std::uint32_t> fans(mesh.positions.size(), 0);
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        if (is_degenerate(mesh.triangles[i])) continue;
        for (std::uint32_t k = 0; k < 3; ++k)
            if (corners.find(3 * i + k) == 3 * i + k) ++fans[mesh.triangles[i][k]];
    }
    for (const std::uint32_t count : fans) check.non_manifold_vertices += count > 1;
}

}  // namespace

std::vector<std::int32_t> triangle_parts(const TriangleMesh& mesh, std::size_t& part_count) {
    DisjointSets sets(mesh.positions.size());
    for (const Triangle& t : mesh.triangles) {
        sets.join(t[0], t[1]);
        sets.join(t[0], t[2]);
    }
    std::vector<std::int32_t> number(mesh.positions.size(), -1);
    std::vector<std::int32_t> part(mesh.triangles.size());
    std::int32_t next = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        std::int32_t& n = number[sets.find(mesh.triangles[i][0])];
        if (n < 0) n = next++;
        part[i] = n;
    }
    part_count = static_cast<std::size_t>(next);
    return part;
}

MeshCheck check_mesh(const TriangleMesh& mesh) {
    MeshCheck check;
    check.triangles = mesh.triangles.size();
    std::vector<bool> used(mesh.positions.size(), false);
    for (const Triangle& t : mesh.triangles) {
        check.degenerate_triangles += is_degenerate(t);
        for (const std::uint32_t v : t) used[v] = true;
    }
    for (std::size_t v = 0; v < used.size(); ++v) {
        check.vertices += used[v];
        check.non_finite_vertices += used[v] && !mesh.positions[v].allFinite();
    }
    const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
    count_edges(edges, check);
    count_vertex_fans(mesh, edges, check);

    std::size_t part_count = 0;
    const std::vector<std::int32_t> part = triangle_parts(mesh, part_count);
    check.parts.resize(part_count);
    const Vec3 origin = mesh.positions.empty() ? Vec3(Vec3::Zero()) : mesh.positions.front();
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        const Vec3 a = mesh.positions[t[0]] - origin;
        const Vec3 b = mesh.positions[t[1]] - origin;
        const Vec3 c = mesh.positions[t[2]] - origin;
        MeshPart& p = check.parts[static_cast<std::size_t>(part[i])];
        ++p.triangles;
        p.volume += a.dot(b.cross(c)) / 6;
        p.area += (b - a).cross(c - a).norm() / 2;
    }
    std::stable_sort(check.parts.begin(), check.parts.end(), [](const MeshPart& a, const MeshPart& b) {
        return std::abs(a.volume) > std::abs(b.volume);
    });
    check.volume = mesh.volume();
    check.area = mesh.area();
    return check;
}

TriangleMesh weld_equal_vertices(const TriangleMesh& mesh) {
    std::vector<std::uint32_t> order(mesh.positions.size());
    std::iota(order.begin(), order.end(), std::uint32_t{0});
    const auto before = [&](std::uint32_t a, std::uint32_t b) {
        const Vec3& p = mesh.positions[a];
        const Vec3& q = mesh.positions[b];
        return std::tie(p[0], p[1], p[2], a) < std::tie(q[0], q[1], q[2], b);
    };
    std::sort(order.begin(), order.end(), before);
    std::vector<std::uint32_t> first(mesh.positions.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool same = i > 0 && mesh.positions[order[i]] == mesh.positions[order[i - 1]];
        first[order[i]] = same ? first[order[i - 1]] : order[i];
    }
    TriangleMesh out;
    std::vector<std::uint32_t> number(mesh.positions.size());
    for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
        if (first[v] != v) continue;
        number[v] = static_cast<std::uint32_t>(out.positions.size());
        out.positions.push_back(mesh.positions[v]);
    }
    for (const Triangle& t : mesh.triangles) {
        const Triangle welded{number[first[t[0]]], number[first[t[1]]], number[first[t[2]]]};
        if (!is_degenerate(welded)) out.triangles.push_back(welded);
    }
    return out;
}

}  // namespace splitcubes::geometry
