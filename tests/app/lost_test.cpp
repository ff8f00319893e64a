// --lost and --picture: material too thin for the grid, reported, drawn and recovered.
#include "app/program.h"

#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/write_mesh.h>
#include <nlohmann/json.hpp>

#include "laws/solids.h"

#include <algorithm>
#include <set>

#ifdef SPLITCUBES_WITH_RENDER
#include <splitcubes/render/image.h>
#endif

namespace splitcubes::app_test {
namespace {

using geometry::TriangleMesh;
using Json = nlohmann::json;

// A block with a tilted plate above it, half as thick as a cell of 24.
class Lost : public Program {
  protected:
    Lost() {
        plate_ = laws::turned(geometry::make_box(Vec3(0.8, 0.6, 0.02)),
                              Quat(Eigen::AngleAxisd(0.35, Vec3(1, 0.2, 0.3).normalized())));
        plate_ = laws::moved(plate_, Vec3(0, 0, 0.62));
        TriangleMesh both = geometry::make_box(Vec3(1, 0.8, 0.4));
        write("block.obj", both);
        both.append(plate_);
        write("both.obj", both);
    }
    void write(const std::string& name, const TriangleMesh& mesh) const {
        io::write_mesh(in(name), geometry::SurfaceMesh{mesh, {}, {}, {}});
    }
    Json report() const { return Json::parse(text_of(in("report.json"))); }

    // Returns the triangles as sorted indices of the plate's vertices; -1 for other vertices.
    std::set<std::array<int, 3>> as_plate(const TriangleMesh& mesh) const {
        const auto vertex = [&](const Vec3& p) {
            for (std::size_t v = 0; v < plate_.positions.size(); ++v)
                if ((p - plate_.positions[v]).norm() < 1e-6) return static_cast<int>(v);
            return -1;
        };
        std::set<std::array<int, 3>> out;
        for (const geometry::Triangle& t : mesh.triangles) {
            std::array<int, 3> corners{};
            for (std::size_t k = 0; k < 3; ++k) corners[k] = vertex(mesh.positions[t[k]]);
            std::sort(corners.begin(), corners.end());
            out.insert(corners);
        }
        return out;
    }

