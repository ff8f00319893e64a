// Meshes whose coordinates fit a double, but not the quantities computed from them.
#include <gtest/gtest.h>

#include <app/program.h>

namespace splitcubes::app_test {
namespace {

class Huge : public Program {
  protected:
    Huge() {
        write_text(in("ball.obj"), tetrahedron_obj("1"));
        write_text(in("scene.json"),
                   R"({"frames": 1, "bodies": [{"name": "b", "cells": 8, "phyxel_count": 20,
                       "shape": {"mesh": {"file": "mesh.obj"}}}]})");
    }

    static std::string tetrahedron_obj(const std::string& s) {
        const std::string m = "-" + s;
        return "v " + m + " " + m + " " + m + "\nv " + s + " " + s + " " + m + "\nv " + s + " " + m + " " +
               s + "\nv " + m + " " + s + " " + s + "\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n";
    }
    static std::string tetrahedron_ply(const std::string& s) {
        const std::string m = "-" + s;
        return "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\n"
               "property double z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n" +
               m + " " + m + " " + m + "\n" + s + " " + s + " " + m + "\n" + s + " " + m + " " + s + "\n" +
               m + " " + s + " " + s + "\n3 0 1 2\n3 0 3 1\n3 0 2 3\n3 1 3 2\n";
    }
    static std::string triangle_stl(const std::string& s) {
        return "solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex " + s + " 0 0\nvertex 0 " + s +
               " 0\nendloop\nendfacet\nendsolid a\n";
    }
    static std::string triangle_gltf(const std::string& scale) {
        // Three vertices (0,0,0), (1,0,0), (0,1,0).
        return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
          "nodes": [{"mesh": 0, "scale": [)" +
               scale + "," + scale + "," + scale + R"(]}],
          "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
          "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
          "bufferViews": [{"buffer": 0, "byteLength": 36}],
          "buffers": [{"byteLength": 36, "uri":
          "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
    }

    void expect_reported(const std::vector<std::string>& arguments, const std::string& file) const {
        expect_refused(arguments, file + ": vertex ");
        const std::string message = run(arguments).err;
        EXPECT_EQ(message.find("nan"), std::string::npos) << message;
        EXPECT_EQ(message.find("inf"), std::string::npos) << message;
        EXPECT_NE(message.find("coordinates reach from -1000000000 to 1000000000"), std::string::npos)
            << message;
    }
};

TEST_F(Huge, NumbersAreRefusedInEveryFormatByEveryCommand) {
    for (const std::string size : {"1.01e9", "1e38", "1e150", "1e300"}) {
        write_text(in("mesh.obj"), tetrahedron_obj(size));
        write_text(in("mesh.ply"), tetrahedron_ply(size));
        write_text(in("mesh.stl"), triangle_stl(size));
        write_text(in("mesh.gltf"), triangle_gltf(size));
        for (const std::string file : {"mesh.obj", "mesh.ply", "mesh.stl", "mesh.gltf"}) {
            expect_reported({"validate", file}, file);
            expect_reported({"validate", file, "--unit", "mm"}, file);
            expect_reported({"surface", file, "-o", "x.ply", "--scale", "1e-9"}, file);
            expect_reported({"cut", file, "--plane", "z=0", "-o", "x.ply", "--cells", "8"}, file);
            expect_reported({"cut", "ball.obj", "--with", file, "-o", "x.ply", "--cells", "8"}, file);
        }
        expect_reported({"run", "scene.json", "-o", "out"}, "mesh.obj");
    }
    EXPECT_FALSE(fs::exists(in("x.ply")));
}

TEST_F(Huge, ScaledNumbersAreRefusedToo) {
    write_text(in("mesh.obj"), tetrahedron_obj("20"));
    const auto with = [](std::vector<std::string> words, const std::string& scale, const std::string& unit) {
        words.insert(words.end(), {"-o", "x.ply", "--cells", "8", "--unit", unit, "--scale", scale});
        return words;
    };
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"surface", "mesh.obj"}, {"cut", "mesh.obj", "--plane", "z=0"}}) {
        expect_reported(with(command, "1e8", "m"), "mesh.obj");
        EXPECT_FALSE(fs::exists(in("x.ply")));
        expect_reported(with(command, "1e8", "mm"), "mesh.obj");
        const Ended ended = run(with(command, "5e7", "mm"));
        EXPECT_EQ(ended.code, 0) << ended.err;
        fs::remove(in("x.ply"));
    }
    expect_reported(
        {"cut", "ball.obj", "--with", "mesh.obj", "-o", "x.ply", "--cells", "8", "--scale", "1e8"},
        "mesh.obj");
}

TEST_F(Huge, TheLargestThatAreTakenAreMeasuredInFiniteNumbers) {
    for (const std::string size : {"1e9", "1e-12", "1e-300"}) {
        write_text(in("mesh.obj"), tetrahedron_obj(size));
        for (const std::string unit : {"m", "mm", "inch"}) {
            const Ended ended = run({"validate", "mesh.obj", "--unit", unit});
            EXPECT_EQ(ended.code, 0) << ended.err;
            EXPECT_EQ(ended.out.find("nan"), std::string::npos) << ended.out;
            EXPECT_EQ(ended.out.find("inf"), std::string::npos) << ended.out;
        }
    }
    write_text(in("mesh.obj"), tetrahedron_obj("1e9"));
    const Ended ended = run({"surface", "mesh.obj", "-o", "x.ply", "--cells", "8"});
    EXPECT_EQ(ended.code, 0) << ended.err;
    EXPECT_EQ(ended.out.find("nan"), std::string::npos) << ended.out;
}

}  // namespace
}  // namespace splitcubes::app_test
