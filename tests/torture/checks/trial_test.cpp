// Processes that fail, and scenes that shrink.
#include "hand_made_run.h"

#include "torture/shrink.h"
#include "torture/trial.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace splitcubes::torture {
namespace {

namespace fs = std::filesystem;

// A program in place of splitcubes; $4 is the folder of the run.
fs::path script(const fs::path& folder, const std::string& text) {
    const fs::path out = folder / "program";
    std::ofstream(out) << "#!/bin/sh\n" << text << "\n";
    fs::permissions(out, fs::perms::owner_all);
    return out;
}

class Trials : public testing::Test {
  protected:
    Trials() {
        falling_box().write(folder.path() / "good");
        fs::create_directories(folder.path() / "scene");
        fs::copy(folder.path() / "good" / "scene.json", folder.path() / "scene");
    }
    Trial run(const std::string& text, double seconds = 60) const {
        return run_trial(script(folder.path(), text), folder.path() / "scene",
                         {.seconds = seconds, .memory_gib = 0});
    }
    // Shell text that leaves the good run.
    std::string leave_good() const {
        return "cp -r '" + (folder.path() / "good" / "run").string() + "' \"$4\"";
    }

    TemporaryFolder folder;
};

TEST_F(Trials, AGoodRunHolds) {
    EXPECT_TRUE(run(leave_good()).verdict.holds());
}

TEST_F(Trials, AnExitCodeBreaksALaw) {
    const Trial trial = run(leave_good() + "; echo first >&2; echo reason >&2; exit 1");
    EXPECT_TRUE(trial.verdict.breaks(Law::ended));
    EXPECT_EQ(trial.verdict.of(Law::ended).note, "reason");
    EXPECT_FALSE(trial.refused());
    EXPECT_TRUE(run("exit 2").refused());
}

TEST_F(Trials, ASignalBreaksALaw) {
    const Trial trial = run("kill -SEGV $$");
    EXPECT_TRUE(trial.verdict.breaks(Law::ended));
    EXPECT_EQ(trial.verdict.of(Law::ended).note, "signal 11");
}

TEST_F(Trials, SlownessBreaksALawAndWhatWasWrittenCounts) {
    const Trial trial = run(leave_good() + "; while true; do :; done", 0.2);
    EXPECT_TRUE(trial.verdict.breaks(Law::time));
    EXPECT_FALSE(trial.verdict.breaks(Law::complete));
    EXPECT_TRUE(trial.verdict.of(Law::energy).measured);
}

TEST_F(Trials, ARunThatWritesNothingIsIncomplete) {
    EXPECT_TRUE(run("exit 0").verdict.breaks(Law::complete));
}

TEST_F(Trials, ShrinkLeavesTheBladesThatMatter) {
    // Fails where both blades are there, whatever else is.
    nlohmann::ordered_json scene = falling_box().scene;
    for (int k = 0; k < 12; ++k) scene["tools"].push_back({{"name", "blade" + std::to_string(k)}});
    scene["handles"] = nlohmann::ordered_json::array();
    std::ofstream(folder.path() / "scene" / "scene.json") << scene;
    const fs::path program = script(
        folder.path(), leave_good() + "; if grep -q blade3 \"$2\" && grep -q blade9 \"$2\"; then exit 1; fi");
    shrink_scene({.program = program, .folder = folder.path() / "scene", .law = Law::ended});
    std::ifstream in(folder.path() / "scene" / "shrunk" / "scene.json");
    const auto left = nlohmann::ordered_json::parse(in);
    ASSERT_EQ(left["tools"].size(), 2U);
    EXPECT_EQ(left["tools"][0]["name"], "blade3");
    EXPECT_EQ(left["tools"][1]["name"], "blade9");
    EXPECT_FALSE(left.contains("handles"));
    EXPECT_THROW(shrink_scene({.program = program, .folder = folder.path() / "scene", .law = Law::energy}),
                 std::runtime_error);
}

TEST(Shrink, FindsTheSmallestFailingSet) {
    int trials = 0;
    const auto fails = [&](const std::vector<std::size_t>& chosen) {
        ++trials;
        return std::count(chosen.begin(), chosen.end(), 3) + std::count(chosen.begin(), chosen.end(), 17) +
                   std::count(chosen.begin(), chosen.end(), 88) ==
               3;
    };
    EXPECT_EQ(smallest_failing(100, fails), (std::vector<std::size_t>{3, 17, 88}));
    EXPECT_LT(trials, 150);
    EXPECT_TRUE(smallest_failing(100, [](const auto&) { return true; }).empty());
    EXPECT_TRUE(smallest_failing(0, [](const auto&) { return true; }).empty());
}

}  // namespace
}  // namespace splitcubes::torture
