#include <gmock/gmock.h>
#include <splitcubes/io/read_mesh.h>

#include <locale>

#include "mesh_samples.h"

using namespace splitcubes;
using namespace splitcubes::io;
using ::testing::HasSubstr;

namespace {

geometry::TriangleMesh read_obj(const std::string& text, ReadMeshReport* report = nullptr) {
    return read_mesh_from_memory(bytes_of(text), MeshFormat::obj, "the-file", report);
}
std::string obj_complaint(const std::string& text) {
    return io::complaint(text, MeshFormat::obj);
}

const std::string four_corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

}  // namespace

TEST(ReadObj, EveryWayToWriteAFaceGivesTheSameMesh) {
    const geometry::TriangleMesh plain = read_obj(four_corners + "f 1 2 3\nf 1 3 4\n");
    ASSERT_EQ(plain.triangles.size(), 2U);
    for (const std::string faces :
         {"f 1 2 3 4\n", "f 1/1 2/1 3/1 4/1\n", "f 1//1 2//1 3//1 4//1\n", "f 1/1/1 2/2/2 3/3/3 4/4/4\n",
          "f -4 -3 -2 -1\n", "f 1 2 \\\n 3 4\n", "f 1 2\\\r\n 3 4\r\n", "f\t1  2 3\t4   # a comment\n",
          "f -4/-1/-1 2/7 3//9 -1", "g x\nusemtl y\ns off\nf 1 2 3 4"}) {
        const geometry::TriangleMesh mesh = read_obj(four_corners + faces);
        EXPECT_EQ(mesh.positions, plain.positions) << faces;
        EXPECT_EQ(mesh.triangles, plain.triangles) << faces;
    }
}

TEST(ReadObj, LineEndsDoNotMatter) {
    const std::string unix_text = "# c\n" + four_corners + "\nf 1 2 3\n";
    for (const std::string end : {"\r\n", "\r"}) {
        std::string text;
        for (const char c : unix_text) text += c == '\n' ? end : std::string(1, c);
        EXPECT_EQ(read_obj(text).triangles, read_obj(unix_text).triangles);
        EXPECT_THAT(obj_complaint(text + "f 1 2 9" + end), HasSubstr("the-file:8: face corner 9"));
    }
}

TEST(ReadObj, NegativeIndicesCountBackFromTheirOwnLine) {
    const geometry::TriangleMesh mesh =
        read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 1\nf -3 -2 -1\n");
    EXPECT_EQ(mesh.triangles[0], (geometry::Triangle{0, 1, 2}));
    EXPECT_EQ(mesh.triangles[1], (geometry::Triangle{1, 2, 3}));
}

TEST(ReadObj, VerticesMayFollowFaces) {
    EXPECT_EQ(read_obj("f 1 2 3\n" + four_corners).triangles, read_obj(four_corners + "f 1 2 3\n").triangles);
    EXPECT_THAT(obj_complaint("f 1 2 5\n" + four_corners),
                HasSubstr("the-file:1: face corner 5 is out of range: there are 4"));
}

TEST(ReadObj, NumbersAreReadToTheLastBit) {
    const geometry::TriangleMesh mesh =
        read_obj("v 0.1 -1e-3 +2.5E2\nv 5e-324 1e-999 999999999.9999999\nv 0 1 0 0.5 0.5 0.5\nf 1 2 3\n");
    EXPECT_EQ(mesh.positions[0], Vec3(0.1, -1e-3, 250));
    EXPECT_EQ(mesh.positions[1], Vec3(5e-324, 0, 999999999.9999999));
    EXPECT_EQ(mesh.positions[2], Vec3(0, 1, 0));
}

TEST(ReadObj, TheGlobalLocaleDoesNotMatter) {
    struct Comma : std::numpunct<char> {
        char do_decimal_point() const override { return ','; }
    };
    const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Comma));
    const geometry::TriangleMesh mesh = read_obj("v 0.5 0 0\nv 1 0 0\nv 0 1.25 0\nf 1 2 3\n");
    std::locale::global(before);
    EXPECT_EQ(mesh.positions[0][0], 0.5);
    EXPECT_EQ(mesh.positions[2][1], 1.25);
}

