#include <gmock/gmock.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/read_surface.h>

#include <limits>

#include "mesh_samples.h"

using namespace splitcubes;
using namespace splitcubes::io;
using ::testing::HasSubstr;

namespace {

geometry::TriangleMesh read_ply(const std::string& text, ReadMeshReport* report = nullptr) {
    return read_mesh_from_memory(bytes_of(text), MeshFormat::ply, "the-file", report);
}
std::string ply_complaint(const std::string& text) {
    return io::complaint(text, MeshFormat::ply);
}

std::string header(const std::string& format, const std::string& elements) {
    return "ply\nformat " + format + " 1.0\ncomment made by a test\n" + elements + "end_header\n";
}
const std::string float_vertices = "property float x\nproperty float y\nproperty float z\n";
const std::string int_faces = "property list uchar int vertex_indices\n";
const std::string square = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
std::string ascii_square(const std::string& faces, const std::string& count = "1") {
    return header("ascii",
                  "element vertex 4\n" + float_vertices + "element face " + count + "\n" + int_faces) +
           square + faces;
}

/// A number of the named type.
void put_typed(std::string& out, const std::string& type, double value, bool big) {
    if (type == "char") put(out, static_cast<std::int8_t>(value), big);
    if (type == "uint8") put(out, static_cast<std::uint8_t>(value), big);
    if (type == "short") put(out, static_cast<std::int16_t>(value), big);
    if (type == "uint16") put(out, static_cast<std::uint16_t>(value), big);
    if (type == "int") put(out, static_cast<std::int32_t>(value), big);
    if (type == "uint32") put(out, static_cast<std::uint32_t>(value), big);
    if (type == "float") put(out, static_cast<float>(value), big);
    if (type == "float64") put(out, value, big);
}

/// The box with the given types, with properties and elements nobody asked for in between.
std::string binary_box(bool big, const std::string& number, const std::string& length,
                       const std::string& index) {
    const geometry::TriangleMesh box = box_mesh();
    std::string out = header(big ? "binary_big_endian" : "binary_little_endian",
                             "element camera 2\nproperty double focus\nproperty list uint8 short lens\n"
                             "element vertex 8\nproperty uint8 red\nproperty " +
                                 number +
                                 " x\nproperty list uint8 float weights\n"
                                 "property " +
                                 number + " y\nproperty " + number +
                                 " z\nelement face 12\nproperty float quality\n"
                                 "property list " +
                                 length + " " + index + " vertex_index\nelement nothing 1000000000000\n");
    for (int c = 0; c < 2; ++c) {
        put(out, 35.0, big);
        put(out, std::uint8_t{3}, big);
        for (int i = 0; i < 3; ++i) put(out, std::int16_t{1}, big);
    }
    for (std::uint8_t v = 0; v < 8; ++v) {
        const Vec3& p = box.positions[v];
        put(out, std::uint8_t{200}, big);
        put_typed(out, number, p[0], big);
        put(out, std::uint8_t{v}, big);
        for (int i = 0; i < v; ++i) put(out, 0.5F, big);
        put_typed(out, number, p[1], big);
        put_typed(out, number, p[2], big);
    }
    for (const geometry::Triangle& t : box.triangles) {
        put(out, std::numeric_limits<float>::quiet_NaN(), big);
        put_typed(out, length, 3, big);
        for (const std::uint32_t v : t) put_typed(out, index, v, big);
    }
    return out;
}

}  // namespace

TEST(ReadPly, EveryTypeAndByteOrderGivesTheSameMesh) {
    const geometry::TriangleMesh box = box_mesh();
    for (const bool big : {false, true})
        for (const char* number : {"char", "uint8", "short", "uint16", "int", "uint32", "float", "float64"})
            for (const char* length : {"uint8", "int", "uint16"})
                for (const char* index : {"char", "uint8", "short", "uint16", "int", "uint32"}) {
                    ReadMeshReport report;
                    const geometry::TriangleMesh mesh =
                        read_ply(binary_box(big, number, length, index), &report);
                    EXPECT_EQ(mesh.positions, box.positions) << big << number << length << index;
                    EXPECT_EQ(mesh.triangles, box.triangles) << big << number << length << index;
                    EXPECT_EQ(report.notes.size(), 2U);
                }
}

