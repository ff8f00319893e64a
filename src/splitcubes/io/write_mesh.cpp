#include <splitcubes/core/error.h>
#include <splitcubes/io/atomic_file.h>
#include <splitcubes/io/mesh_writers.h>
#include <splitcubes/io/write_mesh.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

namespace splitcubes::io {

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

/// A file that no reader takes is not written.
void check_surface(const SurfaceMesh& surface, const std::string& name) {
    const std::size_t vertices = surface.mesh.positions.size();
    check_length(surface.normals.size(), vertices, "normals", name);
    check_length(surface.vertex_piece.size(), vertices, "piece numbers", name);
    check_length(surface.triangle_origin.size(), surface.mesh.triangles.size(), "origins", name);
    for (std::size_t v = 0; v < vertices; ++v)
        if (!surface.mesh.positions[v].allFinite())
            throw InputError(name, "the position of vertex " + std::to_string(v) + " is not finite", "");
    for (std::size_t v = 0; v < surface.normals.size(); ++v)
        if (!surface.normals[v].allFinite())
            throw InputError(name, "the normal of vertex " + std::to_string(v) + " is not finite", "");
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t)
        for (const std::uint32_t v : surface.mesh.triangles[t])
            if (v >= vertices)
                throw InputError(name,
                                 "triangle " + std::to_string(t) + " uses vertex " + std::to_string(v) +
                                     " of " + std::to_string(vertices),
                                 "");
}

/// The fewest digits that give the same number back, in the classic locale.
template <class Number>
void put_text(std::string& out, Number value) {
    char digits[32];
    out.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

void put_line(std::string& out, const char* keyword, const Vec3& v) {
    out += keyword;
    for (const double value : v) {
        out += ' ';
        put_text(out, value);
    }
    out += '\n';
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
        throw InputError(name, "a number is too large for single precision (" + std::to_string(value) + ")",
                         "scale it down, or write positions as PLY or OBJ");
    return static_cast<float>(value);
}

std::string encode_ply(const SurfaceMesh& surface, const std::string& name) {
    const geometry::TriangleMesh& mesh = surface.mesh;
    std::string out = "ply\nformat binary_little_endian 1.0\ncomment splitcubes surface, metres\n";
    out += "element vertex " + std::to_string(mesh.positions.size()) + "\n";
    out += "property double x\nproperty double y\nproperty double z\n";
    if (!surface.normals.empty()) out += "property float nx\nproperty float ny\nproperty float nz\n";
    if (!surface.vertex_piece.empty()) out += "property int piece\n";
    out += "element face " + std::to_string(mesh.triangles.size()) + "\n";
    out += "property list uchar int vertex_indices\n";
    if (!surface.triangle_origin.empty()) out += "property uchar origin\n";
    out += "end_header\n";
    out.reserve(out.size() + mesh.positions.size() * 40 + mesh.triangles.size() * 14);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        for (const double value : mesh.positions[v]) put_number(out, value);
        if (!surface.normals.empty())
            for (const double value : surface.normals[v]) put_number(out, to_float(value, name));
        if (!surface.vertex_piece.empty()) put_number(out, surface.vertex_piece[v]);
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        put_number(out, std::uint8_t{3});
        for (const std::uint32_t v : mesh.triangles[t]) put_number(out, v);
        if (!surface.triangle_origin.empty())
            put_number(out, static_cast<std::uint8_t>(surface.triangle_origin[t]));
    }
    return out;
}

std::string encode_obj(const SurfaceMesh& surface) {
    const geometry::TriangleMesh& mesh = surface.mesh;
    std::string out = "# splitcubes surface, metres\n";
    out.reserve(mesh.positions.size() * 120 + mesh.triangles.size() * 40);
    for (const Vec3& position : mesh.positions) put_line(out, "v", position);
    for (const Vec3& normal : surface.normals) put_line(out, "vn", normal);
    for (const Origin origin : {Origin::boundary, Origin::cut}) {
        bool begun = false;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            if (origin_of(surface, t) != origin) continue;
            if (!begun) out += std::string("g ") + name_of(origin) + "\nusemtl " + name_of(origin) + "\n";
            begun = true;
            out += 'f';
            for (const std::uint32_t v : mesh.triangles[t]) {
                out += ' ';
                put_text(out, std::uint64_t{v} + 1);
                if (surface.normals.empty()) continue;
                out += "//";
                put_text(out, std::uint64_t{v} + 1);
            }
            out += '\n';
        }
    }
    return out;
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
        if (!normal.allFinite()) normal.setZero();  // what STL asks readers to work out themselves
        for (const double value : normal) put_number(out, static_cast<float>(value));
        for (const std::uint32_t v : t)
            for (const double value : mesh.positions[v]) put_number(out, to_float(value, name));
        put_number(out, std::uint16_t{0});
    }
    return out;
}

std::string encode_mesh(const SurfaceMesh& surface, MeshFormat format, const std::string& name) {
    check_surface(surface, name);
    switch (format) {
        case MeshFormat::obj:
            return encode_obj(surface);
        case MeshFormat::ply:
            return encode_ply(surface, name);
        case MeshFormat::stl:
            return encode_stl(surface, name);
        case MeshFormat::gltf:
            return encode_glb(surface, name);
    }
    throw InputError(name, "unknown mesh format " + std::to_string(static_cast<int>(format)), "");
}

void write_mesh(const std::filesystem::path& path, const SurfaceMesh& surface) {
    const std::optional<MeshFormat> format = format_of_extension(path);
    const std::string extension = path.extension().string();
    // JSON glTF would need a second file beside it, and two are not written at once.
    const bool text_gltf = format == MeshFormat::gltf && (extension.size() == 5);
    if (!format || text_gltf)
        throw InputError(path.string(), "meshes are not written as '" + printable(extension) + "'",
                         "use .ply, .obj, .stl or .glb");
    AtomicFile file(path);
    file.write(encode_mesh(surface, *format, path.string()));
    file.commit();
}

}  // namespace splitcubes::io
