#include <splitcubes/core/compensated_sum.h>
#include <splitcubes/splitting/extract.h>

#include <algorithm>
#include <cassert>

namespace splitcubes::splitting {

geometry::SurfaceMesh extract(const NodeGrid& grid, const Surface& surface, const Pieces& pieces,
                              std::span<const Vec3> positions, std::span<const Vec3> normals,
                              const Parallel& parallel) {
    const std::vector<SurfaceVertex>& vertices = surface.vertices();
    assert(positions.empty() || positions.size() == vertices.size());
    std::vector<std::uint32_t> new_index(vertices.size(), UINT32_MAX);
    std::uint32_t vertex_count = 0;
    for (std::size_t i = 0; i < vertices.size(); ++i)
        if (vertices[i].alive()) new_index[i] = vertex_count++;
    geometry::SurfaceMesh out;
    out.mesh.positions.resize(vertex_count);
    out.normals.resize(vertex_count);
    out.rest.resize(vertex_count);
    out.vertex_piece.resize(vertex_count);
    parallel.for_each(vertices.size(), 4096, [&](std::size_t i) {
        if (new_index[i] == UINT32_MAX) return;
        const SurfaceVertex& v = vertices[i];
        out.mesh.positions[new_index[i]] = positions.empty() ? v.rest : positions[i];
        out.normals[new_index[i]] = normals.empty() ? Vec3(v.normal.cast<double>()) : normals[i];
        out.rest[new_index[i]] = v.rest;
        out.vertex_piece[new_index[i]] = pieces.piece_of(grid, surface.influence(v));
    });
    const std::vector<SurfaceCell>& cells = surface.cells();
    std::vector<std::uint32_t> first_quad(cells.size() + 1, 0);
    for (std::size_t c = 0; c < cells.size(); ++c) first_quad[c + 1] = first_quad[c] + cells[c].quad_count;
    out.mesh.triangles.resize(2 * static_cast<std::size_t>(first_quad.back()));
    out.triangle_origin.resize(out.mesh.triangles.size());
    out.triangle_cut.resize(out.mesh.triangles.size());
    parallel.for_each(cells.size(), 1024, [&](std::size_t c) {
        std::size_t t = 2 * static_cast<std::size_t>(first_quad[c]);
        for (const SurfaceQuad& q : surface.quads(cells[c])) {
            const auto at = [&](std::size_t k) { return new_index[q.vertices[k]]; };
            const Crossing& crossing = grid.crossing(q.crossing);
            const Origin origin = crossing.origin;
            out.triangle_cut[t] = out.triangle_cut[t + 1] = origin == Origin::cut ? crossing.cut : -1;
            out.triangle_origin[t] = out.triangle_origin[t + 1] = origin;
            out.mesh.triangles[t++] = {at(0), at(1), at(2)};
            out.mesh.triangles[t++] = {at(0), at(2), at(3)};
        }
    });
    return out;
}

geometry::SurfaceMesh extract_piece(const geometry::SurfaceMesh& surface, std::int32_t piece) {
    assert(piece >= 0);
    std::int32_t last = piece;
    for (const std::int32_t p : surface.vertex_piece) last = std::max(last, p);
    std::vector<std::uint8_t> wanted(static_cast<std::size_t>(last) + 1, 0);
    wanted[static_cast<std::size_t>(piece)] = 1;
    return extract_pieces(surface, wanted);
}

geometry::SurfaceMesh extract_pieces(const geometry::SurfaceMesh& surface,
                                     std::span<const std::uint8_t> wanted) {
    geometry::SurfaceMesh out;
    std::vector<std::uint32_t> new_index(surface.mesh.positions.size(), UINT32_MAX);
    for (std::size_t v = 0; v < surface.mesh.positions.size(); ++v) {
        if (!wanted[static_cast<std::size_t>(surface.vertex_piece[v])]) continue;
        new_index[v] = static_cast<std::uint32_t>(out.mesh.positions.size());
        out.mesh.positions.push_back(surface.mesh.positions[v]);
        out.normals.push_back(surface.normals[v]);
        out.vertex_piece.push_back(surface.vertex_piece[v]);
        if (!surface.rest.empty()) out.rest.push_back(surface.rest[v]);
        if (!surface.vertex_body.empty()) out.vertex_body.push_back(surface.vertex_body[v]);
    }
    const geometry::MeshAttributes& from = surface.attributes;
    geometry::MeshAttributes& to = out.attributes;
    to.materials = from.materials;
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
        const geometry::Triangle& tri = surface.mesh.triangles[t];
        if (new_index[tri[0]] == UINT32_MAX) continue;
        out.mesh.triangles.push_back({new_index[tri[0]], new_index[tri[1]], new_index[tri[2]]});
        out.triangle_origin.push_back(surface.triangle_origin[t]);
        if (!surface.triangle_cut.empty()) out.triangle_cut.push_back(surface.triangle_cut[t]);
        if (!from.corner_uv.empty()) to.corner_uv.push_back(from.corner_uv[t]);
        if (!from.corner_colour.empty()) to.corner_colour.push_back(from.corner_colour[t]);
        if (!from.triangle_material.empty()) to.triangle_material.push_back(from.triangle_material[t]);
    }
    return out;
}

std::vector<PieceMeasure> measure_pieces(const geometry::SurfaceMesh& surface, std::size_t piece_count) {
    std::vector<PieceMeasure> out(piece_count);
    if (surface.mesh.positions.empty()) return out;
    const Vec3 origin = surface.mesh.positions.front();
    std::vector<CompensatedSum> volumes(piece_count);
    std::vector<Vec3> moments(piece_count, Vec3::Zero());  // m^4, about `origin`
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
        const geometry::Triangle& tri = surface.mesh.triangles[t];
        const Vec3 a = surface.mesh.positions[tri[0]] - origin;
        const Vec3 b = surface.mesh.positions[tri[1]] - origin;
        const Vec3 c = surface.mesh.positions[tri[2]] - origin;
        const auto k = static_cast<std::size_t>(surface.vertex_piece[tri[0]]);
        PieceMeasure& piece = out[k];
        ++piece.triangles;
        const double volume = a.dot(b.cross(c)) / 6;
        volumes[k].add(volume);
        moments[k] += volume / 4 * (a + b + c);
        for (const std::uint32_t v : tri) piece.bounds.add(surface.mesh.positions[v]);
        const double area = (b - a).cross(c - a).norm() / 2;
        (surface.triangle_origin[t] == Origin::cut ? piece.cut_area : piece.boundary_area) += area;
    }
    for (std::size_t k = 0; k < piece_count; ++k) {
        out[k].volume = volumes[k].value();
        out[k].center_of_mass = origin + moments[k] / out[k].volume;
        // Negated, so that it also replaces NaN.
        if (!out[k].bounds.contains(out[k].center_of_mass)) out[k].center_of_mass = out[k].bounds.center();
    }
    return out;
}

}  // namespace splitcubes::splitting
