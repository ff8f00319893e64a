// cut with planes, units and scales, and its selection of pieces.
#include "app/program.h"

#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/write_mesh.h>
#include <nlohmann/json.hpp>

#include <cmath>

namespace splitcubes::app_test {
namespace {

using geometry::TriangleMesh;
using Json = nlohmann::json;
using Words = std::vector<std::string>;

class CutOptions : public Program {
  protected:
    // 100 x 60 x 40, like a part in millimetres.
    CutOptions() {
        write("block.stl", geometry::make_box(Vec3(100, 60, 40)));
        write("ball.obj", geometry::make_sphere(0.5, 3));
    }
    void write(const std::string& name, const TriangleMesh& mesh) const {
        io::write_mesh(in(name), geometry::SurfaceMesh{mesh, {}, {}, {}});
    }
    Json cut(const Words& more, const std::string& mesh = "block.stl") {
        Words words{"cut", mesh,       "-o",          "out.ply",  "--cells",
                    "25",  "--report", "report.json", "--pieces", "parts"};
        words.insert(words.end(), more.begin(), more.end());
        said_ = run(words);
        EXPECT_EQ(said_.code, 0) << said_.err;
        return said_.code == 0 ? Json::parse(text_of(in("report.json"))) : Json();
    }
    Ended said_;
};

TEST_F(CutOptions, LengthsInMessagesAreInTheUnit) {
    write("thin.stl", geometry::make_box(Vec3(20, 20, 0.05)));
    const Ended refused = run({"surface", "thin.stl", "-o", "x.ply", "--unit", "mm", "--cell-size", "0.003"});
    EXPECT_EQ(refused.code, 2);
    EXPECT_NE(refused.err.find("--cell-size: 0.003 mm makes 6667 cells along an axis"), std::string::npos)
        << refused.err;
    const Ended lost = run({"surface", "thin.stl", "-o", "x.ply", "--unit", "mm", "--cell-size", "1"});
    EXPECT_EQ(lost.err.find(" m "), std::string::npos) << lost.err;
    EXPECT_NE(lost.err.find("a cell of 1 mm"), std::string::npos) << lost.err;
}

// The plane lies off the grid nodes: volumes are those of the plane itself.
TEST_F(CutOptions, APlaneCutsWhereItSays) {
    for (const std::string plane : {"x=11", "1,0,0,11", "-2,0,0,-22", "1e0,0.0,+0,1.1e1"}) {
        const Json report = cut({"--plane", plane});
        ASSERT_EQ(report["pieces"].size(), 2U) << plane;
        EXPECT_NEAR(report["pieces"][0]["volume"], 61.0 * 60 * 40, 1);
        EXPECT_NEAR(report["pieces"][1]["volume"], 39.0 * 60 * 40, 1);
        EXPECT_EQ(report["cutters"][0]["plane"], plane);
        EXPECT_TRUE(report["cutters"][0].value("file", "").empty());
    }
    const Json slant = cut({"--plane", "1,1,0,0", "--plane=z=-3"});
    EXPECT_EQ(slant["pieces"].size(), 4U);
    EXPECT_NEAR(slant["pieces"][0]["volume"], 3000.0 * 23, 60);
    const Json missed = cut({"--plane", "x=500"});
    EXPECT_EQ(missed["pieces"].size(), 1U);
    EXPECT_NE(said_.err.find("plane x=500"), std::string::npos) << said_.err;
}

TEST_F(CutOptions, MaterialInFrontOfAPlaneIsRemoved) {
    const Json front = cut({"--plane", "x=11", "--mode", "remove"});
    EXPECT_NEAR(front["volume_removed"], 39.0 * 60 * 40, 1);
    EXPECT_NEAR(front["pieces"][0]["bounds"]["max"][0], 11, 1e-6);
    const Json back = cut({"--plane", "-1,0,0,-11", "--mode", "remove"});
    EXPECT_NEAR(back["volume_removed"], 61.0 * 60 * 40, 1);
    // In front of all of the block and behind it, from any distance.
    for (const char* offset : {"-51", "-1000000", "-1e9"})
        EXPECT_EQ(cut({"--plane", std::string("x=") + offset, "--mode", "remove"})["volume_kept"], 0)
            << offset;
    for (const char* offset : {"51", "1e9"})
        EXPECT_EQ(cut({"--plane", std::string("x=") + offset, "--mode", "remove"})["volume_removed"], 0)
            << offset;
    // Two planes remove a corner each and overlap: their union is removed.
    const Json both = cut({"--plane", "x=11", "--plane", "z=3", "--mode", "remove"});
    EXPECT_NEAR(both["volume_kept"], 61.0 * 60 * 23, 3);
}

TEST_F(CutOptions, CuttersCutInTheOrderOfTheLine) {
    write("sheet.obj", geometry::make_plane_sheet({11, 0, 0}, Vec3(1, 0, 0), 200));
    const Json report = cut({"--plane", "z=1", "--with", "sheet.obj", "--plane", "y=2"});
    ASSERT_EQ(report["cutters"].size(), 3U);
    EXPECT_EQ(report["cutters"][0]["plane"], "z=1");
    EXPECT_EQ(report["cutters"][1]["file"], "sheet.obj");
    EXPECT_EQ(report["cutters"][2]["plane"], "y=2");
    EXPECT_EQ(report["pieces"].size(), 8U);
}

TEST_F(CutOptions, MillimetresInMillimetresOutMetresInReports) {
    const Json report = cut({"--plane", "x=11", "--unit", "mm"});
    EXPECT_NEAR(report["volume_whole"], 100e-3 * 60e-3 * 40e-3, 1e-9);
    EXPECT_NEAR(report["cell_size"], 4e-3, 1e-9);
    EXPECT_NEAR(report["pieces"][0]["bounds"]["max"][0], 11e-3, 1e-9);
    EXPECT_NE(said_.out.find("mm^3"), std::string::npos) << said_.out;
    const TriangleMesh out = io::read_mesh(in("out.ply"));
    EXPECT_NEAR(out.bounds().size()[0], 100, 1e-4);
    const TriangleMesh part = io::read_mesh(in("parts/piece-0001.ply"));
    EXPECT_NEAR(part.volume(), 39.0 * 60 * 40, 1);
    // The same shape as without a unit.
    const TriangleMesh in_unit = out;
    cut({"--plane", "x=11"});
    const TriangleMesh plain = io::read_mesh(in("out.ply"));
    ASSERT_EQ(in_unit.positions.size(), plain.positions.size());
    for (std::size_t v = 0; v < plain.positions.size(); ++v)
        EXPECT_LT((in_unit.positions[v] - plain.positions[v]).norm(), 1e-4);
}

TEST_F(CutOptions, ScaleAppliesToAllInput) {
    write("sheet.obj", geometry::make_plane_sheet({11, 0, 0}, Vec3(1, 0, 0), 200));
    write_text(in("wire.json"), R"({"tools": [{"name": "wire",
      "blades": [{"straight": {"from": [-80, 0, 0], "to": [80, 0, 0]}}],
      "motion": {"path": {"keyframes": [{"time": 0, "position": [0, 3, 50]}, {"time": 1, "position": [0, 3, -50]}]}}}]})");
    const Json report = cut(
        {"--scale", "25.4", "--unit", "mm", "--with", "sheet.obj", "--path", "wire.json", "--plane", "z=1"});
    const double inch = 25.4e-3;
    EXPECT_NEAR(report["volume_whole"], 240000 * inch * inch * inch, 1e-4);
    ASSERT_EQ(report["pieces"].size(), 8U);
    EXPECT_NEAR(report["pieces"][0]["volume"], 61.0 * 33 * 21 * inch * inch * inch, 1e-4);
    EXPECT_NEAR(io::read_mesh(in("out.ply")).bounds().size()[0], 2540, 1e-2);
    const Json same = cut({"--unit", "inch", "--with", "sheet.obj", "--path", "wire.json", "--plane", "z=1"});
    EXPECT_NEAR(same["pieces"][0]["volume"], report["pieces"][0]["volume"], 1e-7);
    EXPECT_NEAR(io::read_mesh(in("out.ply")).bounds().size()[0], 100, 1e-4);
}

