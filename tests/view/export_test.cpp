// Files that a session leaves: scenes and paths of its strokes, the rate over its steps; runs that are played
// back.
#include "view/sessions.h"

#include <splitcubes/core/error.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/write_mesh.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/view/run_player.h>
#include <splitcubes/view/session_curve.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <sstream>

namespace splitcubes::view_tests {
namespace {

const Vec3 line_from(0.01, -0.16, 0.1), line_to(0.01, 0.16, 0.1);

std::string text_of(const std::filesystem::path& file) {
    std::stringstream out;
    out << std::ifstream(file).rdbuf();
    return out.str();
}

struct Export : testing::Test {
    TemporaryFolder folder{"export"};
    HandSession session{write_block_scene(folder.path)};

    void cut() {
        session.key("space");
        session.run(2);
        session.drag(line_from, line_to, 20);
        session.run(5);
    }
};

TEST_F(Export, SceneWithTheStrokesCutsTheSame) {
    cut();
    const std::string file = folder.path / "cut.json";
    session.act("save_scene", file);
    ASSERT_EQ(session.state().notice, "saved " + file);
    HandSession again(file);
    again.key("space");
    while (again.state().step < session.state().step) again.frame();
    EXPECT_EQ(again.pieces(), 2U);
    EXPECT_NEAR(static_cast<double>(again.cut_triangles()), static_cast<double>(session.cut_triangles()), 20);
    const auto a = session.state().bodies[0].bounds, b = again.state().bodies[0].bounds;
    EXPECT_LT((a.min - b.min).norm() + (a.max - b.max).norm(), 0.004);
}

TEST_F(Export, SceneHasPullsAndPresentParameters) {
    session.key("space");
    session.set("youngs_modulus", 12345);
    session.set("gravity", 3);
    session.key("4");
    session.drag({0, 0, 0.1}, {0, 0, 0.16});
    session.key("7");
    session.press({0.05, 0.05, 0.1});
    session.release({0.05, 0.05, 0.1});
    session.run(2);
    const std::string file = folder.path / "pulled.json";
    session.act("save_scene", file);
    const scene::SceneDescription scene = scene::parse_scene_file(file);
    EXPECT_EQ(scene.bodies[0].material.youngs_modulus, 12345);
    EXPECT_EQ(scene.gravity, Vec3(0, 0, -3));
    ASSERT_EQ(scene.handles.size(), 2U);
    EXPECT_TRUE(scene.handles[0].until_time);
    EXPECT_FALSE(scene.handles[1].until_time) << "a pin stays";
    EXPECT_NEAR(scene.handles[0].keyframes.back().position.z(), 0.06, 0.03);
    EXPECT_TRUE(scene.tools.empty());
}

// Forceps are two handles with a limit, and the recording repeats them.
TEST_F(Export, ForcepsAreInScenesAndRecordings) {
    session.key("space");
    session.key("8");
    session.drag({0, 0, 0.1}, {0, 0, 0.12}, 30);
    const std::string file = folder.path / "gripped.json", recording = folder.path / "gripped.jsonl";
    session.act("save_scene", file);
    const scene::SceneDescription scene = scene::parse_scene_file(file);
    ASSERT_EQ(scene.handles.size(), 2U);
    const double limit = session.viewer.tools().grip_limit(session.state());
    for (const scene::HandleDescription& jaw : scene.handles) {
        ASSERT_TRUE(jaw.force_limit);
        EXPECT_NEAR(*jaw.force_limit, 0.5 * limit, 1e-9 * limit);
        EXPECT_TRUE(jaw.until_time);
        EXPECT_GT(jaw.keyframes.back().position.z(), 0.01);
    }
    const auto gap = [&](bool closed) {
        Vec3 out = Vec3::Zero();
        for (const int k : {0, 1}) {
            const scene::HandleDescription& jaw = scene.handles[static_cast<std::size_t>(k)];
            const Vec3 moved = closed ? jaw.keyframes.back().position : jaw.keyframes.front().position;
            out += (k == 0 ? 1 : -1) * (jaw.pivot + moved);
        }
        return out.norm();
    };
    EXPECT_LT(gap(true), 0.9 * gap(false)) << "they closed towards each other";
    session.act("save_recording", recording);
    const std::int64_t steps = session.state().step;
    const std::uint64_t hash = session.hash();
    HandSession again(recording);
    again.key("space");
    while (again.state().step < steps) again.frame();
    EXPECT_EQ(again.hash(), hash);
}

TEST_F(Export, PathHasTheStrokesThatWereNotUndone) {
    cut();
    session.drag({-0.04, -0.16, 0.1}, {-0.04, 0.16, 0.1}, 20);
    const std::string file = folder.path / "path.json";
    session.act("save_path", file);
    EXPECT_EQ(scene::parse_path_file(file).size(), 2U);
    session.key("z", control_key);
    session.act("save_path", file);
    ASSERT_EQ(scene::parse_path_file(file).size(), 1U);
    session.key("y", control_key);
    session.act("save_path", file);
    EXPECT_EQ(scene::parse_path_file(file).size(), 2U);
    session.key("z", control_key);
    session.key("z", control_key);
    session.act("save_path", file);
    EXPECT_THAT(session.state().notice, testing::HasSubstr("there is no stroke yet"));
}

TEST_F(Export, PathIsInTheCoordinatesOfTheMesh) {
    // A mesh that lies elsewhere and is drawn in millimetres; the window puts it on the table in metres.
    geometry::TriangleMesh mesh = geometry::make_box(Vec3(6000, 6000, 3000));
    for (Vec3& p : mesh.positions) p += Vec3(6000, 9000, 10500);
    io::write_mesh(folder.path / "large box.obj", geometry::SurfaceMesh{mesh, {}, {}, {}});
    HandSession large(folder.path / "large box.obj");
    OrbitCamera camera;
    camera.look({10, -10, 12}, {0, 0, 1.5});
    large.viewer.set_camera(camera);
    large.key("space");
    large.run(2);
    large.drag({0.3, -4.5, 3}, {0.3, 4.5, 3}, 10);
    const std::string file = folder.path / "path.json";
    large.act("save_path", file);
    const auto tools = scene::parse_path_file(file);
    const auto& keyframes = std::get<scene::KeyframeMotion>(tools.at(0).motion).keyframes;
    // Off the body the blade is anywhere along the view.
    const Vec3 middle = keyframes[keyframes.size() / 2].position;
    EXPECT_NEAR(middle.x(), 6000 + 300, 400);
    EXPECT_NEAR(middle.y(), 9000, 1500);
    EXPECT_NEAR(middle.z(), 12000, 600);
}

TEST(FittedMotions, AreThoseOfRigidBodies) {
    const Isometry motion = Eigen::Translation3d(1, -2, 3) * Eigen::AngleAxisd(2, Vec3(1, 2, 3).normalized());
    std::vector<float> rest, world;
    std::vector<std::int32_t> pieces;
    for (int k = 0; k < 60; ++k) {
        const Vec3 p(std::sin(k), std::cos(2.3 * k), std::sin(1.7 * k + 1));
        const Vec3 q = k < 30 ? Vec3(motion * p) : p;
        for (int axis = 0; axis < 3; ++axis) {
            rest.push_back(static_cast<float>(p[axis]));
            world.push_back(static_cast<float>(q[axis]));
        }
        pieces.push_back(k < 30 ? 0 : 1);
    }
    SurfaceView surface;
    surface.rest_positions = rest;
    surface.positions = world;
    surface.pieces = pieces;
    EXPECT_TRUE(fitted_motion(surface, 0).isApprox(motion, 1e-5));
    EXPECT_TRUE(fitted_motion(surface, 1).isApprox(Isometry::Identity(), 1e-5));
    EXPECT_TRUE(fitted_motion(surface, 7).matrix().allFinite());
}

TEST_F(Export, CurveHasAStepALineAndADiagram) {
    cut();
    const std::filesystem::path csv = folder.path / "curve.csv", svg = folder.path / "curve.svg";
    session.act("save_curve", csv);
    session.act("save_curve", svg);
    const std::string text = text_of(csv);
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), session.state().step + 1);
    EXPECT_THAT(text, testing::StartsWith("step,time_s,step_ms,steps_per_second,triangles,pieces,cut_edges"));
    EXPECT_THAT(text_of(svg), testing::HasSubstr("</svg>"));
    session.act("save_curve", folder.path / "curve.docx");
    EXPECT_THAT(session.state().notice, testing::HasSubstr("unknown ending"));
}

