// Feeds arbitrary bytes to the mesh readers. The first byte chooses the format. Accepted meshes must satisfy
// the readers' guarantees and survive a round trip.
#include <splitcubes/core/error.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/read_surface.h>
#include <splitcubes/io/write_mesh.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <utility>

using namespace splitcubes;
using namespace splitcubes::io;

namespace {

void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "broken promise: %s\n", what);
    std::abort();
}

std::span<const std::byte> bytes_of(const std::string& text) {
    return std::as_bytes(std::span(text.data(), text.size()));
}

void require_sound(const geometry::TriangleMesh& mesh) {
    for (const Vec3& p : mesh.positions) require(p.allFinite(), "positions are finite");
    for (const geometry::Triangle& t : mesh.triangles) {
        for (const std::uint32_t v : t) require(v < mesh.positions.size(), "indices are in range");
        require(t[0] != t[1] && t[1] != t[2] && t[2] != t[0], "no triangle uses a vertex twice");
    }
}

void require_sound(const geometry::MeshAttributes& attributes, std::size_t triangles) {
    for (const std::size_t length :
         {attributes.corner_uv.size(), attributes.corner_colour.size(), attributes.triangle_material.size()})
        require(length == 0 || length == triangles, "attributes are none or one each");
    for (const auto& corners : attributes.corner_uv)
        for (const geometry::Uv& uv : corners)
            require(std::isfinite(uv[0]) && std::isfinite(uv[1]), "texture coordinates are finite");
    for (const auto& corners : attributes.corner_colour)
        for (const geometry::Rgba& colour : corners)
            for (const float value : colour) require(value >= 0 && value <= 1, "colours are in range");
    for (const std::int32_t material : attributes.triangle_material)
        require(material >= -1 && material < static_cast<std::int64_t>(attributes.materials.size()),
                "materials are in range");
}

/// Double precision round-trips exactly; single precision may not be able to hold it.
void require_round_trips(const geometry::SurfaceMesh& surface) {
    const std::string ply = encode_mesh(surface, MeshFormat::ply, "ply");
    const geometry::SurfaceMesh again = read_surface_from_memory(bytes_of(ply), "ply");
    require(again.mesh.positions == surface.mesh.positions, "PLY keeps positions");
    require(again.mesh.triangles == surface.mesh.triangles, "PLY keeps triangles");
    require(again.vertex_piece == surface.vertex_piece, "PLY keeps pieces");
    require(again.triangle_origin == surface.triangle_origin, "PLY keeps origins");
    require(again.normals.size() == surface.normals.size(), "PLY keeps normals");
    require(again.rest == surface.rest, "PLY keeps rest positions");
    require(again.attributes.corner_uv == surface.attributes.corner_uv, "PLY keeps texture coordinates");
    require(again.attributes.triangle_material == surface.attributes.triangle_material,
            "PLY keeps material numbers");
    require(again.attributes.corner_colour.empty() == surface.attributes.corner_colour.empty(),
            "PLY keeps colours");
    if (surface.mesh.triangles.empty()) return;
    const std::string obj = encode_mesh(surface, MeshFormat::obj, "obj");
    const geometry::TriangleMesh from_obj = read_mesh_from_memory(bytes_of(obj), MeshFormat::obj, "obj");
    require(from_obj.positions == surface.mesh.positions, "OBJ keeps positions");
    require(from_obj.triangles.size() == surface.mesh.triangles.size(), "OBJ keeps triangles");
    try {
        const std::string glb = encode_mesh(surface, MeshFormat::gltf, "glb");
        const geometry::TriangleMesh from_glb = read_mesh_from_memory(bytes_of(glb), MeshFormat::gltf, "glb");
        require(from_glb.triangles.size() == surface.mesh.triangles.size(), "GLB keeps triangles");
        const std::string stl = encode_mesh(surface, MeshFormat::stl, "stl");
        require(stl.size() == 84 + 50 * surface.mesh.triangles.size(), "STL keeps triangles");
        read_mesh_from_memory(bytes_of(stl), MeshFormat::stl, "stl");
    } catch (const InputError&) {
        // Too large for single precision, or every triangle degenerates in it.
    }
}

geometry::SurfaceMesh with_attributes(Model model) {
    geometry::SurfaceMesh surface;
    surface.mesh = std::move(model.mesh);
    surface.attributes = std::move(model.attributes);
    return surface;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const auto bytes = std::as_bytes(std::span(data + 1, size - 1));
    constexpr MeshFormat formats[] = {MeshFormat::obj, MeshFormat::ply, MeshFormat::stl, MeshFormat::gltf};
    const unsigned choice = data[0] % 5;
    try {
        geometry::SurfaceMesh surface;
        if (choice == 4)
            surface = read_surface_from_memory(bytes, "fuzz");
        else
            surface = with_attributes(read_model_from_memory(bytes, formats[choice], "fuzz"));
        require_sound(surface.mesh);
        require_sound(surface.attributes, surface.mesh.triangles.size());
        // Beyond single precision a normal would be written as infinite.
        const bool writable = std::all_of(surface.normals.begin(), surface.normals.end(),
                                          [](const Vec3& n) { return n.cwiseAbs().maxCoeff() < 1e38; });
        if (writable) require_round_trips(surface);
    } catch (const InputError&) {
    }
    return 0;
}