TEST(ReadPly, AsciiWithPolygonsUnknownsAndLineEnds) {
    const std::string text =
        header("ascii",
               "obj_info by hand\nelement edge 1\nproperty int a\nproperty int b\nelement vertex 4\n" +
                   float_vertices + "property uchar red\nelement face 1\n" + int_faces) +
        "0 1\n0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n4 0 1 2 3\n\n";
    const geometry::TriangleMesh mesh = read_ply(text);
    EXPECT_EQ(mesh.triangles, (std::vector<geometry::Triangle>{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_EQ(mesh.positions[2], Vec3(1, 1, 0));
    for (const std::string end : {"\r\n", "\r"}) {
        std::string other;
        for (const char c : text) other += c == '\n' ? end : std::string(1, c);
        EXPECT_EQ(read_ply(other).triangles, mesh.triangles);
    }
}

TEST(ReadPly, BinaryDataMayBeginWithALineEndsByte) {
    for (const std::string end : {"\n", "\r\n", "\r"}) {
        std::string text;
        for (const char c : header("binary_little_endian",
                                   "element vertex 3\nproperty uchar x\nproperty uchar y\nproperty uchar z\n"
                                   "element face 1\n" +
                                       int_faces))
            text += c == '\n' ? end : std::string(1, c);
        text += "\n\r\n";  // 10, 13, 10
        text += std::string("\1\2\3\3\2\2", 6);
        text += '\3';
        for (const std::int32_t v : {0, 1, 2}) put(text, v);
        EXPECT_EQ(read_ply(text).positions[0], Vec3(10, 13, 10));
    }
}

TEST(ReadPly, FacesMayComeFirst) {
    const std::string text =
        header("ascii", "element face 1\n" + int_faces + "element vertex 4\n" + float_vertices);
    EXPECT_EQ(read_ply(text + "3 1 2 3\n" + square).triangles[0], (geometry::Triangle{1, 2, 3}));
    EXPECT_THAT(ply_complaint(text + "3 1 2 4\n" + square),
                HasSubstr("face corner 4 is out of range: there are 4"));
}

TEST(ReadPly, SaysWhereAndWhatIsWrong) {
    EXPECT_THAT(ply_complaint("plx\n"), HasSubstr("the-file:1: the file does not begin with a line 'ply'"));
    EXPECT_THAT(ply_complaint("ply\nformat ascii 1.0\n"), HasSubstr("within the header"));
    EXPECT_THAT(ply_complaint("ply\nformat ascii 1.1\n"), HasSubstr("version '1.1'"));
    EXPECT_THAT(ply_complaint("ply\nformat text 1.0\n"), HasSubstr("the-file:2: unknown format 'text'"));
    EXPECT_THAT(ply_complaint(header("ascii", "")), HasSubstr("no element 'vertex'"));
    EXPECT_THAT(ply_complaint(header("ascii", "element vertex -1\n")), HasSubstr("count '-1'"));
    EXPECT_THAT(ply_complaint(header("ascii", "property int x\n")), HasSubstr("before the first element"));
    EXPECT_THAT(ply_complaint(header("ascii", "element vertex 1\nproperty quad x\n")),
                HasSubstr("type 'quad'"));
    EXPECT_THAT(ply_complaint(header("ascii", "element vertex 1\nproperty int x\nproperty int x\n")),
                HasSubstr("twice"));
    EXPECT_THAT(
        ply_complaint(header("ascii", "element vertex 1\nproperty int x\nproperty int y\n") + "1 2\n"),
        HasSubstr("no number 'z'"));
    EXPECT_THAT(ply_complaint(header("ascii", "element vertex 0\n" + float_vertices)),
                HasSubstr("no triangles"));
    EXPECT_THAT(ply_complaint(ascii_square("3 0 1 4\n")),
                HasSubstr("the-file:15: face corner 4 is out of range: there are 4"));
    EXPECT_THAT(ply_complaint(ascii_square("3 0 1 -1\n")), HasSubstr("face corner -1"));
    EXPECT_THAT(ply_complaint(ascii_square("2 0 1\n")), HasSubstr("a face has 2 corners"));
    EXPECT_THAT(ply_complaint(ascii_square("3 0 1\n")), HasSubstr("ends within a face"));
    EXPECT_THAT(ply_complaint(ascii_square("3 0 1 2\n3 0 1 2\n")), HasSubstr("'3' follows the last element"));
    EXPECT_THAT(ply_complaint(ascii_square("3 0 1 2\n", "2")), HasSubstr("ends within"));
    EXPECT_THAT(ply_complaint(ascii_square("3 0 1 2\n", "1000000000000")),
                HasSubstr("claims 1000000000000 of element 'face'"));
    EXPECT_THAT(ply_complaint(ascii_square("1000000000 0 1 2\n")), HasSubstr("length 1000000000"));
    EXPECT_THAT(ply_complaint(header("ascii", "element vertex 1\n" + float_vertices) + "0 inf 0\n"),
                HasSubstr("'inf'"));
}

TEST(ReadPly, BinaryErrorsNameTheByte) {
    const std::string good = binary_box(false, "float", "uint8", "int");
    EXPECT_NO_THROW(read_ply(good));
    EXPECT_NO_THROW(read_ply(good + "\n"));
    EXPECT_THAT(ply_complaint(good + "x"), HasSubstr("bytes behind the last element"));
    EXPECT_THAT(ply_complaint(good.substr(0, good.size() - 1)),
                HasSubstr(" at byte " + std::to_string(good.size() - 4)));
    std::string wrong = good;
    wrong[good.size() - 4] = 8;
    EXPECT_THAT(ply_complaint(wrong), HasSubstr("face corner 8 is out of range: there are 8"));
    const std::string claim = header("binary_little_endian", "element vertex 4000000000\n" + float_vertices +
                                                                 "element face 1\n" + int_faces);
    EXPECT_THAT(ply_complaint(claim + "0123456789ab"), HasSubstr("the-file:4: the header claims 4000000000"));
}

TEST(ReadSurface, AttributesAreOptionalAndCheckedOnlyThere) {
    const std::string plain = ascii_square("3 0 1 2\n");
    const geometry::SurfaceMesh surface = read_surface_from_memory(bytes_of(plain), "the-file");
    EXPECT_TRUE(surface.normals.empty() && surface.vertex_piece.empty() && surface.triangle_origin.empty());
    const auto with_origin = [](const std::string& origin) {
        return header("ascii", "element vertex 4\n" + float_vertices + "element face 2\n" + int_faces +
                                   "property uchar origin\n") +
               square + "4 0 1 2 3 1\n3 0 1 2 " + origin + "\n";
    };
    const std::string odd = with_origin("7");
    EXPECT_EQ(read_ply(odd).triangles.size(), 3U);
    EXPECT_THROW(read_surface_from_memory(bytes_of(odd), "the-file"), InputError);
    using geometry::Origin;
    const std::string good = with_origin("0");
    EXPECT_EQ(read_surface_from_memory(bytes_of(good), "the-file").triangle_origin,
              (std::vector<Origin>{Origin::cut, Origin::cut, Origin::boundary}));
}
