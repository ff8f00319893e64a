#include <splitcubes/core/error.h>
#include <splitcubes/core/memory.h>
#include <splitcubes/geometry/coordinate_limit.h>
#include <splitcubes/io/mesh_readers.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/read_surface.h>
#include <splitcubes/io/text_encoding.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <system_error>

namespace splitcubes::io {

namespace fs = std::filesystem;

using geometry::Origin;

namespace {

// Beyond this a mesh would not fit the indices; it also keeps a sparse file
// that claims terabytes from being requested.
constexpr std::uintmax_t max_file_bytes = std::uintmax_t{16} << 30;

Model read_format(Bytes bytes, MeshFormat format, const std::string& name, const fs::path& folder,
                  ReadMeshReport* report) {
    if (bytes.empty()) throw InputError(name, "is empty", "give a file with a triangle mesh");
    if (is_utf16(bytes)) throw InputError(name, "is text in UTF-16", "save it as UTF-8 or plain ASCII");
    bytes = without_byte_order_mark(bytes);
    ReadMeshReport ignored;
    ReadMeshReport& notes = report ? *report : ignored;
    switch (format) {
        case MeshFormat::obj:
            return read_obj(bytes, name, folder, notes);
        case MeshFormat::ply: {
            geometry::SurfaceMesh surface = read_ply(bytes, name, folder, PlyContent::mesh, notes);
            return {std::move(surface.mesh), std::move(surface.attributes)};
        }
        case MeshFormat::stl:
            return {read_stl(bytes, name, notes), {}};
        case MeshFormat::gltf:
            return read_gltf(bytes, name, folder, notes);
    }
    throw InputError(name, "unknown mesh format " + std::to_string(static_cast<int>(format)), "");
}

Model read_bytes(Bytes bytes, MeshFormat format, const std::string& name, const fs::path& folder,
                 ReadMeshReport* report) {
    Model model = read_format(bytes, format, name, folder, report);
    geometry::require_coordinates(model.mesh, name);
    return model;
}

fs::path folder_of(const fs::path& path) {
    return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

}  // namespace

std::optional<float> finite_float(double value) {
    if (!(std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max()))) return std::nullopt;
    return static_cast<float>(value);
}

float channel(double value) {
    return static_cast<float>(std::clamp(value, 0.0, 1.0));
}

std::string resolved_texture(const std::string& written, const fs::path& folder, const fs::path& mesh_folder,
                             ReadMeshReport& report) {
    // Programs on Windows write backslashes. Web addresses are no paths and stay.
    std::string name = written;
    std::replace(name.begin(), name.end(), '\\', '/');
    if (folder.empty() || name.empty() || name.find("://") != name.npos || name.find('\0') != name.npos)
        return name;
    const fs::path named = (folder / name).lexically_normal();
    // Meshes that have been sent come with their textures beside them, whatever folder they were in.
    for (const fs::path& path : {named, mesh_folder / named.filename()}) {
        std::error_code ignored;
        if (!fs::is_regular_file(path, ignored)) continue;
        report.files.push_back(path);
        return path.generic_string();
    }
    report.notes.push_back("texture '" + printable(name) + "' is not there; its name is kept");
    return named.generic_string();
}

bool is_beside_or_below(const std::string& relative) {
    const fs::path path = fs::path(relative).lexically_normal();
    return !relative.empty() && relative.find('\0') == relative.npos && !path.is_absolute() &&
           relative.find("://") == relative.npos &&
           std::find(path.begin(), path.end(), fs::path("..")) == path.end();
}

std::string at_byte(const std::string& name, std::size_t offset) {
    return name + " at byte " + std::to_string(offset);
}

std::vector<std::byte> read_file_bytes(const fs::path& path) {
    std::error_code why;
    const std::string name = path.string();
    const fs::file_status status = fs::status(path, why);
    if (!fs::exists(status)) throw InputError(name, "there is no such file", "check the path");
    // A pipe or a device may never end.
    if (!fs::is_regular_file(status)) throw InputError(name, "is not a file", "give the path of a file");
    const std::uintmax_t size = fs::file_size(path, why);
    if (why) throw InputError(name, "cannot be read (" + why.message() + ")", "");
    if (size == 0) throw InputError(name, "is empty", "give a file with a triangle mesh");
    if (size > max_file_bytes)
        throw InputError(name, "has " + std::to_string(size) + " bytes",
                         "files of up to " + std::to_string(max_file_bytes) + " bytes can be read");
    // Its text or bytes, the mesh in memory, and a copy of that while vertices are joined.
    require_memory(name, 4 * static_cast<double>(size), "make the mesh smaller");
    std::ifstream stream(path, std::ios::binary);
    if (!stream) throw InputError(name, "cannot be opened", "check who may read it");
    std::vector<std::byte> bytes(size);
    stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
    if (static_cast<std::uintmax_t>(stream.gcount()) != size)
        throw InputError(name,
                         "only " + std::to_string(stream.gcount()) + " of its " + std::to_string(size) +
                             " bytes could be read",
                         "");
    return bytes;
}

Model read_model(const fs::path& path, ReadMeshReport* report) {
    const std::vector<std::byte> bytes = read_file_bytes(path);
    std::optional<MeshFormat> format = format_of_extension(path);
    if (!format) format = format_of_content(bytes);
    if (!format)
        throw InputError(
            path.string(),
            "neither its name (" + path.extension().string() + ") nor its content tells a format",
            "OBJ, PLY, STL, glTF and GLB can be read");
    return read_bytes(bytes, *format, path.string(), folder_of(path), report);
}

Model read_model_from_memory(Bytes bytes, MeshFormat format, const std::string& name,
                             ReadMeshReport* report) {
    return read_bytes(bytes, format, name, {}, report);
}

geometry::TriangleMesh read_mesh(const fs::path& path, ReadMeshReport* report) {
    return std::move(read_model(path, report).mesh);
}

geometry::TriangleMesh read_mesh_from_memory(Bytes bytes, MeshFormat format, const std::string& name,
                                             ReadMeshReport* report) {
    return std::move(read_model_from_memory(bytes, format, name, report).mesh);
}

geometry::SurfaceMesh read_surface(const fs::path& path) {
    if (format_of_extension(path) != MeshFormat::ply)
        throw InputError(path.string(), "surfaces with their attributes are read from PLY files only",
                         "give a .ply file");
    const std::vector<std::byte> bytes = read_file_bytes(path);
    ReadMeshReport ignored;
    return read_ply(bytes, path.string(), folder_of(path), PlyContent::surface, ignored);
}

geometry::SurfaceMesh read_any_surface(const fs::path& path) {
    if (format_of_extension(path) == MeshFormat::ply) return read_surface(path);
    Model model = read_model(path);
    geometry::SurfaceMesh out;
    out.mesh = std::move(model.mesh);
    out.rest = std::move(model.rest);
    out.attributes = std::move(model.attributes);
    if (out.attributes.triangle_material.empty()) return out;
    bool has_own = !out.attributes.corner_uv.empty() || !out.attributes.corner_colour.empty();
    std::vector<Origin> origin_of_material;
    for (const geometry::Material& material : out.attributes.materials) {
        const bool is_cut = material.name == "cut" || material.name.ends_with("/cut");
        origin_of_material.push_back(is_cut ? Origin::cut : Origin::boundary);
        has_own = has_own || (material.name != "cut" && material.name != "boundary");
    }
    for (const std::int32_t material : out.attributes.triangle_material)
        out.triangle_origin.push_back(material < 0 ? Origin::boundary
                                                   : origin_of_material[static_cast<std::size_t>(material)]);
    // Materials that only stand for the origin are no attributes of the surface.
    if (!has_own) out.attributes = {};
    return out;
}

geometry::SurfaceMesh read_surface_from_memory(Bytes bytes, const std::string& name) {
    if (bytes.empty()) throw InputError(name, "is empty", "give a PLY file");
    ReadMeshReport ignored;
    return read_ply(bytes, name, {}, PlyContent::surface, ignored);
}

}  // namespace splitcubes::io
