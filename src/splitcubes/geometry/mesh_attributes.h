// What a mesh says about its surface besides its shape: texture coordinates,
// colours, materials.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace splitcubes::geometry {

struct TriangleMesh;

/// The first coordinate runs to the right, the second up: (0, 0) is the picture's lower left corner.
using Uv = std::array<float, 2>;
using Rgba = std::array<float, 4>;

/// A picture file that came inside of another file.
struct EmbeddedImage {
    std::string mime_type;  // as image/png
    std::vector<std::byte> bytes;
    bool operator==(const EmbeddedImage&) const = default;
};

struct Material {
    std::string name;
    Rgba colour{0.8F, 0.8F, 0.8F, 1.0F};  // base colour, linear
    /// Picture of the base colour: its file, absolute or relative to the working
    /// directory; of an embedded image the name that it should have as a file.
    std::string texture;
    std::shared_ptr<const EmbeddedImage> image;  // null: `texture` is a file of its own

    /// Images are compared by their bytes.
    bool operator==(const Material& other) const {
        return name == other.name && colour == other.colour && texture == other.texture &&
               (image == other.image || (image && other.image && *image == *other.image));
    }
};

/// By corner, which is the form that holds seams and that all formats map to.
/// Each array is either empty or as long as the mesh has triangles.
struct MeshAttributes {
    std::vector<std::array<Uv, 3>> corner_uv;
    /// sRGB as files of vertex colours have it, each channel in [0, 1]; times the material's colour.
    std::vector<std::array<Rgba, 3>> corner_colour;
    std::vector<std::int32_t> triangle_material;  // index into materials; -1: none
    std::vector<Material> materials;

    bool empty() const {
        return corner_uv.empty() && corner_colour.empty() && triangle_material.empty() && materials.empty();
    }
    /// Appends what belongs to another mesh's triangles, `own_triangles` and
    /// `other_triangles` being how many each mesh has. Materials of the other come
    /// behind; what only one of the two has is filled with zeros, white or none.
    void append(std::size_t own_triangles, const MeshAttributes& other, std::size_t other_triangles);

    bool operator==(const MeshAttributes&) const = default;
};

/// Number of the chart of each triangle, numbered by first triangle. A chart's
/// triangles hang together over edges along which they agree in material and, at
/// both ends, in texture coordinate and colour, bit for bit. Vertices count as one
/// where their positions are bitwise equal, so vertices that a format has split
/// for other reasons do not part a chart.
std::vector<std::int32_t> attribute_charts(const TriangleMesh& mesh, const MeshAttributes& attributes);

}  // namespace splitcubes::geometry
