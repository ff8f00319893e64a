// cut with sheets, closed meshes and paths: kept and removed pieces, and messages.
#include "app/program.h"

#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/read_surface.h>
#include <splitcubes/io/write_mesh.h>
#include <nlohmann/json.hpp>

#include "laws/solids.h"

#include <cmath>
#include <numbers>
#include <optional>

namespace splitcubes::app_test {
namespace {

using geometry::TriangleMesh;
using Json = nlohmann::json;
using Words = std::vector<std::string>;

class Cut : public Program {
  protected:
    Cut() {
        write("block.obj", geometry::make_box(Vec3(1, 1, 0.5)));
        write("plane.obj", geometry::make_plane_sheet({0.01, 0, 0}, Vec3(1, 0.2, 0.1), 2));
    }
    void write(const std::string& name, const TriangleMesh& mesh) const {
        io::write_mesh(in(name), geometry::SurfaceMesh{mesh, {}, {}, {}});
    }

    // Cuts block.obj into out.ply and pieces into `parts`; checks invariants of any cut.
    Json cut(const Words& words, const std::string& cells = "24") {
        Words all = {"cut", "block.obj", "-o",          "out.ply",  "--cells",
                     cells, "--report",  "report.json", "--pieces", "parts"};
        all.insert(all.end(), words.begin(), words.end());
        said_ = run(all);
        EXPECT_EQ(said_.code, 0) << said_.err;
        if (said_.code != 0) return {};
        const Json report = Json::parse(text_of(in("report.json")));
        check_pieces(report);
        EXPECT_EQ(unfinished_files(), 0U);
        return report;
    }

    void check_pieces(const Json& report) const {
        double kept = 0, removed = 0, last = 0;
        std::size_t kept_count = 0, removed_count = 0, triangles = 0;
        for (const Json& piece : report["pieces"]) {
            char digits[8];
            std::size_t& number = piece["removed"] ? removed_count : kept_count;
            std::snprintf(digits, sizeof digits, "-%04zu", number);
            EXPECT_EQ(piece["name"], (piece["removed"] ? "removed" : "piece") + std::string(digits));
            const auto volume = piece["volume"].get<double>();
            if (number++ > 0) {
                EXPECT_LE(volume, last) << "not the largest first";
            }
            last = volume;
            (piece["removed"] ? removed : kept) += volume;
            const fs::path file = in(piece["file"].get<std::string>());
            EXPECT_EQ(file, in("parts/" + piece["name"].get<std::string>() + ".ply"));
            const TriangleMesh part = io::read_mesh(file);
            EXPECT_TRUE(geometry::check_mesh(part).valid());
            EXPECT_EQ(part.triangles.size(), piece["triangles"]);
            EXPECT_NEAR(part.volume(), volume, 1e-13);
            for (int axis = 0; axis < 3; ++axis) {
                EXPECT_EQ(piece["bounds"]["min"][axis], part.bounds().min[axis]);
                EXPECT_EQ(piece["bounds"]["max"][axis], part.bounds().max[axis]);
                EXPECT_GE(piece["center_of_mass"][axis], part.bounds().min[axis]);
                EXPECT_LE(piece["center_of_mass"][axis], part.bounds().max[axis]);
            }
            if (!piece["removed"]) triangles += part.triangles.size();
        }
        EXPECT_NEAR(report["volume_kept"], kept, 1e-12);
        EXPECT_NEAR(report["volume_removed"], removed, 1e-12);
        const auto whole = report["volume_whole"].get<double>();
        EXPECT_NEAR(kept + removed, whole, 1e-12 * whole);
        EXPECT_EQ(report["triangles"], triangles);
        EXPECT_EQ(report["closed"], true);
        if (triangles == 0) return;
        const geometry::SurfaceMesh out = io::read_surface(in("out.ply"));
        EXPECT_TRUE(geometry::check_mesh(out.mesh).valid());
        EXPECT_NEAR(out.mesh.volume(), kept, 1e-12 * whole);
        for (const std::int32_t piece : out.vertex_piece) ASSERT_LT(piece, static_cast<int>(kept_count));
    }

