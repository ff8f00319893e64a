// The encoder of each format. Internal to the module: encode_mesh has checked
// the surface before one of these is called.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <string>
#include <type_traits>
#include <vector>

namespace splitcubes::io {

/// Input of a writer: a surface, and its materials with the textures' names as they
/// shall stand in the file.
struct Output {
    const geometry::SurfaceMesh& surface;
    std::vector<geometry::Material> materials;
    std::string name;  // of the file, for messages
};

/// Throws InputError for a surface that no reader could take.
void check_surface(const geometry::SurfaceMesh& surface, const std::string& name);
/// The name by which a file in `folder` refers to a texture.
std::string texture_from(const std::filesystem::path& folder, const std::string& texture);

/// library: the file name of the material library that it refers to.
std::string encode_obj(const Output& output, const std::string& library);
/// The material library.
std::string encode_mtl(const std::vector<geometry::Material>& materials);
/// These throw InputError where a number that they store in single precision does not fit it.
std::string encode_ply(const Output& output);
std::string encode_stl(const geometry::SurfaceMesh& surface, const std::string& name);
std::string encode_glb(const Output& output);

/// Names of materials that no two share, without line ends and blanks at their ends.
std::vector<std::string> distinct_names(const std::vector<geometry::Material>& materials);

/// Text that stands on a line of its own: control characters become _.
std::string one_line(std::string text);

/// One colour a vertex, for formats that have no more: the mean over its corners in
/// boundary triangles, or in cut ones where it has no others. Empty without colours.
std::vector<geometry::Rgba> vertex_colours(const geometry::SurfaceMesh& surface);

/// `boundary` or `cut`: groups and materials are called so.
const char* name_of(geometry::Origin origin);

geometry::Origin origin_of(const geometry::SurfaceMesh& surface, std::size_t triangle);

/// A number in single precision; throws InputError where it would be infinite.
float to_float(double value, const std::string& name);

/// glTF is y-up, all else z-up; both are right-handed.
inline Vec3 gltf_from_own(const Vec3& p) {
    return {p.x(), p.z(), -p.y()};
}

/// Appends the number's bytes, lowest first.
template <class Number>
void put_number(std::string& out, Number value) {
    static_assert(std::is_arithmetic_v<Number>);
    char bytes[sizeof(Number)];
    std::memcpy(bytes, &value, sizeof(Number));
    if constexpr (std::endian::native == std::endian::little)
        out.append(bytes, sizeof(Number));
    else
        out.append(std::reverse_iterator(bytes + sizeof(Number)), std::reverse_iterator(bytes + 0));
}

/// The fewest digits that give the same number back, in the classic locale.
template <class Number>
void put_text(std::string& out, Number value) {
    char digits[32];
    out.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

}  // namespace splitcubes::io
