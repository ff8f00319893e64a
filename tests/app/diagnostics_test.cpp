// Messages of the program about runs with problems, and about runs without.
#include "app/program.h"

#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/write_mesh.h>
#include <nlohmann/json.hpp>

namespace splitcubes::app_test {
namespace {

using Json = nlohmann::json;

class Diagnostics : public Program {
  protected:
    // A block and blades that move down along y, each from its own start time, for a tenth of a second.
    static Json scene(const std::vector<std::pair<double, double>>& places_and_times = {}) {
        Json out = {{"name", "Block"},
                    {"frames", 12},
                    {"gravity", {0, 0, 0}},
                    {"bodies",
                     {{{"name", "block"},
                       {"shape", {{"box", {{"size", {0.2, 0.16, 0.14}}}}}},
                       {"cells", 14},
                       {"phyxel_count", 200},
                       {"velocity", {0, 0, 0.01}},
                       {"material", {{"youngs_modulus", 2e5}}}}}}};
        for (const auto& [x, time] : places_and_times) {
            const auto key = [](double t, double z) { return Json{{"time", t}, {"position", {0, 0, z}}}; };
            out["tools"].push_back(
                {{"name", "knife" + std::to_string(out["tools"].size())},
                 {"blades", {{{"straight", {{"from", {x, -0.3, 0}}, {"to", {x, 0.3, 0}}}}}}},
                 {"motion", {{"path", {{"keyframes", {key(time, 0.2), key(time + 0.1, -0.2)}}}}}}});
        }
        return out;
    }
    Ended run_scene(const Json& scene, std::vector<std::string> more = {}) const {
        write_text(in("x.json"), scene.dump(1));
        more.insert(more.begin(), {"run", "x.json", "-o", "out"});
        return run(more);
    }
    Json summary() const { return Json::parse(text_of(in("out/summary.json"))); }
};

std::vector<std::string> said(const Ended& ended) {
    return lines_without_progress(ended.err);
}

TEST_F(Diagnostics, ASoundRunPrintsNothing) {
    const Ended ended = run_scene(scene({{0.01, 0}}));
    ASSERT_EQ(ended.code, 0) << ended.err;
    EXPECT_TRUE(said(ended).empty()) << ended.err;
    EXPECT_EQ(summary()["flags"]["not_converged"], 0);
    EXPECT_EQ(summary()["flags"].size(), 7U);
    EXPECT_EQ(summary()["idle_tools"], Json::array());
}

TEST_F(Diagnostics, AFrequentFlagIsReportedWithAnEffectiveRemedy) {
    Json hard = scene({{0.01, 0}});
    hard["gravity"] = {0, 0, -9.81};
    hard["constraints"] = {
        {{"body", "block"},
         {"kind", "hold"},
         {"region", {{"half_space", {{"point", {-0.08, 0, 0}}, {"normal", {-1, 0, 0}}}}}}}};
    hard["solver"] = {{"max_iterations", 2}};
    const Ended ended = run_scene(hard, {"--checkpoint-every", "5"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    const auto count = summary()["flags"]["not_converged"].get<int>();
    EXPECT_GT(count, 8);
    const std::vector<std::string> lines = said(ended);
    ASSERT_FALSE(lines.empty());
    EXPECT_EQ(lines[0].rfind("Block: not_converged in " + std::to_string(count) + " of 12 steps (", 0), 0U)
        << ended.err;
    EXPECT_NE(lines[0].find("raise solver.max_iterations"), std::string::npos);
    // A resumed run also counts the earlier steps.
    const Ended again = run({"run", "x.json", "-o", "out", "--resume", "out/checkpoint.bin"});
    ASSERT_EQ(again.code, 0) << again.err;
    EXPECT_EQ(summary()["flags"]["not_converged"], count);
    EXPECT_EQ(said(again), lines);
    hard["solver"] = {{"max_iterations", 200}};
    EXPECT_TRUE(said(run_scene(hard)).empty());
}

TEST_F(Diagnostics, ToolsThatCutNothingSayWhy) {
    Json idle = scene({{0.01, 0}, {0.3, 0}, {0.012, 0.15}, {0.0985, 0}, {0.05, 9}});
    idle["frames"] = 18;
    idle["bodies"][0]["velocity"] = {0, 0, 0};
    const Ended ended = run_scene(idle);
    ASSERT_EQ(ended.code, 0) << ended.err;
    const std::vector<std::string> lines = said(ended);
    ASSERT_EQ(lines.size(), 4U) << ended.err;
    EXPECT_EQ(lines[0].rfind(
                  "tool 'knife1': nothing was cut: it missed 'block'; its bounding box is (0.3, -0.3, ", 0),
              0U)
        << lines[0];
    EXPECT_NE(lines[1].find("tool 'knife2': nothing was cut: all "), std::string::npos) << lines[1];
    EXPECT_NE(lines[1].find("were cut before"), std::string::npos) << lines[1];
    EXPECT_NE(lines[2].find("tool 'knife3': nothing was cut: it stayed closer than a cell (0.014"),
              std::string::npos)
        << lines[2];
    EXPECT_NE(lines[3].find("tool 'knife4': was never active"), std::string::npos) << lines[3];
    std::vector<std::string> reasons;
    const Json all = summary();
    for (const Json& one : all["idle_tools"]) reasons.push_back(one["reason"]);
    EXPECT_EQ(reasons, (std::vector<std::string>{"missed", "already_cut", "near_surface", "never_active"}));
}

TEST_F(Diagnostics, SheetsThatCutNothingSayWhy) {
    const auto write = [&](const std::string& name, const geometry::TriangleMesh& mesh) {
        io::write_mesh(in(name), geometry::SurfaceMesh{mesh, {}, {}, {}});
    };
    write("block.obj", geometry::make_box(Vec3(0.2, 0.16, 0.14)));
    write("plane.obj", geometry::make_plane_sheet({0.013, 0, 0}, Vec3(1, 0, 0), 2));
    write("away.obj", geometry::make_plane_sheet({0.4, 0, 0}, Vec3(1, 0, 0), 2));
    write("skin.obj", geometry::make_plane_sheet({0.0985, 0, 0}, Vec3(1, 0, 0), 2));
    const Ended ended =
        run({"cut", "block.obj", "-o", "out.ply", "--cells", "14", "--report", "report.json", "--with",
             "plane.obj", "--with", "away.obj", "--with", "plane.obj", "--with", "skin.obj"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    const std::vector<std::string> lines = lines_without_progress(ended.err);
    ASSERT_EQ(lines.size(), 3U) << ended.err;
    EXPECT_NE(lines[0].find("away.obj: nothing was cut: it missed 'block.obj'; its bounding box is (0.4, "),
              std::string::npos);
    EXPECT_NE(lines[1].find("plane.obj: nothing was cut: all "), std::string::npos);
    EXPECT_NE(lines[2].find("skin.obj: nothing was cut: it stayed closer than a cell"), std::string::npos);
    const Json cutters = Json::parse(text_of(in("report.json")))["cutters"];
    EXPECT_FALSE(cutters[0].contains("idle"));
    EXPECT_EQ(cutters[1]["idle"], "missed");
    EXPECT_EQ(cutters[2]["idle"], "already_cut");
    EXPECT_EQ(cutters[3]["idle"], "near_surface");
}

TEST_F(Diagnostics, ABladeThatMovesAlongItselfAndAPlaneThatMissesAreReported) {
    io::write_mesh(in("block.obj"), geometry::SurfaceMesh{geometry::make_box(Vec3(20, 16, 14)), {}, {}, {}});
    write_text(in("along.json"), R"({"tools": [{
        "name": "along", "blades": [{"straight": {"from": [-50, 1, 1], "to": [50, 1, 1]}}],
        "motion": {"path": {"keyframes": [{"time": 0, "position": [-30, 0, 0]}, {"time": 1, "position": [30, 0, 0]}]}}}]})");
    const Ended ended = run({"cut", "block.obj", "-o", "out.ply", "--unit", "mm", "--cells", "14", "--path",
                             "along.json", "--plane", "0,0,2,200"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    const std::vector<std::string> lines = lines_without_progress(ended.err);
    ASSERT_EQ(lines.size(), 2U) << ended.err;
    EXPECT_NE(lines[0].find("its edge stands still or moves along itself"), std::string::npos) << lines[0];
    EXPECT_NE(lines[1].find("along its normal (0, 0, 1) it is at 100 mm, 'block.obj' from -7 mm to 7 mm"),
              std::string::npos)
        << lines[1];
}

TEST_F(Diagnostics, AllProblemsOfASceneAreReportedAtOnce) {
    Json wrong = scene({{0.01, 0}});
    wrong["time_step"] = -1;
    wrong["bodies"][0]["cels"] = 10;
    wrong["tools"][0]["name"] = 5;
    const Ended ended = run_scene(wrong, {"--set", "ground.height=low"});
    EXPECT_EQ(ended.code, 2);
    EXPECT_EQ(ended.out, "");
    EXPECT_FALSE(fs::exists(in("out")));
    const std::vector<std::string> lines = lines_without_progress(ended.err);
    ASSERT_EQ(lines.size(), 4U) << ended.err;
    for (const std::string& line : lines) EXPECT_EQ(line.rfind("splitcubes: ", 0), 0U) << line;
    EXPECT_NE(lines[3].find("--set ground.height=low: ground.height is \"low\""), std::string::npos);
}

}  // namespace
}  // namespace splitcubes::app_test
