// The header of a PLY file: which elements follow, with which properties.
// Internal to the module. After G. Turk, "The PLY polygon file format", 1994.
#pragma once

#include <splitcubes/io/mesh_readers.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace splitcubes::io {

enum class PlyEncoding { ascii, little_endian, big_endian };

enum class PlyType : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::size_t byte_count(PlyType type);

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::float32;  // of the value, or of a list's items
    bool is_list = false;
    PlyType count_type = PlyType::uint8;  // of a list's length
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;  // as claimed; nothing is allocated by it before it is checked
    std::size_t line = 0;     // of the header
    std::vector<PlyProperty> properties;

    /// The fewest bytes that one can take, with every list empty.
    std::size_t min_bytes(PlyEncoding encoding) const;
    const PlyProperty* find(const std::string& property) const;
};

struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::ascii;
    std::vector<PlyElement> elements;
    std::vector<std::string> comments;  // without the word itself and the blanks behind it
    std::size_t body_offset = 0;        // byte of the file
    std::size_t body_line = 0;          // counted from 1

    const PlyElement* find(const std::string& element) const;
};

/// Throws InputError with name:line for anything that is not a PLY 1.0 header.
PlyHeader read_ply_header(Bytes bytes, const std::string& name);

}  // namespace splitcubes::io
