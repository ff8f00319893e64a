// Surface attributes of a mesh: texture coordinates, colours, materials.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace splitcubes::geometry {

struct TriangleMesh;

/// Texture coordinates: u runs to the right, v up; (0, 0) is the picture's lower left corner.
using Uv = std::array<float, 2>;
using Rgba = std::array<float, 4>;

/// A picture file embedded in another file.
struct EmbeddedImage {
    std::string mime_type;  // as image/png
    std::vector<std::byte> bytes;
    bool operator==(const EmbeddedImage&) const = default;
};

struct Material {
    std::string name;
    Rgba colour{0.8F, 0.8F, 0.8F, 1.0F};  // base colour, linear
    /// Picture of the base colour: its file, absolute or relative to the working
    /// directory; for an embedded image the suggested file name.
    std::string texture;
    std::shared_ptr<const EmbeddedImage> image;  // null: `texture` is a file of its own
    std::optional<float> roughness = {};         // 0 mirror .. 1 chalk; none: not said
    std::optional<float> metalness = {};         // 0 plastic .. 1 metal; none: not said

    /// Images are compared by their bytes.
    bool operator==(const Material& other) const {
        return name == other.name && colour == other.colour && texture == other.texture &&
               roughness == other.roughness && metalness == other.metalness &&
               (image == other.image || (image && other.image && *image == *other.image));
    }
};

/// Attributes per triangle corner: this form can hold UV seams and all formats map to it.
/// Each array is either empty or has one entry per triangle.
struct MeshAttributes {
    std::vector<std::array<Uv, 3>> corner_uv;
    /// sRGB as in files with vertex colours, each channel in [0, 1]; multiplies the material's colour.
    std::vector<std::array<Rgba, 3>> corner_colour;
    std::vector<std::int32_t> triangle_material;  // index into materials; -1: none
    std::vector<Material> materials;

    bool empty() const {
        return corner_uv.empty() && corner_colour.empty() && triangle_material.empty() && materials.empty();
    }
    /// Appends the attributes of another mesh; `own_triangles` and `other_triangles` are the
    /// triangle counts of the two meshes. The other's materials follow. Attributes that
    /// only one mesh has are filled with (0, 0), white or -1 for the other.
    void append(std::size_t own_triangles, const MeshAttributes& other, std::size_t other_triangles);

    bool operator==(const MeshAttributes&) const = default;
};

/// Returns the chart index of each triangle; charts are ordered by their first triangle. A
/// chart's triangles are connected over edges along which they agree in material and, at
/// both ends, in texture coordinate and colour, bit for bit. Vertices with bitwise equal
/// positions count as one, so vertices that a format has split for other reasons do not
/// separate a chart.
std::vector<std::int32_t> attribute_charts(const TriangleMesh& mesh, const MeshAttributes& attributes);

}  // namespace splitcubes::geometry
