// Runs that are moved or sent: their inputs go along, and nothing reveals the original folders.
#include "app/program.h"

#include <splitcubes/core/sha256.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/read_surface.h>
#include <splitcubes/io/write_mesh.h>

#include <nlohmann/json.hpp>

#include <set>

namespace splitcubes::app_test {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

// In the author's folders; only text that the author wrote may contain "author".
const char* const sent_scene = R"({
  "name": "Sent", "frames": 6,
  "bodies": [{"name": "cube", "shape": {"mesh": {"file": "../models/cube.obj"}}, "cells": 8, "phyxel_count": 40,
              "material": {"youngs_modulus": 2e5, "tearing": {"strength": 1e6,
                           "strength_map": [{"paint": {"picture": "../models/strength.pgm"}}]}}}],
  "colliders": [{"name": "plate", "shape": {"mesh": {"file": "../models/plate.ply"}},
                 "placement": {"position": [0.05, 0.05, -0.05]}}],
  "tools": [{"name": "knife", "blades": [{"straight": {"from": [0.052, -1, 0], "to": [0.052, 1, 0]}}],
             "motion": {"path": {"keyframes": [{"time": 0, "position": [0, 0, 0.2]},
                                               {"time": 0.05, "position": [0, 0, -0.2]}]}}}],
  "camera": {"width": 64, "height": 48}
})";

class Moved : public Program {
  protected:
    Moved() {
        fs::create_directories(in("author/scenes"));
        fs::create_directories(in("author/models/mats"));
        fs::create_directories(in("author/textures"));
        fs::create_directories(in("colleague"));
        std::string obj = "mtllib mats/cube.mtl\n";
        for (int c = 0; c < 8; ++c)
            obj += "v " + std::to_string(0.1 * (c & 1)) + " " + std::to_string(0.1 * (c >> 1 & 1)) + " " +
                   std::to_string(0.1 * (c >> 2)) + "\n";
        obj += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl skin\n";
        for (const auto& quad : {"1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"}) {
            const std::string q(quad);
            obj += "f";
            for (std::size_t k = 0; k < 4; ++k) obj += " " + q.substr(2 * k, 1) + "/" + std::to_string(k + 1);
            obj += "\n";
        }
        write_text(in("author/models/cube.obj"), obj);
        write_text(in("author/models/mats/cube.mtl"),
                   "newmtl skin\nKd 0.5 0.25 0.125\nmap_Kd ../../textures/skin.png\n");
        write_text(in("author/textures/skin.png"), "not opened by any reader");
        write_text(in("author/models/strength.pgm"), "P5 2 2 255\nzdnx");
        io::write_mesh(in("author/models/plate.ply"),
                       geometry::SurfaceMesh{geometry::make_box(Vec3(0.3, 0.3, 0.02)), {}, {}, {}});
        write_text(in("author/scenes/sent.json"), sent_scene);
    }

    Ended run_sent(const std::string& out, const Words& more) const {
        Words words = {"run", "author/scenes/sent.json", "-o", out, "--threads", "1"};
        words.insert(words.end(), more.begin(), more.end());
        return run(words);
    }
    std::string state(const std::string& folder) const {
        return Json::parse(text_of(in(folder) / "summary.json"))["state_hash"];
    }
    // Expects a refusal after the scene's set-up, which prints notes of its own.
    void expect_refused_in_the_end(const Words& words, const std::string& culprit) const {
        const Ended ended = run(words);
        EXPECT_EQ(ended.code, 2);
        const Words lines = lines_of(ended.err);
        ASSERT_FALSE(lines.empty());
        EXPECT_EQ(lines.back().rfind("splitcubes: ", 0), 0U) << ended.err;
        EXPECT_NE(lines.back().find(culprit), std::string::npos) << ended.err;
    }
    void author_is_gone() const { fs::rename(in("author"), in("gone")); }

    // Returns the files that contain a text.
    std::set<std::string> found_in(const std::string& folder, const std::string& text) const {
        std::set<std::string> out;
        for (const auto& entry : fs::recursive_directory_iterator(in(folder)))
            if (entry.is_regular_file() && text_of(entry.path()).find(text) != std::string::npos)
                out.insert(entry.path().filename().string());
        return out;
    }
};

