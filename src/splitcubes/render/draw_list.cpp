#include <splitcubes/core/error.h>
#include <splitcubes/geometry/attribute_transfer.h>
#include <splitcubes/geometry/srgb.h>
#include <splitcubes/render/draw_list.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <span>
#include <string>

namespace splitcubes::render {

namespace {

using geometry::Origin;
using geometry::SurfaceMesh;
using geometry::Triangle;
using geometry::TriangleMesh;

/// Returns twice the area times the unit normal, m^2.
Vec3 area_vector(const TriangleMesh& mesh, const Triangle& triangle) {
    const Vec3& a = mesh.positions[triangle[0]];
    return (mesh.positions[triangle[1]] - a).cross(mesh.positions[triangle[2]] - a);
}

/// Returns the direction of v, or zero if it has none.
Vec3 direction_of(const Vec3& v) {
    const double length = v.norm();
    return length > 0 && std::isfinite(length) ? Vec3(v / length) : Vec3(Vec3::Zero());
}

/// Returns 1 for an equilateral triangle, 0 for one without area.
double roundness(const TriangleMesh& mesh, const Triangle& triangle, const Vec3& area) {
    double edges = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        edges += (mesh.positions[triangle[(k + 1) % 3]] - mesh.positions[triangle[k]]).squaredNorm();
    }
    return edges > 0 ? 2 * std::sqrt(3.0) * area.norm() / edges : 0;
}

/// Corners (3 * triangle + k) around each vertex, in corner order.
struct CornersOfVertices {
    std::vector<std::uint32_t> first;    // per vertex and one past the end, into corners
    std::vector<std::uint32_t> corners;  // 3 * triangle + k

    explicit CornersOfVertices(const TriangleMesh& mesh)
        : first(mesh.positions.size() + 1, 0), corners(3 * mesh.triangles.size()) {
        for (const Triangle& triangle : mesh.triangles) {
            for (const std::uint32_t vertex : triangle) ++first[vertex + 1];
        }
        for (std::size_t v = 1; v < first.size(); ++v) first[v] += first[v - 1];
        std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            for (std::size_t k = 0; k < 3; ++k) {
                corners[next[mesh.triangles[t][k]]++] = static_cast<std::uint32_t>(3 * t + k);
            }
        }
    }
};

void check_mesh(const char* where, const TriangleMesh& mesh) {
    for (const Triangle& triangle : mesh.triangles) {
        for (const std::uint32_t vertex : triangle) {
            if (vertex >= mesh.positions.size()) {
                throw InputError(where, "a triangle names vertex " + std::to_string(vertex) + " of " +
                                            std::to_string(mesh.positions.size()));
            }
        }
    }
}

Vec3 hsv_from_rgb(const Color& rgb) {
    const double high = rgb.maxCoeff();
    const double span = high - rgb.minCoeff();
    double hue = 0;
    if (span > 0) {
        if (high == rgb.x()) {
            hue = (rgb.y() - rgb.z()) / span;
        } else if (high == rgb.y()) {
            hue = 2 + (rgb.z() - rgb.x()) / span;
        } else {
            hue = 4 + (rgb.x() - rgb.y()) / span;
        }
    }
    return {60 * hue, high > 0 ? span / high : 0, high};
}

Color rgb_from_hsv(const Vec3& hsv) {
    const auto channel = [&](double n) {
        double k = std::fmod(n + hsv.x() / 60, 6.0);
        if (k < 0) k += 6;
        return hsv.z() * (1 - hsv.y() * std::clamp(std::min(k, 4 - k), 0.0, 1.0));
    };
    return {channel(5), channel(3), channel(1)};
}

/// Returns the palette's colour for piece 0; the hues of the others spread over +-step by the golden ratio
/// sequence, in which neighbours differ much.
Color piece_color(const SurfacePalette& palette, std::int32_t piece) {
    if (piece <= 0) return palette.boundary;
    const double fraction = std::fmod(piece * 0.6180339887498949 + 0.25, 1.0);
    Vec3 hsv = hsv_from_rgb(palette.boundary);
    hsv.x() += palette.piece_hue_step * (2 * fraction - 1);
    return rgb_from_hsv(hsv);
}

bool is_cut(const SurfaceMesh& surface, std::size_t triangle) {
    return !surface.triangle_origin.empty() && surface.triangle_origin[triangle] == Origin::cut;
}

