#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/validate.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>

namespace splitcubes::splitting {

namespace {

class Findings {
  public:
    explicit Findings(std::size_t limit) : limit_(limit) {}
    template <class... Parts>
    void add(const Parts&... parts) {
        if (lines_.size() >= limit_) return;
        std::ostringstream out;
        (out << ... << parts);
        lines_.push_back(out.str());
    }
    std::vector<std::string> take() { return std::move(lines_); }

  private:
    std::size_t limit_;
    std::vector<std::string> lines_;
};

std::string text_of(const GridEdge& edge) {
    std::ostringstream out;
    out << "edge (" << edge.node[0] << ", " << edge.node[1] << ", " << edge.node[2] << ") along "
        << "xyz"[edge.axis];
    return out.str();
}

std::uint64_t bits_of(double value) {
    std::uint64_t bits = 0;
    value += 0.0;  // -0 becomes 0
    std::memcpy(&bits, &value, sizeof bits);
    return bits;
}

std::uint64_t name_of(const SurfaceVertex& v) {
    return edge_id({v.lowest_node, v.axis}) << 12 | static_cast<std::uint64_t>(v.kind) << 8 | v.instance;
}

}  // namespace

std::vector<std::string> validate(const NodeGrid& grid, std::size_t limit) {
    Findings findings(limit);
    const Vec3i n = grid.rest().node_count;
    for (int z = 0; z < n[2]; ++z)
        for (int y = 0; y < n[1]; ++y)
            for (int x = 0; x < n[0]; ++x)
                for (int axis = 0; axis < 3; ++axis) {
                    const GridEdge edge{{x, y, z}, axis};
                    const bool lower = grid.inside(edge.node);
                    if (!grid.has_edge(edge)) {
                        if (lower) findings.add(text_of(edge), ": an inside node on the grid's border");
                        continue;
                    }
                    const bool upper = grid.inside(edge.upper());
                    if (lower != upper && !grid.is_cut(edge))
                        findings.add(text_of(edge), ": between inside and outside but not cut");
                    if (!lower && !upper && grid.is_cut(edge))
                        findings.add(text_of(edge), ": cut outside the body");
                }
    for (const Crossing& c : grid.crossings()) {
        const bool is_boundary = grid.inside(c.edge.node) != grid.inside(c.edge.upper());
        if (!(c.parameter >= min_parameter && c.parameter <= 1 - min_parameter))
            findings.add(text_of(c.edge), ": parameter ", c.parameter);
        if (!(std::abs(c.normal.norm() - 1) < 1e-9) || !(c.normal[c.edge.axis] >= 0))
            findings.add(text_of(c.edge), ": normal ", c.normal.transpose());
        if (is_boundary && c.origin != Origin::boundary)
            findings.add(text_of(c.edge), ": a boundary crossing marked as cut");
    }
    return findings.take();
}

std::vector<std::array<std::uint64_t, 16>> canonical_quads(const Surface& surface) {
    std::vector<std::array<std::uint64_t, 16>> out;
    for (const SurfaceCell& cell : surface.cells())
        for (const SurfaceQuad& q : surface.quads(cell)) {
            std::array<std::uint64_t, 16>& row = out.emplace_back();
            for (std::size_t k = 0; k < 4; ++k) {
                const SurfaceVertex& v = surface.vertices()[q.vertices[k]];
                row[k] = name_of(v);
                for (int axis = 0; axis < 3; ++axis)
                    row[4 + 3 * k + static_cast<std::size_t>(axis)] = bits_of(v.rest[axis]);
            }
        }
    std::sort(out.begin(), out.end());
    return out;
}

std::vector<std::string> validate(const NodeGrid& grid, const Surface& surface, const Pieces& pieces,
                                  std::size_t limit) {
    Findings findings(limit);
    const Surface fresh(grid);
    if (canonical_quads(fresh) != canonical_quads(surface))
        findings.add("the updated surface differs from one rebuilt from scratch");
    const geometry::SurfaceMesh mesh = extract(grid, surface, pieces);
    const geometry::MeshCheck check = geometry::check_mesh(mesh.mesh);
    if (check.triangles > 0 && !check.valid())
        findings.add("surface: ", check.boundary_edges, " boundary, ", check.non_manifold_edges,
                     " non-manifold, ", check.misoriented_edges, " misoriented edges, ",
                     check.non_manifold_vertices, " non-manifold vertices, ", check.non_finite_vertices,
                     " not finite");
    std::size_t alive = 0;
    for (const SurfaceVertex& v : surface.vertices()) {
        if (!v.alive()) continue;
        ++alive;
        double total = 0;
        bool one_piece = true;
        const std::int32_t piece = pieces.piece_of(grid, surface.influence(v));
        const Influences influences = surface.influences(grid.rest(), v);
        for (std::size_t k = 0; k < influences.count; ++k) {
            total += influences.weights[k];
            one_piece = one_piece && pieces.piece_of(grid, surface.nodes()[influences.nodes[k]]) == piece;
        }
        if (piece < 0 || !one_piece) findings.add("a vertex influenced by nodes of different pieces");
        if (!(std::abs(total - 1) < 1e-5)) findings.add("a vertex whose weights sum to ", total);
    }
    if (alive != check.vertices) findings.add("vertices alive: ", alive, ", used: ", check.vertices);
    return findings.take();
}

}  // namespace splitcubes::splitting
