#include <splitcubes/core/disjoint_sets.h>
#include <splitcubes/geometry/mesh_attributes.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <tuple>

namespace splitcubes::geometry {

namespace {

/// Appends to an array that may be empty (attribute absent).
template <class Value>
void append_filled(std::vector<Value>& own, std::size_t own_count, const std::vector<Value>& other,
                   std::size_t other_count, const Value& filling) {
    if (own.empty() && other.empty()) return;
    own.resize(own_count, filling);
    own.insert(own.end(), other.begin(), other.end());
    own.resize(own_count + other_count, filling);
}

/// Returns for each vertex the lowest vertex with the same position.
std::vector<std::uint32_t> first_with_position(const std::vector<Vec3>& positions) {
    std::vector<std::uint32_t> order(positions.size());
    std::iota(order.begin(), order.end(), 0U);
    const auto less = [&](std::uint32_t a, std::uint32_t b) {
        for (int k = 0; k < 3; ++k)
            if (positions[a][k] != positions[b][k]) return positions[a][k] < positions[b][k];
        return a < b;
    };
    std::sort(order.begin(), order.end(), less);
    std::vector<std::uint32_t> first(positions.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool same = i > 0 && positions[order[i]] == positions[order[i - 1]];
        first[order[i]] = same ? first[order[i - 1]] : order[i];
    }
    return first;
}

/// A triangle's side of an edge with the values that must agree across it; ends in order of their vertices.
struct EdgeSide {
    std::array<std::uint32_t, 2> vertices;
    std::array<std::uint32_t, 12> values{};  // bits of uv and colour at both ends
    std::int32_t material = -1;
    std::uint32_t triangle = 0;

    auto key() const { return std::tie(vertices, values, material); }
    bool operator<(const EdgeSide& other) const {
        return std::tie(vertices, values, material, triangle) <
               std::tie(other.vertices, other.values, other.material, other.triangle);
    }
};

EdgeSide side_of(const MeshAttributes& a, const std::vector<std::uint32_t>& first_vertex,
                 const Triangle& triangle, std::size_t t, std::size_t k) {
    std::array<std::size_t, 2> ends = {k, (k + 1) % 3};
    if (first_vertex[triangle[ends[1]]] < first_vertex[triangle[ends[0]]]) std::swap(ends[0], ends[1]);
    EdgeSide side{.vertices = {first_vertex[triangle[ends[0]]], first_vertex[triangle[ends[1]]]}};
    std::size_t at = 0;
    for (const std::size_t end : ends) {
        if (!a.corner_uv.empty())
            for (const float x : a.corner_uv[t][end]) side.values[at++] = std::bit_cast<std::uint32_t>(x);
        if (!a.corner_colour.empty())
            for (const float x : a.corner_colour[t][end]) side.values[at++] = std::bit_cast<std::uint32_t>(x);
    }
    if (!a.triangle_material.empty()) side.material = a.triangle_material[t];
    side.triangle = static_cast<std::uint32_t>(t);
    return side;
}

}  // namespace

void MeshAttributes::append(std::size_t own_triangles, const MeshAttributes& other,
                            std::size_t other_triangles) {
    append_filled(corner_uv, own_triangles, other.corner_uv, other_triangles, {});
    constexpr Rgba white{1, 1, 1, 1};
    append_filled(corner_colour, own_triangles, other.corner_colour, other_triangles, {white, white, white});
    append_filled(triangle_material, own_triangles, other.triangle_material, other_triangles, -1);
    const auto shift = static_cast<std::int32_t>(materials.size());
    if (!triangle_material.empty())
        for (std::size_t t = own_triangles; t < triangle_material.size(); ++t)
            if (triangle_material[t] >= 0) triangle_material[t] += shift;
    materials.insert(materials.end(), other.materials.begin(), other.materials.end());
}

std::vector<std::int32_t> attribute_charts(const TriangleMesh& mesh, const MeshAttributes& attributes) {
    const std::vector<std::uint32_t> first_vertex = first_with_position(mesh.positions);
    std::vector<EdgeSide> sides;
    sides.reserve(3 * mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k)
            sides.push_back(side_of(attributes, first_vertex, mesh.triangles[t], t, k));
    std::sort(sides.begin(), sides.end());
    DisjointSets sets(mesh.triangles.size());
    for (std::size_t i = 1; i < sides.size(); ++i)
        if (sides[i].key() == sides[i - 1].key()) sets.join(sides[i].triangle, sides[i - 1].triangle);
    std::vector<std::int32_t> chart(mesh.triangles.size());
    std::int32_t count = 0;
    for (std::uint32_t t = 0; t < chart.size(); ++t) {
        const std::uint32_t root = sets.find(t);  // the lowest of its set
        chart[t] = root == t ? count++ : chart[root];
    }
    return chart;
}

}  // namespace splitcubes::geometry
