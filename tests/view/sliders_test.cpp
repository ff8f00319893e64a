// Every slider, by replayed input.
#include "view/sessions.h"

#include <splitcubes/view/parameters.h>
#include <splitcubes/view/replay.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace splitcubes::view_tests {
namespace {

/// A setting and what it is set to; the key of the tool that it is of, or none.
struct Slider {
    std::string name;
    double value;
    std::string tool = "1";
};

void PrintTo(const Slider& slider, std::ostream* out) {
    *out << slider.name;
}

struct Sliders : testing::Test {
    TemporaryFolder folder{"sliders"};
    std::filesystem::path scene = write_block_scene(folder.path, "", 8, 50);

    // A stroke of a tool over the block, with what is set before it.
    ReplayResult stroke(const std::string& tool, const std::vector<Slider>& sliders, int threads = 1) const {
        ReplaySettings settings{.file = scene, .frames = 12, .size = {640, 480}, .threads = threads};
        auto& in = settings.inputs;
        for (const Slider& slider : sliders)
            in.push_back({.kind = InputKind::set, .frame = 0, .name = slider.name, .value = slider.value});
        // Cells and phyxels are made anew with the restart.
        in.push_back({.kind = InputKind::key, .frame = 0, .name = "r"});
        in.push_back({.kind = InputKind::key, .frame = 0, .name = tool});
        in.push_back({.kind = InputKind::key, .frame = 0, .name = "space"});
        in.push_back({.kind = InputKind::press, .frame = 1, .x = 290, .y = 190});
        for (int k = 1; k <= 6; ++k)
            in.push_back({.kind = InputKind::move, .frame = 1 + k, .x = 290.0 + 12 * k, .y = 190.0 + 10 * k});
        in.push_back({.kind = InputKind::release, .frame = 8, .x = 362, .y = 250});
        force = 0;
        return replay_input(settings, [&](const ReplayFrame& frame) {
            force = std::max(force, frame.viewer.state()->statistics.tool_force);
        });
    }
    mutable double force = 0;  // N, the largest one of the last stroke
};

TEST_F(Sliders, OfTheMaterialEndInStatesOfTheirOwn) {
    // A cut to a depth, so that resistance and cells matter.
    const Slider shallow{"knife_through", 0};
    const ReplayResult plain = stroke("1", {shallow});
    EXPECT_EQ(plain.pieces, 1U);
    EXPECT_EQ(stroke("1", {shallow}, 2).state_hash, plain.state_hash);
    EXPECT_GT(force, 0);
    const double plain_force = force;
    std::set<std::uint64_t> hashes = {plain.state_hash};
    for (std::size_t k = 0; k < parameter_count; ++k) {
        const Parameter& parameter = parameter_list()[k];
        double value = parameter.low + 0.3 * (parameter.high - parameter.low);
        if (k == strength) value = 50;
        if (k == time_step) value = 0.01;
        if (k == cell_size) value = 0.04;
        if (k == phyxel_spacing) value = 0.06;
        const ReplayResult one = stroke("1", {shallow, {std::string(parameter.name), value}});
        EXPECT_EQ(one.step, plain.step) << parameter.name;
        EXPECT_GE(one.pieces, 1U);
        // Resistance is what a tool feels.
        if (k == cutting_resistance)
            EXPECT_GT(force, 2 * plain_force);
        else
            EXPECT_TRUE(hashes.insert(one.state_hash).second) << parameter.name;
    }
}

TEST_F(Sliders, OfToolsEndInStatesOfTheirOwn) {
    const std::vector<Slider> sliders = {{"knife_through", 1},           {"knife_depth", 0.05},
                                         {"scalpel_depth", 0.06, "2"},   {"scalpel_tilt", 40, "2"},
                                         {"scissors_length", 0.12, "3"}, {"pull_strength", 5, "4"},
                                         {"pull_strength", 5, "5"},      {"blade_length", 0.4, "6"},
                                         {"forceps_width", 0.06, "8"},   {"forceps_grip", 0.1, "8"}};
    for (const Slider& slider : sliders) {
        const Slider shallow{"knife_through", 0};
        const ReplayResult plain = stroke(slider.tool, {shallow}),
                           one = stroke(slider.tool, {shallow, slider});
        EXPECT_NE(one.state_hash, plain.state_hash) << testing::PrintToString(slider);
        EXPECT_EQ(one.step, plain.step);
        EXPECT_GE(one.pieces, plain.pieces);
    }
}

TEST_F(Sliders, OfSpeedAndTimelineLeaveTheState) {
    const ReplayResult plain = stroke("1", {});
    EXPECT_EQ(stroke("1", {{"speed", 0.1}}).state_hash, plain.state_hash);
    HandSession session(scene);
    session.set("speed", 0.25);
    EXPECT_EQ(session.state().speed, 0.25);
    session.key("+");
    EXPECT_NEAR(session.state().speed, 0.375, 1e-9);
}

}  // namespace
}  // namespace splitcubes::view_tests