    std::size_t files_in_parts() const {
        std::size_t count = 0;
        for (const auto& entry : fs::directory_iterator(in("parts")))
            count += entry.path().filename() != "splitcubes-files.txt";
        return count;
    }

    Ended said_;
};

TEST_F(Cut, RemoveDrillsACylinderOutOfABlock) {
    constexpr double radius = 0.2;
    TriangleMesh drill = geometry::make_cylinder(radius, 2, 256);
    for (Vec3& p : drill.positions) p += Vec3(0.013, 0.021, 0);
    write("drill.obj", drill);
    const Json report = cut({"--with", "drill.obj", "--mode", "remove"}, "32");
    ASSERT_EQ(report["pieces"].size(), 2U);
    EXPECT_EQ(report["mode"], "remove");
    EXPECT_EQ(report["pieces"][0]["removed"], false);
    EXPECT_EQ(report["pieces"][1]["removed"], true);
    // The cut follows the cylinder to second order in the cell size (1/32); its ends are the block's faces.
    const double core = std::numbers::pi * radius * radius * 0.5;
    EXPECT_NEAR(report["volume_removed"], core, 2e-3 * core);
    EXPECT_NEAR(report["volume_whole"], 0.5, 1e-3);
    EXPECT_NEAR(report["pieces"][1]["center_of_mass"][0], 0.013, 1e-3);
    EXPECT_NEAR(report["pieces"][1]["center_of_mass"][1], 0.021, 1e-3);
    EXPECT_NEAR(report["pieces"][0]["cut_area"], report["pieces"][1]["cut_area"], 1e-12);
    EXPECT_NE(said_.out.find("removed-0000"), std::string::npos);
    // The mode separate keeps it.
    const Json both = cut({"--with", "drill.obj"}, "32");
    EXPECT_EQ(both["mode"], "separate");
    EXPECT_EQ(both["volume_removed"], 0);
    EXPECT_EQ(both["pieces"][1]["name"], "piece-0001");
    EXPECT_EQ(both["pieces"][1]["volume"], report["pieces"][1]["volume"]);
    EXPECT_EQ(files_in_parts(), 2U) << "pieces of the cut before are left";
}

TEST_F(Cut, OverlappingCuttersRemoveTheirUnion) {
    write("a.obj", laws::moved(geometry::make_sphere(0.2, 4), Vec3(-0.11, 0.01, 0.02)));
    write("b.obj", laws::moved(geometry::make_sphere(0.2, 4), Vec3(0.12, 0, 0.01)));
    const Json report = cut({"--with", "a.obj", "b.obj", "--mode", "remove"}, "48");
    // Two balls less their common lens, d apart.
    const double r = 0.2, d = Vec3(0.23, 0.01, 0.01).norm();
    const double lens = std::numbers::pi * (4 * r + d) * (2 * r - d) * (2 * r - d) / 12;
    const double both = 8.0 / 3 * std::numbers::pi * r * r * r - lens;
    EXPECT_NEAR(report["volume_removed"], both, 0.01 * both);
    std::size_t kept = 0;
    for (const Json& piece : report["pieces"]) kept += !piece["removed"];
    EXPECT_EQ(kept, 1U);
    ASSERT_EQ(report["cutters"].size(), 2U);
    EXPECT_EQ(report["cutters"][0]["file"], "a.obj");
    EXPECT_GT(report["cutters"][1]["cut_edges"], 100);
}

TEST_F(Cut, ACutterMayIntersectItselfAndBeInsideOut) {
    TriangleMesh crossed = geometry::make_torus(0.25, 0.1, 48, 24);
    for (Vec3& p : crossed.positions) p[1] *= 4 * p[0];  // the ring becomes a figure eight
    ASSERT_TRUE(geometry::check_mesh(crossed).closed());
    write("eight.obj", crossed);
    write("thgie.obj", laws::reversed(crossed));
    const Json report = cut({"--with", "eight.obj", "--mode", "remove"});
    EXPECT_GT(report["volume_removed"], 0.01);
    EXPECT_GT(report["volume_kept"], 0.3);
    const Json other = cut({"--with", "thgie.obj", "--mode", "remove"});
    EXPECT_NEAR(other["volume_removed"], report["volume_removed"], 1e-9);
}

TEST_F(Cut, OpenSheetsAndClosedOnesCutTogether) {
    write("ball.obj", geometry::make_sphere(0.2, 4));
    const Json report = cut({"--with", "plane.obj", "--with", "ball.obj"}, "32");
    ASSERT_GE(report["pieces"].size(), 4U);
    EXPECT_GT(report["pieces"][3]["volume"], 0.01);
    expect_refused(
        {"cut", "block.obj", "--with", "plane.obj", "ball.obj", "--mode", "remove", "-o", "no.ply"},
        "plane.obj");
    EXPECT_FALSE(fs::exists(in("no.ply")));
}

TEST_F(Cut, ACutterThatEnclosesTheBodyLeavesAnEmptySurface) {
    for (const double size : {2.0, 1e3, 1e6}) {
        write("huge.obj", geometry::make_sphere(size, 2));
        const Json report = cut({"--with", "huge.obj", "--mode", "remove"});
        ASSERT_EQ(report["pieces"].size(), 1U);
        EXPECT_EQ(report["pieces"][0]["name"], "removed-0000");
        EXPECT_EQ(report["volume_kept"], 0);
        EXPECT_EQ(report["triangles"], 0);
        EXPECT_NE(said_.out.find("empty"), std::string::npos) << said_.out;
        EXPECT_EQ(said_.err, "");
        EXPECT_EQ(text_of(in("out.ply")).rfind("ply\n", 0), 0U);
    }
    // The same size far away: cuts nothing.
    TriangleMesh far = geometry::make_sphere(1e6, 2);
    for (Vec3& p : far.positions) p[0] += 2e6;
    write("far.obj", far);
    const Json report = cut({"--with", "far.obj", "--mode", "remove"});
    EXPECT_EQ(report["volume_removed"], 0);
    EXPECT_EQ(lines_without_progress(said_.err).size(), 1U) << said_.err;
}

TEST_F(Cut, ACutterSmallerThanACellCutsNothingAndSaysSo) {
    write("mote.obj", laws::moved(geometry::make_sphere(1e-4, 2), Vec3(0.0041, 0.0052, 0.0063)));
    const Json report = cut({"--with", "mote.obj", "--mode", "remove"});
    EXPECT_EQ(report["cut_edges"], 0);
    EXPECT_EQ(report["pieces"].size(), 1U);
    const Words said = lines_without_progress(said_.err);
    ASSERT_EQ(said.size(), 1U) << said_.err;
    EXPECT_EQ(said[0].rfind("mote.obj: ", 0), 0U);
}

const std::string wire = R"({
  "tools": [{
    "name": "wire",
    "blades": [{"straight": {"from": [-1, 0.013, 0], "to": [1, 0.021, 0]}}],
    "motion": {"path": {"keyframes": [{"time": 0, "position": [0, 0, 1]}, {"time": 2, "position": [0, 0.1, -1]}]}}
  }, {
    "name": "idle",
    "blades": [{"straight": {"from": [5, 0, 0], "to": [6, 0, 0]}}],
    "motion": {"path": {"keyframes": [{"time": 0, "position": [0, 0, 1]}, {"time": 2, "position": [0, 0, -1]}]}}
  }]
})";

