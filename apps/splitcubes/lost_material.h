// Outputs material too thin for the grid as a mesh and as a picture.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/splitting/solidify.h>

#include <filesystem>

namespace splitcubes::app {

class Command;
struct MeshScale;

/// Files to write; empty: not requested.
struct LostMaterialOptions {
    std::filesystem::path mesh;     // --lost
    std::filesystem::path picture;  // --picture
};

void add_lost_material_options(Command& command, LostMaterialOptions& options);

/// Throws InputError if a file cannot be written under its name, JobError if a picture is requested in a
/// build without the renderer. Called before the work.
void check_lost_material_options(const LostMaterialOptions& options);

/// Writes the requested files. If nothing was lost the mesh has no triangles, which replaces a file of an
/// earlier run. bounds: of the whole input, m; shown by the picture. cell_size: m. scale: of the mesh. Throws
/// JobError if OpenGL cannot start or a file cannot be written.
void write_lost_material(const LostMaterialOptions& options, const MeshScale& scale,
                         const splitting::SolidifyReport& solid, const geometry::SurfaceMesh& surface,
                         const geometry::Box& bounds, double cell_size);

}  // namespace splitcubes::app