TEST_F(Moved, NothingRevealsTheOriginalFolder) {
    for (const char* format : {"ply", "obj", "glb"}) {
        const Ended ended =
            run_sent("author/out", {"--checkpoint-every", "3", "--record", "author/motions.json", "--links",
                                    "--set", std::string("output.format=") + format});
        ASSERT_EQ(ended.code, 0) << ended.err;
        const std::string machine = folder_.filename().string();
        EXPECT_EQ(found_in("author/out", machine), std::set<std::string>());
        EXPECT_EQ(found_in("author/out", "author"), std::set<std::string>());
        EXPECT_EQ(found_in("author/out", "../../"), std::set<std::string>({"cube.mtl"}))
            << "what the author wrote";
        for (const char* word : {"author", "\"/", "..", "/tmp"})
            EXPECT_EQ(text_of(in("author/motions.json")).find(word), std::string::npos) << word;
    }
}

TEST_F(Moved, AReportOfACutNamesNoFoldersOfTheMachine) {
    io::write_mesh(
        in("author/models/sheet.ply"),
        geometry::SurfaceMesh{geometry::make_plane_sheet({0.05, 0.05, 0.05}, Vec3(0, 0, 1), 1), {}, {}, {}});
    const auto files = [&](const std::string& report) {
        const Ended ended =
            run({"cut", in("author/models/cube.obj").string(), "--with",
                 in("author/models/sheet.ply").string(), "-o", in("author/cut.ply").string(), "--cells", "8",
                 "--pieces", in("author/parts").string(), "--report", in(report).string()});
        EXPECT_EQ(ended.code, 0) << ended.err;
        const std::string text = text_of(in(report));
        EXPECT_EQ(text.find(folder_.filename().string()), std::string::npos);
        const Json json = Json::parse(text);
        return Words{json["pieces"][0]["file"], json["cutters"][0]["file"]};
    };
    EXPECT_EQ(files("author/report.json"), (Words{"parts/piece-0000.ply", "models/sheet.ply"}));
    EXPECT_EQ(files("colleague/report.json"), (Words{"piece-0000.ply", "sheet.ply"}));
}

TEST_F(Moved, FramesFindTheirTextures) {
    ASSERT_EQ(run_sent("author/out", {"--frames", "1"}).code, 0);
    fs::rename(in("author/out"), in("colleague/run"));
    author_is_gone();
    const auto textures = [&](const std::string& frame) {
        std::set<std::string> out;
        for (const geometry::Material& material : io::read_surface(in(frame)).attributes.materials)
            if (!material.texture.empty()) out.insert(text_of(material.texture));
        return out;
    };
    const std::set<std::string> right = {"not opened by any reader"};
    EXPECT_EQ(textures("colleague/run/surface/000001.ply"), right);
    // Also those of a run of the sent scene.
    const Ended again = run({"run", "colleague/run/scene.json", "-o", "colleague/again", "--frames", "1"});
    ASSERT_EQ(again.code, 0) << again.err;
    EXPECT_EQ(textures("colleague/again/surface/000001.ply"), right);
    EXPECT_EQ(state("colleague/again"), state("colleague/run"));
}

TEST_F(Moved, ItResumesAndReplaysElsewhere) {
    ASSERT_EQ(run_sent("whole", {}).code, 0);
    ASSERT_EQ(run_sent("author/out",
                       {"--frames", "3", "--checkpoint-every", "3", "--record", "author/out/motions.json"})
                  .code,
              0);
    fs::rename(in("author/out"), in("colleague/run"));
    author_is_gone();
    const Ended replayed = run({"replay", "colleague/run/motions.json", "-o", "colleague/again"});
    EXPECT_EQ(replayed.code, 0) << replayed.err;
    EXPECT_NE(replayed.out.find("the same state as recorded"), std::string::npos) << replayed.out;
    EXPECT_EQ(state("colleague/again"), state("colleague/run"));
    // Into the folder that it came from, with inputs already there.
    const Ended resumed = run({"run", "colleague/run/scene.json", "-o", "colleague/run", "--frames", "6",
                               "--resume", "colleague/run/checkpoint.bin"});
    ASSERT_EQ(resumed.code, 0) << resumed.err;
    EXPECT_EQ(state("colleague/run"), state("whole"));
    EXPECT_EQ(text_of(in("colleague/run/surface/000006.ply")), text_of(in("whole/surface/000006.ply")));
    const Ended rerun = run({"run", "colleague/run/scene.json", "-o", "colleague/run"});
    ASSERT_EQ(rerun.code, 0) << rerun.err;
    EXPECT_EQ(state("colleague/run"), state("whole"));
}

