// Processes that fail, scenes that shrink, campaigns and the corpus.
#include "hand_made_run.h"

#include "torture/campaign.h"
#include "torture/corpus.h"
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

// A campaign that was interrupted within a line of its report.
TEST_F(Trials, ACampaignGoesOnWhereItStopped) {
    const fs::path runs = folder.path() / "runs", work = folder.path() / "work";
    Campaign campaign;
    campaign.program = script(folder.path(), "echo run >> '" + runs.string() + "'; exit 1");
    campaign.work = work;
    campaign.last = 3;
    campaign.process.memory_gib = 0;
    const auto count = [&] {
        std::ifstream in(runs);
        std::size_t out = 0;
        for (std::string line; std::getline(in, line);) ++out;
        return out;
    };
    EXPECT_FALSE(run_campaign(campaign));
    EXPECT_EQ(count(), 3U);
    campaign.last = 5;
    run_campaign(campaign);
    EXPECT_EQ(count(), 5U);
    fs::resize_file(work / "report.jsonl", fs::file_size(work / "report.jsonl") - 20);
    run_campaign(campaign);
    EXPECT_EQ(count(), 6U);
    campaign.limits.max_blades = 3;
    EXPECT_THROW(run_campaign(campaign), std::runtime_error);
}

class Corpus : public testing::Test {
  protected:
    void write(const std::string& rows) const {
        std::ofstream(folder.path() / "README.md") << "# x\n\n| scene | seed |\n|---|---|\n" << rows;
    }
    void add_scene(const std::string& name) const {
        std::ofstream(folder.path() / (name + ".json")) << falling_box().scene;
    }
    TemporaryFolder folder;
};

TEST_F(Corpus, TableAndScenesAgree) {
    add_scene("a");
    write("| `a` | 1 | energy | rises | 0.3 | fails |\n");
    const std::vector<CorpusRow> rows = read_corpus(folder.path());
    ASSERT_EQ(rows.size(), 1U);
    EXPECT_EQ(rows[0].scene + rows[0].seed + rows[0].law + rows[0].status, "a1energyfails");
    for (const char* row :
         {"| `a` | 1 | energy | rises | 0.3 | perhaps |", "| `a` | 1 | beauty | x | 0.3 | fails |",
          "| `b` | 1 | energy | rises | 0.3 | fails |", "| `a` | 1 |"}) {
        write(std::string(row) + "\n");
        EXPECT_THROW(read_corpus(folder.path()), std::runtime_error) << row;
    }
    write("| `a` | 1 | energy | rises | 0.3 | fails |\n");
    add_scene("b");
    EXPECT_THROW(read_corpus(folder.path()), std::runtime_error);
}

TEST_F(Corpus, ScenesMustDoWhatTheTableSays) {
    const TemporaryFolder work;
    falling_box().write(work.path() / "good");
    add_scene("a");
    write("| `a` | 1 | ended | crashes | 0.3 | holds |\n");
    const fs::path good =
        script(work.path(), "cp -r '" + (work.path() / "good" / "run").string() + "' \"$4\"");
    const ProcessLimits limits{.memory_gib = 0};
    EXPECT_TRUE(run_corpus(folder.path(), "holds", good, work.path() / "runs", limits));
    EXPECT_THROW(run_corpus(folder.path(), "fails", good, work.path() / "runs", limits), std::runtime_error);
    const fs::path bad = script(work.path(), "exit 1");
    EXPECT_FALSE(run_corpus(folder.path(), "holds", bad, work.path() / "runs", limits));
    write("| `a` | 1 | ended | crashes | 0.3 | fails |\n");
    EXPECT_TRUE(run_corpus(folder.path(), "fails", bad, work.path() / "runs", limits));
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
