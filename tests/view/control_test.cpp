// Time, undo, recordings, the timeline, parameters and saved files.
#include "view/sessions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

namespace splitcubes::view_tests {
namespace {

const Vec3 stroke_from(0.01, -0.16, 0.1), stroke_to(0.01, 0.16, 0.1);

struct Control : testing::Test {
    TemporaryFolder folder{"control"};
    std::filesystem::path scene = write_block_scene(folder.path);
    HandSession session{scene};
};

TEST_F(Control, StartsPausedAndPlaysPausesAndSteps) {
    session.run(5);
    EXPECT_EQ(session.state().step, 0);
    session.key("space");
    session.run(5);
    EXPECT_EQ(session.state().step, 5);
    EXPECT_TRUE(session.state().playing);
    session.key("space");
    session.run(5);
    EXPECT_EQ(session.state().step, 5);
    session.key(".");
    session.run(5);
    EXPECT_EQ(session.state().step, 6);
}

TEST_F(Control, RestartIsTheBeginning) {
    const std::uint64_t before = session.hash();
    session.key("space");
    session.run(5);
    EXPECT_NE(session.hash(), before);
    session.key("r");
    EXPECT_EQ(session.hash(), before);
    EXPECT_EQ(session.state().step, 0);
}

TEST_F(Control, UndoAndRedoOfACut) {
    session.key("space");
    session.run(2);
    const std::uint64_t before = session.hash();
    session.drag(stroke_from, stroke_to);
    session.run(5);
    const std::uint64_t after = session.hash();
    EXPECT_EQ(session.pieces(), 2U);
    session.key("space");
    session.key("z", control_key);
    EXPECT_EQ(session.pieces(), 1U);
    EXPECT_EQ(session.hash(), before);
    session.key("y", control_key);
    EXPECT_EQ(session.pieces(), 2U);
    EXPECT_EQ(session.hash(), after);
}

TEST_F(Control, UndoWithoutACutSaysSo) {
    session.key("z", control_key);
    EXPECT_EQ(session.state().notice, "there is nothing to undo");
}

TEST_F(Control, ParametersChangeTheRunningSimulation) {
    session.key("space");
    session.run(3);
    session.set("youngs_modulus", 12345);
    session.set("gravity", 3);
    session.set("friction", 0.9);
    session.set("time_step", 0.01);
    session.set("strength", 4000);
    const double time = session.state().time;
    session.run(1);
    const auto& p = session.state().parameters;
    EXPECT_EQ(p[youngs_modulus], 12345);
    EXPECT_EQ(p[gravity], 3);
    EXPECT_EQ(p[friction], 0.9);
    EXPECT_EQ(p[strength], 4000);
    EXPECT_NEAR(session.state().time, time + 0.01, 1e-9);
}

TEST_F(Control, CellSizeTakesEffectWithARestart) {
    const std::size_t before = session.state().bodies[0].topology->triangles.size();
    session.set("cell_size", 0.02);
    EXPECT_EQ(session.state().bodies[0].topology->triangles.size(), before);
    EXPECT_THAT(session.state().notice, testing::HasSubstr("restart"));
    session.key("r");
    EXPECT_LT(session.state().bodies[0].topology->triangles.size(), before);
    EXPECT_EQ(session.state().parameters[cell_size], 0.02);
}

TEST_F(Control, PresetsSetTheirMaterial) {
    for (const Preset& preset : preset_list()) {
        session.act("preset", std::string(preset.name));
        const auto& p = session.state().parameters;
        EXPECT_EQ(p[youngs_modulus], preset.youngs_modulus) << preset.name;
        EXPECT_EQ(p[cutting_resistance], preset.cutting_resistance) << preset.name;
        EXPECT_EQ(p[strength], preset.strength) << preset.name;
        EXPECT_EQ(preset_like(p), &preset) << "the window names it";
        EXPECT_GT(preset.source.size(), 40U);
    }
    session.act("preset", "granite");
    EXPECT_THAT(session.state().notice, testing::HasSubstr("liver"));
}

TEST_F(Control, RecordingRepeatsTheSessionToTheLastBit) {
    session.key("space");
    session.run(2);
    session.set("youngs_modulus", 50000);
    session.drag(stroke_from, stroke_to);
    session.key("z", control_key);
    session.key("4");
    session.drag({0, 0, 0.1}, {0, 0, 0.16});
    session.key("2");
    session.drag({-0.06, 0, 0.1}, {0.06, 0, 0.1});
    session.run(5);
    const std::string file = folder.path / "session.jsonl";
    session.act("save_recording", file);
    EXPECT_EQ(session.state().notice, "saved " + file);
    const std::uint64_t hash = session.hash();
    const std::int64_t steps = session.state().step;

    HandSession again(file);
    again.key("space");
    while (again.state().step < steps) again.frame();
    EXPECT_EQ(again.hash(), hash);
    EXPECT_THAT(again.state().notice, testing::HasSubstr("in the state that was recorded"));
}

TEST_F(Control, SavesSurfacesPiecesAndCheckpoints) {
    session.key("space");
    session.drag(stroke_from, stroke_to);
    session.run(3);
    const std::string surface = folder.path / "surface.ply", checkpoint = folder.path / "state.splitcubes";
    session.act("save_surface", surface);
    session.act("save_pieces", folder.path / "pieces");
    session.act("save_checkpoint", checkpoint);
    EXPECT_EQ(session.state().notice, "saved " + checkpoint);
    EXPECT_TRUE(std::filesystem::exists(surface));
    EXPECT_TRUE(std::filesystem::exists(folder.path / "pieces" / "body-0-piece-1.ply"));
    const std::uint64_t hash = session.hash();
    session.run(5);
    session.act("open", checkpoint);
    EXPECT_EQ(session.hash(), hash);
    EXPECT_EQ(session.pieces(), 2U);
}

TEST_F(Control, RecordingRepeatsWhatCameAfterTheLastStep) {
    session.key("space");
    session.drag(stroke_from, stroke_to);
    const std::uint64_t cut = session.hash();
    session.key("space");
    session.key("z", control_key);
    const std::string file = folder.path / "undone.jsonl";
    session.act("save_recording", file);
    EXPECT_NE(session.hash(), cut);
    const std::int64_t steps = session.state().step;
    HandSession again(file);
    again.key("space");
    while (again.state().step < steps) again.frame();
    EXPECT_EQ(again.hash(), session.hash());
    EXPECT_THAT(again.state().notice, testing::HasSubstr("in the state that was recorded"));
}

TEST_F(Control, OpeningIsShownUntilTheFileIsThereOrRefused) {
    for (const char* name : {"block.json", "nothing.json"}) {
        const std::string file = folder.path / name;
        session.viewer.take({.kind = InputKind::act, .name = "open", .text = file});
        session.viewer.show(session.viewer.state());
        EXPECT_EQ(session.viewer.opening(), file);
        session.frame(0);
        EXPECT_EQ(session.viewer.opening(), "");
    }
}

TEST_F(Control, WrongFilesAreANoticeAndChangeNothing) {
    const std::uint64_t before = session.hash();
    session.act("open", folder.path / "nothing.json");
    EXPECT_THAT(session.state().notice, testing::HasSubstr("nothing.json"));
    const std::string damaged = folder.path / "damaged.jsonl";
    session.act("save_recording", damaged);
    std::ofstream(damaged, std::ios::app)
        << "{\"step\": 1, \"command\": \"begin_stroke\", \"points\": [[0, 0]]}\n";
    session.act("open", damaged);
    EXPECT_THAT(session.state().notice, testing::HasSubstr("damaged.jsonl:2: is no line of a recording"));
    session.act("save_surface", folder.path / "surface.docx");
    EXPECT_THAT(session.state().notice, testing::HasSubstr("surface.docx"));
    EXPECT_EQ(session.hash(), before);
}

TEST(OpenedFiles, MeshBecomesABodyOnATable) {
    HandSession session(std::filesystem::path(SPLITCUBES_SCENES) / "meshes" / "liver.obj");
    EXPECT_NEAR(session.viewer.bounds().min.z(), 0, 0.004);
    session.key("space");
    session.run(40);
    EXPECT_GT(session.viewer.bounds().min.z(), -0.01) << "it lies on the table";
    EXPECT_GT(session.viewer.bounds().max.z(), 0.02);
}

TEST(OpenedFiles, SceneMovesItsOwnTools) {
    HandSession session(std::filesystem::path(SPLITCUBES_SCENES) / "pear_halves.json");
    session.key("space");
    session.run(30);
    EXPECT_FALSE(session.state().instruments.empty()) << "its knife is drawn as a solid";
    session.run(30);
    EXPECT_GE(session.pieces(), 2U);
}

TEST(OpenedFiles, SceneHoldsAndPullsAsInRun) {
    HandSession session(std::filesystem::path(SPLITCUBES_SCENES) / "long_incision.json");
    session.key("space");
    session.run(40);
    // The slab of 0.24 m is held and pulled by 0.02 m at both ends.
    EXPECT_NEAR(session.viewer.bounds().size().x(), 0.28, 0.01);
    session.run(50);
    EXPECT_GT(session.cut_triangles(), 100U);
}

TEST(Thread, StepsInItsOwnTimeAndAnswersAtOnce) {
    const TemporaryFolder folder("thread");
    // The timeline has room for its ends only.
    SimulationThread thread({.threads = 1}, 1);
    Command open;
    open.kind = CommandKind::open;
    open.name = write_block_scene(folder.path);
    const std::uint64_t opened = thread.send(open);
    Command play;
    play.kind = CommandKind::play;
    thread.send(play);
    using Clock = std::chrono::steady_clock;
    const auto until = [&](const auto& done) {
        for (const auto end = Clock::now() + std::chrono::seconds(20); Clock::now() < end;) {
            const auto before = Clock::now();
            const State state = thread.newest();
            EXPECT_LT(Clock::now() - before, std::chrono::milliseconds(500)) << "the window waits for a step";
            if (state && done(*state)) return true;
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        return false;
    };
    EXPECT_TRUE(until([&](const PublishedState& s) { return s.commands >= opened && s.step >= 5; }));
    Command pause;
    pause.kind = CommandKind::pause;
    const std::uint64_t paused = thread.send(pause);
    EXPECT_TRUE(until([&](const PublishedState& s) { return s.commands >= paused && !s.playing; }));
    const std::int64_t step = thread.newest()->step;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_EQ(thread.newest()->step, step);
    ASSERT_TRUE(thread.timeline().range());
    EXPECT_EQ(thread.timeline().range(), (std::pair<std::int64_t, std::int64_t>(0, step)));
    Command seek;
    seek.kind = CommandKind::seek;
    seek.value = 2;
    thread.send(seek);
    EXPECT_TRUE(until([&](const PublishedState&) { return thread.timeline().at(2)->step == 2; }));
    EXPECT_EQ(thread.newest()->step, step) << "the present stays";
}

}  // namespace
}  // namespace splitcubes::view_tests
