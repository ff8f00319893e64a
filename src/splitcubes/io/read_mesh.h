// Triangle meshes out of files: OBJ, PLY, STL, glTF.
#pragma once

#include <splitcubes/geometry/mesh_attributes.h>
#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/io/mesh_format.h>

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace splitcubes::io {

/// Repairs and omissions of a reader; one line a note.
struct ReadMeshReport {
    std::vector<std::string> notes;
    /// Files beside the mesh's own that are there: libraries and buffers that were read, textures that it
    /// names.
    std::vector<std::filesystem::path> files;
};

/// Reads a triangle mesh; the format goes by the extension and, where that is
/// unknown, by the content. Positions are taken as metres, in the file's own
/// axes, but for glTF, whose y axis, which points up, becomes z. Polygons are cut into fans from their first
/// corner; triangles that use a vertex twice are left out and noted. Vertices keep the file's order, also
/// those that no triangle uses. STL, which has no shared vertices, is welded
/// where positions are equal; glTF, which splits vertices at seams, is not (see
/// geometry::weld_equal_vertices). glTF's nodes are followed and their transforms
/// applied; skins, morph targets and animations are not.
///
/// Throws InputError, with the line or the byte and the offending value, for
/// anything malformed: a file that is empty, cut off or has no triangles,
/// coordinates that are not finite or beyond geometry::max_coordinate, indices out of range, counts that
/// do not fit the content, a glTF feature that would change the geometry and is not known here. Memory is
/// bounded by the size of the files, whatever their headers claim.
geometry::TriangleMesh read_mesh(const std::filesystem::path& path, ReadMeshReport* report = nullptr);

/// The same from bytes; `name` stands in messages for the file. glTF cannot
/// refer to other files here.
geometry::TriangleMesh read_mesh_from_memory(std::span<const std::byte> bytes, MeshFormat format,
                                             const std::string& name, ReadMeshReport* report = nullptr);

struct Model {
    geometry::TriangleMesh mesh;
    geometry::MeshAttributes attributes;  // of the mesh's triangles
    std::vector<Vec3> rest = {};          // per vertex, m: of a GLB that write_mesh wrote; else empty
};

/// Reads a mesh as read_mesh does, and with it what the file says about its surface:
/// - OBJ: vt; r g b behind a vertex; usemtl, and newmtl, Kd, d, map_Kd of its mtllib files.
/// - PLY: s t, u v or texture_u texture_v and red green blue alpha of vertices; texcoord, texnumber
///   and material of faces; `comment TextureFile`.
/// - glTF: TEXCOORD_n of the base colour, COLOR_0, baseColorFactor, baseColorTexture; images inside of
///   the file are kept as they are.
/// STL has none. Pictures are not opened; one that is not where the file says is taken from beside
/// the mesh. Files that a mesh refers to and that are
/// not there, cannot be used or lie outside of its folder become notes; numbers out
/// of range are an InputError as everywhere.
Model read_model(const std::filesystem::path& path, ReadMeshReport* report = nullptr);

/// The same from bytes. Names of other files are kept as they are written.
Model read_model_from_memory(std::span<const std::byte> bytes, MeshFormat format, const std::string& name,
                             ReadMeshReport* report = nullptr);

}  // namespace splitcubes::io
