// Texture coordinates, colours and materials: read, and written so that they come back.
#include <gmock/gmock.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/read_surface.h>
#include <splitcubes/io/write_mesh.h>

#include <algorithm>
#include <cmath>

#include "gltf_samples.h"

using namespace splitcubes;
using namespace splitcubes::io;
using geometry::MeshAttributes;
using geometry::Rgba;
using geometry::SurfaceMesh;
using geometry::Uv;
using ::testing::Contains;
using ::testing::HasSubstr;

namespace {

Model read_obj_text(const std::string& text, ReadMeshReport* report = nullptr) {
    return read_model_from_memory(bytes_of(text), MeshFormat::obj, "the-file", report);
}

/// Contents of one triangle, independent of the order of triangles and vertices in the file.
struct Face {
    std::vector<std::array<double, 9>> corners;  // position, uv, colour; from the least on
    std::string material;
    auto operator<=>(const Face&) const = default;
};

std::vector<Face> faces_of(const geometry::TriangleMesh& mesh, const MeshAttributes& a, bool single) {
    std::vector<Face> faces;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        Face& face = faces.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            auto& corner = face.corners.emplace_back();
            const Vec3& p = mesh.positions[mesh.triangles[t][k]];
            for (std::size_t i = 0; i < 3; ++i) {
                const double x = p[static_cast<Eigen::Index>(i)];
                corner[i] = single ? static_cast<double>(static_cast<float>(x)) : x;
            }
            if (!a.corner_uv.empty())
                for (std::size_t i = 0; i < 2; ++i) corner[3 + i] = static_cast<double>(a.corner_uv[t][k][i]);
            // To a third of a byte's step: GLB stores another scale.
            if (!a.corner_colour.empty())
                for (std::size_t i = 0; i < 4; ++i)
                    corner[5 + i] = std::round(765 * static_cast<double>(a.corner_colour[t][k][i]));
        }
        std::rotate(face.corners.begin(), std::min_element(face.corners.begin(), face.corners.end()),
                    face.corners.end());
        if (!a.triangle_material.empty() && a.triangle_material[t] >= 0)
            face.material = a.materials[static_cast<std::size_t>(a.triangle_material[t])].name;
    }
    std::sort(faces.begin(), faces.end());
    return faces;
}

/// A model as a file holds one: no origins, pieces or rest.
SurfaceMesh model_surface(std::uint64_t seed) {
    SurfaceMesh surface;
    const SurfaceMesh all = textured_surface(seed);
    surface.mesh = all.mesh;
    surface.attributes = all.attributes;
    return surface;
}

const std::string four = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
const std::string picture = "\x89PNG, say, of seventeen bytes";

}  // namespace

TEST(Attributes, ComeBackFromEveryFormatThatHoldsThem) {
    const TemporaryFolder folder;
    for (std::uint64_t seed = 0; seed < 7; ++seed)
        for (const char* name : {"a.obj", "a.ply", "a.glb"}) {
            SurfaceMesh surface = model_surface(seed);
            // Each combination, as the arrays may be empty.
            MeshAttributes& a = surface.attributes;
            if (seed & 1) a.corner_uv.clear();
            if (seed & 2) a.corner_colour.clear();
            if (seed & 4) {
                a.triangle_material.clear();
                a.materials.clear();
            }
            write_mesh(folder.path() / name, surface);
            const Model again = read_model(folder.path() / name);
            const bool single = std::string(name) == "a.glb";
            EXPECT_EQ(faces_of(again.mesh, again.attributes, single), faces_of(surface.mesh, a, single))
                << name << " " << seed;
            EXPECT_EQ(again.attributes.materials, a.materials) << name;
        }
}

TEST(Attributes, PlyKeepsThemInOrderWithTheSurface) {
    const TemporaryFolder folder;
    const SurfaceMesh surface = textured_surface(3);
    write_mesh(folder.path() / "a.ply", surface);
    const SurfaceMesh again = read_surface(folder.path() / "a.ply");
    EXPECT_EQ(again.mesh.triangles, surface.mesh.triangles);
    EXPECT_EQ(again.rest, surface.rest);
    EXPECT_EQ(again.attributes.corner_uv, surface.attributes.corner_uv);
    EXPECT_EQ(again.attributes.triangle_material, surface.attributes.triangle_material);
    EXPECT_EQ(again.attributes.materials, surface.attributes.materials);
}