TEST_F(Moved, TheScenesFolderDoesNotMatterToACheckpoint) {
    ASSERT_EQ(run_sent("whole", {}).code, 0);
    ASSERT_EQ(run_sent("out", {"--frames", "3", "--checkpoint-every", "3"}).code, 0);
    fs::rename(in("author"), in("elsewhere"));
    fs::rename(in("elsewhere/models/cube.obj"), in("elsewhere/models/body.obj"));
    const Ended resumed =
        run({"run", "elsewhere/scenes/sent.json", "-o", "out", "--resume", "out/checkpoint.bin", "--set",
             "bodies[0].shape.mesh.file=\"../models/body.obj\"", "--set", "name=Another", "--set",
             "camera.width=80"});
    ASSERT_EQ(resumed.code, 0) << resumed.err;
    EXPECT_EQ(state("out"), state("whole"));
}

TEST_F(Moved, WithoutItsInputsItSaysWhatIsMissing) {
    ASSERT_EQ(run_sent("whole", {}).code, 0);
    ASSERT_EQ(run_sent("out", {"--frames", "3", "--checkpoint-every", "3", "--record", "motions.json"}).code,
              0);
    fs::remove_all(in("out/inputs"));
    const std::string hash = sha256_of_file(in("author/models/cube.obj"));
    const Words resume = {"run",      "out/scene.json",    "-o", "out", "--frames", "6",
                          "--resume", "out/checkpoint.bin"};
    for (const Words& words : {resume, Words{"replay", "motions.json", "-o", "again"}}) {
        expect_refused(words, "cube.obj");
        expect_refused(words, hash);
        expect_refused(words, "mesh of body 'cube'");
        expect_refused(words, "--inputs");
    }
    EXPECT_FALSE(fs::exists(in("again")));
    // Found by content, under any name, with the files that they refer to beside them.
    fs::rename(in("author/models/cube.obj"), in("author/models/renamed.obj"));
    write_text(in("author/models/cube.obj"), "another one");
    Words found = resume;
    found.insert(found.end(), {"--inputs", "colleague", "--inputs", "author"});
    const Ended resumed = run(found);
    ASSERT_EQ(resumed.code, 0) << resumed.err;
    EXPECT_EQ(state("out"), state("whole"));
    // The run has copies again.
    EXPECT_EQ(run({"replay", "motions.json", "-o", "again", "--inputs", "out"}).code, 0);
    fs::remove_all(in("author"));
    EXPECT_EQ(run({"run", "out/scene.json", "-o", "again"}).code, 0);
    EXPECT_EQ(state("again"), state("whole"));
    fs::remove_all(in("out/inputs"));
    expect_refused({"replay", "motions.json", "-o", "x", "--inputs", "colleague"}, "colleague");
    expect_refused({"replay", "motions.json", "-o", "x", "--inputs", "nowhere"}, "nowhere");
}

