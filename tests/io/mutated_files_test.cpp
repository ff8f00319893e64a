// Damaged files of every format, made from valid ones: each either reads as a
// mesh that keeps the readers' promises or gives an InputError of one line.
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/read_surface.h>
#include <splitcubes/io/write_mesh.h>

#include <cmath>

#include "gltf_samples.h"

using namespace splitcubes;
using namespace splitcubes::io;

namespace {

struct Sample {
    MeshFormat format;
    std::string content;
};

std::vector<Sample> valid_files() {
    const geometry::SurfaceMesh surface = box_surface(11);
    std::vector<Sample> samples;
    for (const MeshFormat format : {MeshFormat::obj, MeshFormat::ply, MeshFormat::stl, MeshFormat::gltf})
        samples.push_back({format, encode_mesh(surface, format, "sample")});
    const geometry::SurfaceMesh textured = textured_surface(12);
    for (const MeshFormat format : {MeshFormat::obj, MeshFormat::ply, MeshFormat::gltf})
        samples.push_back({format, encode_mesh(textured, format, "sample")});
    samples.push_back(
        {MeshFormat::ply,
         "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
         "property int piece\nelement face 1\nproperty list uchar int vertex_indices\nproperty uchar origin\n"
         "end_header\n0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2 1\n"});
    samples.push_back({MeshFormat::stl,
                       "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                       "endloop\nendfacet\nendsolid s\n"});
    samples.push_back(
        {MeshFormat::obj, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2//1 -2/1 \\\n4\n"});
    GltfSample gltf = box_sample();
    gltf.json["nodes"] = {{{"mesh", 0}, {"children", {1}}, {"scale", {1, 2, -3}}},
                          {{"mesh", 0}, {"rotation", {0, 0, 0, 1}}}};
    gltf.json["scenes"] = {{{"nodes", {0}}}};
    samples.push_back({MeshFormat::gltf, gltf.embedded()});
    samples.push_back({MeshFormat::gltf, gltf.glb()});
    return samples;
}

void expect_sound(const geometry::MeshAttributes& attributes, std::size_t triangles) {
    for (const std::size_t length :
         {attributes.corner_uv.size(), attributes.corner_colour.size(), attributes.triangle_material.size()})
        ASSERT_TRUE(length == 0 || length == triangles) << length;
    for (const auto& corners : attributes.corner_uv)
        for (const geometry::Uv& uv : corners) ASSERT_TRUE(std::isfinite(uv[0]) && std::isfinite(uv[1]));
    for (const auto& corners : attributes.corner_colour)
        for (const geometry::Rgba& colour : corners)
            for (const float value : colour) ASSERT_TRUE(value >= 0 && value <= 1);
    for (const std::int32_t material : attributes.triangle_material) {
        ASSERT_GE(material, -1);
        ASSERT_LT(material, static_cast<std::int64_t>(attributes.materials.size()));
    }
}

void expect_sound(const Model& model) {
    const geometry::TriangleMesh& mesh = model.mesh;
    expect_sound(model.attributes, mesh.triangles.size());
    EXPECT_FALSE(mesh.triangles.empty());
    for (const Vec3& p : mesh.positions) ASSERT_TRUE(p.allFinite());
    for (const geometry::Triangle& t : mesh.triangles) {
        for (const std::uint32_t v : t) ASSERT_LT(v, mesh.positions.size());
        ASSERT_TRUE(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
    }
}

/// True where it could be read.
bool read_or_complain(const Sample& sample) {
    bool good = false;
    try {
        expect_sound(read_model_from_memory(bytes_of(sample.content), sample.format, "sample"));
        good = true;
    } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
    if (sample.format != MeshFormat::ply) return good;
    try {
        const geometry::SurfaceMesh surface = read_surface_from_memory(bytes_of(sample.content), "sample");
        expect_sound(surface.attributes, surface.mesh.triangles.size());
        const std::string again = encode_mesh(surface, MeshFormat::ply, "sample");
        EXPECT_EQ(read_surface_from_memory(bytes_of(again), "again").mesh.positions, surface.mesh.positions);
    } catch (const InputError&) {
    }
    return good;
}

std::string mutated(std::string text, Random& random) {
    const char* const words[] = {"-1", "0",    "4294967296", "1e999", "nan", "list",
                                 "\n", "\\\n", "/",          "{",     "]",   "\xff"};
    const std::uint32_t changes = 1 + random.below(4);
    for (std::uint32_t i = 0; i < changes && !text.empty(); ++i) {
        const std::size_t at = random.below(static_cast<std::uint32_t>(text.size()));
        const std::size_t length = random.below(9);
        switch (random.below(6)) {
            case 0:
                text[at] = static_cast<char>(random.bits());
                break;
            case 1:
                text[at] = static_cast<char>(text[at] ^ (1 << random.below(8)));
                break;
            case 2:
                text.erase(at, length);
                break;
            case 3:
                text.insert(at, text.substr(random.below(static_cast<std::uint32_t>(text.size())), length));
                break;
            case 4:
                text.replace(at, length, words[random.below(std::size(words))]);
                break;
            default:
                text.resize(at);
                break;
        }
    }
    return text;
}

}  // namespace

TEST(MutatedFiles, EveryTruncationIsRefusedOrSound) {
    for (const Sample& sample : valid_files()) {
        EXPECT_TRUE(read_or_complain(sample));
        for (std::size_t length = 0; length < sample.content.size(); ++length)
            read_or_complain({sample.format, sample.content.substr(0, length)});
    }
}

TEST(MutatedFiles, RandomDamageIsRefusedOrSound) {
    Random random(20);
    std::size_t read = 0, refused = 0;
    for (const Sample& sample : valid_files())
        for (int i = 0; i < 2000; ++i)
            ++(read_or_complain({sample.format, mutated(sample.content, random)}) ? read : refused);
    // Both ways are met often: damage that is never refused would mean that nothing is checked.
    EXPECT_GT(read, 500U);
    EXPECT_GT(refused, 500U);
}

TEST(MutatedFiles, AFileOfAnotherFormatIsRefused) {
    const std::vector<Sample> samples = valid_files();
    for (const Sample& sample : samples) {
        for (const MeshFormat format :
             {MeshFormat::obj, MeshFormat::ply, MeshFormat::stl, MeshFormat::gltf}) {
            if (format == sample.format) continue;
            EXPECT_FALSE(read_or_complain({format, sample.content}));
        }
    }
}
