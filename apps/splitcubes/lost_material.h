// Material too thin for the grid, on demand as a mesh and as a picture.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/splitting/solidify.h>

#include <filesystem>

namespace splitcubes::app {

class Command;
struct MeshScale;

/// Files to write; empty: not asked for.
struct LostMaterialOptions {
    std::filesystem::path mesh;     // --lost
    std::filesystem::path picture;  // --picture
};

void add_lost_material_options(Command& command, LostMaterialOptions& options);

/// Throws InputError where a file cannot be written under its name, JobError where a
/// picture is asked for and the program was built without the renderer: asked before the work.
void check_lost_material_options(const LostMaterialOptions& options);

/// Writes what was asked for. Where nothing was lost the mesh has no triangles, so that a
/// file of an earlier run does not say otherwise. bounds: of the whole input, m; what the
/// picture takes in. cell_size: m. scale: of the mesh. Throws JobError where OpenGL cannot start or a file
/// cannot be written.
void write_lost_material(const LostMaterialOptions& options, const MeshScale& scale,
                         const splitting::SolidifyReport& solid, const geometry::SurfaceMesh& surface,
                         const geometry::Box& bounds, double cell_size);

}  // namespace splitcubes::app