TEST_F(Cut, ABladeOnAPathSevers) {
    write_text(in("wire.json"), wire);
    const Json report = cut({"--path", "wire.json"});
    ASSERT_EQ(report["pieces"].size(), 2U);
    const Words said = lines_without_progress(said_.err);
    ASSERT_EQ(said.size(), 1U) << said_.err;
    EXPECT_EQ(
        said[0].rfind("wire.json: blade 'idle': nothing was cut: it missed 'block.obj'; its bounding box "
                      "is (5, 0, -1) to (6, 0, 1) m, that of 'block.obj' (",
                      0),
        0U)
        << said[0];
    EXPECT_EQ(report["cutters"][1]["idle"], "missed");
    EXPECT_FALSE(report["cutters"][0].contains("idle"));
    ASSERT_EQ(report["cutters"].size(), 2U);
    EXPECT_EQ(report["cutters"][0]["blade"], "wire");
    EXPECT_EQ(report["cutters"][1]["cut_edges"], 0);
    // The sheet that it sweeps makes the same pieces.
    const TriangleMesh sheet{{{-1, 0.013, 1}, {1, 0.021, 1}, {-1, 0.113, -1}, {1, 0.121, -1}},
                             {{0, 1, 2}, {1, 3, 2}}};
    write("sheet.obj", sheet);
    const Json by_sheet = cut({"--with", "sheet.obj"});
    EXPECT_EQ(by_sheet["cut_edges"], report["cut_edges"]);
    for (std::size_t k = 0; k < 2; ++k)
        EXPECT_NEAR(by_sheet["pieces"][k]["volume"], report["pieces"][k]["volume"], 1e-7);
    // Together with a sheet, for any number of threads.
    write_text(in("second.json"), wire);
    for (const char* threads : {"1", "2"}) {
        const std::string out = std::string("out") + threads + ".ply";
        const Ended ended = run({"cut", "block.obj", "--with", "plane.obj", "--path", "wire.json", "--path",
                                 "second.json", "-o", out, "--cells", "24", "--threads", threads});
        ASSERT_EQ(ended.code, 0) << ended.err;
        EXPECT_EQ(lines_of(ended.out).size(), 6U) << ended.out;  // summary, head, four pieces
    }
    EXPECT_EQ(text_of(in("out1.ply")), text_of(in("out2.ply")));
}

