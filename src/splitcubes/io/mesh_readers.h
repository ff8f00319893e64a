// The reader of each format, and what they share. Internal to the module.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/io/read_mesh.h>

#include <cstddef>
#include <filesystem>
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

/// A place in a binary file, for messages: `name at byte 84`.
std::string at_byte(const std::string& name, std::size_t offset);

geometry::TriangleMesh read_obj(Bytes bytes, const std::string& name, ReadMeshReport& report);

geometry::TriangleMesh read_stl(Bytes bytes, const std::string& name, ReadMeshReport& report);

/// Whether the size is that of a binary STL file with the count of triangles in
/// its header. The header's text says nothing: many binary files begin with "solid".
bool is_binary_stl(Bytes bytes);

/// surface: also take the attributes that write_mesh leaves, and allow that there are no triangles.
enum class PlyContent { mesh, surface };
geometry::SurfaceMesh read_ply(Bytes bytes, const std::string& name, PlyContent content,
                               ReadMeshReport& report);

/// Both containers. An empty folder means that the file may not refer to others.
geometry::TriangleMesh read_gltf(Bytes bytes, const std::string& name, const std::filesystem::path& folder,
                                 ReadMeshReport& report);

}  // namespace splitcubes::io