/// Returns the sRGB colours of a boundary triangle's corners: vertex colours times the material's colour.
std::array<Color, 3> corner_colors(const SurfaceMesh& surface, std::size_t triangle,
                                   const Color& plain_color) {
    const geometry::MeshAttributes& a = surface.attributes;
    const std::int32_t material_index = a.triangle_material.empty() ? -1 : a.triangle_material[triangle];
    const geometry::Material* material =
        material_index < 0 ? nullptr : &a.materials[static_cast<std::size_t>(material_index)];
    const bool coloured = !a.corner_colour.empty();
    // The look of a textured face is in its texture, and the material that was added for unassigned faces has
    // no colour of its own.
    const bool plain = material && material->texture.empty() && material->name != geometry::boundary_material;
    if (!coloured && !plain) return {plain_color, plain_color, plain_color};
    std::array<Color, 3> out;
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < 3; ++i) {
            float linear = coloured ? geometry::linear_from_srgb(a.corner_colour[triangle][k][i]) : 1.0F;
            if (material) linear *= material->colour[i];
            out[k][static_cast<Eigen::Index>(i)] = static_cast<double>(geometry::srgb_from_linear(linear));
        }
    return out;
}

/// An edge with a boundary triangle on one side and a cut triangle on the other.
struct RimSegment {
    std::array<std::uint32_t, 2> edge;
    std::size_t cut_triangle;
};

std::vector<RimSegment> rim_segments(const SurfaceMesh& surface) {
    struct Side {
        std::array<std::uint32_t, 2> edge;
        bool cut;
        std::size_t triangle;
        auto operator<=>(const Side&) const = default;
    };
    std::vector<Side> sides;
    sides.reserve(3 * surface.mesh.triangles.size());
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
        const Triangle& triangle = surface.mesh.triangles[t];
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = triangle[k];
            const std::uint32_t b = triangle[(k + 1) % 3];
            sides.push_back({{std::min(a, b), std::max(a, b)}, is_cut(surface, t), t});
        }
    }
    std::sort(sides.begin(), sides.end());
    std::vector<RimSegment> segments;
    for (std::size_t i = 1; i < sides.size(); ++i) {
        // Boundary sides come first, so each edge has at most one such transition.
        if (sides[i].edge == sides[i - 1].edge && sides[i].cut != sides[i - 1].cut) {
            segments.push_back({sides[i].edge, sides[i].triangle});
        }
    }
    return segments;
}

std::int32_t material_of(const SurfaceMesh& surface, std::size_t triangle) {
    const geometry::MeshAttributes& a = surface.attributes;
    return a.triangle_material.empty() ? -1 : a.triangle_material[triangle];
}

/// Returns the entry of a material; null where there is none.
template <class T>
std::shared_ptr<const T> entry_of(const std::vector<std::shared_ptr<const T>>& entries,
                                  std::int32_t material) {
    const auto index = static_cast<std::size_t>(material);
    return material >= 0 && index < entries.size() ? entries[index] : nullptr;
}

/// Removes positions that the mesh does not use, and adds what else the surface says of the others.
void keep_used_positions(ShadedMesh& mesh, const SurfaceMesh& surface, const SurfaceLooks& looks) {
    constexpr std::uint32_t unused = 0xffffffff;
    std::vector<std::uint32_t> renumbered(surface.mesh.positions.size(), unused);
    for (Triangle& triangle : mesh.triangles) {
        for (std::uint32_t& vertex : triangle) {
            if (renumbered[vertex] == unused) {
                renumbered[vertex] = static_cast<std::uint32_t>(mesh.positions.size());
                mesh.positions.push_back(surface.mesh.positions[vertex]);
                if (!surface.rest.empty()) mesh.rest.push_back(surface.rest[vertex]);
                if (!looks.depth.empty()) mesh.depth.push_back(looks.depth[vertex]);
                if (!looks.mark.empty()) mesh.mark.push_back(looks.mark[vertex]);
            }
            vertex = renumbered[vertex];
        }
    }
}