TEST_F(Cut, TheExampleCutsAPear) {
    write("pear.obj", geometry::make_pear(0.2, 96));
    const Ended ended = run({"cut", "pear.obj", "--path", SPLITCUBES_SCENES "/paths/pear_wire.json", "-o",
                             "out.obj", "--cells", "48", "--report", "report.json"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    const Json report = Json::parse(text_of(in("report.json")));
    std::size_t large = 0;
    for (const Json& piece : report["pieces"]) large += piece["volume"] > 1e-5;
    EXPECT_EQ(large, 4U) << "top, bottom and the core of each";
    for (const Json& cutter : report["cutters"]) EXPECT_GT(cutter["cut_edges"], 200);
}

TEST_F(Cut, BadPathsAndOptionsAreOneLine) {
    write_text(in("wire.json"), wire);
    const auto broken = [&](const std::string& old_text, const std::string& new_text) {
        std::string text = wire;
        write_text(in("bad.json"), text.replace(text.find(old_text), old_text.size(), new_text));
        return Words{"cut", "block.obj", "--path", "bad.json", "-o", "no.ply"};
    };
    expect_refused(broken("\"from\": [-1, 0.013, 0]", "\"from\": [-1, 0]"), "bad.json:4");
    expect_refused(broken("\"motion\"", "\"motoin\""), "bad.json:5");
    expect_refused(broken("\"name\": \"wire\"", "\"name\": \"idle\""), "bad.json:7");
    expect_refused(broken("\"name\": \"wire\"", "\"name\": \"wire\", \"bodies\": []"), "bad.json:3");
    expect_refused(broken("\"tools\"", "\"bodies\": [], \"tools\""), "bad.json:2");
    expect_refused(broken("{", ""), "bad.json");
    write_text(in("bad.json"), "{\"tools\": []}");
    expect_refused({"cut", "block.obj", "--path", "bad.json", "-o", "no.ply"}, "bad.json:1");
    expect_refused({"cut", "block.obj", "--path", "absent.json", "-o", "no.ply"}, "absent.json");
    expect_refused({"cut", "block.obj", "-o", "no.ply"}, "--with");
    expect_refused({"cut", "block.obj", "--path", "wire.json", "--mode", "remove", "-o", "no.ply"},
                   "wire.json");
    expect_refused({"cut", "block.obj", "--with", "plane.obj", "--mode", "crush", "-o", "no.ply"}, "--mode");
    write_text(in("file"), "mine");
    expect_refused({"cut", "block.obj", "--with", "plane.obj", "-o", "no.ply", "--pieces", "file"}, "file");
    EXPECT_EQ(text_of(in("file")), "mine");
    EXPECT_FALSE(fs::exists(in("no.ply")));
}

TEST_F(Cut, ManyPiecesAreOneLine) {
    TriangleMesh planes;
    for (int k = 0; k < 5; ++k) {
        planes.append(geometry::make_plane_sheet({0.16 * k - 0.31, 0, 0}, Vec3(1, 0.01, 0.02), 2));
        planes.append(geometry::make_plane_sheet({0, 0.16 * k - 0.31, 0}, Vec3(0.02, 1, 0.01), 2));
    }
    write("planes.obj", planes);
    const Json report = cut({"--with", "planes.obj"});
    EXPECT_GE(report["pieces"].size(), 36U);
    EXPECT_EQ(lines_of(said_.out).size(), 1U) << said_.out;
}

TEST_F(Cut, PiecesReplaceThoseOfAnEarlierCutAndNothingElse) {
    cut({"--with", "plane.obj"});
    const std::size_t before = files_in_parts();
    for (const char* name : {"piece-7.txt", "pieces.ply", "piece-00x1.ply"})
        write_text(in("parts") / name, "mine");
    // Cuts nothing: one piece is left.
    TriangleMesh beside = geometry::make_plane_sheet({9, 9, 9}, Vec3(0, 0, 1), 1);
    write("beside.obj", beside);
    cut({"--with", "beside.obj"});
    EXPECT_TRUE(fs::exists(in("parts/piece-0000.ply")));
    EXPECT_FALSE(fs::exists(in("parts/piece-0001.ply")));
    for (const char* name : {"piece-7.txt", "pieces.ply", "piece-00x1.ply"})
        EXPECT_EQ(text_of(in("parts") / name), "mine");
    EXPECT_EQ(files_in_parts(), before - 1 + 3);
    // It has the name of a piece, but no cut wrote it.
    write_text(in("parts/piece-0007.obj"), "mine");
    expect_refused({"cut", "block.obj", "--with", "plane.obj", "-o", "no.ply", "--pieces", "parts"},
                   "piece-0007.obj");
    EXPECT_EQ(text_of(in("parts/piece-0007.obj")), "mine");
    cut({"--with", "plane.obj", "--force"});
    EXPECT_FALSE(fs::exists(in("parts/piece-0007.obj")));
    EXPECT_EQ(text_of(in("parts/piece-7.txt")), "mine");
}

TEST_F(Cut, AnInterruptLeavesNothing) {
    // The note about the open mesh shows that work has begun; the wire's motion takes minutes.
    TriangleMesh open = geometry::make_sphere(0.5, 3);
    open.triangles.pop_back();
    write("open.obj", open);
    write_text(in("long.json"), R"({"tools": [{"name": "whisk",
      "blades": [{"polyline": {"points": [[-0.3, 0, -0.3], [0, 0.1, 0.3], [0.3, 0, -0.3]]}}],
      "motion": {"circular": {"radius": 0.1, "turns": 10000, "until_time": 1000}}}]})");
    const Ended ended = run({"cut", "open.obj", "--path", "long.json", "-o", "out.ply", "--cells", "24",
                             "--pieces", "parts", "--report", "report.json"},
                            [&](pid_t child) {
                                if (text_of(in(".err")).find("not closed") == std::string::npos) return true;
                                kill(child, SIGINT);
                                return false;
                            });
    EXPECT_EQ(ended.code, 1);
    const Words said = lines_of(ended.err);
    ASSERT_FALSE(said.empty());
    EXPECT_EQ(said.back(), "splitcubes: interrupted; nothing was written");
    for (const char* name : {"out.ply", "parts", "report.json"}) EXPECT_FALSE(fs::exists(in(name))) << name;
    EXPECT_EQ(unfinished_files(), 0U);
}

}  // namespace
}  // namespace splitcubes::app_test
