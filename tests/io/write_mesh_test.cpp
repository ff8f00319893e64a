#include <gmock/gmock.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/io/atomic_file.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/read_surface.h>
#include <splitcubes/io/write_mesh.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <limits>

#include "gltf_check.h"
#include "mesh_samples.h"

using namespace splitcubes;
using namespace splitcubes::io;
using geometry::Origin;
using geometry::SurfaceMesh;
using ::testing::HasSubstr;

namespace {

std::vector<geometry::Triangle> sorted(std::vector<geometry::Triangle> triangles) {
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

void expect_same(const SurfaceMesh& a, const SurfaceMesh& b) {
    EXPECT_EQ(a.mesh.positions, b.mesh.positions);
    EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
    EXPECT_EQ(a.normals, b.normals);
    EXPECT_EQ(a.vertex_piece, b.vertex_piece);
    EXPECT_EQ(a.triangle_origin, b.triangle_origin);
}

/// The JSON of a GLB and its binary chunk.
std::pair<nlohmann::json, std::string> parts_of_glb(const std::string& glb) {
    const auto word = [&](std::size_t at) {
        std::uint32_t value = 0;
        std::memcpy(&value, glb.data() + at, 4);
        return std::size_t{value};
    };
    EXPECT_EQ(word(8), glb.size());
    const std::size_t json_bytes = word(12);
    const std::string text = glb.substr(20, json_bytes);
    return {nlohmann::json::parse(text), glb.size() > 20 + json_bytes ? glb.substr(28 + json_bytes) : ""};
}

}  // namespace

TEST(WriteMesh, PlyComesBackToTheLastBit) {
    const TemporaryFolder folder;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        SurfaceMesh surface = box_surface(seed);
        surface.mesh.positions[0] = Vec3(5e-324, -0.0, 999999999.9999999);
        // Each combination of attributes, as the arrays may be empty.
        if (seed & 1) surface.normals.clear();
        if (seed & 2) surface.vertex_piece.clear();
        if (seed & 4) surface.triangle_origin.clear();
        write_mesh(folder.path() / "a.PLY", surface);
        expect_same(read_surface(folder.path() / "a.PLY"), surface);
        EXPECT_EQ(read_mesh(folder.path() / "a.PLY").triangles, surface.mesh.triangles);
    }
    EXPECT_EQ(folder.file_count(), 1U);
}

TEST(WriteMesh, ObjComesBackToTheLastBit) {
    const TemporaryFolder folder;
    SurfaceMesh surface = box_surface(7);
    surface.mesh.positions[0] = Vec3(5e-324, -0.1, 999999999.9999999);
    for (const bool normals : {true, false}) {
        if (!normals) surface.normals.clear();
        write_mesh(folder.path() / "a.obj", surface);
        const geometry::TriangleMesh mesh = read_mesh(folder.path() / "a.obj");
        EXPECT_EQ(mesh.positions, surface.mesh.positions);
        EXPECT_EQ(sorted(mesh.triangles), sorted(surface.mesh.triangles));
        const std::string text = folder.content("a.obj");
        const auto cuts =
            std::count(surface.triangle_origin.begin(), surface.triangle_origin.end(), Origin::cut);
        const std::string cut_part = text.substr(text.find("usemtl cut\n"));
        EXPECT_EQ(std::count(cut_part.begin(), cut_part.end(), 'f'), cuts);
        EXPECT_LT(text.find("usemtl boundary\n"), text.find("usemtl cut\n"));
        EXPECT_EQ(text.find("vn ") != text.npos, normals);
        EXPECT_EQ(text.find("//") != text.npos, normals);
    }
}