TEST_F(Moved, AnInputThatHasChangedIsNamed) {
    ASSERT_EQ(
        run_sent("out", {"--frames", "3", "--checkpoint-every", "3", "--record", "out/motions.json"}).code,
        0);
    const fs::path mesh = in("author/models/cube.obj");
    const std::string then = sha256_of_file(mesh);
    const std::string text = text_of(mesh);
    // Set-up has not started: it would fail with another error.
    write_text(mesh, "no mesh");
    expect_refused({"run", "author/scenes/sent.json", "-o", "out", "--resume", "out/checkpoint.bin"},
                   "out/scene.json differs, first in bodies/0/shape/mesh/sha256 (\"" + then);
    write_text(mesh, text + "# a comment\n");
    fs::path copy;
    for (const auto& entry : fs::recursive_directory_iterator(in("out/inputs")))
        if (entry.path().filename() == "cube.obj") copy = entry.path();
    write_text(copy, text_of(copy) + "# a comment\n");
    expect_refused({"run", "out/scene.json", "-o", "out", "--resume", "out/checkpoint.bin"},
                   "cube.obj: has changed; it is the mesh of body 'cube'");
    expect_refused({"replay", "out/motions.json", "-o", "x"}, then);
    expect_refused({"run", "author/scenes/sent.json", "-o", "out", "--resume", "out/checkpoint.bin", "--set",
                    "time_step=0.01"},
                   "out/scene.json differs, first in time_step");
    // A file that the user overrides is a different input.
    EXPECT_EQ(run({"replay", "out/motions.json", "-o", "x", "--set",
                   "bodies[0].shape.mesh.file=\"" + mesh.string() + '"', "--inputs", "author"})
                  .code,
              0);
}

TEST_F(Moved, ARecordingElsewhereHasItsInputsBesideIt) {
    ASSERT_EQ(run_sent("author/out", {"--record", "colleague/motions.json"}).code, 0);
    EXPECT_EQ(found_in("colleague", "author"), std::set<std::string>());
    fs::remove_all(in("author"));
    fs::rename(in("colleague"), in("third"));
    const Ended replayed = run({"replay", "third/motions.json", "-o", "again"});
    EXPECT_EQ(replayed.code, 0) << replayed.err;
    EXPECT_NE(replayed.out.find("the same state as recorded"), std::string::npos) << replayed.out;
}

TEST_F(Moved, BuffersOfAMeshGoAlong) {
    std::string bytes;
    for (const float x : {0.F, 0.F, 0.F, .1F, 0.F, 0.F, 0.F, .1F, 0.F, 0.F, 0.F, .1F})
        bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
    for (const std::uint16_t i : {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3})
        bytes.append(reinterpret_cast<const char*>(&i), sizeof i);
    write_text(in("author/models/tip.bin"), bytes);
    write_text(in("author/models/tip.gltf"), R"({"asset": {"version": "2.0"},
        "buffers": [{"byteLength": 72, "uri": "tip.bin"}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                      {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}]})");
    write_text(in("author/tip.json"),
               R"({"frames": 2, "bodies": [{"name": "tip", "cells": 6, "phyxel_count": 30,
        "shape": {"mesh": {"file": "models/tip.gltf"}}}, {"name": "same", "cells": 6, "phyxel_count": 30,
        "shape": {"mesh": {"file": "models/tip.gltf"}}, "placement": {"position": [1, 0, 0]}}]})");
    const Ended ended = run({"run", "author/tip.json", "-o", "author/out"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    EXPECT_EQ(std::distance(fs::directory_iterator(in("author/out/inputs")), {}), 1)
        << "equal ones share a copy";
    fs::rename(in("author/out"), in("colleague/run"));
    author_is_gone();
    ASSERT_EQ(run({"run", "colleague/run/scene.json", "-o", "again"}).code, 0);
    EXPECT_EQ(state("again"), state("colleague/run"));
}

#ifdef SPLITCUBES_WITH_RENDER

TEST_F(Moved, ItIsDrawnWithAndWithoutItsInputs) {
    ASSERT_EQ(run_sent("out", {"--frames", "2"}).code, 0);
    fs::rename(in("out"), in("colleague/run"));
    author_is_gone();
    const Ended drawn = run({"render", "colleague/run", "-o", "last.png"});
    if (drawn.code == 1 && drawn.err.find("OpenGL cannot start") != std::string::npos)
        GTEST_SKIP() << drawn.err;
    ASSERT_EQ(drawn.code, 0) << drawn.err;
    fs::remove_all(in("colleague/run/inputs"));
    const Ended without = run({"render", "colleague/run", "-o", "without.png"});
    EXPECT_EQ(without.code, 0) << without.err;
    EXPECT_NE(without.err.find("plate: is not drawn"), std::string::npos) << without.err;
    EXPECT_NE(text_of(in("last.png")), text_of(in("without.png")));
}

#endif

}  // namespace
}  // namespace splitcubes::app_test
