// Choice of the quality in motion by the time of frames.
#include <splitcubes/view/quality.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace splitcubes::view_tests {
namespace {

using splitcubes::view::Quality;
using splitcubes::view::QualityControl;

/// A machine on which a frame takes so long, by its quality.
struct Machine {
    QualityControl control{};
    std::array<double, 4> seconds;  // a frame
    double now = 0;
    int changes = 0;

    void run(double duration) {
        for (const double end = now + duration; now < end;) {
            const Quality drawn = control.quality();
            const double taken = seconds[static_cast<std::size_t>(drawn)];
            now += std::max(taken, 1.0 / 60);
            control.drawn(drawn, taken, now);
            changes += control.quality() != drawn;
        }
    }
};

TEST(QualityInMotion, StaysFineOnAFastMachine) {
    Machine machine{.seconds = {0.010, 0.004, 0.002, 0.001}};
    machine.run(60);
    EXPECT_EQ(machine.control.quality(), Quality::fine);
    EXPECT_EQ(machine.changes, 0);
}

TEST(QualityInMotion, GoesDownWithinTwoSecondsToWhatIsFastEnough) {
    Machine machine{.seconds = {0.4, 0.08, 0.03, 0.02}};
    machine.run(4);  // the first three frames wait for shaders
    EXPECT_EQ(machine.control.quality(), Quality::coarse);
    machine.seconds = {0.8, 0.16, 0.06, 0.03};
    machine.run(1);
    EXPECT_EQ(machine.control.quality(), Quality::coarsest);
    machine.seconds.fill(1);
    machine.run(20);
    EXPECT_EQ(machine.control.quality(), Quality::coarsest) << "there is nothing below";
}

TEST(QualityInMotion, DoesNotMindASlowFrame) {
    Machine machine{.seconds = {0.015, 0.006, 0.003, 0.002}};
    machine.run(10);
    machine.control.drawn(Quality::fine, 0.1, machine.now += 0.1);
    machine.run(5);
    EXPECT_EQ(machine.changes, 0);
}

TEST(QualityInMotion, ComesBackAndTriesLaterEachTimeThatFails) {
    Machine machine{.seconds = {0.4, 0.05, 0.03, 0.02}};
    machine.run(5);
    EXPECT_EQ(machine.control.quality(), Quality::coarse);
    machine.seconds = {0.012, 0.008, 0.005, 0.003};
    machine.run(30);
    EXPECT_EQ(machine.control.quality(), Quality::fine);
    // Fast in one quality and slow in the next one: attempts become rare.
    machine.seconds = {0.4, 0.05, 0.005, 0.003};
    machine.run(5);
    machine.changes = 0;
    machine.run(120);
    const int early = machine.changes;
    machine.run(480);
    EXPECT_LE(early, 12);
    EXPECT_LE(machine.changes - early, 10);
}

}  // namespace
}  // namespace splitcubes::view_tests
