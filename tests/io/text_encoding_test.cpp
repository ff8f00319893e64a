// Marks that text editors put before a text.
#include <gmock/gmock.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/write_mesh.h>

#include "mesh_samples.h"

#include <filesystem>
#include <fstream>

namespace splitcubes::io {
namespace {

using ::testing::HasSubstr;

const std::string mark = "\xEF\xBB\xBF";

const std::string triangle_stl =
    "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    "endsolid x\n";
const std::string triangle_obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const std::string triangle_ply =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

TEST(TextEncoding, AByteOrderMarkChangesNothing) {
    for (const auto& [format, text] : {std::pair{MeshFormat::obj, triangle_obj},
                                       {MeshFormat::stl, triangle_stl},
                                       {MeshFormat::ply, triangle_ply}}) {
        ReadMeshReport plain, marked;
        const geometry::TriangleMesh mesh = read_mesh_from_memory(bytes_of(text), format, "f", &plain);
        const geometry::TriangleMesh same =
            read_mesh_from_memory(bytes_of(mark + text), format, "f", &marked);
        ASSERT_EQ(mesh.triangles.size(), 1U);
        EXPECT_EQ(same.positions, mesh.positions);
        EXPECT_EQ(same.triangles, mesh.triangles);
        EXPECT_EQ(marked.notes, plain.notes);
        EXPECT_EQ(format_of_content(bytes_of(mark + text)), format);
    }
}

TEST(TextEncoding, TheFirstVertexAndTheFirstMaterialAreRead) {
    const auto folder = std::filesystem::temp_directory_path() / "splitcubes-text-encoding";
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "a.mtl") << mark << "newmtl wood\nKd 1 0 0\n";
    std::ofstream(folder / "a.obj") << mark << "mtllib a.mtl\nusemtl wood\n" << triangle_obj;
    const Model model = read_model(folder / "a.obj");
    std::filesystem::remove_all(folder);
    ASSERT_EQ(model.attributes.materials.size(), 1U);
    EXPECT_EQ(model.attributes.materials[0].name, "wood");
    EXPECT_EQ(model.attributes.materials[0].colour[1], 0);
}

TEST(TextEncoding, LinesAreCountedAsBefore) {
    EXPECT_THAT(complaint(mark + "v 0 0 x\n", MeshFormat::obj), HasSubstr(":1"));
}

TEST(TextEncoding, ABinaryStlMayBeginWithTheBytesOfAMark) {
    std::string stl = mark;
    stl.resize(80, ' ');
    put(stl, std::uint32_t{1});
    for (const float x : {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0}) put(stl, x);
    put(stl, std::uint16_t{0});
    EXPECT_EQ(read_mesh_from_memory(bytes_of(stl), MeshFormat::stl, "f").triangles.size(), 1U);
    stl[0] = '\xFF';
    stl[1] = '\xFE';
    EXPECT_EQ(read_mesh_from_memory(bytes_of(stl), MeshFormat::stl, "f").triangles.size(), 1U);
}

TEST(TextEncoding, Utf16IsNamed) {
    for (const std::string start : {"\xFF\xFE", "\xFE\xFF"})
        for (const MeshFormat format : {MeshFormat::obj, MeshFormat::stl, MeshFormat::ply, MeshFormat::gltf})
            EXPECT_THAT(complaint(start + "v x", format), HasSubstr("UTF-16"));
}

}  // namespace
}  // namespace splitcubes::io
