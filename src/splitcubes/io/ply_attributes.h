// Collects what a PLY file says about its surface, vertex by vertex and face by
// face, into attributes by corner. Internal to the module.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/io/ply_header.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <unordered_map>
#include <vector>

namespace splitcubes::io {

/// Materials come from comments of the header, `material K R G B A NAME` (linear
/// base colour) as write_mesh leaves them, and `TextureFile FILE`: behind a
/// material's comment the texture of that material, else a material of its own.
class PlyAttributes {
  public:
    PlyAttributes(const PlyHeader& header, const std::filesystem::path& folder, ReadMeshReport& report);

    void add_vertex_uv(float u, float v) { vertex_uv_.push_back({u, v}); }
    /// colour: red green blue alpha.
    void add_vertex_colour(const double* colour);
    /// Of the triangles that were added from the number `first` on; uv: two a corner of the face.
    void add_face_uv(std::size_t first, std::span<const std::array<std::uint32_t, 3>> added,
                     std::span<const float> uv);
    /// For the next `count` triangles: the number that the file gives, -1 for none;
    /// by_texture: it counts the texture files. Unknown numbers become materials without a name.
    void add_material(std::int32_t number, std::size_t count, bool by_texture);

    geometry::MeshAttributes finish(const geometry::TriangleMesh& mesh);

  private:
    void read_comment(const std::string& comment, const std::filesystem::path& folder,
                      ReadMeshReport& report);

    geometry::MeshAttributes out_;
    std::vector<geometry::Uv> vertex_uv_;
    std::vector<geometry::Rgba> vertex_colour_;
    std::unordered_map<std::int32_t, std::int32_t> by_number_;  // the file's number to ours
    std::vector<std::int32_t> by_texture_;                      // texture file to our material
    std::int32_t commented_ = -1;                               // the material of the last comment
};

}  // namespace splitcubes::io
