// Graphs' data, latencies, kept settings and replays.
#include "view/sessions.h"

#include <splitcubes/view/kept_settings.h>
#include <splitcubes/view/replay.h>
#include <splitcubes/view/simulation_loop.h>
#include <splitcubes/view/step_history.h>
#include <splitcubes/view/viewer.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <splitcubes/core/error.h>

namespace splitcubes::view_tests {
namespace {

TEST(Spreads, AreMedianHighAndWorst) {
    std::vector<double> values;
    for (int k = 100; k >= 0; --k) values.push_back(k);
    const Spread spread = spread_of(values);
    EXPECT_EQ(spread.median, 50);
    EXPECT_EQ(spread.high, 99);
    EXPECT_EQ(spread.worst, 100);
    EXPECT_EQ(spread_of({}).worst, 0);
}

TEST(Histories, KeepTheLastStepsOnce) {
    StepHistory history;
    PublishedState state;
    for (int k = 1; k <= 400; ++k) {
        state.step = k;
        state.statistics.step_ms = k;
        history.add(state);
        history.add(state);
    }
    EXPECT_EQ(history.steps().size(), history_length);
    EXPECT_EQ(history.total().worst, 400);
    state.step = 3;
    history.add(state);
    EXPECT_EQ(history.steps().size(), 1U) << "an earlier step begins anew";
}

TEST(LatencyMeasure, IsFromTheEventToItsPicture) {
    Latencies latencies;
    latencies.sent(1, 1.0);
    latencies.sent(2, 1.1);
    latencies.shown(0, 1.2);
    EXPECT_EQ(latencies.count(), 0U);
    latencies.shown(1, 1.25);
    EXPECT_EQ(latencies.count(), 1U);
    EXPECT_NEAR(latencies.spread().worst, 250, 1e-9);
    latencies.shown(5, 1.3);
    EXPECT_EQ(latencies.count(), 2U);
    EXPECT_NEAR(latencies.spread().worst, 250, 1e-9);
}

TEST(KeptSettings, AreThereAgainInTheNextSession) {
    const TemporaryFolder folder("settings");
    const auto file = folder.path / "deep" / "viewer.json";
    Viewer first;
    first.take({.kind = InputKind::set, .name = "colouring", .value = 3});
    first.take({.kind = InputKind::set, .name = "scalpel_tilt", .value = -20});
    save_settings(file, first);
    Viewer second;
    load_settings(file, second);
    EXPECT_EQ(second.display().colouring, Colouring::principal_stress);
    EXPECT_EQ(second.setting("scalpel_tilt"), -20);
    std::ofstream(file) << "{ damaged";
    Viewer third;
    load_settings(file, third);
    load_settings(folder.path / "missing.json", third);
    EXPECT_EQ(third.display().colouring, Colouring::material);
}

TEST(Replays, AreTheSameForAnyNumberOfThreads) {
    const TemporaryFolder folder("replay");
    ReplaySettings settings{.file = write_block_scene(folder.path), .frames = 25, .size = {640, 480}};
    settings.inputs = {{.kind = InputKind::key, .frame = 0, .name = "space"},
                       {.kind = InputKind::press, .frame = 2, .x = 320, .y = 60}};
    for (int k = 0; k < 12; ++k)
        settings.inputs.push_back({.kind = InputKind::move, .frame = 3 + k, .x = 320, .y = 60.0 + 30 * k});
    settings.inputs.push_back({.kind = InputKind::release, .frame = 15, .x = 320, .y = 420});
    settings.inputs.push_back({.kind = InputKind::act, .frame = 18, .name = "save_picture", .text = "a.png"});
    std::vector<ReplayResult> results;
    for (const int threads : {1, 2}) {
        settings.threads = threads;
        int frames = 0, pictures = 0;
        results.push_back(replay_input(settings, [&](const ReplayFrame& frame) {
            ++frames;
            for (const auto& [act, text] : frame.acts)
                pictures += act == WindowAct::save_picture && text == "a.png";
        }));
        EXPECT_EQ(frames, 25);
        EXPECT_EQ(pictures, 1);
    }
    EXPECT_EQ(results[0].state_hash, results[1].state_hash);
    EXPECT_EQ(results[0].pieces, 2U);
    EXPECT_EQ(results[0].step, 25);
}

TEST(Replays, RefuseUnknownNames) {
    const TemporaryFolder folder("unknown");
    ReplaySettings settings{.file = write_block_scene(folder.path), .frames = 2, .size = {640, 480}};
    settings.inputs = {{.kind = InputKind::set, .name = "stickiness", .value = 1}};
    EXPECT_THROW(replay_input(settings, [](const ReplayFrame&) {}), InputError);
}

}  // namespace
}  // namespace splitcubes::view_tests