/// Appends the triangles of one origin that look alike; key: their material if it has a finish or picture,
/// else -1.
void add_alike(DrawList& list, const SurfaceMesh& surface, const SurfacePalette& palette,
               const SurfaceLooks& looks, std::span<const Vec3> normals,
               std::span<const std::uint32_t> triangles, bool cut, std::int32_t key) {
    ShadedMesh mesh;
    mesh.finish = entry_of(looks.finishes, key);
    mesh.picture = cut || surface.attributes.corner_uv.empty() ? nullptr : entry_of(looks.pictures, key);
    mesh.roughness = cut ? 0.38 : 0.55;
    // On a closed cut the boundary hides both cut faces.
    mesh.recessed = cut;
    for (const std::uint32_t t : triangles) {
        const Triangle& triangle = surface.mesh.triangles[t];
        const std::int32_t piece = surface.vertex_piece.empty() ? 0 : surface.vertex_piece[triangle[0]];
        mesh.triangles.push_back(triangle);
        mesh.triangle_colors.push_back(cut ? palette.cut : piece_color(palette, piece));
        if (mesh.picture) {
            for (const geometry::Uv& uv : surface.attributes.corner_uv[t]) mesh.corner_uvs.push_back(uv);
            mesh.triangle_colors.back() = Color(1, 1, 1);
        }
        if (!cut && !surface.attributes.empty() && !mesh.finish)
            for (const Color& color : corner_colors(surface, t, mesh.triangle_colors.back()))
                mesh.corner_colors.push_back(color);
        for (std::size_t k = 0; k < 3; ++k) mesh.corner_normals.push_back(normals[3 * t + k]);
    }
    keep_used_positions(mesh, surface, looks);
    list.meshes.push_back(std::move(mesh));
}

/// Appends the rims of cuts: in the palette's colour, or a dark shade of the cut's finish.
void add_rims(DrawList& list, const SurfaceMesh& surface, const SurfacePalette& palette,
              const SurfaceLooks& looks) {
    std::map<std::int32_t, LineSet> rims;  // by material with a finish; -1: others
    for (const RimSegment& segment : rim_segments(surface)) {
        const std::int32_t material = material_of(surface, segment.cut_triangle);
        const auto finish = entry_of(looks.finishes, material);
        const auto [rim, is_new] = rims.try_emplace(finish ? material : -1);
        if (is_new) {
            rim->second.color = finish ? Color(0.55 * finish->colour) : palette.line;
            rim->second.width = finish ? 0.6 * palette.line_width : palette.line_width;
        }
        rim->second.segments.push_back(segment.edge);
    }
    for (auto& [material, rim] : rims) {
        rim.points = surface.mesh.positions;
        rim.depth_offset = 0.003 * surface.mesh.bounds().size().norm();
        list.lines.push_back(std::move(rim));
    }
}

void check_surface(const SurfaceMesh& surface) {
    check_mesh("add_surface", surface.mesh);
    const auto fits = [](std::size_t size, std::size_t wanted) { return size == 0 || size == wanted; };
    if (!fits(surface.vertex_piece.size(), surface.mesh.positions.size())) {
        throw InputError("add_surface: vertex_piece",
                         "has not one entry a vertex (" + std::to_string(surface.vertex_piece.size()) + ")");
    }
    if (!fits(surface.triangle_origin.size(), surface.mesh.triangles.size())) {
        throw InputError(
            "add_surface: triangle_origin",
            "has not one entry a triangle (" + std::to_string(surface.triangle_origin.size()) + ")");
    }
    const geometry::MeshAttributes& a = surface.attributes;
    const auto known = [&](std::int32_t material) {
        return material < static_cast<std::int64_t>(a.materials.size());
    };
    if (!fits(a.corner_colour.size(), surface.mesh.triangles.size()) ||
        !fits(a.triangle_material.size(), surface.mesh.triangles.size()) ||
        !std::all_of(a.triangle_material.begin(), a.triangle_material.end(), known)) {
        throw InputError("add_surface: attributes", "do not fit the triangles");
    }
}

}  // namespace

geometry::Box DrawList::bounds() const {
    geometry::Box box;
    for (const ShadedMesh& mesh : meshes) {
        for (const Vec3& point : mesh.positions) box.add(point);
    }
    for (const LineSet& set : lines) {
        if (!set.in_bounds) continue;
        for (const Vec3& point : set.points) box.add(point);
    }
    for (const LiveSurface* surface : surfaces)
        if (!surface->bounds().empty()) box.add(surface->bounds());
    return box;
}

