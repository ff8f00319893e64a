// Collects vertices and polygons into a triangle mesh. Internal to the module.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/io/read_mesh.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace splitcubes::io {

class MeshBuilder {
  public:
    geometry::TriangleMesh mesh;

    /// Cuts a polygon of three or more corners into a fan from its first one and
    /// leaves out triangles with a repeated vertex. Returns how many triangles were added.
    std::size_t add_polygon(std::span<const std::uint32_t> corners);
    /// Of the last polygon: for each triangle added, which of its corners it has.
    const std::vector<std::array<std::uint32_t, 3>>& added() const { return added_; }
    /// False, and counted, where a vertex is repeated.
    bool add_triangle(const geometry::Triangle& triangle);

    /// Notes what was cut and left out. Throws InputError where no triangle was
    /// given at all, or none is left and `allow_empty` is not set.
    geometry::TriangleMesh finish(const std::string& name, ReadMeshReport& report, bool allow_empty = false);

  private:
    std::vector<std::array<std::uint32_t, 3>> added_;
    std::size_t polygon_count_ = 0;     // with more than three corners
    std::size_t degenerate_count_ = 0;  // triangles left out
};

/// The most vertices that 32-bit indices can tell apart with one value to spare.
inline constexpr std::size_t max_vertex_count = 0xffffffffULL;

}  // namespace splitcubes::io
