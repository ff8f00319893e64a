// Surfaces into files: PLY, OBJ, STL, GLB.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/io/mesh_format.h>

#include <filesystem>
#include <string>

namespace splitcubes::io {

/// Writes a surface in the format of the extension, whole or not at all:
/// - .ply  binary little endian; vertex x y z (double), nx ny nz (float), piece (int); face
///         vertex_indices (uchar, int), origin (uchar). Read back by read_surface.
/// - .obj  v and vn with all their digits, the faces in one group and material an origin
///         (`boundary`, `cut`).
/// - .stl  binary, single precision, no attributes.
/// - .glb  glTF 2.0, single precision, one primitive and material an origin.
/// Attributes that the surface does not have are left out. A surface without
/// triangles gives a valid file without triangles.
///
/// Throws InputError for another extension, for a folder that does not exist,
/// for a surface that no reader could take (index out of range, an attribute
/// array of the wrong length, a number that is not finite) or that the format
/// cannot hold; JobError where the file cannot be written.
void write_mesh(const std::filesystem::path& path, const geometry::SurfaceMesh& surface);

/// The bytes of that file; `name` stands in messages for it. MeshFormat::gltf gives a GLB.
std::string encode_mesh(const geometry::SurfaceMesh& surface, MeshFormat format, const std::string& name);

}  // namespace splitcubes::io
