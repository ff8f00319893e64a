// Recorded motions: a world that replays them has bit-identical states.
#include <splitcubes/body/body.h>
#include <splitcubes/core/error.h>
#include <splitcubes/world/motion_tracks.h>

#include "laws/worlds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

namespace splitcubes::body {
namespace {

using namespace laws;

constexpr int steps = 30;

Quat turn(const Vec3& axis, double angle) {
    return Quat(Eigen::AngleAxisd(angle, axis.normalized()));
}

// Blade on a curve that rotates within a step by more than one part of a sweep may.
cutting::Blade curved_blade() {
    std::vector<cutting::Keyframe> keys;
    for (int k = 0; k <= 7; ++k)
        keys.push_back({0.03 + 0.06 * k, Vec3(0.02 * std::sin(k), 0.01 * k, 0.2 - 0.06 * k),
                        turn(Vec3(0.2, 0.1, 1), 1.1 * k)});
    return {"knife",
            {{{Vec3(0, -0.3, 0), Vec3(0.02, 0, 0.01), Vec3(0, 0.3, 0)}}},
            keys,
            {.interpolation = cutting::PathInterpolation::smooth, .active_from = 0.05}};
}

// Adds a handle and a collider; they_move: each follows a path.
void add_pushers(World& world, Body& body, bool they_move) {
    const auto swing = [they_move](const Vec3& amplitude) {
        return [they_move, amplitude](double time) {
            Isometry out = Isometry::Identity();
            if (they_move) out.translation() = std::sin(9 * time) * amplitude;
            return out;
        };
    };
    Handle handle;
    handle.name = "hook";
    handle.region = [](const Vec3& rest) { return rest.x() < -0.06; };
    handle.motion = swing(Vec3(-0.05, 0.03, 0));
    handle.stiffness = 50;
    body.add_handle(handle);
    Collider ball;
    ball.name = "ball";
    ball.solid = geometry::make_sphere_distance(0.05);
    ball.motion = [motion = swing(Vec3(0.01, 0, 0.03))](double time) {
        return Isometry(Eigen::Translation3d(-0.05, 0, -0.13) * motion(time));
    };
    world.add_collider(ball);
}

// Held block, shaken if `shaken`, that a blade cuts.
std::unique_ptr<World> shaken_world(cutting::Blade blade, bool shaken, int thread_count = 1) {
    auto world = std::make_unique<World>(free_space(), threads(thread_count));
    Body& body = world->add_body(geometry::make_box(Vec3(0.2, 0.16, 0.14)), soft(0.02, 100));
    HoldConstraint hold = hold_beyond(Vec3(0.05, 0, 0), Vec3::UnitX());
    if (shaken)
        hold.motion = [](double time) {
            Isometry out = Isometry::Identity();
            out.translation() = Vec3(0, 0, 0.02 * std::sin(20 * time));
            return out;
        };
    body.add_constraint(hold);
    add_pushers(*world, body, shaken);
    world->add_tool(std::move(blade));
    return world;
}

std::string state_after(World& world, int count) {
    for (int k = 0; k < count; ++k) world.step();
    return world.state_hash().text();
}

TEST(MotionTracks, ReplayGivesTheSameState) {
    const auto first = shaken_world(curved_blade(), true);
    state_after(*first, 15);
    ASSERT_FALSE(first->active_contacts().empty()) << "the ball touches";
    const std::string state = state_after(*first, steps - 15);
    ASSERT_GT(first->bodies()[0]->cut_edge_count(), 20U);
    for (const int thread_count : {1, 2}) {
        // Made with other motions, which the tracks replace.
        const cutting::Blade still("knife", curved_blade().shape(), {{0, Vec3(0, 0, 9), Quat::Identity()}},
                                   {.active_from = 0.05, .active_until = curved_blade().active_until()});
        const auto again = shaken_world(still, false, thread_count);
        follow_tracks(*again, motion_tracks(*first, steps));
        EXPECT_EQ(state_after(*again, steps), state);
    }
}

TEST(MotionTracks, DependOnTheSettingsOnly) {
    const auto stepped = shaken_world(curved_blade(), true), fresh = shaken_world(curved_blade(), true);
    state_after(*stepped, 5);
    const auto a = motion_tracks(*stepped, steps), b = motion_tracks(*fresh, steps);
    ASSERT_EQ(a.size(), 4U);
    for (std::size_t k = 0; k < a.size(); ++k) {
        EXPECT_EQ(a[k].name, b[k].name);
        EXPECT_EQ(a[k].motion.times(), b[k].motion.times());
    }
    EXPECT_EQ(a[0].name, "knife");
    EXPECT_EQ(a[1].name, fresh->bodies()[0]->name() + "/0");
    EXPECT_EQ(a[2].name, "hook");
    EXPECT_EQ(a[3].name, "ball");
}

TEST(MotionTracks, RecordingAReplayGivesTheSameTracks) {
    const auto first = shaken_world(curved_blade(), true), second = shaken_world(curved_blade(), true);
    const auto once = motion_tracks(*first, steps);
    follow_tracks(*second, once);
    const auto twice = motion_tracks(*second, steps);
    for (std::size_t k = 0; k < once.size(); ++k) EXPECT_EQ(once[k].motion.times(), twice[k].motion.times());
}

// The motion of a tool that a user moves can be replayed.
TEST(MotionTracks, RecordAToolMovedInteractively) {
    const auto hand = [](double time) {
        Isometry out = Isometry::Identity();
        out.linear() = turn(Vec3(0, 1, 1), 2 * time).toRotationMatrix();
        out.translation() = Vec3(0.01 * std::cos(9 * time), 0, 0.2 - 0.9 * time);
        return out;
    };
    SampledMotion start;
    start.add(0, hand(0));
    const auto live = shaken_world({"knife", curved_blade().shape(), start}, true);
    for (int k = 0; k < steps; ++k) {
        if (k > 0) live->move_tool(0, hand(live->time()));
        live->step();
    }
    ASSERT_GT(live->bodies()[0]->cut_edge_count(), 20U);
    const auto again = shaken_world({"knife", curved_blade().shape(), start}, true);
    follow_tracks(*again, motion_tracks(*live, steps));
    EXPECT_EQ(state_after(*again, steps), live->state_hash().text());
}

TEST(MotionTracks, TracksOfUnknownObjectsAreRejected) {
    const auto world = shaken_world(curved_blade(), true);
    SampledMotion motion;
    motion.add(0, Isometry::Identity());
    EXPECT_THROW(follow_tracks(*world, {{Driven::tool, "fork", motion}}), InputError);
    EXPECT_THROW(follow_tracks(*world, {{Driven::constraint, "knife", motion}}), InputError);
    EXPECT_THROW(world->move_tool(0, Isometry::Identity()), InputError) << "made with keyframes";
}

}  // namespace
}  // namespace splitcubes::body