TEST(Attributes, WithoutThemFilesStayAsTheyWere) {
    SurfaceMesh surface = box_surface(5);
    const std::string ply = encode_mesh(surface, MeshFormat::ply, "a");
    EXPECT_EQ(ply.substr(0, ply.find("end_header")),
              "ply\nformat binary_little_endian 1.0\ncomment splitcubes surface, metres\n"
              "element vertex 8\nproperty double x\nproperty double y\nproperty double z\n"
              "property float nx\nproperty float ny\nproperty float nz\nproperty int piece\n"
              "element face 12\nproperty list uchar int vertex_indices\nproperty uchar origin\n");
    const std::string obj = encode_mesh(surface, MeshFormat::obj, "a");
    for (const char* none : {"vt", "mtllib"}) EXPECT_EQ(obj.find(none), obj.npos);
    EXPECT_THAT(obj, HasSubstr("g boundary\nusemtl boundary\nf "));
    const std::string glb = encode_mesh(surface, MeshFormat::gltf, "a");
    for (const char* none : {"TEXCOORD", "COLOR", "_REST"}) EXPECT_EQ(glb.find(none), glb.npos);
}

TEST(Attributes, ObjCutFacesHaveTheirPlaceInTheSolid) {
    const TemporaryFolder folder;
    SurfaceMesh surface = textured_surface(8);
    surface.attributes.materials[1].name = "cut";
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
        const bool cut = surface.triangle_origin[t] == geometry::Origin::cut;
        surface.attributes.triangle_material[t] = cut ? 1 : 0;
        if (cut) surface.attributes.corner_uv[t] = {};
    }
    write_mesh(folder.path() / "a.obj", surface);
    const std::string text = folder.content("a.obj");
    EXPECT_EQ(text.find("vt "), text.find("vt"));
    std::size_t deep = 0;
    for (std::size_t at = text.find("\nvt "); at != text.npos; at = text.find("\nvt ", at + 1)) {
        const std::string line = text.substr(at + 4, text.find('\n', at + 1) - at - 4);
        deep += std::count(line.begin(), line.end(), ' ') == 2;
    }
    EXPECT_GT(deep, 2U);
    // These are no texture coordinates of a picture.
    const Model again = read_model(folder.path() / "a.obj");
    EXPECT_EQ(faces_of(again.mesh, again.attributes, false),
              faces_of(surface.mesh, surface.attributes, false));
}

TEST(Attributes, ObjTakesWhatOtherProgramsWrite) {
    const TemporaryFolder folder;
    folder.write("two words.mtl",
                 "# c\nKd 9 9 9\nnewmtl red skin\n  Kd 1 0.25 0\nmap_Kd -s 2 2 -clamp on sub\\a b.png\n"
                 "newmtl glass\nKd 0 x 0\nd 0.5\n");
    folder.write("a.obj",
                 "mtllib two words.mtl\nvt 0 0\nvt 1 0 0\nvt 1 1\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\n"
                 "v 1 1 0 0 0 2\nv 0 1 0 0.5\nf 1/1 2/2 3/3\nusemtl red skin\nf 1/1 3/-1 4\n"
                 "usemtl glass\nusemtl nowhere\nf 1 2 4\n");
    ReadMeshReport report;
    const Model model = read_model(folder.path() / "a.obj", &report);
    const MeshAttributes& a = model.attributes;
    ASSERT_EQ(a.materials.size(), 3U);
    EXPECT_EQ(a.materials[0].name, "red skin");
    EXPECT_EQ(a.materials[0].colour, (Rgba{1, 0.25F, 0, 1}));
    EXPECT_EQ(a.materials[0].texture, (folder.path() / "sub/a b.png").string());
    EXPECT_EQ(a.materials[1].colour[3], 0.5F);
    EXPECT_EQ(a.materials[2].name, "nowhere");
    EXPECT_EQ(a.triangle_material, (std::vector<std::int32_t>{-1, 0, 2}));
    EXPECT_EQ(a.corner_uv[1], (std::array<Uv, 3>{{{0, 0}, {1, 1}, {0, 0}}}));
    EXPECT_EQ(a.corner_uv[2], (std::array<Uv, 3>{}));
    EXPECT_EQ(a.corner_colour[0], (std::array<Rgba, 3>{{{1, 0, 0, 1}, {0, 1, 0, 1}, {0, 0, 1, 1}}}));
    EXPECT_EQ(a.corner_colour[2][2], (Rgba{1, 1, 1, 1}));
    EXPECT_THAT(report.notes, Contains(HasSubstr("1 statements of the material library")));
    EXPECT_THAT(report.notes, Contains(HasSubstr("texture 'sub/a b.png' is not there")));
}

