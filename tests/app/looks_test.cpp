// What scenes say of looks is in the files of a run and in its pictures.
#include "app/program.h"
#include "io/gltf_check.h"

#include <gmock/gmock.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/read_surface.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <set>
#include <string>

namespace splitcubes::app_test {
namespace {

using testing::HasSubstr;

const fs::path looks_file = fs::path(SPLITCUBES_APP_TESTS) / "looks.json";

class Looks : public Program {
  protected:
    void SetUp() override { write_text(in("scene.json"), text_of(looks_file)); }
    Ended simulate(const std::string& format) {
        return run({"run", "scene.json", "-o", format, "--set", "output.format=" + format});
    }
};

std::set<std::string> used_materials(const geometry::MeshAttributes& attributes) {
    std::set<std::string> out;
    for (const std::int32_t material : attributes.triangle_material)
        if (material >= 0) out.insert(attributes.materials[static_cast<std::size_t>(material)].name);
    return out;
}

TEST_F(Looks, FramesHaveTheMaterialsOfTheScene) {
    for (const std::string format : {"ply", "obj", "glb"}) {
        const Ended ended = simulate(format);
        ASSERT_EQ(ended.code, 0) << ended.err;
        const io::Model last = io::read_model(in(format + "/surface/000012." + format));
        EXPECT_EQ(used_materials(last.attributes),
                  (std::set<std::string>{"block/surface", "block/cut", "boundary"}))
            << format;
        for (const geometry::Material& material : last.attributes.materials)
            if (material.name == "block/cut") EXPECT_GT(material.colour[1], 0.7F);
    }
    EXPECT_THAT(text_of(in("glb/surface/000012.glb")), HasSubstr("\"metallicFactor\":0.25"));
}

TEST_F(Looks, PlyHasRestPiecesBodiesAndCuts) {
    ASSERT_EQ(simulate("ply").code, 0);
    const geometry::SurfaceMesh last = io::read_surface(in("ply/surface/000012.ply"));
    const std::size_t vertices = last.mesh.positions.size(), triangles = last.mesh.triangles.size();
    ASSERT_EQ(last.rest.size(), vertices);
    ASSERT_EQ(last.vertex_piece.size(), vertices);
    ASSERT_EQ(last.vertex_body.size(), vertices);
    ASSERT_EQ(last.triangle_cut.size(), triangles);
    EXPECT_EQ(*std::max_element(last.vertex_piece.begin(), last.vertex_piece.end()), 2);
    EXPECT_EQ(*std::max_element(last.vertex_body.begin(), last.vertex_body.end()), 1);
    for (std::size_t t = 0; t < triangles; ++t)
        EXPECT_EQ(last.triangle_cut[t], last.triangle_origin[t] == geometry::Origin::cut ? 0 : -1);
    // The plane of the cut at rest, to a cell.
    for (std::size_t t = 0; t < triangles; ++t)
        if (last.triangle_cut[t] == 0)
            for (const std::uint32_t v : last.mesh.triangles[t]) EXPECT_NEAR(last.rest[v].x(), 0.003, 0.0125);
}

#ifdef SPLITCUBES_WITH_RENDER

TEST_F(Looks, RunsOfAnyFormatAreDrawnAndBecomeOneAnimation) {
    for (const std::string format : {"ply", "obj", "stl", "glb"}) {
        ASSERT_EQ(simulate(format).code, 0);
        const Ended drawn = run({"render", format, "-o", format + ".png", "-o", format + "-run.glb"});
        if (drawn.err.find("OpenGL cannot start") != std::string::npos) GTEST_SKIP() << drawn.err;
        ASSERT_EQ(drawn.code, 0) << drawn.err;
        EXPECT_GT(fs::file_size(in(format + ".png")), 1000u);
        const std::string glb = text_of(in(format + "-run.glb"));
        std::uint32_t bytes = 0;
        std::memcpy(&bytes, glb.data() + 12, 4);
        const nlohmann::json json = nlohmann::json::parse(glb.substr(20, bytes));
        std::set<std::string> names;
        for (const auto& node : json["nodes"]) names.insert(node["name"]);
        for (const char* name : {"frame 0", "frame 12", "wall", "knife/blade", "knife/grip"})
            EXPECT_TRUE(names.contains(name)) << format << " " << name;
        EXPECT_EQ(json["animations"].size(), 1u);
        EXPECT_EQ(io::GltfCheck(glb).faults(), "") << format;
        if (format == "glb") EXPECT_EQ(io::GltfCheck(text_of(in("glb/surface/000012.glb"))).faults(), "");
    }
}

TEST_F(Looks, AFolderWithoutFramesIsRefused) {
    ASSERT_EQ(simulate("ply").code, 0);
    for (const auto& entry : fs::directory_iterator(in("ply/surface"))) fs::remove(entry.path());
    write_text(in("ply/surface/notes.ply"), "no frame");
    const Ended ended = run({"render", "ply", "-o", "a.png"});
    EXPECT_EQ(ended.code, 2);
    EXPECT_THAT(ended.err, HasSubstr("holds no frames (.ply, .obj, .stl or .glb)"));
}

#endif

TEST_F(Looks, ReplaysAndResumedRunsComeToTheSameBits) {
    write_text(in("released.json"), nlohmann::json::parse(text_of(looks_file), nullptr, true, true)
                                        .patch(nlohmann::json::parse(R"([
                 {"op": "add", "path": "/handles/0/release_when", "value": {"body": "block"}},
                 {"op": "add", "path": "/handles/0/relative_to", "value": "knife-1"},
                 {"op": "add", "path": "/tools/0/solid", "value": {"friction": 0.2}},
                 {"op": "add", "path": "/tools/0/repeat", "value": {"count": 2, "position": [0.04, 0, 0], "time": 0.05}},
                 {"op": "add", "path": "/contact", "value": {"pieces": true}}])"))
                                        .dump());
    const Ended whole =
        run({"run", "released.json", "-o", "whole", "--record", "motions.json", "--checkpoint-every", "7"});
    ASSERT_EQ(whole.code, 0) << whole.err;
    const std::string state = whole.out.substr(whole.out.find("state"));
    const Ended replayed = run({"replay", "motions.json", "-o", "again"});
    EXPECT_EQ(replayed.code, 0) << replayed.err;
    EXPECT_THAT(replayed.out, HasSubstr("the same state as recorded"));
    const Ended resumed = run({"run", "released.json", "-o", "rest", "--resume", "whole/checkpoint.bin"});
    EXPECT_EQ(resumed.code, 0) << resumed.err;
    EXPECT_THAT(resumed.out, HasSubstr(state));
}

// Tools that go along with the material, and a grip that starts when it is severed.
TEST_F(Looks, WhatTheStateDecidesIsTheSameResumedReplayedAndDrawn) {
    const std::string scene = SPLITCUBES_DOCS "/../scenes/carried_tools.json";
    const Words coarse = {"--set", "bodies[0].cells=20", "bodies[0].phyxel_count=150"};
    const auto with = [&](Words words) {
        words.insert(words.end(), coarse.begin(), coarse.end());
        return run(words);
    };
    const Ended whole = with({"run", scene, "-o", "whole", "--record", "motions.json"});
    ASSERT_EQ(whole.code, 0) << whole.err;
    const std::string state = whole.out.substr(whole.out.find("state"));
    const Ended part = with({"run", scene, "-o", "part", "--frames", "70", "--checkpoint-every", "64"});
    ASSERT_EQ(part.code, 0) << part.err;
    const Ended resumed =
        with({"run", scene, "-o", "rest", "--resume", "part/checkpoint.bin", "--record", "rest.json"});
    EXPECT_THAT(resumed.out, HasSubstr(state)) << resumed.err;
    EXPECT_EQ(text_of(in("rest.json")).substr(text_of(in("rest.json")).find("\"tracks\"")),
              text_of(in("motions.json")).substr(text_of(in("motions.json")).find("\"tracks\"")));
    const Ended replayed = run({"replay", "motions.json", "-o", "again"});
    EXPECT_THAT(replayed.out, HasSubstr("the same state as recorded")) << replayed.err;
    const auto as_run = nlohmann::json::parse(text_of(in("whole/scene_as_run.json")));
    EXPECT_EQ(text_of(in("whole/scene_as_run.json")), text_of(in("rest/scene_as_run.json")));
    ASSERT_EQ(as_run["tools"].size(), 2u);
    EXPECT_GT(as_run["tools"][1]["shown_from"], 0.3) << "it waited";
    EXPECT_GT(as_run["handles"][0]["from_time"], 0.3);
    EXPECT_TRUE(as_run["tools"][0]["relative_to"].is_null());
}

}  // namespace
}  // namespace splitcubes::app_test
