#include "lost_material.h"

#include "command_line.h"
#include "mesh_scale.h"
#include "output_targets.h"

#include <splitcubes/core/error.h>

#include <algorithm>

#ifdef SPLITCUBES_WITH_RENDER
#include <splitcubes/gl/context.h>
#include <splitcubes/render/image.h>
#include <splitcubes/render/renderer.h>
#endif

namespace splitcubes::app {

void add_lost_material_options(Command& command, LostMaterialOptions& options) {
    command
        .add_path("--lost", "FILE", options.mesh,
                  "Mesh out of the input's triangles on either side of material too thin for the grid")
        .completes(meshes_out());
    command
        .add_path("--picture", "FILE", options.picture,
                  "PNG out: the surface, and the material too thin for the grid in magenta")
        .completes(files({"png"}));
}

void check_lost_material_options(const LostMaterialOptions& options) {
    if (!options.mesh.empty()) check_mesh_output(options.mesh);
    if (options.picture.empty()) return;
    check_output_file(options.picture, {".png"});
#ifndef SPLITCUBES_WITH_RENDER
    throw JobError("--picture: this build has no renderer (SPLITCUBES_BUILD_RENDER is off)");
#endif
}

#ifdef SPLITCUBES_WITH_RENDER
namespace {

constexpr int picture_width = 1280, picture_height = 800;  // pixels
constexpr double field_of_view = 30;                       // degrees

// Offsets the mesh along its normals: lost triangles may coincide with faces that are kept.
geometry::TriangleMesh raised(geometry::TriangleMesh mesh, double by) {
    std::vector<Vec3> normals(mesh.positions.size(), Vec3::Zero());
    for (const geometry::Triangle& t : mesh.triangles) {
        const Vec3& a = mesh.positions[t[0]];
        const Vec3 normal = (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
        for (const std::uint32_t v : t) normals[v] += normal;
    }
    for (std::size_t v = 0; v < normals.size(); ++v) mesh.positions[v] += by * normals[v].stableNormalized();
    return mesh;
}

// Returns the one of four view directions from above that shows most of the lost area: the area that faces
// the eye; area in front counts twice, hidden area not at all.
Vec3 view_direction(const geometry::TriangleMesh& lost, const geometry::Box& bounds) {
    const Vec3 sides[] = {{0.9, -1.6, 0.8}, {1.6, 0.9, 0.8}, {-0.9, 1.6, 0.8}, {-1.6, -0.9, 0.8}};
    Vec3 best = sides[0];
    double max_seen = 0;
    for (const Vec3& side : sides) {
        const Vec3 to_eye = side.normalized();
        double seen = 0;
        for (const geometry::Triangle& t : lost.triangles) {
            const Vec3 &a = lost.positions[t[0]], &b = lost.positions[t[1]], &c = lost.positions[t[2]];
            const double nearer =
                ((a + b + c) / 3 - bounds.center()).dot(to_eye) / (0.5 * bounds.size().norm());
            seen += std::max(0.0, (b - a).cross(c - a).dot(to_eye)) * (1 + nearer);
        }
        if (seen <= max_seen) continue;
        max_seen = seen;
        best = side;
    }
    return best;
}

render::Picture picture_of(const geometry::SurfaceMesh& surface, const geometry::TriangleMesh& lost,
                           const geometry::Box& bounds, double cell_size) {
    std::string why_not;
    const auto context = gl::HeadlessContext::create(&why_not);
    if (!context) throw JobError("OpenGL cannot start: " + why_not);
    render::DrawList list;
    if (!surface.mesh.triangles.empty()) render::add_surface(list, surface);
    for (render::ShadedMesh& mesh : list.meshes) mesh.recessed = true;
    const render::Color signal(0.85, 0.05, 0.75);
    if (!lost.triangles.empty()) render::add_mesh(list, raised(lost, 0.05 * cell_size), signal);
    render::RenderOptions options;
    options.width = picture_width;
    options.height = picture_height;
    options.ground = false;
    render::Renderer renderer(*context, options);
    return renderer.draw(list, render::frame_camera(bounds, view_direction(lost, bounds), field_of_view,
                                                    double{picture_width} / picture_height));
}

}  // namespace
#endif

void write_lost_material(const LostMaterialOptions& options, const MeshScale& scale,
                         const splitting::SolidifyReport& solid, const geometry::SurfaceMesh& surface,
                         const geometry::Box& bounds, double cell_size) {
    if (!options.mesh.empty())
        write_scaled(options.mesh, geometry::SurfaceMesh{solid.lost, {}, {}, {}}, scale);
#ifdef SPLITCUBES_WITH_RENDER
    if (!options.picture.empty())
        render::write_png(options.picture, picture_of(surface, solid.lost, bounds, cell_size));
#else
    static_cast<void>(surface), static_cast<void>(bounds), static_cast<void>(cell_size);
#endif
}

}  // namespace splitcubes::app