TEST(Attributes, WhatIsNotThereIsANoteAndKeepsItsName) {
    const TemporaryFolder folder;
    ReadMeshReport report;
    folder.write("a.obj", "mtllib none.mtl ../secret.mtl\n" + four + "usemtl bark\nf 1 2 3 4\n");
    const Model model = read_model(folder.path() / "a.obj", &report);
    EXPECT_EQ(model.attributes.materials.at(0).name, "bark");
    EXPECT_EQ(model.attributes.triangle_material, (std::vector<std::int32_t>{0, 0}));
    EXPECT_THAT(report.notes, Contains(HasSubstr("'none.mtl' was not read")));
    EXPECT_THAT(report.notes, Contains(HasSubstr("'../secret.mtl' was not read: it lies outside")));
}

TEST(Attributes, NumbersThatLieAreRefusedWithTheirLine) {
    EXPECT_THAT(complaint(four + "vt 0 0\nf 1/1 2/2 3/1\n", MeshFormat::obj),
                HasSubstr("the-file:6: texture coordinate 2 is out of range: there are 1"));
    EXPECT_THAT(complaint(four + "vt 0 0\nf 1/1 2/-2 3/1\n", MeshFormat::obj),
                HasSubstr("the-file:6: texture coordinate -2 is out of range"));
    EXPECT_THAT(complaint(four + "f 1/-1 2/1 3/1\nvt 0 0\n", MeshFormat::obj),
                HasSubstr("the-file:5: texture coordinate -1 is out of range"));
    EXPECT_THAT(complaint("vt\n" + four + "f 1 2 3\n", MeshFormat::obj), HasSubstr("the-file:1:"));
    EXPECT_THAT(complaint("vt 1e39 0\n" + four + "f 1 2 3\n", MeshFormat::obj), HasSubstr("the-file:1:"));
    // They may follow, though.
    EXPECT_EQ(read_obj_text("f 1/1 2/2 3/1\nvt 0 0\nvt 0 1\n" + four).attributes.corner_uv[0][1], (Uv{0, 1}));
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar float texcoord\nproperty int material\n"
        "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
    EXPECT_THAT(complaint(head + "5 0 0 1 1 0 0 3 0 1 2\n", MeshFormat::ply),
                HasSubstr("texcoord of 5 numbers"));
    EXPECT_THAT(complaint(head + "6 0 0 1 1 0 1e39 0 3 0 1 2\n", MeshFormat::ply), HasSubstr("the-file:15"));
    EXPECT_THAT(complaint(head + "0 -2 3 0 1 2\n", MeshFormat::ply), HasSubstr("material is -2"));
    GltfSample sample = box_sample();
    sample.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] =
        sample.add_accessor(std::vector<float>(14), 5126, "VEC2", 2);
    EXPECT_THAT(complaint(sample.glb(), MeshFormat::gltf), HasSubstr("TEXCOORD_0: has 7 elements for 8"));
    sample = box_sample();
    sample.json["meshes"][0]["primitives"][0]["material"] = 0;
    EXPECT_THAT(complaint(sample.glb(), MeshFormat::gltf), HasSubstr("materials[0] but there are 0"));
}

TEST(Attributes, PlyTakesWhatOtherProgramsWrite) {
    const std::string text =
        "ply\nformat ascii 1.0\ncomment TextureFile one.png\ncomment TextureFile two.png\n"
        "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float texture_u\n"
        "property float texture_v\nelement face 2\nproperty list uchar int vertex_indices\n"
        "property int texnumber\nend_header\n0 0 0 255 0 51 0 0\n1 0 0 0 0 0 1 0\n1 1 0 0 0 0 1 1\n"
        "0 1 0 0 0 0 0.5 0.25\n4 0 1 2 3 1\n3 0 2 3 -1\n";
    const MeshAttributes a = read_model_from_memory(bytes_of(text), MeshFormat::ply, "the-file").attributes;
    EXPECT_EQ(a.triangle_material, (std::vector<std::int32_t>{1, 1, -1}));
    EXPECT_EQ(a.materials.at(1).texture, "two.png");
    EXPECT_EQ(a.materials.at(1).name, "two");
    EXPECT_EQ(a.corner_colour[0][0], (Rgba{1, 0, 0.2F, 1}));
    EXPECT_EQ(a.corner_uv[1][2], (Uv{0.5F, 0.25F}));
}