TEST(ReadObj, RepeatedIndicesAreLeftOutAndNoted) {
    ReadMeshReport report;
    const geometry::TriangleMesh mesh = read_obj(four_corners + "f 1 2 3\nf 1 1 2\nf 1 2 2 3 4\n", &report);
    EXPECT_EQ(mesh.triangles.size(), 3U);
    EXPECT_THAT(report.notes, ::testing::Contains(HasSubstr("2 triangles that use a vertex twice")));
    EXPECT_THAT(report.notes, ::testing::Contains(HasSubstr("1 polygons")));
    EXPECT_THAT(obj_complaint(four_corners + "f 1 1 2\n"), HasSubstr("every triangle uses a vertex twice"));
}

TEST(ReadObj, UnknownStatementsAreNoted) {
    ReadMeshReport report;
    read_obj(four_corners + "ff 1 2 3\nf 1 2 3\nff 1 2 4\n", &report);
    ASSERT_EQ(report.notes.size(), 1U);
    EXPECT_THAT(report.notes[0], HasSubstr("2 unknown statements"));
    EXPECT_THAT(report.notes[0], HasSubstr("'ff' in line 5"));
}

TEST(ReadObj, SaysWhereAndWhatIsWrong) {
    EXPECT_THAT(obj_complaint(""), HasSubstr("is empty"));
    EXPECT_THAT(obj_complaint("# nothing\n"), HasSubstr("no triangles (0 vertices)"));
    EXPECT_THAT(obj_complaint(four_corners), HasSubstr("no triangles (4 vertices)"));
    EXPECT_THAT(obj_complaint("v 0 0 0\nv 1 nan 0\n"),
                HasSubstr("the-file:2: 'nan' is not a finite number (y)"));
    EXPECT_THAT(obj_complaint("v inf 0 0\n"), HasSubstr("'inf' is not a finite"));
    EXPECT_THAT(obj_complaint("v 0 0 1e999\n"), HasSubstr("'1e999' is not a finite number (z)"));
    EXPECT_THAT(obj_complaint("v 0 0x10 0\n"), HasSubstr("'0x10' is not a number (y)"));
    EXPECT_THAT(obj_complaint("v 1,5 0 0\n"), HasSubstr("'1,5' is not a number"));
    EXPECT_THAT(obj_complaint("v 0 0\nv 0 0 0\n"), HasSubstr("the-file:1: a number for z is missing"));
    EXPECT_THAT(obj_complaint(four_corners + "f 1 2\n"), HasSubstr("the-file:5: a face has 2 corners"));
    EXPECT_THAT(obj_complaint(four_corners + "f 1 2 0\n"),
                HasSubstr("face corner 0 is out of range: there are 4 vertices"));
    EXPECT_THAT(obj_complaint(four_corners + "f 1 2 -5\n"), HasSubstr("face corner -5 is out of range"));
    EXPECT_THAT(obj_complaint(four_corners + "f 1 2 99999999999999999999\n"),
                HasSubstr("'99999999999999999999'"));
    EXPECT_THAT(obj_complaint(four_corners + "f 1 2 4294967297\n"),
                HasSubstr("face corner 4294967297 is out of range"));
    EXPECT_THAT(obj_complaint(four_corners + "f 1 2 3.5\n"), HasSubstr("'3.5'"));
    EXPECT_THAT(obj_complaint(four_corners + "f 1/ 2 3\n"), HasSubstr("'1/'"));
    EXPECT_THAT(obj_complaint(four_corners + "f 1/1/1/1 2 3\n"), HasSubstr("'1/1/1/1'"));
    EXPECT_THAT(obj_complaint(four_corners + "f 1 2 3\n\x01\x02 2\n"),
                HasSubstr("the-file:6: '\?\?' is no OBJ statement"));
}

TEST(ReadMesh, GoesByTheExtensionAndElseByTheContent) {
    const TemporaryFolder folder;
    const std::string text = four_corners + "f 1 2 3\n";
    for (const char* name : {"a.obj", "a.OBJ", "a.Obj", "a.mesh", "a"})
        EXPECT_EQ(read_mesh(folder.write(name, text)).triangles.size(), 1U) << name;
    EXPECT_THROW(read_mesh(folder.write("a.ply", text)), InputError);
    EXPECT_THROW(read_mesh(folder.write("b.mesh", "hello")), InputError);
    EXPECT_THROW(read_mesh(folder.write("c.obj", "")), InputError);
    EXPECT_THROW(read_mesh(folder.path() / "none.obj"), InputError);
    EXPECT_THROW(read_mesh(folder.path()), InputError);
}
