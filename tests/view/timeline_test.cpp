// The past: what a timeline keeps, and what is made again of it.
#include "view/sessions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace splitcubes::view_tests {
namespace {

const Vec3 past_from(0.01, -0.16, 0.1), past_to(0.01, 0.16, 0.1);

bool is_always_wanted() {
    return true;
}

struct Past : testing::Test {
    TemporaryFolder folder{"past"};
    HandSession session{write_block_scene(folder.path, "", 8, 50)};
    std::vector<State> all;  // by step
    std::vector<std::uint64_t> hashes;

    void SetUp() override {
        session.key("space");
        note();
    }
    void note() {
        all.resize(static_cast<std::size_t>(session.state().step));
        hashes.resize(all.size());
        all.push_back(session.viewer.state());
        hashes.push_back(session.hash());
    }
    void frame() {
        session.frame();
        note();
    }
    void run(int frames) {
        for (int k = 0; k < frames; ++k) frame();
    }
    void stroke(const Vec3& from, const Vec3& to, int frames) {
        session.press(from);
        for (int k = 1; k <= frames; ++k) {
            session.move(from + (to - from) * k / frames);
            frame();
        }
        session.release(to);
        run(4);
    }
    // The state of a step, out of a timeline that knows the ends only.
    State again(std::int64_t step) {
        Timeline timeline(std::size_t{64} << 20);
        timeline.add(all.front());
        timeline.add(session.viewer.state());
        session.viewer.take({.kind = InputKind::set, .name = "timeline", .value = static_cast<double>(step)});
        session.loop.take(session.viewer.take_commands());
        session.loop.fill_timeline(timeline, is_always_wanted);
        return timeline.at(step);
    }
};

void expect_same(const PublishedState& a, const PublishedState& b) {
    ASSERT_EQ(a.step, b.step);
    SCOPED_TRACE("step " + std::to_string(a.step));
    EXPECT_EQ(a.time, b.time);
    ASSERT_EQ(a.bodies.size(), b.bodies.size());
    for (std::size_t k = 0; k < a.bodies.size(); ++k) {
        EXPECT_EQ(a.bodies[k].pieces, b.bodies[k].pieces);
        EXPECT_EQ(a.bodies[k].topology->triangles, b.bodies[k].topology->triangles);
        const SurfaceTopology &one = *a.bodies[k].topology, &other = *b.bodies[k].topology;
        bool has_same_births = true;
        for (std::size_t t = 0; t < one.born.size(); ++t)
            has_same_births = has_same_births && (one.triangles[3 * t] == one.triangles[3 * t + 1] ||
                                                  one.born[t] == other.born[t]);
        EXPECT_TRUE(has_same_births);
        EXPECT_EQ(a.bodies[k].positions, b.bodies[k].positions);
    }
    EXPECT_EQ(a.blades.size(), b.blades.size());
    EXPECT_EQ(a.pulls.size(), b.pulls.size());
    EXPECT_EQ(a.parameters, b.parameters);
}

TEST_F(Past, IsMadeAgainToTheLastBitAndThePresentStaysAsItIs) {
    stroke(past_from, past_to, 26);
    session.set("youngs_modulus", 50000);
    session.key("4");
    session.press({-0.05, 0, 0.1});
    session.move({-0.05, 0, 0.14});
    run(8);
    const std::uint64_t now = session.hash();
    const std::size_t undos = session.state().undo_count;
    for (const std::int64_t step : {0, 7, 21, 33, 36}) {
        const State past = again(step);
        ASSERT_TRUE(past);
        expect_same(*past, *all[static_cast<std::size_t>(step)]);
        EXPECT_EQ(session.hash(), now) << "after a look at step " << step;
    }
    session.key("escape");
    EXPECT_EQ(session.state().undo_count, undos);
    EXPECT_EQ(session.state().notice, all.back()->notice);

    // Another session that never looks back comes to the same end.
    session.key("space");
    session.run(5);
    const std::string file = folder.path / "session.jsonl";
    session.act("save_recording", file);
    const std::int64_t steps = session.state().step;
    const std::uint64_t end = session.hash();
    HandSession other(file);
    other.key("space");
    while (other.state().step < steps) other.frame();
    EXPECT_EQ(other.hash(), end);
}

TEST_F(Past, IsMadeAgainOnBothSidesOfAnUndo) {
    stroke(past_from, past_to, 20);
    run(4);
    session.key("z", control_key);
    stroke({-0.16, 0, 0.1}, {0.16, 0, 0.1}, 12);
    session.key("z", control_key);
    session.key("y", control_key);
    run(6);
    const std::uint64_t now = session.hash();
    for (std::int64_t step = 0; step < session.state().step; step += 9) {
        const State past = again(step);
        ASSERT_TRUE(past);
        expect_same(*past, *all[static_cast<std::size_t>(step)]);
    }
    EXPECT_EQ(session.hash(), now);
}

// No state but the ends is kept: every step is made from the first one, through all undos and redos.
TEST_F(Past, IsMadeAgainThroughUndoAndRedoFromWhatIsLeft) {
    const TemporaryFolder other("past-thin");
    HandSession thin(write_block_scene(other.path, "", 8, 50), {.threads = 2, .timeline_bytes = 1});
    std::vector<State> states;
    const auto note_state = [&] {
        states.resize(static_cast<std::size_t>(thin.state().step));
        states.push_back(thin.viewer.state());
    };
    const auto run_on = [&](int frames) {
        for (int k = 0; k < frames; ++k) {
            thin.frame();
            note_state();
        }
    };
    const auto drag_on = [&](const char* tool, const Vec3& from, const Vec3& to, bool pins = false) {
        thin.key(tool);
        thin.press(from);
        for (int k = 1; k <= 10; ++k) {
            thin.move(from + (to - from) * k / 10);
            run_on(1);
        }
        if (pins) thin.key("p");
        thin.release(to);
        run_on(4);
    };
    const auto travel = [&](const char* key) {
        thin.key(key, control_key);
        note_state();
        run_on(5);
    };
    thin.key("space");
    note_state();
    run_on(3);
    drag_on("4", {-0.06, 0.06, 0.1}, {-0.06, 0.06, 0.12}, true);
    drag_on("1", past_from, past_to);
    travel("z");
    drag_on("8", {0.06, 0, 0.1}, {0.06, 0, 0.11}, true);
    drag_on("1", {-0.16, 0.02, 0.1}, {0.16, 0.02, 0.1});
    travel("z");
    travel("z");
    travel("y");
    travel("y");
    drag_on("4", {0.06, -0.06, 0.1}, {0.06, -0.06, 0.13});
    travel("z");
    run_on(6);
    Engine& engine = *thin.loop.engine();
    EXPECT_LE(engine.kept_steps().size(), 2U);
    const std::uint64_t now = thin.hash();
    for (std::int64_t step = 1; step < thin.state().step; step += 4) {
        const auto past = engine.look_back(step, is_always_wanted);
        ASSERT_TRUE(past) << step;
        expect_same(*past, *states[static_cast<std::size_t>(step)]);
    }
    EXPECT_EQ(thin.hash(), now);
    // Going on from there is the same, and the recording of it, too.
    const std::int64_t step = thin.state().step - 13;  // before the last undo
    thin.set("timeline", static_cast<double>(step));
    thin.act("resume");
    EXPECT_EQ(thin.state().step, step);
    expect_same(thin.state(), *states[static_cast<std::size_t>(step)]);
    thin.key("space");
    thin.run(6);
    const std::string file = other.path / "thin.jsonl";
    thin.act("save_recording", file);
    const std::int64_t steps = thin.state().step;
    HandSession again(file);
    again.key("space");
    while (again.state().step < steps) again.frame();
    EXPECT_EQ(again.hash(), thin.hash());
}

TEST_F(Past, OfASceneWithToolsAndHandlesIsMadeAgain) {
    const TemporaryFolder other("past-scene");
    session.act("open", write_block_scene(other.path, R"(,
  "tools": [{"name": "knife", "blades": [{"straight": {"from": [0, -0.2, 0], "to": [0, 0.2, 0]}}],
             "motion": {"path": {"keyframes": [{"time": 0.05, "position": [0.02, 0, 0.12]},
                                               {"time": 0.6, "position": [0.02, 0, -0.02]}]}}}],
  "handles": [{"name": "hand", "body": "block", "region": {"sphere": {"center": [-0.08, 0, 0.1], "radius": 0.03}},
               "until_time": 0.4, "keyframes": [{"time": 0}, {"time": 0.5, "position": [0, 0, 0.05]}]}])",
                                          8, 50));
    note();
    session.key("space");
    if (!session.loop.is_playing()) session.key("space");
    run(45);
    const std::uint64_t now = session.hash();
    for (const std::int64_t step : {3, 33}) expect_same(*again(step), *all[static_cast<std::size_t>(step)]);
    EXPECT_EQ(session.hash(), now);
}