TEST(WriteMesh, StlHoldsTheTrianglesInSinglePrecision) {
    const TemporaryFolder folder;
    const SurfaceMesh surface = box_surface(3);
    write_mesh(folder.path() / "a.stl", surface);
    const geometry::TriangleMesh mesh = read_mesh(folder.path() / "a.stl");
    EXPECT_TRUE(geometry::check_mesh(mesh).valid());
    ASSERT_EQ(mesh.triangles.size(), 12U);
    const std::string file = folder.content("a.stl");
    EXPECT_EQ(file.size(), 84U + 12 * 50);
    for (std::size_t t = 0; t < 12; ++t) {
        Vec3 corners[3];
        for (std::size_t c = 0; c < 3; ++c) {
            const Vec3& p = surface.mesh.positions[surface.mesh.triangles[t][c]];
            corners[c] = mesh.positions[mesh.triangles[t][c]];
            EXPECT_EQ(corners[c], p.cast<float>().cast<double>());
        }
        float normal[3];
        std::memcpy(normal, file.data() + 84 + 50 * t, sizeof normal);
        const Vec3 expected = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
        EXPECT_LT((Vec3(normal[0], normal[1], normal[2]) - expected).norm(), 1e-5);
    }
}

TEST(WriteMesh, GlbHasAPrimitiveAnOriginAndTrueBounds) {
    const TemporaryFolder folder;
    const SurfaceMesh surface = box_surface(4);
    write_mesh(folder.path() / "a.glb", surface);
    const geometry::TriangleMesh mesh = read_mesh(folder.path() / "a.glb");
    EXPECT_EQ(sorted(mesh.triangles), sorted(surface.mesh.triangles));
    ASSERT_EQ(mesh.positions.size(), 8U);
    for (std::size_t v = 0; v < 8; ++v)
        EXPECT_EQ(mesh.positions[v], surface.mesh.positions[v].cast<float>().cast<double>());
    const auto [json, binary] = parts_of_glb(folder.content("a.glb"));
    ASSERT_EQ(json["meshes"][0]["primitives"].size(), 2U);
    for (const auto& primitive : json["meshes"][0]["primitives"]) {
        const auto& indices = json["accessors"][primitive["indices"].get<std::size_t>()];
        const std::string material = json["materials"][primitive["material"].get<std::size_t>()]["name"];
        const Origin origin = material == "cut" ? Origin::cut : Origin::boundary;
        EXPECT_EQ(indices["count"],
                  3 * std::count(surface.triangle_origin.begin(), surface.triangle_origin.end(), origin));
        const auto& positions = json["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
        // y is up in the file.
        const geometry::Box own = mesh.bounds();
        geometry::Box bounds;
        for (const Vec3& p : {own.min, own.max}) bounds.add(Vec3(p.x(), p.z(), -p.y()));
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_EQ(positions["min"][static_cast<std::size_t>(axis)].get<double>(), bounds.min[axis]);
            EXPECT_EQ(positions["max"][static_cast<std::size_t>(axis)].get<double>(), bounds.max[axis]);
        }
    }
    EXPECT_EQ(json["buffers"][0]["byteLength"], binary.size());
}

TEST(WriteMesh, GlbKeepsToTheSpecification) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const TemporaryFolder folder;
        for (const SurfaceMesh& surface : {box_surface(seed), textured_surface(seed), SurfaceMesh{}}) {
            write_mesh(folder.path() / "a.glb", surface);
            EXPECT_EQ(GltfCheck(folder.content("a.glb")).faults(), "") << seed;
        }
    }
}

// The check itself sees what is wrong.
TEST(WriteMesh, TheCheckOfGlbFindsFaults) {
    const TemporaryFolder folder;
    write_mesh(folder.path() / "a.glb", textured_surface(1));
    const std::string sound = folder.content("a.glb");
    const auto parts = parts_of_glb(sound);
    const nlohmann::json& json = parts.first;
    const std::string& binary = parts.second;
    const auto faults_with = [&](const char* path, const nlohmann::json& value) {
        nlohmann::json changed = json;
        changed[nlohmann::json::json_pointer(path)] = value;
        std::string text = changed.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        std::string file = "glTF";
        put(file, std::uint32_t{2});
        put(file, static_cast<std::uint32_t>(28 + text.size() + binary.size()));
        put(file, static_cast<std::uint32_t>(text.size()));
        file += "JSON" + text;
        put(file, static_cast<std::uint32_t>(binary.size()));
        file += std::string("BIN\0", 4) + binary;
        return GltfCheck(file).faults();
    };
    EXPECT_EQ(faults_with("/scene", 0), "");
    EXPECT_THAT(faults_with("/scene", 3), HasSubstr("scene does not exist"));
    EXPECT_THAT(faults_with("/accessors/0/min/1", -9), HasSubstr("other bounds"));
    EXPECT_THAT(faults_with("/accessors/0/count", 100000), HasSubstr("reaches out of its view"));
    EXPECT_THAT(faults_with("/bufferViews/0/byteLength", 1 << 30), HasSubstr("reaches out of its buffer"));
    EXPECT_THAT(faults_with("/meshes/0/primitives/0/indices", 999), HasSubstr("there is no accessors 999"));
    EXPECT_THAT(faults_with("/nodes/1", nlohmann::json::object()),
                HasSubstr("something of nodes is not used"));
    EXPECT_THAT(faults_with("/materials/0/pbrMetallicRoughness/roughnessFactor", 2),
                HasSubstr("out of bounds"));
}

