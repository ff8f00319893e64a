// The parts of a GLB file while it is written: JSON, binary chunk, materials and surfaces. Internal to the
// module. After the Khronos glTF 2.0 specification.
#pragma once

#include <splitcubes/io/mesh_writers.h>

#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::io {

using OrderedJson = nlohmann::ordered_json;

// Values of the specification.
inline constexpr int type_float = 5126;
inline constexpr int type_uint32 = 5125;
inline constexpr int target_none = 0;
inline constexpr int target_vertices = 34962;
inline constexpr int target_indices = 34963;

class GltfBuilder {
  public:
    /// name: of the file, for messages.
    explicit GltfBuilder(std::string name);

    OrderedJson& json() { return json_; }
    std::string& binary() { return binary_; }
    const std::string& name() const { return name_; }

    /// Adds an accessor for the bytes appended to the binary chunk since `offset`; returns its index.
    std::size_t add_accessor(std::size_t offset, int target, int component_type, std::size_t count,
                             const char* type);
    /// Returns the index of a material like that; equal ones are one.
    std::size_t add_material(const geometry::Material& material);
    /// Returns the index of the material that stands for an origin.
    std::size_t add_material(geometry::Origin origin);
    /// Returns the whole file.
    std::string container() const;

  private:
    std::size_t add_texture(const geometry::Material& material);
    std::size_t image_view(const geometry::EmbeddedImage& image);

    std::string name_;
    OrderedJson json_;
    std::string binary_;
    std::vector<std::pair<OrderedJson, std::size_t>> materials_;
    std::vector<std::pair<geometry::EmbeddedImage, std::size_t>> image_views_;
};

/// Adds a surface as a mesh with a primitive for each material, or for each origin where it has none;
/// returns its index. It must have triangles. materials: its own, with textures by their names in the file.
std::size_t add_gltf_surface(GltfBuilder& to, const geometry::SurfaceMesh& surface,
                             const std::vector<geometry::Material>& materials, const std::string& mesh_name);

}  // namespace splitcubes::io