TEST(SessionCurves, AreBoundedAndGoBack) {
    SessionCurve curve;
    for (int k = 1; k <= 50000; ++k) curve.add({.step = k, .step_ms = 1});
    EXPECT_LE(curve.points().size(), SessionCurve::max_points);
    EXPECT_GT(curve.points().back().step, 49990);
    curve.go_back(100);
    EXPECT_LE(curve.points().back().step, 100);
}

/// A run of three frames: a block whose second piece rises.
std::filesystem::path write_run(const std::filesystem::path& folder) {
    const std::filesystem::path run = folder / "run";
    std::filesystem::create_directories(run / "surface");
    std::ofstream(run / "scene.json") << text_of(write_block_scene(folder));
    for (int frame = 0; frame < 3; ++frame) {
        geometry::SurfaceMesh surface;
        for (int piece = 0; piece < 2; ++piece)
            for (int c = 0; c < 4; ++c) {
                surface.mesh.positions.emplace_back(c == 1, c == 2, (c == 3) + 0.5 * piece * frame + piece);
                surface.vertex_piece.push_back(piece);
            }
        for (const std::uint32_t first : {0U, 4U})
            for (const auto& t : {geometry::Triangle{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
                surface.mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
                surface.triangle_origin.push_back(first > 0 && t[0] == 1 ? geometry::Origin::cut
                                                                         : geometry::Origin::boundary);
            }
        io::write_mesh(run / "surface" / ("00000" + std::to_string(frame) + ".ply"), surface);
    }
    return run;
}

TEST(Runs, ArePlayedBackScrubbedAndNotCut) {
    const TemporaryFolder folder("run");
    HandSession session(write_run(folder.path));
    EXPECT_EQ(session.state().run_frames, 3);
    EXPECT_EQ(session.state().bodies.size(), 1U);
    EXPECT_EQ(session.pieces(), 2U);
    EXPECT_EQ(session.cut_triangles(), 1U);
    const double low = session.viewer.bounds().max.z();
    session.key("space");
    session.run(10);
    EXPECT_EQ(session.state().step, 2);
    EXPECT_FALSE(session.state().playing) << "it pauses at its end";
    EXPECT_GT(session.viewer.bounds().max.z(), low + 0.9);
    session.set("timeline", 1);
    EXPECT_EQ(session.state().step, 1);
    EXPECT_NEAR(session.state().time, 1.0 / 60, 1e-9);
    const Vec3 eye = session.viewer.camera().eye();
    session.drag({0, 0, 0.1}, {0.1, 0, 0.1});
    EXPECT_NE(session.viewer.camera().eye(), eye) << "the left button turns the view";
    EXPECT_EQ(session.state().blades.size(), 0U);
    session.key("z", control_key);
    EXPECT_THAT(session.state().notice, testing::HasSubstr("to cut, open its scene"));
    session.act("open", write_block_scene(folder.path));
    EXPECT_EQ(session.state().run_frames, 0);
}

TEST(Runs, WithoutFramesOrWithDamagedOnesAreNotices) {
    const TemporaryFolder folder("damaged");
    const auto run = write_run(folder.path);
    HandSession session(run);
    std::ofstream(run / "surface" / "000001.ply") << "no mesh";
    session.key(".");
    session.run(1);
    EXPECT_THAT(session.state().notice, testing::HasSubstr("000001.ply"));
    EXPECT_EQ(session.pieces(), 2U);
    for (int k = 0; k < 3; ++k)
        std::filesystem::remove(run / "surface" / ("00000" + std::to_string(k) + ".ply"));
    EXPECT_THROW(RunPlayer{run}, InputError);
    EXPECT_FALSE(is_run(folder.path));
}

TEST_F(Export, AgesAndNumbersOfCutsFollowUndo) {
    cut();
    const double first = session.state().time;
    session.drag({-0.04, -0.16, 0.1}, {-0.04, 0.16, 0.1}, 20);
    const auto births = [&](std::set<std::int32_t>& cuts) {
        const SurfaceTopology& topology = *session.viewer.state()->bodies[0].topology;
        std::pair<double, double> out(1e9, -1);
        for (std::size_t t = 0; t < topology.born.size(); ++t) {
            if (topology.triangles[3 * t] == topology.triangles[3 * t + 1]) continue;
            EXPECT_EQ(topology.born[t] >= 0, topology.origins[t] == SurfaceOrigin::cut);
            if (topology.born[t] < 0) continue;
            cuts.insert(topology.cuts[t]);
            out.first = std::min<double>(out.first, topology.born[t]);
            out.second = std::max<double>(out.second, topology.born[t]);
        }
        return out;
    };
    std::set<std::int32_t> both, one;
    const auto [oldest, newest] = births(both);
    EXPECT_EQ(both.size(), 2U);
    EXPECT_LT(oldest, first);
    EXPECT_GT(newest, first);
    session.key("z", control_key);
    EXPECT_LE(births(one).second, first);
    EXPECT_EQ(one.size(), 1U);
}

TEST_F(Export, SixAxesMoveTheFreeBladeOrTheView) {
    const auto move = [&](std::array<double, 6> axes) {
        session.viewer.take({.kind = InputKind::six_axis, .axes = axes});
    };
    const Vec3 eye = session.viewer.camera().eye();
    move({0.1, 0, 0, 0, 0.2, 0});
    EXPECT_GT((session.viewer.camera().eye() - eye).norm(), 0.01);
    session.key("6");
    const Vec3 still = session.viewer.camera().eye();
    const auto blade = [&] {
        const auto points = session.viewer.tools().overlay(session.viewer.context()).back().points;
        return std::pair{Vec3(0.5 * (points[0] + points[1])), Vec3((points[1] - points[0]).normalized())};
    };
    const auto [at, along] = blade();
    move({0.1, 0, 0, 0, 0, 0});
    EXPECT_EQ(session.viewer.camera().eye(), still);
    EXPECT_NEAR((blade().first - at).dot(session.viewer.camera().right()),
                0.1 * session.viewer.camera().distance, 1e-9);
    move({0, 0, 0, 0, 0, 0.3});
    EXPECT_NEAR(blade().second.dot(along), std::cos(0.3), 1e-9);
    EXPECT_EQ(
        input_of_line(input_line({.kind = InputKind::six_axis, .axes = {1, 2, 3, 4, 5, 6}}), "x").axes[5], 6);
    EXPECT_THROW(input_of_line(R"({"kind": "six_axis", "axes": [1]})", "x"), InputError);
}

}  // namespace
}  // namespace splitcubes::view_tests
