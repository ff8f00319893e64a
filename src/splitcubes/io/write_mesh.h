// Surfaces into files: PLY, OBJ, STL, GLB.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/io/mesh_format.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace splitcubes::io {

/// Writes a surface in the format of the extension, whole or not at all:
/// - .ply  binary little endian; vertex x y z (double), nx ny nz (float), piece (int), red green blue
///         alpha (uchar), rest_x rest_y rest_z (double); face vertex_indices (uchar, int), origin (uchar),
///         texcoord (uchar, float), material (int), texnumber (int, with several textures). Read back
///         by read_surface.
/// - .obj  v and vn with all their digits, vt; the faces in one group and material an origin
///         (`boundary`, `cut`), or by the surface's own materials and a .mtl file of the same name.
///         Cut faces have their rest position as a vt of three components.
/// - .stl  binary, single precision, no attributes.
/// - .glb  glTF 2.0, single precision, one primitive and material an origin, or one for each of the
///         surface's own materials; TEXCOORD_0, COLOR_0, _REST. Vertices are split where they differ.
/// Attributes that the surface lacks are left out; docs/meshes.md has the details. A
/// surface without triangles gives a valid file without triangles.
///
/// Textures are referred to relative to the file; pictures that came inside of a
/// file are put into a GLB again, and into files of their own beside the others (see write_images).
///
/// Throws InputError for another extension, for a folder that does not exist, for a .mtl file that would be
/// replaced and is not of this program,
/// for a surface that no reader could take (index out of range, an attribute
/// array of the wrong length, a number that is not finite) or that the format
/// cannot hold; JobError where the file cannot be written.
void write_mesh(const std::filesystem::path& path, const geometry::SurfaceMesh& surface);

/// Writes the pictures that materials carry as files `PREFIX-NAME` into a folder,
/// whole or not at all, and makes the materials refer to them. If a file of that name has other
/// contents, it stays, and the picture is called `PREFIX-NAME-1` (2, ...), with the ending behind it.
/// `before` is called for each file before it is written.
void write_images(const std::filesystem::path& folder, const std::string& prefix,
                  std::vector<geometry::Material>& materials,
                  const std::function<void(const std::filesystem::path&)>& before = {});

/// The bytes of that file, textures by the names that the materials have; `name` stands in messages for it.
/// MeshFormat::gltf gives a GLB.
std::string encode_mesh(const geometry::SurfaceMesh& surface, MeshFormat format, const std::string& name);

}  // namespace splitcubes::io
