#include <splitcubes/core/error.h>
#include <splitcubes/render/packed_scene.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace splitcubes::render {

namespace {

void store(float (&out)[3], const Vec3& value) {
    for (int i = 0; i < 3; ++i) out[i] = static_cast<float>(value[i]);
}

void require(bool ok, const std::string& where, const char* problem) {
    if (!ok) throw InputError(where, problem);
}

void check_points(const std::string& where, const std::vector<Vec3>& points) {
    for (const Vec3& point : points) require(point.allFinite(), where, "has a position that is not finite");
}

void pack_mesh(PackedScene& scene, const ShadedMesh& mesh, const std::string& where, const Vec3& origin) {
    require(mesh.corner_normals.size() == 3 * mesh.triangles.size(), where + ".corner_normals",
            "has not three entries a triangle");
    require(mesh.triangle_colors.size() == mesh.triangles.size(), where + ".triangle_colors",
            "has not one entry a triangle");
    require(mesh.corner_colors.empty() || mesh.corner_colors.size() == 3 * mesh.triangles.size(),
            where + ".corner_colors", "has not three entries a triangle");
    const auto fits = [](std::size_t size, std::size_t wanted) { return size == 0 || size == wanted; };
    require(fits(mesh.rest.size(), mesh.positions.size()) && fits(mesh.depth.size(), mesh.positions.size()) &&
                fits(mesh.mark.size(), mesh.positions.size()),
            where + ".rest, depth and mark", "have not one entry a position");
    require(fits(mesh.corner_uvs.size(), 3 * mesh.triangles.size()), where + ".corner_uvs",
            "has not three entries a triangle");
    check_points(where, mesh.positions);
    check_points(where + ".rest", mesh.rest);
    const std::size_t first = scene.vertices.size();
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 color = linear(mesh.triangle_colors[t]);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t index = mesh.triangles[t][k];
            require(index < mesh.positions.size(), where, "names a vertex that it does not have");
            PackedScene::Vertex vertex;
            store(vertex.position, mesh.positions[index] - origin);
            store(vertex.normal, mesh.corner_normals[3 * t + k]);
            store(vertex.color, mesh.corner_colors.empty() ? color : linear(mesh.corner_colors[3 * t + k]));
            const Vec3& rest = mesh.rest.empty() ? mesh.positions[index] : mesh.rest[index];
            for (int i = 0; i < 3; ++i) vertex.rest[i] = static_cast<float>(rest[i]);
            vertex.rest[3] = mesh.depth.empty() ? 0.0F : mesh.depth[index];
            vertex.extra[0] = mesh.corner_uvs.empty() ? 0.0F : mesh.corner_uvs[3 * t + k][0];
            vertex.extra[1] = mesh.corner_uvs.empty() ? 0.0F : mesh.corner_uvs[3 * t + k][1];
            vertex.extra[2] = mesh.mark.empty() ? 0.0F : static_cast<float>(mesh.mark[index]);
            scene.vertices.push_back(vertex);
        }
    }
    scene.ranges.push_back({.first = first,
                            .count = scene.vertices.size() - first,
                            .roughness = static_cast<float>(std::clamp(mesh.roughness, 0.1, 1.0)),
                            .recessed = mesh.recessed,
                            .finish = mesh.finish ? scene.finishes.add(*mesh.finish) : -1,
                            .picture = mesh.corner_uvs.empty() ? nullptr : mesh.picture});
}

void pack_lines(PackedScene& scene, const LineSet& set, const std::string& where, const Vec3& origin,
                double pixel_scale) {
    check_points(where, set.points);
    const Vec3 color = linear(set.color);
    for (const auto& [from, to] : set.segments) {
        require(from < set.points.size() && to < set.points.size(), where,
                "names a point that it does not have");
        PackedScene::Segment segment;
        store(segment.from, set.points[from] - origin);
        store(segment.to, set.points[to] - origin);
        store(segment.color, color);
        // A line thinner than a pixel would break up between the samples.
        segment.shape[0] = static_cast<float>(0.5 * std::max(set.width * pixel_scale, 1.0));
        segment.shape[1] = static_cast<float>(set.depth_offset);
        scene.segments.push_back(segment);
    }
}

}  // namespace

Vec3 linear(const Color& color) {
    return {linear_from_srgb(color.x()), linear_from_srgb(color.y()), linear_from_srgb(color.z())};
}

double linear_from_srgb(double value) {
    const double v = std::clamp(value, 0.0, 1.0);
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

PackedScene pack(const DrawList& list, const Vec3& origin, double pixel_scale) {
    PackedScene scene;
    std::size_t triangle_count = 0;
    for (const ShadedMesh& mesh : list.meshes) triangle_count += mesh.triangles.size();
    scene.vertices.reserve(3 * triangle_count);
    for (std::size_t i = 0; i < list.meshes.size(); ++i) {
        pack_mesh(scene, list.meshes[i], "meshes[" + std::to_string(i) + "]", origin);
    }
    for (std::size_t i = 0; i < list.lines.size(); ++i) {
        pack_lines(scene, list.lines[i], "lines[" + std::to_string(i) + "]", origin, pixel_scale);
    }
    return scene;
}

}  // namespace splitcubes::render
