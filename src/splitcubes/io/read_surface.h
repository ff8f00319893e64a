// Surfaces with their attributes out of PLY files, as write_mesh leaves them.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace splitcubes::io {

/// Reads a PLY file like read_mesh, and with it what it says about vertices
/// (nx ny nz: normal; piece) and faces (origin: 0 boundary, 1 cut). Attributes
/// that the file does not have come back as empty arrays. Positions are what
/// write_mesh was given to the last bit, normals to single precision. A surface
/// without triangles, which is what a run leaves of a body that is gone, is read
/// as such. Throws InputError for another format, a malformed file or an
/// attribute out of its range.
geometry::SurfaceMesh read_surface(const std::filesystem::path& path);

/// The same of any mesh format. Of others than PLY there are attributes, rest positions in a GLB, and
/// origins by the materials that write_mesh and runs give to cut faces: `cut` or with the ending `/cut`.
geometry::SurfaceMesh read_any_surface(const std::filesystem::path& path);

/// The same from the bytes of a PLY file; `name` stands in messages for the file.
geometry::SurfaceMesh read_surface_from_memory(std::span<const std::byte> bytes, const std::string& name);

}  // namespace splitcubes::io