TEST(Attributes, GltfHasItsPicturesUpsideDownAndItsColoursLinear) {
    GltfSample sample = box_sample();
    nlohmann::json& primitive = sample.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["TEXCOORD_1"] = sample.add_accessor(
        std::vector<std::uint8_t>{255, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255}, 5121, "VEC2", 2);
    sample.json["accessors"].back()["normalized"] = true;
    primitive["attributes"]["COLOR_0"] =
        sample.add_accessor(std::vector<float>(24, 0.2140411F), 5126, "VEC3", 3);
    primitive["material"] = 0;
    sample.json["materials"] = {
        {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}, {"texCoord", 1}}}}}}};
    sample.json["textures"] = {{{"source", 0}}};
    sample.json["images"] = {{{"uri", "a%20b.png"}}};
    const Model model = read_model_from_memory(bytes_of(sample.glb()), MeshFormat::gltf, "the-file");
    for (std::size_t t = 0; t < 12; ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t v = model.mesh.triangles[t][k];
            EXPECT_EQ(model.attributes.corner_uv[t][k], (Uv{v == 0 ? 1.0F : 0.0F, v == 7 ? 0.0F : 1.0F}));
            EXPECT_NEAR(model.attributes.corner_colour[t][k][1], 0.5, 1e-5);
        }
    EXPECT_EQ(model.attributes.materials.at(0).texture, "a b.png");
}

TEST(Attributes, PicturesInsideOfAFileGoBackInOrIntoFilesOfTheirOwn) {
    const TemporaryFolder folder;
    SurfaceMesh surface = model_surface(2);
    const auto bytes = bytes_of(picture);
    const auto image = std::make_shared<geometry::EmbeddedImage>(
        geometry::EmbeddedImage{"image/png", {bytes.begin(), bytes.end()}});
    for (const std::size_t k : {0U, 2U}) {
        surface.attributes.materials[k].texture = "skin.png";
        surface.attributes.materials[k].image = image;
    }
    write_mesh(folder.path() / "a.glb", surface);
    const Model again = read_model(folder.path() / "a.glb");
    EXPECT_EQ(again.attributes.materials, surface.attributes.materials);
    // Both materials share the one picture.
    const std::string glb = folder.content("a.glb");
    EXPECT_EQ(glb.find(picture), glb.rfind(picture));
    for (const char* name : {"b.obj", "c.ply"}) {
        write_mesh(folder.path() / name, surface);
        const std::string file = std::string(1, name[0]) + "-skin.png";
        EXPECT_EQ(folder.content(file), picture);
        ReadMeshReport report;
        const MeshAttributes a = read_model(folder.path() / name, &report).attributes;
        EXPECT_EQ(a.materials.at(2).texture, (folder.path() / file).string());
        EXPECT_TRUE(report.notes.empty());
    }
    EXPECT_EQ(folder.file_count(), 6U);  // a.glb, b.obj, b.mtl, b-skin.png, c.ply, c-skin.png
}

TEST(Attributes, ALibraryOfSomebodyElseIsNotReplaced) {
    const TemporaryFolder folder;
    SurfaceMesh surface = model_surface(5);
    for (const char* content : {"newmtl mine\n", "# splitcubes", ""}) {
        folder.write("a.mtl", content);
        EXPECT_THROW(write_mesh(folder.path() / "a.obj", surface), InputError);
        EXPECT_EQ(folder.content("a.mtl"), content);
        EXPECT_EQ(folder.file_count(), 1U);
    }
    std::filesystem::remove(folder.path() / "a.mtl");
    write_mesh(folder.path() / "a.obj", surface);
    const std::string first = folder.content("a.mtl");
    surface.attributes.materials[0].colour[0] = 0.125F;
    write_mesh(folder.path() / "a.obj", surface);
    EXPECT_NE(folder.content("a.mtl"), first);
}

