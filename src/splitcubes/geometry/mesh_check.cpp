#include <splitcubes/core/disjoint_sets.h>
#include <splitcubes/geometry/half_edges.h>
#include <splitcubes/geometry/mesh_check.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace splitcubes::geometry {

namespace {

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

// Counts vertices whose triangle corners are not connected through shared edges: joins
// the two corners on each side of an edge with two triangles.
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
    std::vector<std::int32_t> new_index(mesh.positions.size(), -1);
    std::vector<std::int32_t> part(mesh.triangles.size());
    std::int32_t next = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        std::int32_t& n = new_index[sets.find(mesh.triangles[i][0])];
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

std::vector<UnbalancedEdge> unbalanced_edges(const TriangleMesh& mesh) {
    const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
    std::vector<UnbalancedEdge> out;
    for (std::size_t i = 0; i < edges.size();) {
        std::size_t end = i;
        int balance = 0;
        for (; end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high;
             ++end)
            balance += edges[end].forward ? 1 : -1;
        if (balance != 0)
            out.push_back({edges[i].low, edges[i].high, static_cast<std::uint32_t>(std::abs(balance))});
        i = end;
    }
    return out;
}

bool is_closed(const TriangleMesh& mesh) {
    for (const Triangle& t : mesh.triangles)
        if (is_degenerate(t)) return false;
    return !mesh.triangles.empty() && unbalanced_edges(mesh).empty();
}

namespace {

std::uint64_t hash_of_position(const Vec3& p) {
    std::uint64_t hash = 0x9e3779b97f4a7c15ULL;
    for (int axis = 0; axis < 3; ++axis) {
        const double value = p[axis] + 0.0;  // -0 becomes 0
        hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 0xff51afd7ed558ccdULL;
        hash ^= hash >> 32;
    }
    return hash;
}

// Returns for each vertex the first one with the same position. Non-finite vertices stay separate.
std::vector<std::uint32_t> first_with_same_position(const std::vector<Vec3>& positions) {
    const std::size_t size = std::bit_ceil(2 * positions.size() + 1);
    std::vector<std::uint32_t> table(size, UINT32_MAX);  // open addressing
    std::vector<std::uint32_t> first(positions.size());
    for (std::uint32_t v = 0; v < positions.size(); ++v) {
        if (!positions[v].allFinite()) {
            first[v] = v;
            continue;
        }
        std::size_t at = hash_of_position(positions[v]) & (size - 1);
        while (table[at] != UINT32_MAX && positions[table[at]] != positions[v]) at = (at + 1) & (size - 1);
        if (table[at] == UINT32_MAX) table[at] = v;
        first[v] = table[at];
    }
    return first;
}

}  // namespace

TriangleMesh weld_equal_vertices(const TriangleMesh& mesh) {
    const std::vector<std::uint32_t> first = first_with_same_position(mesh.positions);
    TriangleMesh out;
    std::vector<std::uint32_t> new_index(mesh.positions.size());
    for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
        if (first[v] != v) continue;
        new_index[v] = static_cast<std::uint32_t>(out.positions.size());
        out.positions.push_back(mesh.positions[v]);
    }
    for (const Triangle& t : mesh.triangles) {
        const Triangle welded{new_index[first[t[0]]], new_index[first[t[1]]], new_index[first[t[2]]]};
        if (!is_degenerate(welded)) out.triangles.push_back(welded);
    }
    return out;
}

}  // namespace splitcubes::geometry