TEST_F(Past, LooksInTheMiddleOfAStrokeChangeNothing) {
    HandSession twin(folder.path / "block.json");
    twin.key("space");
    for (HandSession* one : {&session, &twin}) {
        const auto frame = [&] { one == &session ? this->frame() : one->frame(); };
        one->press(past_from);
        for (int k = 1; k <= 24; ++k) {
            one->move(past_from + (past_to - past_from) * k / 24);
            frame();
            if (one == &session && k % 5 == 3) {
                one->loop.engine()->look_back(k / 2, is_always_wanted);
            }
        }
        one->release(past_to);
        for (int k = 0; k < 8; ++k) frame();
    }
    EXPECT_EQ(twin.hash(), session.hash());
}

TEST_F(Past, OfNoStepOrOfNoInterestIsNotMade) {
    run(10);
    Engine& engine = *session.loop.engine();
    EXPECT_EQ(engine.look_back(10, is_always_wanted), nullptr) << "that is the present";
    EXPECT_EQ(engine.look_back(-1, is_always_wanted), nullptr);
    const std::uint64_t now = session.hash();
    EXPECT_EQ(engine.look_back(5, [] { return false; }), nullptr);
    EXPECT_EQ(session.hash(), now);
    EXPECT_EQ(session.state().step, 10);
}

