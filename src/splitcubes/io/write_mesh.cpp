#include <splitcubes/core/error.h>
#include <splitcubes/core/plain_number.h>
#include <splitcubes/io/atomic_file.h>
#include <splitcubes/io/mesh_writers.h>
#include <splitcubes/io/write_mesh.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

namespace splitcubes::io {

namespace fs = std::filesystem;

using geometry::Origin;
using geometry::SurfaceMesh;
using geometry::Triangle;

namespace {

void check_length(std::size_t length, std::size_t wanted, const char* what, const std::string& name) {
    if (length != 0 && length != wanted)
        throw InputError(
            name, "the surface has " + std::to_string(length) + " " + what + " for " + std::to_string(wanted),
            "give none or one each");
}

template <class Corners>
bool all_finite(const std::vector<Corners>& corners) {
    for (const Corners& three : corners)
        for (const auto& values : three)
            for (const float value : values)
                if (!std::isfinite(value)) return false;
    return true;
}

void check_attributes(const SurfaceMesh& surface, const std::string& name) {
    const geometry::MeshAttributes& a = surface.attributes;
    const std::size_t triangles = surface.mesh.triangles.size();
    check_length(surface.rest.size(), surface.mesh.positions.size(), "rest positions", name);
    check_length(a.corner_uv.size(), triangles, "texture coordinates", name);
    check_length(a.corner_colour.size(), triangles, "colours", name);
    check_length(a.triangle_material.size(), triangles, "material numbers", name);
    for (const Vec3& rest : surface.rest)
        if (!rest.allFinite()) throw InputError(name, "a rest position is not finite", "");
    if (!all_finite(a.corner_uv) || !all_finite(a.corner_colour))
        throw InputError(name, "a texture coordinate or colour is not finite", "");
    for (const std::int32_t material : a.triangle_material)
        if (material < -1 || material >= static_cast<std::int64_t>(a.materials.size()))
            throw InputError(name,
                             "a triangle has material " + std::to_string(material) + " of " +
                                 std::to_string(a.materials.size()),
                             "");
}

}  // namespace

/// A file that no reader takes is not written.
void check_surface(const SurfaceMesh& surface, const std::string& name) {
    const std::size_t vertices = surface.mesh.positions.size();
    check_length(surface.normals.size(), vertices, "normals", name);
    check_length(surface.vertex_piece.size(), vertices, "piece numbers", name);
    check_length(surface.triangle_origin.size(), surface.mesh.triangles.size(), "origins", name);
    check_length(surface.triangle_cut.size(), surface.mesh.triangles.size(), "cut numbers", name);
    check_length(surface.vertex_body.size(), vertices, "body numbers", name);
    for (std::size_t v = 0; v < vertices; ++v)
        if (!surface.mesh.positions[v].allFinite())
            throw InputError(name, "the position of vertex " + std::to_string(v) + " is not finite", "");
    for (std::size_t v = 0; v < surface.normals.size(); ++v)
        if (!surface.normals[v].allFinite())
            throw InputError(name, "the normal of vertex " + std::to_string(v) + " is not finite", "");
    check_attributes(surface, name);
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t)
        for (const std::uint32_t v : surface.mesh.triangles[t])
            if (v >= vertices)
                throw InputError(name,
                                 "triangle " + std::to_string(t) + " uses vertex " + std::to_string(v) +
                                     " of " + std::to_string(vertices),
                                 "");
}

namespace {

std::string encode(const Output& output, MeshFormat format, const std::string& library) {
    check_surface(output.surface, output.name);
    switch (format) {
        case MeshFormat::obj:
            return encode_obj(output, library);
        case MeshFormat::ply:
            return encode_ply(output);
        case MeshFormat::stl:
            return encode_stl(output.surface, output.name);
        case MeshFormat::gltf:
            return encode_glb(output);
    }
    throw InputError(output.name, "unknown mesh format " + std::to_string(static_cast<int>(format)), "");
}

}  // namespace

std::string texture_from(const fs::path& folder, const std::string& texture) {
    if (texture.empty() || texture.find("://") != texture.npos) return texture;
    std::error_code why;
    const fs::path from = fs::absolute(folder, why).lexically_normal();
    const fs::path to = fs::absolute(texture, why).lexically_normal();
    const fs::path relative = to.lexically_relative(from);
    return why || relative.empty() ? texture : relative.generic_string();
}

