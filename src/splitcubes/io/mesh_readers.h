// The reader of each format, and what they share. Internal to the module.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/io/read_mesh.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace splitcubes::io {

using Bytes = std::span<const std::byte>;

inline std::string_view as_text(Bytes bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// The content of a regular file. Throws InputError where there is none, it
/// cannot be read, or it is empty.
std::vector<std::byte> read_file_bytes(const std::filesystem::path& path);

/// A location in a binary file, for messages: `name at byte 84`.
std::string at_byte(const std::string& name, std::size_t offset);

/// The file of a texture that a file in `folder` names, or the one of its name beside the mesh where that is
/// not there; the name as it stands where the folder is empty. A note where there is neither.
std::string resolved_texture(const std::string& written, const std::filesystem::path& folder,
                             const std::filesystem::path& mesh_folder, ReadMeshReport& report);

/// Whether a name that a mesh file gives stays in the file's folder. Only such files
/// are opened, so that a mesh from elsewhere cannot make the program read whatever it names.
bool is_beside_or_below(const std::string& relative);

// The readers below are given the file's folder; an empty one means that the file
// may not refer to others.

Model read_obj(Bytes bytes, const std::string& name, const std::filesystem::path& folder,
               ReadMeshReport& report);

/// Adds what a material library (.mtl) defines, after what is in `materials`
/// already or into those of the same name. Statements that make no sense are noted.
void read_mtl(Bytes bytes, const std::string& name, const std::filesystem::path& folder,
              const std::filesystem::path& mesh_folder, std::vector<geometry::Material>& materials,
              ReadMeshReport& report);

geometry::TriangleMesh read_stl(Bytes bytes, const std::string& name, ReadMeshReport& report);

/// Whether the size is that of a binary STL file with the count of triangles in
/// its header. The header's text says nothing: many binary files begin with "solid".
bool is_binary_stl(Bytes bytes);

/// surface: also take the attributes that write_mesh leaves, and allow that there are no triangles.
enum class PlyContent { mesh, surface };
geometry::SurfaceMesh read_ply(Bytes bytes, const std::string& name, const std::filesystem::path& folder,
                               PlyContent content, ReadMeshReport& report);

/// Both containers.
Model read_gltf(Bytes bytes, const std::string& name, const std::filesystem::path& folder,
                ReadMeshReport& report);

/// In single precision; an optional without value where it would be infinite or is not a number.
std::optional<float> finite_float(double value);

/// As vertex colours are stored: within [0, 1].
float channel(double value);

}  // namespace splitcubes::io
