#include <splitcubes/geometry/attribute_transfer.h>
#include <splitcubes/geometry/srgb.h>

#include <algorithm>
#include <bit>
#include <utility>

namespace splitcubes::geometry {

namespace {

template <std::size_t n>
std::array<float, n> mixed(const std::array<std::array<float, n>, 3>& corners,
                           const std::array<double, 3>& weights) {
    std::array<float, n> out;
    for (std::size_t i = 0; i < n; ++i) {
        // Interpolating equal values gives exactly that value.
        const double base = corners[0][i];
        out[i] = static_cast<float>(base + weights[1] * (corners[1][i] - base) +
                                    weights[2] * (corners[2][i] - base));
    }
    return out;
}

std::int32_t material_named(std::vector<Material>& materials, const char* name, const Rgba& colour) {
    const auto found =
        std::find_if(materials.begin(), materials.end(), [&](const Material& m) { return m.name == name; });
    if (found != materials.end()) return static_cast<std::int32_t>(found - materials.begin());
    materials.push_back({.name = name, .colour = colour, .texture = {}, .image = {}});
    return static_cast<std::int32_t>(materials.size() - 1);
}

bool any_origin(const SurfaceMesh& surface, Origin origin) {
    return std::find(surface.triangle_origin.begin(), surface.triangle_origin.end(), origin) !=
           surface.triangle_origin.end();
}

bool is_cut(const SurfaceMesh& surface, std::size_t t) {
    return !surface.triangle_origin.empty() && surface.triangle_origin[t] == Origin::cut;
}

std::array<Vec3, 3> rest_corners(const SurfaceMesh& surface, std::size_t t) {
    const std::vector<Vec3>& rest = surface.rest.empty() ? surface.mesh.positions : surface.rest;
    const Triangle& tri = surface.mesh.triangles[t];
    return {rest[tri[0]], rest[tri[1]], rest[tri[2]]};
}

/// Hash table of a surface's boundary triangles by their exact rest corners, on which
/// alone a triangle's result depends.
class RestTriangleTable {
  public:
    static constexpr std::size_t none = static_cast<std::size_t>(-1);

    explicit RestTriangleTable(const SurfaceMesh& surface) : surface_(surface) {
        const std::size_t count = surface.mesh.triangles.size();
        if (count == 0) return;
        table_.assign(std::bit_ceil(2 * count), empty);
        for (std::uint32_t t = 0; t < count; ++t) {
            if (is_cut(surface, t)) continue;
            std::size_t slot = hash(rest_corners(surface, t)) & (table_.size() - 1);
            while (table_[slot] != empty) slot = (slot + 1) & (table_.size() - 1);
            table_[slot] = t;
        }
    }
    std::size_t find(const std::array<Vec3, 3>& corners) const {
        if (table_.empty()) return none;
        for (std::size_t slot = hash(corners) & (table_.size() - 1); table_[slot] != empty;
             slot = (slot + 1) & (table_.size() - 1))
            if (rest_corners(surface_, table_[slot]) == corners) return table_[slot];
        return none;
    }

  private:
    static constexpr std::uint32_t empty = 0xffffffff;

    static std::size_t hash(const std::array<Vec3, 3>& corners) {
        std::uint64_t h = 0;
        for (const Vec3& corner : corners)
            for (const double x : corner) {
                // 0 and -0 are equal, so they must have the same hash; the constant is SplitMix64's.
                h = (h ^ std::bit_cast<std::uint64_t>(x + 0.0)) * 0x9e3779b97f4a7c15ULL;
                h ^= h >> 29;
            }
        return static_cast<std::size_t>(h);
    }

    const SurfaceMesh& surface_;
    std::vector<std::uint32_t> table_;  // triangles, by hash; open addressing
};

}  // namespace

MeshAttributes attributes_by_origin(const SurfaceMesh& surface) {
    MeshAttributes out;
    material_named(out.materials, boundary_material, boundary_colour);
    material_named(out.materials, cut_material, cut_colour);
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t)
        out.triangle_material.push_back(is_cut(surface, t) ? 1 : 0);
    return out;
}