namespace {

/// Nobody names the library of materials: it must not take the place of somebody else's.
void check_library(const fs::path& library) {
    std::error_code error;
    if (!fs::exists(library, error)) return;
    const std::string own = encode_mtl({});
    std::string begin(own.size(), '\0');
    std::ifstream file(library, std::ios::binary);
    if (file.read(begin.data(), static_cast<std::streamsize>(begin.size())) && begin == own) return;
    throw InputError(library.string(), "is there already, and this program did not write it",
                     "move it away, or give the mesh another name");
}

}  // namespace

const char* name_of(Origin origin) {
    return origin == Origin::boundary ? "boundary" : "cut";
}

Origin origin_of(const SurfaceMesh& surface, std::size_t triangle) {
    return surface.triangle_origin.empty() ? Origin::boundary : surface.triangle_origin[triangle];
}

float to_float(double value, const std::string& name) {
    if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max()))
        throw InputError(name, "a number is too large for single precision (" + plain_number(value) + ")",
                         "scale it down, or write positions as PLY or OBJ");
    return static_cast<float>(value);
}

std::string encode_stl(const SurfaceMesh& surface, const std::string& name) {
    const geometry::TriangleMesh& mesh = surface.mesh;
    if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max())
        throw InputError(name, "there are too many triangles for STL", "write PLY");
    std::string out = "splitcubes surface, metres";
    out.resize(80, ' ');
    put_number(out, static_cast<std::uint32_t>(mesh.triangles.size()));
    out.reserve(out.size() + mesh.triangles.size() * 50);
    for (const Triangle& t : mesh.triangles) {
        const Vec3& a = mesh.positions[t[0]];
        // Scaled first, as the square of an area of huge or tiny lengths leaves the range.
        Vec3 u = mesh.positions[t[1]] - a;
        Vec3 w = mesh.positions[t[2]] - a;
        u.stableNormalize();
        w.stableNormalize();
        Vec3 normal = u.cross(w);
        normal.stableNormalize();
        if (!normal.allFinite()) normal.setZero();  // STL readers compute it themselves
        for (const double value : normal) put_number(out, static_cast<float>(value));
        for (const std::uint32_t v : t)
            for (const double value : mesh.positions[v]) put_number(out, to_float(value, name));
        put_number(out, std::uint16_t{0});
    }
    return out;
}

std::string encode_mesh(const SurfaceMesh& surface, MeshFormat format, const std::string& name) {
    std::vector<geometry::Material> materials = surface.attributes.materials;
    return encode({surface, std::move(materials), name}, format, fs::path(name).stem().string() + ".mtl");
}

void write_mesh(const fs::path& path, const SurfaceMesh& surface) {
    const std::optional<MeshFormat> format = format_of_extension(path);
    const std::string extension = path.extension().string();
    // JSON glTF would need a second file beside it, and two are not written at once.
    const bool text_gltf = format == MeshFormat::gltf && (extension.size() == 5);
    if (!format || text_gltf)
        throw InputError(path.string(), "meshes are not written as '" + printable(extension) + "'",
                         "use .ply, .obj, .stl or .glb");
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    std::vector<geometry::Material> materials = surface.attributes.materials;
    const bool to_files = *format == MeshFormat::obj || *format == MeshFormat::ply;
    if (to_files) check_surface(surface, path.string());
    const fs::path library = path.stem().string() + ".mtl";
    const bool with_library = *format == MeshFormat::obj && !materials.empty();
    if (with_library) check_library(folder / library);
    if (to_files) write_images(folder, path.stem().string(), materials);
    for (geometry::Material& material : materials)
        if (!material.image) material.texture = texture_from(folder, material.texture);
    const std::string library_text = with_library ? encode_mtl(materials) : std::string();
    const std::string text =
        encode({surface, std::move(materials), path.string()}, *format, library.string());
    AtomicFile file(path);
    file.write(text);
    if (with_library) {
        // First, so that the mesh never refers to a library that is not there.
        AtomicFile library_file(folder / library);
        library_file.write(library_text);
        library_file.commit();
    }
    file.commit();
}

}  // namespace splitcubes::io
