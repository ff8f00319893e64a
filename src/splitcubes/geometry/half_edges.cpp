#include <splitcubes/geometry/half_edges.h>

#include <algorithm>
#include <tuple>

namespace splitcubes::geometry {

std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh) {
    std::vector<std::uint32_t> begin(mesh.positions.size() + 1, 0);
    const auto for_each_edge = [&](const auto& visit) {
        for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
            const Triangle& t = mesh.triangles[i];
            if (is_degenerate(t)) continue;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t a = t[k], b = t[(k + 1) % 3];
                visit(HalfEdge{std::min(a, b), std::max(a, b), a < b, i});
            }
        }
    };
    for_each_edge([&](const HalfEdge& e) { ++begin[e.low + 1]; });
    for (std::size_t v = 0; v + 1 < begin.size(); ++v) begin[v + 1] += begin[v];
    std::vector<HalfEdge> edges(begin.back());
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for_each_edge([&](const HalfEdge& e) { edges[next[e.low]++] = e; });
    for (std::size_t v = 0; v + 1 < begin.size(); ++v)
        std::sort(edges.begin() + begin[v], edges.begin() + begin[v + 1],
                  [](const HalfEdge& a, const HalfEdge& b) {
                      return std::tie(a.high, a.triangle) < std::tie(b.high, b.triangle);
                  });
    return edges;
}

}  // namespace splitcubes::geometry
