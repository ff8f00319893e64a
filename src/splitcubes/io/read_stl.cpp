#include <splitcubes/core/error.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/io/byte_reader.h>
#include <splitcubes/io/mesh_builder.h>
#include <splitcubes/io/mesh_readers.h>
#include <splitcubes/io/text_cursor.h>

#include <cmath>

namespace splitcubes::io {

namespace {

constexpr std::size_t header_bytes = 80;
constexpr std::size_t prefix_bytes = header_bytes + 4;  // header and count
constexpr std::size_t triangle_bytes = 50;              // normal, three corners, attribute count

std::uint64_t claimed_triangles(Bytes bytes) {
    return load_number<std::uint32_t>(bytes.data() + header_bytes, std::endian::little);
}

/// Three corners after one another are a triangle, as no vertices are shared yet.
geometry::TriangleMesh welded(std::vector<Vec3> corners, const std::string& name, ReadMeshReport& report) {
    geometry::TriangleMesh loose;
    loose.positions = std::move(corners);
    loose.triangles.reserve(loose.positions.size() / 3);
    for (std::size_t i = 0; i + 2 < loose.positions.size(); i += 3) {
        const auto first = static_cast<std::uint32_t>(i);
        loose.triangles.push_back({first, first + 1, first + 2});
    }
    MeshBuilder builder;
    builder.mesh = geometry::weld_equal_vertices(loose);
    const std::size_t collapsed = loose.triangles.size() - builder.mesh.triangles.size();
    if (collapsed > 0)
        report.notes.push_back(std::to_string(collapsed) +
                               " triangles that use a vertex twice were left out");
    return builder.finish(name, report);
}

std::vector<Vec3> binary_corners(Bytes bytes, const std::string& name) {
    const std::uint64_t count = claimed_triangles(bytes);
    if (count * 3 > max_vertex_count)
        throw InputError(at_byte(name, header_bytes), std::to_string(count) + " triangles are too many",
                         "split the mesh");
    std::vector<Vec3> corners;
    corners.reserve(count * 3);
    for (std::uint64_t t = 0; t < count; ++t) {
        const std::size_t first = prefix_bytes + t * triangle_bytes + 3 * sizeof(float);
        for (std::size_t c = 0; c < 3; ++c) {
            Vec3 corner;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const std::size_t at = first + (3 * c + axis) * sizeof(float);
                const auto value = load_number<float>(bytes.data() + at, std::endian::little);
                if (!std::isfinite(value))
                    throw InputError(
                        at_byte(name, at),
                        "a coordinate of triangle " + std::to_string(t) + " is " + std::to_string(value),
                        "coordinates must be finite");
                corner[static_cast<Eigen::Index>(axis)] = value;
            }
            corners.push_back(corner);
        }
    }
    return corners;
}

/// facet normal x y z / outer loop / vertex x y z (three times) / endloop /
/// endfacet, between solid [name] and endsolid [name].
class AsciiStl {
  public:
    AsciiStl(Bytes bytes, const std::string& name) : cursor_(as_text(bytes), name) {}

    std::vector<Vec3> corners() {
        for (;;) {
            const std::string_view word = cursor_.word();
            if (word.empty() && !within_solid_) return std::move(corners_);
            if (word == "solid" && !within_solid_) {
                within_solid_ = true;
                cursor_.next_line();  // the rest is a name, of any words
            } else if (word == "endsolid" && within_solid_) {
                within_solid_ = false;
                cursor_.next_line();
            } else if (word == "facet" && within_solid_) {
                read_facet();
            } else {
                unexpected(word, within_solid_ ? "facet or endsolid" : "solid");
            }
        }
    }

  private:
    void read_facet() {
        expect("normal");
        // Not used, and often nan: the order of the corners says which side is out.
        for (int i = 0; i < 3; ++i)
            if (cursor_.word().empty()) unexpected({}, "a normal");
        expect("outer");
        expect("loop");
        for (int i = 0; i < 3; ++i) {
            expect("vertex");
            const double x = cursor_.number(cursor_.word(), "x");
            const double y = cursor_.number(cursor_.word(), "y");
            const double z = cursor_.number(cursor_.word(), "z");
            corners_.emplace_back(x, y, z);
        }
        expect("endloop");
        expect("endfacet");
        if (corners_.size() > max_vertex_count - 3)
            cursor_.fail("there are too many triangles", "split the mesh");
    }

    void expect(const char* wanted) {
        const std::string_view word = cursor_.word();
        if (word != wanted) unexpected(word, wanted);
    }
    [[noreturn]] void unexpected(std::string_view word, const std::string& wanted) const {
        if (word.empty())
            cursor_.fail("the file ends where " + wanted + " should be",
                         "the file was cut off; get it again");
        cursor_.fail(in_quotes(word) + " stands where " + wanted + " should be",
                     "every facet is one triangle");
    }

    TextCursor cursor_;
    std::vector<Vec3> corners_;
    bool within_solid_ = false;
};

bool begins_with_solid(Bytes bytes) {
    const std::string_view text = as_text(bytes);
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    return first != text.npos && text.substr(first).starts_with("solid");
}

}  // namespace

bool is_binary_stl(Bytes bytes) {
    return bytes.size() >= prefix_bytes &&
           bytes.size() == prefix_bytes + claimed_triangles(bytes) * triangle_bytes;
}

geometry::TriangleMesh read_stl(Bytes bytes, const std::string& name, ReadMeshReport& report) {
    if (is_binary_stl(bytes)) return welded(binary_corners(bytes, name), name, report);
    // A text has no zero byte; a binary file of the wrong size has them in nearly every number.
    const bool text = begins_with_solid(bytes) && as_text(bytes).find('\0') == std::string_view::npos;
    if (text) return welded(AsciiStl(bytes, name).corners(), name, report);
    if (bytes.size() < prefix_bytes)
        throw InputError(name,
                         "its " + std::to_string(bytes.size()) +
                             " bytes are neither text that begins with "
                             "'solid' nor the " +
                             std::to_string(prefix_bytes) + " bytes that a binary STL begins with",
                         "the file is no STL or was cut off");
    const std::uint64_t count = claimed_triangles(bytes);
    throw InputError(at_byte(name, header_bytes),
                     "the header says " + std::to_string(count) + " triangles, which take " +
                         std::to_string(prefix_bytes + count * triangle_bytes) + " bytes, but there are " +
                         std::to_string(bytes.size()),
                     "the file was cut off or is no STL");
}

}  // namespace splitcubes::io