TEST_F(CutOptions, SurfaceAndValidateKnowUnitsToo) {
    const Ended ended = run({"surface", "block.stl", "-o", "out.stl", "--unit", "mm", "--cell-size", "4",
                             "--report", "report.json", "--scale", "0.5"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    const Json report = Json::parse(text_of(in("report.json")));
    EXPECT_NEAR(report["cell_size"], 4e-3, 1e-12);
    EXPECT_NEAR(report["volume"], 50e-3 * 30e-3 * 20e-3, 1e-9);
    EXPECT_NEAR(io::read_mesh(in("out.stl")).bounds().size()[0], 50, 1e-4);
    EXPECT_NE(ended.out.find("volume 30000 mm^3"), std::string::npos) << ended.out;
    const Ended checked = run({"validate", "out.stl", "--unit", "mm"});
    EXPECT_NE(checked.out.find("volume 30000 mm^3"), std::string::npos) << checked.out;
    expect_refused({"surface", "block.stl", "-o", "x.stl", "--unit", "foot"}, "m, mm, cm, inch");
    expect_refused({"surface", "block.stl", "-o", "x.stl", "--scale", "0"}, "--scale: 0 is out of range");
}

// Four pieces of 61 or 39 by 33 or 27.
TEST_F(CutOptions, SmallPiecesAreDroppedAndReported) {
    const Words planes{"--plane", "x=11", "--plane", "y=3", "--unit", "mm"};
    const auto with = [&](const Words& more) {
        Words out = planes;
        out.insert(out.end(), more.begin(), more.end());
        return cut(out);
    };
    const Json all = with({});
    ASSERT_EQ(all["pieces"].size(), 4U);
    EXPECT_EQ(all["volume_dropped"], 0);
    const Json large = with({"--min-volume", "60000"});
    ASSERT_EQ(large["pieces"].size(), 4U);
    EXPECT_NEAR(large["volume_kept"], (61 * 33 + 61 * 27) * 40e-9, 1e-9);
    EXPECT_NEAR(large["volume_dropped"], 39 * 60 * 40e-9, 1e-9);
    EXPECT_NEAR(large["volume_kept"].get<double>() + large["volume_dropped"].get<double>(),
                large["volume_whole"], 1e-12);
    EXPECT_EQ(large["pieces"][2]["name"], "dropped-0000");
    EXPECT_EQ(large["pieces"][2]["dropped"], true);
    EXPECT_EQ(large["pieces"][0]["dropped"], false);
    EXPECT_FALSE(large["pieces"][2].contains("file"));
    EXPECT_FALSE(fs::exists(in("parts/piece-0002.ply"))) << "of the cut before";
    EXPECT_FALSE(fs::exists(in("parts/dropped-0000.ply")));
    EXPECT_NE(said_.out.find("2 pieces dropped, smaller than 60000 mm^3"), std::string::npos) << said_.out;
    const TriangleMesh kept = io::read_mesh(in("out.ply"));
    EXPECT_TRUE(geometry::check_mesh(kept).valid());
    EXPECT_NEAR(kept.volume(), 61 * 60 * 40, 2);

    const Json one = with({"--largest"});
    EXPECT_NEAR(one["volume_kept"], 61 * 33 * 40e-9, 1e-9);
    EXPECT_NE(said_.out.find("3 pieces dropped, not among the 1 largest"), std::string::npos) << said_.out;
    EXPECT_EQ(with({"--largest", "1"})["volume_kept"], one["volume_kept"]);
    EXPECT_NEAR(with({"--largest=3"})["volume_dropped"], 39 * 27 * 40e-9, 1e-9);
    EXPECT_EQ(with({"--largest", "9"})["volume_dropped"], 0);
    EXPECT_NE(said_.out.find("no piece was dropped"), std::string::npos) << said_.out;
    EXPECT_EQ(with({"--min-volume", "1e9"})["volume_kept"], 0);
    EXPECT_NE(said_.out.find("the surface is empty"), std::string::npos) << said_.out;
    // The word after the option without a number is the mesh.
    EXPECT_EQ(run({"cut", "--plane", "x=11", "-o", "out.ply", "--cells", "9", "--largest", "block.stl"}).code,
              0);
}

TEST_F(CutOptions, OfWhatIsKeptOnly) {
    const Json report =
        cut({"--plane", "x=11", "--plane", "y=40", "--with", "block.stl", "--mode", "separate", "--largest"});
    EXPECT_NEAR(report["volume_dropped"], 39.0 * 60 * 40, 1);
    write("drill.obj", geometry::make_box(Vec3(10, 10, 100)));
    const Json removed =
        cut({"--with", "drill.obj", "--mode", "remove", "--largest", "--min-volume", "5000"});
    EXPECT_NEAR(removed["volume_removed"], 4000, 50) << "what is removed is removed, however small";
    EXPECT_EQ(removed["volume_dropped"], 0);
    EXPECT_TRUE(fs::exists(in("parts/removed-0000.ply")));
}

TEST_F(CutOptions, APieceThatIsCutAgainIsNotReplacedByItsOwnPieces) {
    cut({"--plane", "x=11"});
    const std::string before = text_of(in("parts/piece-0001.ply"));
    expect_refused({"cut", "parts/piece-0001.ply", "--plane", "y=0", "-o", "no.ply", "--pieces", "parts"},
                   "parts/piece-0001.ply");
    expect_refused(
        {"cut", "block.stl", "--with", "parts/../parts/piece-0000.ply", "-o", "no.ply", "--pieces", "parts"},
        "piece-0000.ply");
    EXPECT_EQ(text_of(in("parts/piece-0001.ply")), before);
    EXPECT_EQ(run({"cut", "parts/piece-0001.ply", "--plane", "y=0", "-o", "yes.ply", "--cells", "12",
                   "--pieces", "parts/again"})
                  .code,
              0);
}

TEST_F(CutOptions, BadPlanesAreOneLine) {
    const auto refused = [&](const std::string& plane, const std::string& text) {
        expect_refused({"cut", "block.stl", "--plane", plane, "-o", "no.ply"}, text);
    };
    for (const char* plane : {"", "x", "w=1", "1,2,3", "1,2,3,4,5", "0,0,0,1"}) refused(plane, "--plane: '");
    refused("x=", "--plane: '' is not a number");
    refused("x=one", "'one' is not a number");
    refused("1,0,0,nan", "'nan' is not a number");
    refused("1,,0,2", "'' is not a number");
    refused("x=1e300", "out of range");
    EXPECT_FALSE(fs::exists(in("no.ply")));
}

}  // namespace
}  // namespace splitcubes::app_test
