// Binary little-endian PLY.
#include <splitcubes/io/mesh_writers.h>

#include <cmath>

namespace splitcubes::io {

using geometry::Material;
using geometry::Rgba;
using geometry::SurfaceMesh;

namespace {

std::uint8_t byte_of(float value) {
    return static_cast<std::uint8_t>(std::lround(255 * std::fmin(std::fmax(value, 0.0F), 1.0F)));
}

/// The texture's number of each material, -1 for none; they are counted as the header lists them.
std::vector<std::int32_t> texture_numbers(const std::vector<Material>& materials, std::int32_t& count) {
    std::vector<std::int32_t> numbers;
    count = 0;
    for (const Material& material : materials) numbers.push_back(material.texture.empty() ? -1 : count++);
    return numbers;
}

/// As PlyAttributes reads them.
void put_material_comments(std::string& out, const std::vector<Material>& materials) {
    const std::vector<std::string> names = distinct_names(materials);
    for (std::size_t k = 0; k < materials.size(); ++k) {
        out += "comment material " + std::to_string(k);
        for (const float value : materials[k].colour) {
            out += ' ';
            put_text(out, value);
        }
        out += " " + names[k] + "\n";
        if (!materials[k].texture.empty())
            out += "comment TextureFile " + one_line(materials[k].texture) + "\n";
    }
}

std::string header(const Output& output, bool with_colours, std::int32_t texture_count) {
    const SurfaceMesh& surface = output.surface;
    std::string out = "ply\nformat binary_little_endian 1.0\ncomment splitcubes surface, metres\n";
    put_material_comments(out, output.materials);
    out += "element vertex " + std::to_string(surface.mesh.positions.size()) + "\n";
    out += "property double x\nproperty double y\nproperty double z\n";
    if (!surface.normals.empty()) out += "property float nx\nproperty float ny\nproperty float nz\n";
    if (!surface.vertex_piece.empty()) out += "property int piece\n";
    if (!surface.vertex_body.empty()) out += "property int body\n";
    if (with_colours)
        out += "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n";
    if (!surface.rest.empty())
        out += "property double rest_x\nproperty double rest_y\nproperty double rest_z\n";
    out += "element face " + std::to_string(surface.mesh.triangles.size()) + "\n";
    out += "property list uchar int vertex_indices\n";
    if (!surface.triangle_origin.empty()) out += "property uchar origin\n";
    if (!surface.triangle_cut.empty()) out += "property int cut\n";
    if (!surface.attributes.corner_uv.empty()) out += "property list uchar float texcoord\n";
    if (!surface.attributes.triangle_material.empty()) {
        out += "property int material\n";
        if (texture_count > 1) out += "property int texnumber\n";
    }
    return out + "end_header\n";
}

}  // namespace

std::string encode_ply(const Output& output) {
    const SurfaceMesh& surface = output.surface;
    const geometry::TriangleMesh& mesh = surface.mesh;
    const geometry::MeshAttributes& attributes = surface.attributes;
    const std::vector<Rgba> colours = vertex_colours(surface);
    std::int32_t texture_count = 0;
    const std::vector<std::int32_t> textures = texture_numbers(output.materials, texture_count);
    std::string out = header(output, !colours.empty(), texture_count);
    out.reserve(out.size() + mesh.positions.size() * 72 + mesh.triangles.size() * 51);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        for (const double value : mesh.positions[v]) put_number(out, value);
        if (!surface.normals.empty())
            for (const double value : surface.normals[v]) put_number(out, to_float(value, output.name));
        if (!surface.vertex_piece.empty()) put_number(out, surface.vertex_piece[v]);
        if (!surface.vertex_body.empty()) put_number(out, surface.vertex_body[v]);
        if (!colours.empty())
            for (const float value : colours[v]) put_number(out, byte_of(value));
        if (!surface.rest.empty())
            for (const double value : surface.rest[v]) put_number(out, value);
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        put_number(out, std::uint8_t{3});
        for (const std::uint32_t v : mesh.triangles[t]) put_number(out, v);
        if (!surface.triangle_origin.empty())
            put_number(out, static_cast<std::uint8_t>(surface.triangle_origin[t]));
        if (!surface.triangle_cut.empty()) put_number(out, surface.triangle_cut[t]);
        if (!attributes.corner_uv.empty()) {
            put_number(out, std::uint8_t{6});
            for (const geometry::Uv& uv : attributes.corner_uv[t])
                for (const float value : uv) put_number(out, value);
        }
        if (attributes.triangle_material.empty()) continue;
        const std::int32_t material = attributes.triangle_material[t];
        put_number(out, material);
        if (texture_count > 1)
            put_number(out, material < 0 ? -1 : textures[static_cast<std::size_t>(material)]);
    }
    return out;
}

}  // namespace splitcubes::io