std::vector<Vec3> creased_corner_normals(const TriangleMesh& mesh, std::span<const std::uint8_t> group,
                                         double crease_degrees) {
    check_mesh("creased_corner_normals", mesh);
    if (!group.empty() && group.size() != mesh.triangles.size()) {
        throw InputError("creased_corner_normals: group", "has not one entry a triangle");
    }
    const double cos_crease = std::cos(crease_degrees * std::numbers::pi / 180);
    const std::size_t triangle_count = mesh.triangles.size();
    std::vector<Vec3> area(triangle_count);    // twice the area times the unit normal, m^2
    std::vector<Vec3> normal(triangle_count);  // unit, or zero for a triangle without area
    std::vector<char> sliver(triangle_count);  // its own normal is unreliable
    for (std::size_t t = 0; t < triangle_count; ++t) {
        area[t] = area_vector(mesh, mesh.triangles[t]);
        normal[t] = direction_of(area[t]);
        sliver[t] = roundness(mesh, mesh.triangles[t], area[t]) < 0.08 ? 1 : 0;
    }
    const CornersOfVertices around(mesh);
    std::vector<Vec3> result(3 * triangle_count);
    for (std::size_t v = 0; v + 1 < around.first.size(); ++v) {
        for (std::uint32_t i = around.first[v]; i < around.first[v + 1]; ++i) {
            const std::uint32_t corner = around.corners[i];
            const std::size_t own = corner / 3;
            Vec3 all = Vec3::Zero();
            for (std::uint32_t j = around.first[v]; j < around.first[v + 1]; ++j) {
                const std::size_t other = around.corners[j] / 3;
                if (group.empty() || group[other] == group[own]) all += area[other];
            }
            // A sliver uses the mean normal of its neighbours instead of its own, arbitrary one.
            const Vec3 reference = sliver[own] != 0 ? direction_of(all) : normal[own];
            Vec3 sum = Vec3::Zero();
            for (std::uint32_t j = around.first[v]; j < around.first[v + 1]; ++j) {
                const std::size_t other = around.corners[j] / 3;
                if (!group.empty() && group[other] != group[own]) continue;
                if (normal[other].dot(reference) >= cos_crease) sum += area[other];
            }
            Vec3 mean = direction_of(sum);
            if (mean.isZero()) mean = reference.isZero() ? normal[own] : reference;
            result[corner] = mean.isZero() ? Vec3(Vec3::UnitZ()) : mean;
        }
    }
    return result;
}

void add_surface(DrawList& list, const SurfaceMesh& surface, const SurfacePalette& palette,
                 const SurfaceLooks& looks) {
    check_surface(surface);
    const std::size_t vertices = surface.mesh.positions.size();
    for (const std::size_t size : {surface.rest.size(), looks.depth.size(), looks.mark.size()})
        if (size != 0 && size != vertices)
            throw InputError("add_surface", "rest positions, depths or marks are not one a vertex (" +
                                                std::to_string(size) + ")");
    const std::size_t triangle_count = surface.mesh.triangles.size();
    if (triangle_count == 0) return;
    std::vector<std::uint8_t> group(triangle_count);
    for (std::size_t t = 0; t < triangle_count; ++t) group[t] = is_cut(surface, t) ? 1 : 0;
    const std::vector<Vec3> normals = creased_corner_normals(surface.mesh, group, palette.crease_degrees);
    for (const bool cut : {false, true}) {
        std::map<std::int32_t, std::vector<std::uint32_t>> alike;
        for (std::uint32_t t = 0; t < triangle_count; ++t) {
            if (is_cut(surface, t) != cut) continue;
            const std::int32_t material = material_of(surface, t);
            const bool is_special = entry_of(looks.finishes, material) || entry_of(looks.pictures, material);
            alike[is_special ? material : -1].push_back(t);
        }
        for (const auto& [key, triangles] : alike)
            add_alike(list, surface, palette, looks, normals, triangles, cut, key);
    }
    if (palette.line_width > 0) add_rims(list, surface, palette, looks);
}

void add_polyline(DrawList& list, std::span<const Vec3> points, const Color& color, double width) {
    if (points.size() < 2) throw InputError("add_polyline: points", "are fewer than two");
    LineSet set;
    set.points.assign(points.begin(), points.end());
    for (std::uint32_t i = 1; i < points.size(); ++i) set.segments.push_back({i - 1, i});
    set.color = color;
    set.width = width;
    list.lines.push_back(std::move(set));
}

void add_mesh(DrawList& list, const TriangleMesh& mesh, const Color& color, double crease_degrees) {
    ShadedMesh shaded;
    shaded.corner_normals = creased_corner_normals(mesh, {}, crease_degrees);
    shaded.positions = mesh.positions;
    shaded.triangles = mesh.triangles;
    shaded.triangle_colors.assign(mesh.triangles.size(), color);
    list.meshes.push_back(std::move(shaded));
}

void add_mesh(DrawList& list, const TriangleMesh& mesh, const geometry::Finish& finish,
              std::vector<Vec3> rest, double crease_degrees) {
    add_mesh(list, mesh, finish.colour, crease_degrees);
    list.meshes.back().finish = std::make_shared<const geometry::Finish>(finish);
    list.meshes.back().rest = std::move(rest);
}

}  // namespace splitcubes::render