TEST(WriteMesh, GlbStandsUprightAndComesBackAsItWas) {
    const TemporaryFolder folder;
    SurfaceMesh surface = box_surface(4);
    surface.rest = surface.mesh.positions;
    for (std::size_t v = 0; v < surface.rest.size(); ++v)
        surface.rest[v] += Vec3(0, 1, static_cast<double>(v));
    write_mesh(folder.path() / "a.glb", surface);
    const auto [json, binary] = parts_of_glb(folder.content("a.glb"));
    const auto& accessor =
        json["accessors"][json["meshes"][0]["primitives"][0]["attributes"]["POSITION"].get<std::size_t>()];
    const geometry::Box bounds = surface.mesh.bounds();
    EXPECT_FLOAT_EQ(accessor["max"][1].get<float>(), static_cast<float>(bounds.max.z())) << "y is up";
    EXPECT_FLOAT_EQ(accessor["max"][2].get<float>(), static_cast<float>(-bounds.min.y()));
    const SurfaceMesh again = read_any_surface(folder.path() / "a.glb");
    ASSERT_EQ(again.mesh.positions.size(), surface.mesh.positions.size());
    for (std::size_t v = 0; v < again.rest.size(); ++v)
        EXPECT_EQ(again.rest[v], surface.rest[v].cast<float>().cast<double>());
    EXPECT_EQ(again.rest.size(), surface.rest.size());
    EXPECT_TRUE(again.attributes.empty()) << "the materials stand for origins";
    EXPECT_EQ(std::count(again.triangle_origin.begin(), again.triangle_origin.end(), Origin::cut),
              std::count(surface.triangle_origin.begin(), surface.triangle_origin.end(), Origin::cut));
}

TEST(WriteMesh, PlyKeepsBodiesAndCutNumbers) {
    const TemporaryFolder folder;
    SurfaceMesh surface = box_surface(9);
    for (std::size_t v = 0; v < surface.mesh.positions.size(); ++v)
        surface.vertex_body.push_back(static_cast<std::int32_t>(v % 3));
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t)
        surface.triangle_cut.push_back(static_cast<std::int32_t>(t) - 1);
    write_mesh(folder.path() / "a.ply", surface);
    const SurfaceMesh again = read_surface(folder.path() / "a.ply");
    expect_same(again, surface);
    EXPECT_EQ(again.vertex_body, surface.vertex_body);
    EXPECT_EQ(again.triangle_cut, surface.triangle_cut);
    surface.triangle_cut.pop_back();
    try {
        write_mesh(folder.path() / "b.ply", surface);
        FAIL() << "an array of the wrong length was written";
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("11 cut numbers for 12"));
    }
}

TEST(WriteMesh, SurfacesWithoutTrianglesGiveValidFiles) {
    const TemporaryFolder folder;
    const SurfaceMesh nothing;
    for (const char* name : {"a.ply", "a.obj", "a.stl", "a.glb"}) write_mesh(folder.path() / name, nothing);
    expect_same(read_surface(folder.path() / "a.ply"), nothing);
    EXPECT_EQ(folder.content("a.stl").size(), 84U);
    const auto [json, binary] = parts_of_glb(folder.content("a.glb"));
    EXPECT_FALSE(json.contains("accessors"));
    EXPECT_TRUE(binary.empty());
    for (const char* name : {"a.ply", "a.obj", "a.stl", "a.glb"})
        EXPECT_THROW(read_mesh(folder.path() / name), InputError) << name;
}

