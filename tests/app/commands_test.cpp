// surface, cut, validate, info, and bad input to all commands.
#include "app/program.h"

#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/read_surface.h>
#include <splitcubes/io/write_mesh.h>
#include <nlohmann/json.hpp>

#include <cmath>

namespace splitcubes::app_test {
namespace {

using geometry::TriangleMesh;
using Json = nlohmann::json;

class Commands : public Program {
  protected:
    Commands() {
        write("ball.obj", geometry::make_sphere(0.5, 3));
        write("plane.obj", geometry::make_plane_sheet({0.01, 0, 0}, Vec3(1, 0.2, 0.1), 2));
        TriangleMesh open = geometry::make_sphere(0.5, 2);
        open.triangles.resize(open.triangles.size() - 3);
        write("open.stl", open);
    }
    void write(const std::string& name, const TriangleMesh& mesh) const {
        io::write_mesh(in(name), geometry::SurfaceMesh{mesh, {}, {}, {}});
    }
};

TEST_F(Commands, SurfaceInEveryFormat) {
    double volume = 0;
    for (const std::string ending : {"ply", "obj", "stl", "glb"}) {
        const Ended ended =
            run({"surface", "ball.obj", "-o", "out." + ending, "--cells", "24", "--report", "report.json"});
        ASSERT_EQ(ended.code, 0) << ended.err;
        EXPECT_EQ(lines_of(ended.out).size(), 1U);
        const TriangleMesh mesh = geometry::weld_equal_vertices(io::read_mesh(in("out." + ending)));
        EXPECT_TRUE(geometry::check_mesh(mesh).valid()) << ending;
        const Json report = Json::parse(text_of(in("report.json")));
        EXPECT_EQ(report["triangles"], mesh.triangles.size());
        EXPECT_NEAR(report["volume"].get<double>(), mesh.volume(), 1e-5);
        EXPECT_EQ(report["closed"], true);
        EXPECT_EQ(report["manifold"], true);
        EXPECT_EQ(report["exact"], true);
        EXPECT_EQ(report["pieces"].size(), 1U);
        if (volume == 0) volume = mesh.volume();
        EXPECT_NEAR(mesh.volume(), volume, 1e-5);
    }
    EXPECT_NEAR(volume, 4.18879 / 8, 0.02 * 4.18879 / 8);
    EXPECT_EQ(unfinished_files(), 0U);
}

TEST_F(Commands, CellSizeAndCellsSayTheSame) {
    ASSERT_EQ(run({"surface", "ball.obj", "-o", "a.ply", "--cells", "20", "--threads", "1"}).code, 0);
    ASSERT_EQ(run({"surface", "ball.obj", "-o", "b.ply", "--cell-size", "0.05", "--threads", "2"}).code, 0);
    EXPECT_EQ(text_of(in("a.ply")), text_of(in("b.ply")));
}

TEST_F(Commands, CutWritesThePieces) {
    const Ended ended = run({"cut", "ball.obj", "--with", "plane.obj", "-o", "out.ply", "--cells", "24",
                             "--pieces", "parts", "--report", "report.json"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    const Json report = Json::parse(text_of(in("report.json")));
    ASSERT_EQ(report["pieces"].size(), 2U);
    EXPECT_GT(report["cut_edges"], 100);
    const geometry::SurfaceMesh whole = io::read_surface(in("out.ply"));
    double sum = 0;
    for (const Json& piece : report["pieces"]) {
        const fs::path file = folder_ / piece["file"].get<std::string>();
        const geometry::SurfaceMesh part = io::read_surface(file);
        EXPECT_TRUE(geometry::check_mesh(part.mesh).valid());
        EXPECT_NEAR(part.mesh.volume(), piece["volume"].get<double>(), 1e-9);
        sum += part.mesh.volume();
    }
    EXPECT_NEAR(sum, whole.mesh.volume(), 1e-9 * sum);
    EXPECT_EQ(unfinished_files(), 0U);
}

TEST_F(Commands, CutCarriesTexturesAndMaterials) {
    write_text(in("cube.mtl"), "newmtl wood\nKd 0.5 0.25 0.125\nmap_Kd planks.png\n");
    std::string cube =
        "mtllib cube.mtl\nusemtl wood\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 "
        "1\n"
        "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    for (const char* face : {"1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"}) {
        cube += "f";
        for (int k = 0; k < 4; ++k) cube += std::string(" ") + face[2 * k] + "/" + std::to_string(k + 1);
        cube += "\n";
    }
    write_text(in("cube.obj"), cube);
    write_text(in("planks.png"), "no picture is opened");
    write("middle.obj", geometry::make_plane_sheet({0.47, 0.5, 0.5}, Vec3(1, 0.2, 0.1), 2));
    std::vector<geometry::Material> materials;
    for (const std::string ending : {"ply", "obj", "glb"}) {
        const Ended ended = run({"cut", "cube.obj", "--with", "middle.obj", "-o", "out." + ending, "--cells",
                                 "16", "--pieces", "parts"});
        ASSERT_EQ(ended.code, 0) << ended.err;
        EXPECT_EQ(ended.err.find("note"), std::string::npos);
        const io::Model out = io::read_model(in("out." + ending));
        ASSERT_EQ(out.attributes.materials.size(), 2U) << ending;
        EXPECT_EQ(out.attributes.materials[0].name, "wood");
        EXPECT_EQ(out.attributes.materials[0].texture, in("planks.png").string());
        EXPECT_EQ(out.attributes.materials[1].name, "cut");
        EXPECT_EQ(out.attributes.corner_uv.size(), out.mesh.triangles.size());
        const io::Model part = io::read_model(in("parts/piece-0001." + ending));
        EXPECT_EQ(part.attributes.materials, out.attributes.materials);
        EXPECT_TRUE(geometry::check_mesh(geometry::weld_equal_vertices(part.mesh)).valid());
    }
    const geometry::SurfaceMesh surface = io::read_surface(in("out.ply"));
    EXPECT_EQ(surface.rest, surface.mesh.positions);
    EXPECT_EQ(unfinished_files(), 0U);
}

TEST_F(Commands, ACutThatMeetsNothingSaysSo) {
    write("far.obj", geometry::make_plane_sheet({9, 0, 0}, Vec3::UnitX(), 2));
    const Ended ended = run({"cut", "ball.obj", "--with", "far.obj", "-o", "out.ply", "--cells", "12"});
    EXPECT_EQ(ended.code, 0);
    EXPECT_NE(ended.err.find("far.obj: "), std::string::npos) << ended.err;
}

TEST_F(Commands, ValidateDistinguishesOpenFromClosed) {
    EXPECT_EQ(run({"validate", "ball.obj"}).code, 0);
    const Ended open = run({"validate", "open.stl"});
    EXPECT_EQ(open.code, 1);
    EXPECT_NE(open.out.find("NOT valid"), std::string::npos);
    EXPECT_EQ(run({"validate", "ball.obj", "open.stl"}).code, 1);
    // The program's output is valid.
    ASSERT_EQ(run({"surface", "open.stl", "-o", "mended.ply", "--cells", "16"}).code, 0);
    EXPECT_EQ(run({"validate", "mended.ply"}).code, 0);
}

TEST_F(Commands, InfoVersionAndHelp) {
    for (const char* word : {"info", "--version", "--help"}) {
        const Ended ended = run({word});
        EXPECT_EQ(ended.code, 0) << word;
        EXPECT_EQ(ended.err, "") << word;
        EXPECT_FALSE(ended.out.empty()) << word;
    }
    EXPECT_NE(run({"run", "--help"}).out.find("--set"), std::string::npos);
}

TEST_F(Commands, BadUsageIsOneLine) {
    expect_refused({}, "splitcubes --help");
    expect_refused({"slice"}, "slice");
    expect_refused({"surface", "ball.obj"}, "--output");
    expect_refused({"surface", "ball.obj", "-o", "x.ply", "--cells", "many"}, "--cells");
    expect_refused({"surface", "ball.obj", "-o", "x.ply", "--cells", "8", "--cell-size", "1"}, "--cell");
    expect_refused({"surface", "ball.obj", "-o", "x.ply", "--colour", "red"}, "--colour");
    expect_refused({"bench", "nothing"}, "nothing");
    expect_refused({"bench", "paper", "ball.obj"}, "ball.obj");
    expect_refused({"bench", "surface", "missing.obj"}, "missing.obj");
    EXPECT_FALSE(fs::exists(in("x.ply")));
}

TEST_F(Commands, BadMeshesAreOneLineWithTheFile) {
    write_text(in("empty.obj"), "");
    write_text(in("broken.obj"), "v 0 0 0\nv 1 0 0\nv 0 x 0\nf 1 2 3\n");
    write_text(in("index.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
    write_text(in("flat.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write_text(in("cut.ply"), "ply\nformat binary_little_endian 1.0\nelement vertex 9\n");
    write_text(in("huge.obj"), "v 0 0 0\nv 1e999 0 0\nv 0 1 0\nf 1 2 3\n");
    for (const std::string file :
         {"absent.obj", "empty.obj", "broken.obj", "index.obj", "cut.ply", "huge.obj", "."}) {
        expect_refused({"surface", file, "-o", "x.ply"}, file);
        expect_refused({"validate", file}, file);
        expect_refused({"cut", "ball.obj", "--with", file, "-o", "x.ply", "--cells", "8"}, file);
    }
    expect_refused({"surface", "flat.obj", "-o", "x.ply"}, "mesh");
    EXPECT_FALSE(fs::exists(in("x.ply")));
    EXPECT_EQ(unfinished_files(), 0U);
}

TEST_F(Commands, BadOptionsAreOneLineWithTheOption) {
    expect_refused({"surface", "ball.obj", "-o", "x.ply", "--cells", "1"}, "cells");
    expect_refused({"surface", "ball.obj", "-o", "x.ply", "--cells", "-5"}, "cells");
    expect_refused({"surface", "ball.obj", "-o", "x.ply", "--cells", "2000"}, "cells");
    expect_refused({"surface", "ball.obj", "-o", "x.ply", "--cell-size", "-1"}, "--cell-size");
    expect_refused({"surface", "ball.obj", "-o", "x.ply", "--cell-size", "nan"}, "--cell-size");
    expect_refused({"surface", "ball.obj", "-o", "x.ply", "--cell-size", "1e-9"}, "cell");
    expect_refused({"surface", "ball.obj", "-o", "x.ply", "--cells", "12", "--threads", "-3"}, "--threads");
    EXPECT_FALSE(fs::exists(in("x.ply")));
}

TEST_F(Commands, FailedWritesKeepTheOldFiles) {
    write_text(in("keep.xyz"), "mine");
    expect_refused({"surface", "ball.obj", "-o", "keep.xyz", "--cells", "8"}, "keep.xyz");
    EXPECT_EQ(text_of(in("keep.xyz")), "mine");
    expect_refused({"surface", "ball.obj", "-o", "no/such/folder/x.ply", "--cells", "8"}, "no/such/folder");
    fs::create_directory(in("folder.ply"));
    expect_refused({"surface", "ball.obj", "-o", "folder.ply", "--cells", "8"}, "folder.ply");
    EXPECT_EQ(unfinished_files(), 0U);
}

}  // namespace
}  // namespace splitcubes::app_test