AttributeTransfer::AttributeTransfer(const TriangleMesh& input, MeshAttributes attributes,
                                     double side_tolerance)
    : triangles_(input.triangles),
      attributes_(std::move(attributes)),
      nearest_(input),
      side_tolerance_(side_tolerance),
      side_(input.volume() < 0 ? -1 : 1) {
    if (!attributes_.corner_uv.empty() || !attributes_.corner_colour.empty())
        charts_ = attribute_charts(input, attributes_);
}

void AttributeTransfer::interpolate(const std::array<Vec3, 3>& rest, std::size_t to, MeshAttributes& out,
                                    std::uint32_t& guess) const {
    NearestPoint::Query query;
    query.point = (rest[0] + rest[1] + rest[2]) / 3;
    query.normal = side_ * (rest[1] - rest[0]).cross(rest[2] - rest[0]);
    query.back_side_penalty = side_tolerance_;
    query.guess = guess;
    const std::uint32_t source = nearest_.at(query).triangle;
    guess = source;
    if (source == NearestPoint::none) return;
    if (!attributes_.triangle_material.empty() && attributes_.triangle_material[source] >= 0)
        out.triangle_material[to] = attributes_.triangle_material[source];
    if (charts_.empty()) return;
    query.labels = charts_;
    query.label = charts_[source];
    query.guess = source;
    for (std::size_t k = 0; k < 3; ++k) {
        query.point = rest[k];
        const NearestPoint::Hit hit = nearest_.at(query);
        if (!out.corner_uv.empty())
            out.corner_uv[to][k] = mixed(attributes_.corner_uv[hit.triangle], hit.weights);
        if (!out.corner_colour.empty())
            out.corner_colour[to][k] = mixed(attributes_.corner_colour[hit.triangle], hit.weights);
    }
}

MeshAttributes AttributeTransfer::prepared(const SurfaceMesh& surface, std::int32_t& cut) const {
    MeshAttributes out;
    const std::size_t count = surface.mesh.triangles.size();
    out.materials = attributes_.materials;
    const std::vector<std::int32_t>& own = attributes_.triangle_material;
    const bool coloured = !attributes_.corner_colour.empty();
    constexpr Rgba white{1, 1, 1, 1};
    const bool bare = own.empty() || std::find(own.begin(), own.end(), -1) != own.end();
    const std::int32_t boundary =
        bare ? material_named(out.materials, boundary_material, coloured ? white : boundary_colour) : 0;
    // With vertex colours these hold the cut colour, since more programs display them.
    if (any_origin(surface, Origin::cut))
        cut = material_named(out.materials, cut_material, coloured ? white : cut_colour);
    Rgba cut_srgb = cut_colour;
    for (std::size_t i = 0; i < 3; ++i) cut_srgb[i] = srgb_from_linear(cut_colour[i]);
    out.triangle_material.assign(count, boundary);
    if (!attributes_.corner_uv.empty()) out.corner_uv.resize(count);
    if (coloured) out.corner_colour.assign(count, {cut_srgb, cut_srgb, cut_srgb});
    return out;
}

MeshAttributes AttributeTransfer::onto(const SurfaceMesh& surface, const Parallel& parallel) const {
    return onto(surface, parallel, {}, {});
}

MeshAttributes AttributeTransfer::onto(const SurfaceMesh& surface, const Parallel& parallel,
                                       const SurfaceMesh& before, const MeshAttributes& known) const {
    if (attributes_.empty()) return {};
    std::int32_t cut = -1;
    MeshAttributes out = prepared(surface, cut);
    const RestTriangleTable table(before);
    parallel.for_chunks(surface.mesh.triangles.size(), 256, [&](std::size_t begin, std::size_t end) {
        std::uint32_t guess = NearestPoint::none;
        for (std::size_t t = begin; t < end; ++t) {
            if (is_cut(surface, t)) {
                out.triangle_material[t] = cut;
                continue;
            }
            const std::array<Vec3, 3> rest = rest_corners(surface, t);
            const std::size_t same = table.find(rest);
            if (same == RestTriangleTable::none) {
                interpolate(rest, t, out, guess);
                continue;
            }
            out.triangle_material[t] = known.triangle_material[same];
            if (!out.corner_uv.empty()) out.corner_uv[t] = known.corner_uv[same];
            if (!out.corner_colour.empty()) out.corner_colour[t] = known.corner_colour[same];
        }
    });
    return out;
}

}  // namespace splitcubes::geometry