TEST(WriteMesh, RefusesWhatNoReaderCouldTake) {
    const TemporaryFolder folder;
    const auto refused = [&](const SurfaceMesh& surface, const char* name = "a.ply") {
        EXPECT_THROW(write_mesh(folder.path() / name, surface), InputError);
        EXPECT_EQ(folder.file_count(), 0U);
    };
    const SurfaceMesh good = box_surface(1);
    SurfaceMesh bad = good;
    bad.mesh.positions[3][1] = std::numeric_limits<double>::quiet_NaN();
    refused(bad);
    bad = good;
    bad.mesh.triangles[5][2] = 8;
    refused(bad);
    bad = good;
    bad.normals.pop_back();
    refused(bad);
    bad = good;
    bad.triangle_origin.pop_back();
    refused(bad);
    bad = good;
    bad.mesh.positions[0][0] = 1e39;  // beyond single precision
    refused(bad, "a.stl");
    refused(bad, "a.glb");
    for (const char* name : {"a.off", "a.gltf", "a", "ply"}) refused(good, name);
    try {
        write_mesh("a.off", good);
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr(".ply, .obj, .stl or .glb"));
    }
    EXPECT_THROW(write_mesh(folder.path() / "none" / "a.ply", good), InputError);
}

TEST(AtomicFile, IsThereWholeOrNotAtAll) {
    const TemporaryFolder folder;
    folder.write("a.csv", "before");
    {
        AtomicFile file(folder.path() / "a.csv");
        file.stream() << "x," << 0.5 << "\n";
        file.stream().flush();
        EXPECT_EQ(folder.content("a.csv"), "before");
        file.commit();
        EXPECT_EQ(folder.content("a.csv"), "x,0.5\n");
    }
    EXPECT_EQ(folder.content("a.csv"), "x,0.5\n");
    try {
        AtomicFile file(folder.path() / "a.csv");
        file.write("half");
        throw JobError("on the way");
    } catch (const JobError&) {
    }
    EXPECT_EQ(folder.content("a.csv"), "x,0.5\n");
    EXPECT_EQ(folder.file_count(), 1U);
}

TEST(AtomicFile, SeveralAtOnceDoNotMeet) {
    const TemporaryFolder folder;
    AtomicFile a(folder.path() / "a"), b(folder.path() / "b"), again(folder.path() / "a");
    a.write("1");
    b.write("2");
    again.write("3");
    a.commit();
    b.commit();
    EXPECT_EQ(folder.content("a") + folder.content("b"), "12");
    again.commit();
    EXPECT_EQ(folder.content("a") + folder.content("b"), "32");
    EXPECT_EQ(folder.file_count(), 2U);
}

TEST(AtomicFile, SaysWhereNothingCanBeWritten) {
    const TemporaryFolder folder;
    EXPECT_THROW(AtomicFile(folder.path() / "none" / "a"), InputError);
    EXPECT_THROW(AtomicFile(folder.path()), InputError);
    EXPECT_THROW(AtomicFile("/proc/none"), JobError);
    EXPECT_EQ(folder.file_count(), 0U);
    // A target that turned into a folder meanwhile: the rename fails and leaves nothing behind.
    {
        AtomicFile file(folder.path() / "a");
        std::filesystem::create_directories(folder.path() / "a" / "b");
        EXPECT_THROW(file.commit(), JobError);
    }
    EXPECT_EQ(folder.file_count(), 1U);
}

TEST(AtomicFile, WhatDidNotReachTheFileIsAJobError) {
    const TemporaryFolder folder;
    folder.write("a", "before");
    {
        AtomicFile file(folder.path() / "a");
        file.write("new");
        file.stream().setstate(std::ios::badbit);  // as a full disk leaves it
        EXPECT_THROW(file.commit(), JobError);
    }
    EXPECT_EQ(folder.content("a"), "before");
    EXPECT_EQ(folder.file_count(), 1U);
}