TEST(Attributes, APictureTakesNoOtherFilesPlace) {
    const TemporaryFolder folder;
    geometry::Material skin{.name = "skin", .texture = "skin.png", .image = nullptr};
    const auto bytes = bytes_of(picture);
    skin.image = std::make_shared<const geometry::EmbeddedImage>(
        geometry::EmbeddedImage{"image/png", {bytes.begin(), bytes.end()}});
    for (const char* name : {"a.obj", "a.ply"}) {
        SurfaceMesh surface = model_surface(5);
        surface.attributes.materials[0] = skin;
        folder.write("a-skin.png", "somebody's");
        std::filesystem::remove(folder.path() / "a-skin-2.png");
        std::filesystem::create_directories(folder.path() / "a-skin-1.png");
        for (int again = 0; again < 2; ++again) {
            write_mesh(folder.path() / name, surface);
            EXPECT_EQ(folder.content("a-skin.png"), "somebody's");
            EXPECT_EQ(folder.content("a-skin-2.png"), picture);
            EXPECT_FALSE(std::filesystem::exists(folder.path() / "a-skin-3.png"))
                << "that of before is the same";
            EXPECT_EQ(read_model(folder.path() / name).attributes.materials[0].texture,
                      (folder.path() / "a-skin-2.png").generic_string());
        }
        // Another picture is another file.
        auto other = std::make_shared<geometry::EmbeddedImage>(*skin.image);
        other->bytes.back() = std::byte{7};
        surface.attributes.materials[0].image = other;
        write_mesh(folder.path() / name, surface);
        EXPECT_EQ(folder.content("a-skin-2.png"), picture);
        EXPECT_NE(folder.content("a-skin-3.png"), picture);
        std::filesystem::remove(folder.path() / "a-skin-3.png");
    }
}

TEST(Attributes, TexturesAreFoundFromAnotherFolder) {
    const TemporaryFolder folder;
    std::filesystem::create_directories(folder.path() / "in");
    std::filesystem::create_directories(folder.path() / "out");
    folder.write("in/t.png", picture);
    SurfaceMesh surface = model_surface(4);
    surface.attributes.materials[0].texture = (folder.path() / "in/t.png").string();
    for (const char* name : {"out/a.obj", "out/a.ply", "out/a.glb"}) {
        write_mesh(folder.path() / name, surface);
        ReadMeshReport report;
        EXPECT_EQ(read_model(folder.path() / name, &report).attributes.materials,
                  surface.attributes.materials);
        EXPECT_TRUE(report.notes.empty());
    }
    EXPECT_THAT(folder.content("out/a.mtl"), HasSubstr("map_Kd ../in/t.png\n"));
}

TEST(Attributes, NamesThatClashOrBreakLinesAreMadeGood) {
    SurfaceMesh surface = model_surface(6);
    surface.attributes.materials[0].name = "a";
    surface.attributes.materials[1].name = "a";
    surface.attributes.materials[2].name = " b\nc ";
    const std::string ply = encode_mesh(surface, MeshFormat::ply, "x");
    EXPECT_THAT(ply, HasSubstr("comment material 0 0.5 0.25 1 1 a\n"));
    EXPECT_THAT(ply, HasSubstr(" a_1\n"));
    EXPECT_THAT(ply, HasSubstr(" b_c\n"));
}

TEST(Attributes, ArraysThatDoNotFitAreNotWritten) {
    const SurfaceMesh good = textured_surface(1);
    EXPECT_NO_THROW(encode_mesh(good, MeshFormat::ply, "x"));
    const auto refused = [](const SurfaceMesh& surface) {
        for (const MeshFormat format : {MeshFormat::obj, MeshFormat::ply, MeshFormat::gltf})
            EXPECT_THROW(encode_mesh(surface, format, "x"), InputError);
    };
    SurfaceMesh bad = good;
    bad.attributes.corner_uv.pop_back();
    refused(bad);
    bad = good;
    bad.attributes.corner_colour.pop_back();
    refused(bad);
    bad = good;
    bad.rest.pop_back();
    refused(bad);
    bad = good;
    bad.attributes.triangle_material[3] = 3;
    refused(bad);
    bad = good;
    bad.attributes.corner_uv[2][1][0] = std::nanf("");
    refused(bad);
}
