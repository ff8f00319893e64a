// A session of random strokes, pulls, undo and returns to the past.
#include "view/sessions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <set>

namespace splitcubes::view_tests {
namespace {

constexpr std::size_t max_cuts = 20;

double resident_mb() {
    std::ifstream in("/proc/self/statm");
    double all = 0, resident = 0;
    in >> all >> resident;
    return resident * 4096 / 1e6;
}

// Each edge of a closed surface is passed once in each direction as often.
bool is_closed(const SurfaceTopology& topology) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> there, back;
    for (std::size_t t = 0; t + 2 < topology.triangles.size(); t += 3) {
        if (topology.triangles[t] == topology.triangles[t + 1]) continue;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = topology.triangles[t + k], b = topology.triangles[t + (k + 1) % 3];
            there.emplace_back(a, b);
            back.emplace_back(b, a);
        }
    }
    std::sort(there.begin(), there.end());
    std::sort(back.begin(), back.end());
    return there == back;
}

/// Random hands on a block.
struct RandomHands {
    std::mt19937 random{7};
    HandSession& session;
    Timeline timeline{std::size_t{24} << 20};
    std::size_t frames = 0, undone = 0, scrubbed = 0, exact = 0, strokes = 0;
    bool is_valid = true;

    explicit RandomHands(HandSession& with) : session(with) {}
    // Distributions of the standard library differ from one to the next.
    double share() { return static_cast<double>(random() >> 8) / (1 << 24); }
    Vec3 point() { return {0.3 * share() - 0.15, 0.3 * share() - 0.15, 0.1}; }
    void frame() {
        session.frame();
        ++frames;
        const State state = session.viewer.state();
        timeline.add(state);
        for (const BodyState& body : state->bodies) {
            for (std::size_t v = 0; v < body.topology->pieces.size(); ++v)
                for (std::size_t k = 0; k < 3 && body.topology->pieces[v] >= 0; ++k)
                    is_valid = is_valid && std::isfinite(body.positions[3 * v + k]);
            if (frames % 50 == 0) is_valid = is_valid && is_closed(*body.topology);
        }
    }
    void stroke() {
        const char* tools[] = {"1", "1", "2", "3", "4", "5", "6", "7", "8"};
        session.key(tools[random() % 9]);
        session.set("knife_through", share() < 0.5 ? 1 : 0);
        const Vec3 from = point(), to = point();
        const int steps = 6 + static_cast<int>(random() % 20);
        session.press(from);
        frame();
        for (int k = 1; k <= steps; ++k) {
            session.move(from + (to - from) * k / steps);
            frame();
        }
        if (share() < 0.1) return;  // something else comes in between
        session.release(to);
        for (int k = 0; k < 6; ++k) frame();
        ++strokes;
    }
    void scrub() {
        const auto range = timeline.range();
        if (!range) return;
        // Strokes from before a return cannot be undone: it is not far and not late.
        const bool returns = share() < 0.5 && session.loop.engine()->log().strokes().size() <= 6;
        const std::int64_t first = returns ? std::max(range->first, range->second - 100) : range->first;
        const auto steps = static_cast<double>(range->second - first + 1);
        const auto step = static_cast<std::int64_t>(static_cast<double>(first) + std::floor(share() * steps));
        const std::uint64_t hash = session.hash();
        session.set("timeline", static_cast<double>(step));
        // The nearest state is shown where many steps are missing.
        int patience = 40;
        session.loop.fill_timeline(timeline, [&] { return --patience > 0; });
        exact += timeline.at(step)->step == step;
        is_valid = is_valid && session.hash() == hash && range->first <= 1;
        session.frame();
        if (returns) session.act("resume");
        session.key("escape");
        session.key("space");
        if (!session.loop.is_playing()) session.key("space");
        ++scrubbed;
    }
    void act() {
        const double what = share();
        if (what < 0.68) stroke();
        if (what >= 0.68 && what < 0.82) {
            session.key("z", control_key);
            ++undone;
        }
        if (what >= 0.82 && what < 0.86) session.key("y", control_key);
        if (what >= 0.86 && what < 0.93) scrub();
        if (what >= 0.93 && what < 0.96) session.set("gravity", 12 * share());
        if (what >= 0.96) session.set("youngs_modulus", 1e4 + 5e4 * share());
        while (session.loop.engine()->log().strokes().size() > max_cuts &&
               session.loop.publish()->undo_count > 0) {
            session.key("z", control_key);
            ++undone;
        }
        if (session.loop.engine()->log().strokes().size() > max_cuts) session.key("r");
    }
};

// The length in seconds of simulated time; ten minutes take some minutes.
double session_seconds() {
    const char* text = std::getenv("SPLITCUBES_SESSION_SECONDS");
    return text != nullptr ? std::atof(text) : 6;
}

TEST(LongSessions, StayValidAndBoundedAndTheirRecordingRepeatsThem) {
    const TemporaryFolder folder("long");
    const EngineSettings settings{
        .threads = 2, .undo_bytes = std::uint64_t{32} << 20, .timeline_bytes = std::uint64_t{32} << 20};
    HandSession session(write_block_scene(folder.path), settings);
    RandomHands hands(session);
    session.key("space");
    const auto last = static_cast<std::size_t>(60 * session_seconds());
    double early = 0;
    std::size_t largest = 0;
    while (hands.frames < last) {
        hands.act();
        largest = std::max(largest, session.loop.engine()->log().strokes().size());
        ASSERT_TRUE(hands.is_valid) << "frame " << hands.frames;
        if (early == 0 && hands.frames > last / 3) early = resident_mb();
    }
    EXPECT_LE(largest, max_cuts + 2);
    EXPECT_LT(resident_mb(), 1.25 * early + 60);
    const std::string file = folder.path / "long.jsonl";
    session.key("escape");
    session.act("save_recording", file);
    ASSERT_EQ(session.state().notice, "saved " + file);
    const std::uint64_t hash = session.hash();
    const std::int64_t steps = session.state().step;
    const double resident = resident_mb();

    HandSession again(file, settings);
    again.key("space");
    while (again.loop.engine()->step_count() < steps) again.frame();
    EXPECT_EQ(again.loop.engine()->step_count(), steps);
    EXPECT_EQ(again.hash(), hash);
    std::printf(
        "%zu frames, %lld steps in the recording, %zu strokes and pulls, %zu undone, %zu times in the past, "
        "%zu of them at "
        "the very step; "
        "%.0f MB after a third, %.0f MB at the end\n",
        hands.frames, static_cast<long long>(steps), hands.strokes, hands.undone, hands.scrubbed, hands.exact,
        early, resident);
}

}  // namespace
}  // namespace splitcubes::view_tests
