// The mesh file formats and the detection of a file's format.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>

namespace splitcubes::io {

/// gltf is both of glTF's containers, JSON text (.gltf) and binary (.glb): the content says which.
enum class MeshFormat { obj, ply, stl, gltf };

/// By file name extension, upper or lower case; empty where it is none of .obj .ply .stl .gltf .glb.
std::optional<MeshFormat> format_of_extension(const std::filesystem::path& path);

/// By what the file begins with (for STL and OBJ, which have no signature, by
/// what it looks like); empty where it looks like none.
std::optional<MeshFormat> format_of_content(std::span<const std::byte> bytes);

}  // namespace splitcubes::io
