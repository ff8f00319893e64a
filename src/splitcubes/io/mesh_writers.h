// The encoder of each format. Internal to the module: encode_mesh has checked
// the surface before one of these is called.
#pragma once

#include <splitcubes/geometry/triangle_mesh.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <string>
#include <type_traits>

namespace splitcubes::io {

std::string encode_obj(const geometry::SurfaceMesh& surface);
/// These throw InputError where a number that they store in single precision does not fit it.
std::string encode_ply(const geometry::SurfaceMesh& surface, const std::string& name);
std::string encode_stl(const geometry::SurfaceMesh& surface, const std::string& name);
std::string encode_glb(const geometry::SurfaceMesh& surface, const std::string& name);

/// `boundary` or `cut`: groups and materials are called so.
const char* name_of(geometry::Origin origin);

geometry::Origin origin_of(const geometry::SurfaceMesh& surface, std::size_t triangle);

/// A number in single precision; throws InputError where it would be infinite.
float to_float(double value, const std::string& name);

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

}  // namespace splitcubes::io