TEST_F(Past, GoesOn) {
    stroke(past_from, past_to, 40);
    run(36);
    for (const int step : {60, 35, 20}) {
        session.set("timeline", step);
        EXPECT_EQ(session.viewer.scrubbed(), step);
        session.act("resume");
        EXPECT_FALSE(session.viewer.scrubbed());
        EXPECT_EQ(session.state().step, step);
        if (step == 60) EXPECT_EQ(session.hash(), hashes[static_cast<std::size_t>(step)]);
        EXPECT_FALSE(session.state().playing);
    }
}

TEST_F(Past, GoesOnAfterAnUndo) {
    stroke(past_from, past_to, 12);
    session.key("z", control_key);
    run(10);
    const std::int64_t step = session.state().step - 4;
    session.set("timeline", static_cast<double>(step));
    session.act("resume");
    EXPECT_EQ(session.state().step, step);
    EXPECT_EQ(session.hash(), hashes[static_cast<std::size_t>(step)]);
}

State state_of(std::int64_t step, const std::shared_ptr<const SurfaceTopology>& topology = nullptr) {
    auto out = std::make_shared<PublishedState>();
    out->step = step;
    if (topology) {
        out->bodies.emplace_back();
        out->bodies[0].topology = topology;
        out->bodies[0].positions.assign(300, 0.0F);
    }
    return out;
}

TEST(TimelineBudget, ThinsThePastAndKeepsItsEnds) {
    constexpr std::size_t budget = 400000;
    Timeline timeline(budget);
    std::shared_ptr<SurfaceTopology> topology;
    for (int k = 0; k < 4000; ++k) {
        if (k % 50 == 0) {
            topology = std::make_shared<SurfaceTopology>();
            topology->triangles.assign(300, 0);
        }
        timeline.add(state_of(k, topology));
        ASSERT_LE(timeline.bytes(), budget);
    }
    EXPECT_EQ(timeline.range(), (std::pair<std::int64_t, std::int64_t>(0, 3999)));
    const std::vector<State> states = timeline.states();
    EXPECT_GT(states.size(), 80U);
    std::int64_t largest = 0, latest = 0;
    for (std::size_t k = 1; k < states.size(); ++k) {
        const std::int64_t gap = states[k]->step - states[k - 1]->step;
        ASSERT_GT(gap, 0);
        largest = std::max(largest, gap);
        if (states[k]->step > 3900) latest = std::max(latest, gap);
    }
    EXPECT_LT(latest, largest) << "the last ones are closer together";
    EXPECT_LT(largest, 200);
    EXPECT_LE(timeline.at(2000)->step, 2000);
    EXPECT_GT(timeline.at(2000)->step, 1800);
    timeline.insert(state_of(2001, topology));
    EXPECT_EQ(timeline.at(2001)->step, 2001) << "although the budget is used up";
    timeline.add(state_of(4000, topology));
    EXPECT_EQ(timeline.at(2001)->step, 2001);
    timeline.add(state_of(1000));
    EXPECT_EQ(timeline.range()->second, 1000) << "what came later is gone";
}

TEST(TimelineBudget, CountsWhatStatesShareOnce) {
    const auto topology = std::make_shared<SurfaceTopology>();
    topology->triangles.assign(100000, 0);
    Timeline timeline(std::size_t{64} << 20);
    timeline.add(state_of(0, topology));
    const std::size_t one = timeline.bytes();
    EXPECT_GT(one, 400000U);
    for (int k = 1; k < 10; ++k) timeline.add(state_of(k, topology));
    EXPECT_LT(timeline.bytes(), one + 10 * 8000);
    timeline.add(state_of(0));
    EXPECT_LT(timeline.bytes(), 8000U);
    EXPECT_EQ(timeline.at(-1), nullptr);
}

}  // namespace
}  // namespace splitcubes::view_tests
