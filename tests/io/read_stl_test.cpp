#include <gmock/gmock.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/io/read_mesh.h>

#include <limits>

#include "mesh_samples.h"

using namespace splitcubes;
using namespace splitcubes::io;
using ::testing::HasSubstr;

namespace {

geometry::TriangleMesh read_stl(const std::string& text, ReadMeshReport* report = nullptr) {
    return read_mesh_from_memory(bytes_of(text), MeshFormat::stl, "the-file", report);
}
std::string stl_complaint(const std::string& text) {
    return io::complaint(text, MeshFormat::stl);
}

std::string binary_stl(const geometry::TriangleMesh& mesh, std::string title) {
    title.resize(80, ' ');
    put(title, static_cast<std::uint32_t>(mesh.triangles.size()));
    for (const geometry::Triangle& t : mesh.triangles) {
        for (int i = 0; i < 3; ++i) put(title, std::numeric_limits<float>::quiet_NaN());
        for (const std::uint32_t v : t)
            for (const double x : mesh.positions[v]) put(title, static_cast<float>(x));
        put(title, std::uint16_t{0});
    }
    return title;
}

std::string ascii_stl(const geometry::TriangleMesh& mesh) {
    std::string out = "solid a box facet of words\n";
    for (const geometry::Triangle& t : mesh.triangles) {
        out += "  facet normal nan 0 0\n    outer loop\n";
        for (const std::uint32_t v : t) {
            out += "      vertex";
            for (const double x : mesh.positions[v]) out.append(" ").append(std::to_string(x));
            out += "\n";
        }
        out += "    endloop\n  endfacet\n";
    }
    return out + "endsolid a box\n";
}

}  // namespace

TEST(ReadStl, BothFormsGiveTheClosedMesh) {
    const geometry::TriangleMesh box = box_mesh();
    // Many binary files begin with "solid": that word alone decides nothing.
    for (const std::string& file :
         {binary_stl(box, "solid box"), binary_stl(box, ""), ascii_stl(box), ascii_stl(box) + "\n\n"}) {
        const geometry::TriangleMesh mesh = read_stl(file);
        EXPECT_EQ(mesh.positions.size(), 8U);
        EXPECT_EQ(mesh.triangles.size(), 12U);
        EXPECT_TRUE(geometry::check_mesh(mesh).valid());
        EXPECT_DOUBLE_EQ(mesh.volume(), 1);
    }
}

TEST(ReadStl, SeveralSolidsAreOneMesh) {
    geometry::TriangleMesh far = box_mesh();
    for (Vec3& p : far.positions) p[0] += 3;
    EXPECT_DOUBLE_EQ(read_stl(ascii_stl(box_mesh()) + ascii_stl(far)).volume(), 2);
}

TEST(ReadStl, CollapsedTrianglesAreLeftOutAndNoted) {
    geometry::TriangleMesh mesh = box_mesh();
    mesh.positions.push_back(mesh.positions[0]);
    mesh.triangles.push_back({0, 8, 1});
    ReadMeshReport report;
    EXPECT_EQ(read_stl(binary_stl(mesh, ""), &report).triangles.size(), 12U);
    ASSERT_EQ(report.notes.size(), 1U);
    EXPECT_THAT(report.notes[0], HasSubstr("1 triangles"));
}

TEST(ReadStl, ContentTellsTheFormatWithoutAnExtension) {
    const TemporaryFolder folder;
    EXPECT_EQ(read_mesh(folder.write("a", binary_stl(box_mesh(), "solid"))).triangles.size(), 12U);
    EXPECT_EQ(read_mesh(folder.write("b", ascii_stl(box_mesh()))).triangles.size(), 12U);
}

TEST(ReadStl, SaysWhereAndWhatIsWrong) {
    const std::string binary = binary_stl(box_mesh(), "solid");
    EXPECT_THAT(stl_complaint(binary.substr(0, binary.size() - 1)),
                HasSubstr("12 triangles, which take 684 bytes, but there are 683"));
    EXPECT_THAT(stl_complaint(binary + "x"), HasSubstr("there are 685"));
    EXPECT_THAT(stl_complaint(binary_stl({}, "")), HasSubstr("no triangles"));
    EXPECT_THAT(stl_complaint("short"), HasSubstr("5 bytes"));
    std::string claim(80, ' ');
    put(claim, std::uint32_t{0xffffffff});
    EXPECT_THAT(stl_complaint(claim), HasSubstr("at byte 80: the header says 4294967295"));
    geometry::TriangleMesh endless = box_mesh();
    endless.positions[7][1] = std::numeric_limits<double>::infinity();
    EXPECT_THAT(stl_complaint(binary_stl(endless, "")),
                HasSubstr("the-file at byte 224: a coordinate of triangle 2 is inf"));
    const std::string text = ascii_stl(box_mesh());
    EXPECT_THAT(stl_complaint(text.substr(0, text.rfind("endfacet"))),
                HasSubstr("the file ends where endfacet should be"));
    EXPECT_THAT(stl_complaint("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 x\n"),
                HasSubstr("the-file:4: 'x' is not a number (z)"));
    EXPECT_THAT(stl_complaint("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nendloop\n"),
                HasSubstr("the-file:5: 'endloop' stands where vertex should be"));
    EXPECT_THAT(stl_complaint("solid\nendsolid\n"), HasSubstr("no triangles"));
    EXPECT_THAT(stl_complaint("solid\nendsolid\nrubbish\n"),
                HasSubstr("'rubbish' stands where solid should be"));
}