    TriangleMesh plate_;
};

TEST_F(Lost, TrianglesAreThePlates) {
    for (const std::string ending : {"ply", "obj", "stl", "glb"}) {
        const Ended ended = run({"surface", "both.obj", "-o", "out.ply", "--cells", "24", "--report",
                                 "report.json", "--lost", "lost." + ending});
        ASSERT_EQ(ended.code, 0) << ended.err;
        EXPECT_NE(ended.err.find("thinner than a cell"), std::string::npos) << ended.err;
        EXPECT_GT(report()["lost_thin_edges"], 50);
        EXPECT_NEAR(report()["lost_thickness"].get<double>(), 0.02, 0.001);
        const auto lost = as_plate(io::read_mesh(in("lost." + ending))), plate = as_plate(plate_);
        EXPECT_GE(lost.size(), 4U) << "its two large faces";
        for (const auto& triangle : lost) EXPECT_TRUE(plate.contains(triangle)) << ending;
    }
    EXPECT_EQ(unfinished_files(), 0U);
}

TEST_F(Lost, TheCellSizeThatKeepsItDoes) {
    ASSERT_EQ(run({"surface", "both.obj", "-o", "out.ply", "--cells", "24", "--report", "report.json"}).code,
              0);
    const auto lost = report()["lost_thin_edges"].get<double>();
    const auto cell_size = report()["keeping_cell_size"].get<double>();
    EXPECT_GT(cell_size, 0.005);
    EXPECT_LT(cell_size, 0.02);
    ASSERT_EQ(run({"surface", "both.obj", "-o", "out.ply", "--cell-size", std::to_string(cell_size),
                   "--report", "report.json"})
                  .code,
              0);
    EXPECT_LE(report()["lost_thin_edges"].get<double>(), lost / 10);
    EXPECT_EQ(report()["pieces"].size(), 2U) << "the block and the plate";
}

TEST_F(Lost, WhereNothingIsLostTheMeshIsEmpty) {
    ASSERT_EQ(run({"surface", "both.obj", "-o", "out.ply", "--cells", "24", "--lost", "lost.obj"}).code, 0);
    EXPECT_NE(text_of(in("lost.obj")).find("\nf "), std::string::npos);
    ASSERT_EQ(run({"surface", "block.obj", "-o", "out.ply", "--cells", "24", "--lost", "lost.obj", "--report",
                   "report.json"})
                  .code,
              0);
    EXPECT_EQ(text_of(in("lost.obj")).find("\nf "), std::string::npos);
    EXPECT_EQ(report()["lost_thin_edges"], 0);
    EXPECT_EQ(report()["lost_thickness"], 0.0);
    EXPECT_EQ(report()["keeping_cell_size"], 0.0);
}

TEST_F(Lost, CutSaysTheSame) {
    write("plane.obj", geometry::make_plane_sheet({0.01, 0, 0}, Vec3(1, 0.2, 0.1), 2));
    const auto words = [](const std::string& command, const std::string& lost) {
        return std::vector<std::string>{command, "both.obj", "-o",          "out.ply", "--cells",
                                        "24",    "--report", "report.json", "--lost",  lost};
    };
    std::vector<std::string> cut = words("cut", "b.ply");
    cut.insert(cut.end(), {"--with", "plane.obj"});
    ASSERT_EQ(run(words("surface", "a.ply")).code, 0);
    const Json before = report();
    ASSERT_EQ(run(cut).code, 0);
    EXPECT_EQ(text_of(in("a.ply")), text_of(in("b.ply")));
    for (const char* key : {"lost_thin_edges", "lost_thickness", "keeping_cell_size", "bisected_edges"})
        EXPECT_EQ(report()[key], before[key]) << key;
}

TEST_F(Lost, BadFilesAreOneLineBeforeAnyWork) {
    const std::vector<std::string> words = {"surface", "both.obj", "-o", "out.ply"};
    const auto with = [&](const std::string& option, const std::string& file) {
        std::vector<std::string> all = words;
        all.insert(all.end(), {option, file});
        return all;
    };
    expect_refused(with("--lost", "lost.txt"), "lost.txt");
    expect_refused(with("--lost", "nowhere/lost.ply"), "nowhere");
    expect_refused(with("--picture", "lost.jpg"), "lost.jpg");
    expect_refused(with("--picture", "nowhere/lost.png"), "nowhere");
#ifndef SPLITCUBES_WITH_RENDER
    const Ended ended = run(with("--picture", "lost.png"));
    EXPECT_EQ(ended.code, 1);
    EXPECT_EQ(lines_of(ended.err).size(), 1U) << ended.err;
#endif
    EXPECT_FALSE(fs::exists(in("out.ply")));
}

#ifdef SPLITCUBES_WITH_RENDER
// Returns the share of a picture's pixels in shades of magenta.
double magenta(const render::Picture& picture) {
    double count = 0;
    for (std::size_t k = 0; k + 2 < picture.rgb.size(); k += 3) {
        const int red = picture.rgb[k], green = picture.rgb[k + 1], blue = picture.rgb[k + 2];
        count += red > green + 80 && blue > green + 80;
    }
    return 3 * count / static_cast<double>(picture.rgb.size());
}

TEST_F(Lost, ThePictureShowsItInMagenta) {
    const auto drawn = [&](const std::string& mesh) {
        const Ended ended =
            run({"surface", mesh, "-o", "out.ply", "--cells", "24", "--picture", "picture.png"});
        EXPECT_EQ(ended.code, 0) << ended.err;
        return magenta(render::read_png(in("picture.png")));
    };
    const Ended first =
        run({"surface", "block.obj", "-o", "out.ply", "--cells", "8", "--picture", "picture.png"});
    if (first.code == 1 && first.err.find("OpenGL cannot start") != std::string::npos)
        GTEST_SKIP() << first.err;
    EXPECT_GT(drawn("both.obj"), 0.05);
    EXPECT_EQ(drawn("block.obj"), 0);
}
#endif

}  // namespace
}  // namespace splitcubes::app_test
