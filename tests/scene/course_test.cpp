// Things that go along with others, and that start and end on conditions.
#include <splitcubes/body/body.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/state_stream.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/played_scene.h>
#include <splitcubes/scene/resolve.h>
#include <splitcubes/scene/world_course.h>
#include <splitcubes/world/checkpoint.h>
#include <splitcubes/world/motion_tracks.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace splitcubes::scene {
namespace {

using testing::HasSubstr;

// A scene in its world, stepped as `run` does.
struct Played {
    SceneDescription scene;
    std::unique_ptr<body::World> world;
    std::unique_ptr<WorldCourse> course;

    explicit Played(const std::string& text, int threads = 1) : scene(parse_scene_text(text, "x.json", "/")) {
        BuildReport report;
        world = build_world(scene, std::make_shared<const Parallel>(threads), report);
        course = std::make_unique<WorldCourse>(scene, *world);
    }
    void step(int count = 1) {
        for (int k = 0; k < count; ++k) {
            course->advance(*world);
            world->step();
        }
    }
    const body::Body& body(std::size_t k = 0) const { return *world->bodies()[k]; }
    Isometry tool(std::size_t k = 0) const { return world->tools()[k].blade.frame(world->time()); }
    std::string hash() const { return world->state_hash().text(); }
};

// The bodies of a world as a course reads them.
struct WorldSamples {
    std::vector<std::vector<Vec3>> at_start;
    std::vector<BodySamples> bodies;

    explicit WorldSamples(const body::World& world) {
        for (const auto& body : world.bodies()) {
            at_start.emplace_back();
            for (const Vec3& p : body->phyxels().rest_position) at_start.back().push_back(body->pose() * p);
        }
        for (std::size_t b = 0; b < at_start.size(); ++b) {
            const meshless::Phyxels& p = world.bodies()[b]->phyxels();
            bodies.push_back(
                {at_start[b], p.position, p.velocity, p.mass, p.piece, world.bodies()[b]->pieces().count()});
        }
    }
};

std::string bar(const std::string& more = "", const std::string& name = "bar", double y = 0) {
    return R"({"name": ")" + name +
           R"(", "shape": {"box": {"size": [1, 0.2, 0.2]}}, "cells": 20, "phyxel_count": 60,
        "placement": {"position": [0, )" +
           std::to_string(y) + R"(, 0]})" + more + "}";
}

std::string scene_of(const std::string& bodies, const std::string& rest) {
    return R"({"gravity": [0, 0, 0], "time_step": 0.02, "contact": {"pieces": false}, "bodies": [)" + bodies +
           "]" + rest + "}";
}

std::string tool_of(const std::string& name, const std::string& keyframes, const std::string& more = "") {
    return R"({"name": ")" + name + R"(", "blades": [{"straight": {"from": [0, -0.3, 0], "to": [0, 0.3, 0]}}],
        "motion": {"path": {"keyframes": [)" +
           keyframes + "]}}" + more + "}";
}

// Through the bar at x, downwards.
std::string stroke_at(double x, double from = 0, double until = 0.1) {
    return R"({"time": )" + std::to_string(from) + R"(, "position": [)" + std::to_string(x) +
           R"(, 0, 0.2]}, {"time": )" + std::to_string(until) + R"(, "position": [)" + std::to_string(x) +
           ", 0, -0.2]}";
}

double frame_distance(const Isometry& a, const Isometry& b) {
    return (a.matrix() - b.matrix()).norm();
}

TEST(Relation, AToolInAFlyingBodyCutsNothing) {
    const std::string flying = bar(R"(, "velocity": [1.5, 0, 0.5], "angular_velocity": [0, 2, 0])");
    const auto cut_edges = [&](const std::string& more) {
        Played played(scene_of(flying, R"(, "tools": [)" +
                                           tool_of("t", R"({"time": 0, "position": [0.1, 0, 0]})",
                                                   R"(, "active_until": 10)" + more) +
                                           "]"));
        played.step(20);
        return played.body().grid().crossings().size();
    };
    const std::size_t uncut = cut_edges(R"(, "relative_to": "bar")");
    EXPECT_LT(uncut, cut_edges("")) << "in the room it cuts what flies past";
    EXPECT_EQ(uncut,
              cut_edges(R"(, "relative_to": {"body": "bar", "region": {"sphere": {"center": [0.1, 0, 0],
                                   "radius": 0.15}}})"));
    Played none(scene_of(flying, ""));
    EXPECT_EQ(uncut, none.body().grid().crossings().size());
}

TEST(Relation, AToolFollowsARigidMotionExactly) {
    // However it is placed.
    std::string turned = bar(R"(, "velocity": [1.5, 0, 0.5], "angular_velocity": [0, 2, 0])");
    turned.replace(turned.find(R"("placement": {)"), 14,
                   R"("placement": {"rotation": {"axis": [1, 2, 3], "angle_degrees": 50}, )");
    Played played(scene_of(turned, R"(, "tools": [)" +
                                       tool_of("t", stroke_at(0.6, 0, 1), R"(, "relative_to": "bar")") + "," +
                                       tool_of("alone", stroke_at(0.6, 0, 1)) + "]"));
    played.step(15);
    const WorldSamples samples(*played.world);
    const Isometry motion =
        MaterialFrame({}, samples.bodies[0]).fit(samples.bodies[0], 0, Isometry::Identity());
    EXPECT_GT(frame_distance(motion, Isometry::Identity()), 0.5);
    EXPECT_LT(frame_distance(played.tool(0), motion * played.tool(1)), 2e-3);
}

TEST(Relation, AFramesPartIsTheOneThatHoldsItsMiddle) {
    // The bar is cut at x = 0.1 and its ends pull apart; both tools stay with their ends.
    Played played(scene_of(
        bar(),
        R"(, "constraints": [{"body": "bar", "kind": "move", "region": {"half_space": {"point": [0.45, 0, 0],
            "normal": [1, 0, 0]}}, "keyframes": [{"time": 0.2}, {"time": 0.6, "position": [0.5, 0, 0.2]}]},
            {"body": "bar", "kind": "hold", "region": {"half_space": {"point": [-0.45, 0, 0], "normal": [-1, 0, 0]}}}],
            "tools": [)" +
            tool_of("knife", stroke_at(0.113)) + "," +
            tool_of(
                "right", R"({"time": 0, "position": [0.3, 0, 0.3]})",
                R"(, "relative_to": {"body": "bar", "region": {"box": {"min": [0.2, -1, -1], "max": [1, 1, 1]}}})") +
            "," + tool_of("whole", R"({"time": 0, "position": [0.3, 0, 0.3]})", R"(, "relative_to": "bar")") +
            "]"));
    played.step(40);
    ASSERT_EQ(played.body().pieces().count(), 2u);
    EXPECT_LT((played.tool(1).translation() - Vec3(0.8, 0, 0.5)).norm(), 0.05);
    EXPECT_LT((played.tool(2).translation() - Vec3(0.3, 0, 0.3)).norm(), 0.05)
        << "its middle is in the left half";
}

TEST(Relation, AToolInTheFrameOfAColliderMovesWithIt) {
    const std::string plate =
        R"(, "colliders": [{"name": "plate", "shape": {"box": {"size": [0.1, 0.1, 0.1]}},
        "placement": {"position": [0, 0, -2]}, "pivot": [1, 0, 0], "keyframes": [{"time": 0},
        {"time": 1, "position": [0, 0, 0.5], "rotation": {"axis": [0, 0, 1], "angle_degrees": 90}}]}])";
    const SceneDescription scene = parse_scene_text(
        scene_of(bar(), plate + R"(, "tools": [)" +
                            tool_of("t", stroke_at(0.6, 0, 1), R"(, "relative_to": "plate")") + "," +
                            tool_of("alone", stroke_at(0.6, 0, 1)) + "]"),
        "x.json", "/");
    EXPECT_FALSE(scene.tools[0].relative_to) << "time alone says where it is";
    const ColliderDescription& collider = scene.colliders[0];
    for (const double t : {0.0, 0.37, 1.0})
        EXPECT_LT(frame_distance(make_blade(scene.tools[0]).frame(t),
                                 keyframe_motion(collider.keyframes, collider.pivot, t) *
                                     make_blade(scene.tools[1]).frame(t)),
                  0.01)
            << t;
}

TEST(Relation, AColliderAndWhatIsRelativeToItGoAlongWithTheMaterial) {
    Played played(scene_of(
        bar(R"(, "velocity": [1, 0, 0])") + "," + bar("", "other", 2),
        R"(, "colliders": [{"name": "plate", "shape": {"box": {"size": [0.1, 0.1, 0.1]}},
            "placement": {"position": [0, 1, 0]}, "relative_to": "bar"},
            {"name": "second", "shape": {"sphere": {"radius": 0.1}}, "placement": {"position": [0, 1, 1]},
             "keyframes": [{"time": 0}, {"time": 0.2, "position": [0, 0, 1]}], "relative_to": "plate"}],
           "handles": [{"name": "h", "body": "other", "stiffness": 5000, "relative_to": "second",
             "region": {"sphere": {"center": [0, 2, 0], "radius": 0.3}}}],
           "tools": [)" +
            tool_of("t", R"({"time": 0, "position": [0, 0, 1]})", R"(, "relative_to": "second")") + "]"));
    played.step(20);
    const double t = played.world->time();
    const auto& colliders = played.world->colliders();
    EXPECT_LT((colliders[0].at(t).translation() - Vec3(t, 1, 0)).norm(), 1e-6);
    EXPECT_LT((colliders[1].at(t).translation() - Vec3(t, 1, 2)).norm(), 1e-6);
    EXPECT_LT((played.tool().translation() - Vec3(t, 0, 2)).norm(), 1e-6);
    EXPECT_LT((played.body(1).handles()[0].motion(t).translation() - Vec3(t, 0, 1)).norm(), 1e-6);
}

// The left end of a bar is held in a jaw.
std::string clamped(const std::string& constraint, const std::string& jaw, const std::string& rest = "") {
    return scene_of(
        bar() + "," + bar(R"(, "velocity": [0, 0, 1])", "other", 2),
        R"(, "colliders": [{"name": "jaw", "shape": {"box": {"size": [0.1, 0.1, 0.1]}},
            "placement": {"position": [-2, 0, 0]})" +
            jaw +
            R"(}], "constraints": [{"body": "bar", "region": {"half_space": {"point": [-0.4, 0, 0],
            "normal": [-1, 0, 0]}}, "relative_to": "jaw", )" +
            constraint + "}]" + rest);
}

// Returns the mean displacement of the phyxels at the end of the bar, m.
Vec3 displacement_of_end(const Played& played) {
    const meshless::Phyxels& phyxels = played.body().phyxels();
    Vec3 sum = Vec3::Zero();
    double count = 0;
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        const Vec3 rest = played.body().pose() * phyxels.rest_position[i];
        if (rest.x() > -0.4) continue;
        sum += phyxels.position[i] - rest;
        ++count;
    }
    EXPECT_GT(count, 0);
    return sum / count;
}

TEST(Relation, AHeldRegionGoesAlongFromWhenItBegins) {
    const std::string lifted = R"(, "keyframes": [{"time": 0}, {"time": 0.4, "position": [0, 0, 0.2]}])";
    Played held(clamped(R"("kind": "hold")", lifted));
    held.step(20);
    EXPECT_LT((displacement_of_end(held) - Vec3(0, 0, 0.2)).norm(), 1e-9);
    // Keyframes come on top of it.
    Played moved(clamped(
        R"("kind": "move", "keyframes": [{"time": 0}, {"time": 0.4, "position": [-0.1, 0, 0]}])", lifted));
    moved.step(20);
    EXPECT_LT((displacement_of_end(moved) - Vec3(-0.1, 0, 0.2)).norm(), 1e-9);
    Played late(clamped(R"("kind": "hold", "from_time": 0.2)", lifted));
    late.step(20);
    EXPECT_LT((displacement_of_end(late) - Vec3(0, 0, 0.1)).norm(), 1e-9);
}

TEST(Relation, AHeldRegionGoesAlongWithMaterialAndWithWhatItCarries) {
    Played played(clamped(R"("kind": "hold")", R"(, "relative_to": "other")"));
    played.step(20);
    EXPECT_LT((displacement_of_end(played) - Vec3(0, 0, 0.4)).norm(), 1e-6);
    // From 0.2 s on, and only until 0.3 s.
    Played some(clamped(R"("kind": "hold", "from_time": 0.2, "release_when": {"time": 0.3})",
                        R"(, "relative_to": "other")"));
    some.step(15);
    EXPECT_LT((displacement_of_end(some) - Vec3(0, 0, 0.1)).norm(), 1e-6);
    some.course->advance(*some.world);
    EXPECT_FALSE(some.body().constraints()[0].is_active(some.world->time()));
}

TEST(Relation, WhatCannotCarryIsRefusedInOneLine) {
    const auto error_of = [](const std::string& rest) -> std::string {
        try {
            Played played(scene_of(bar() + "," + bar("", "t", 2), rest));
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    };
    const auto tool = [&](const std::string& relation) {
        return error_of(R"(, "tools": [)" + tool_of("t", stroke_at(0)) + "," +
                        tool_of("u", stroke_at(0), R"(, "relative_to": )" + relation) + "]");
    };
    EXPECT_THAT(tool(R"("v")"), HasSubstr("names nothing that it can go along with"));
    EXPECT_THAT(tool(R"("u")"), HasSubstr("the thing itself"));
    EXPECT_THAT(tool(R"("t")"), HasSubstr("the name of several things; say which, as {\"tool\": \"t\"}"));
    EXPECT_THAT(tool(R"({"tool": "t"})"), "");
    EXPECT_THAT(tool(R"({"region": {"sphere": {"center": [0, 0, 0], "radius": 1}}})"),
                HasSubstr("names no tool, collider or body"));
    EXPECT_THAT(tool(R"({"tool": "t", "region": {"sphere": {"center": [0, 0, 0], "radius": 1}}})"),
                HasSubstr("only bodies have regions"));
    EXPECT_THAT(tool(R"({"tool": "t", "body": "bar"})"), HasSubstr("body"));
    EXPECT_THAT(tool(R"({"body": "bar", "region": {"sphere": {"center": [9, 9, 9], "radius": 0.1}}})"),
                HasSubstr("tool 'u' relative_to: its region holds no phyxel of body 'bar'"));
    EXPECT_THAT(error_of(R"(, "constraints": [{"body": "bar", "kind": "hold", "relative_to": "nobody",
                            "region": {"sphere": {"center": [0, 0, 0], "radius": 1}}}])"),
                HasSubstr("constraints[0].relative_to is \"nobody\", which names nothing"));
    EXPECT_THAT(
        error_of(R"(, "colliders": [{"name": "a", "shape": {"sphere": {"radius": 1}}, "relative_to": "b"},
                            {"name": "b", "shape": {"sphere": {"radius": 1}}, "relative_to": "a"}])"),
        HasSubstr("colliders[0].relative_to is \"b\", which names nothing"));
}

// A bar hangs from its two ends; a blade parts it, and the condition lets one of them go.
TEST(Conditions, AHoldEndsWhenTheBodyIsInTwo) {
    Played played(scene_of(bar(), R"(, "constraints": [
          {"body": "bar", "kind": "hold", "region": {"half_space": {"point": [-0.4, 0, 0], "normal": [-1, 0, 0]}},
           "release_when": {"body": "bar"}},
          {"body": "bar", "kind": "hold", "region": {"half_space": {"point": [0.4, 0, 0], "normal": [1, 0, 0]}}}],
          "tools": [)" + tool_of("t", stroke_at(0.013)) +
                                      "]"));
    for (int k = 0; k < 12; ++k) {
        const bool severed = played.body().pieces().count() >= 2;
        played.course->advance(*played.world);
        EXPECT_EQ(played.body().constraints()[0].is_active(played.world->time()), !severed) << k;
        EXPECT_TRUE(played.body().constraints()[1].is_active(played.world->time()));
        played.world->step();
    }
    EXPECT_EQ(played.body().pieces().count(), 2u);
}

TEST(Conditions, AToolStartsWhenAnotherHasEnded) {
    Played played(scene_of(
        bar(),
        R"(, "tools": [)" +
            tool_of("second", stroke_at(0.313, 0.02, 0.1), R"(, "start_when": {"ended": "first"})") + "," +
            tool_of("first", stroke_at(-0.213)) + "," +
            tool_of("third", stroke_at(0.113, 0, 0.1),
                    R"(, "start_when": {"body": "bar", "at_least": 3, "time": 0.5})") +
            "," +
            tool_of("never", stroke_at(0.413, 0, 0.1), R"(, "start_when": {"body": "bar", "at_least": 9})") +
            "]"));
    const Isometry waiting = played.tool(0);
    played.step(5);
    EXPECT_LT(frame_distance(played.tool(0), waiting), 1e-12) << "it stands at its first keyframe";
    played.step(3);
    EXPECT_EQ(played.body().pieces().count(), 2u);
    EXPECT_GT(frame_distance(played.tool(0), waiting), 0.01);
    played.step(5);
    EXPECT_EQ(played.body().pieces().count(), 3u);
    played.step(11);
    EXPECT_LE(played.world->time(), 0.5) << "both must hold";
    EXPECT_EQ(played.body().pieces().count(), 3u);
    played.step(10);
    EXPECT_EQ(played.body().pieces().count(), 4u);
}

TEST(Conditions, AToolThatHasEndedStandsStillAndCutsNoMore) {
    const auto pieces = [](const std::string& more) {
        Played played(scene_of(bar(), R"(, "tools": [)" + tool_of("first", stroke_at(-0.213, 0, 0.1)) + "," +
                                          tool_of("slow", stroke_at(0.213, 0, 0.4), more) + "]"));
        played.step(12);
        const Isometry then = played.tool(1);
        played.step(15);
        return std::pair(played.body().pieces().count(), frame_distance(played.tool(1), then));
    };
    EXPECT_EQ(pieces(R"(, "end_when": {"body": "bar"})"), std::pair(std::size_t{2}, 0.0));
    EXPECT_EQ(pieces("").first, 3u);
}

TEST(Conditions, AGripTakesTheMaterialWhereItIs) {
    // Both handles hold the bar, which flies, from 0.2 s on; one was told so by the clock.
    const auto hold = [](const std::string& start) {
        Played played(scene_of(bar(R"(, "velocity": [1, 0, 0])"),
                               R"(, "handles": [{"name": "h", "body": "bar", "stiffness": 2000,
            "region": {"sphere": {"center": [0, 0, 0], "radius": 0.3}}, )" +
                                   start + "}]"));
        played.step(11);
        return (played.body().handles()[0].motion(played.world->time()) * Vec3::Zero()).x();
    };
    EXPECT_NEAR(hold(R"("from_time": 0.2)"), 0, 1e-12);
    EXPECT_NEAR(hold(R"("start_when": {"time": 0.2})"), 0.2, 0.01);
    EXPECT_NEAR(
        hold(
            R"("start_when": {"time": 0.2}, "keyframes": [{"time": 0}, {"time": 0.02, "position": [0.5, 0, 0]}])"),
        0.7, 0.01);
}

TEST(Conditions, WhatCannotHoldIsRefusedInOneLine) {
    const auto error_of = [](const std::string& tools) -> std::string {
        try {
            parse_scene_text(scene_of(bar(), R"(, "tools": [)" + tools + "]"), "x.json", "/");
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    };
    const auto waiting = [](const std::string& name, const std::string& condition) {
        return tool_of(name, stroke_at(0), R"(, "start_when": )" + condition);
    };
    EXPECT_THAT(error_of(waiting("t", "{}")), HasSubstr("tools[0].start_when says nothing to wait for"));
    EXPECT_THAT(error_of(waiting("t", R"({"at_least": 3})")), HasSubstr("start_when"));
    EXPECT_THAT(error_of(waiting("t", R"({"at_least": 3, "time": 1})")), HasSubstr("without a body"));
    EXPECT_THAT(error_of(waiting("t", R"({"ended": "u"})")),
                HasSubstr("but no tool has that name; there are t"));
    EXPECT_THAT(error_of(waiting("t", R"({"body": "u"})")), HasSubstr("but no body has that name"));
    EXPECT_THAT(error_of(waiting("t", R"({"ended": "t"})")), HasSubstr("waits for its own end"));
    EXPECT_THAT(error_of(waiting("t", R"({"ended": "u"})") + "," + waiting("u", R"({"ended": "t"})")),
                HasSubstr("waits for its own end"));
    EXPECT_EQ(error_of(waiting("t", R"({"ended": "u"})") + "," + tool_of("u", stroke_at(0))), "");
    EXPECT_THAT(
        [] {
            try {
                parse_path_text(
                    R"({"tools": [)" + tool_of("t", stroke_at(0), R"(, "end_when": {"time": 1})") + "]}",
                    "p.json");
            } catch (const InputError& error) {
                return std::string(error.what());
            }
            return std::string();
        }(),
        HasSubstr("nothing happens on a path"));
}

// A bar is severed; then a grip lifts one end, a tool that goes along with it cuts it, and a third one
// follows.
std::string eventful() {
    return scene_of(
        bar(R"(, "angular_velocity": [0, 0, 0.5])") + "," + bar("", "other", 2),
        R"(, "colliders": [{"name": "ball", "shape": {"sphere": {"radius": 0.05}}, "placement": {"position": [0.3, 0, 0.3]},
             "keyframes": [{"time": 0}, {"time": 0.2, "position": [0, 0, -0.12]}], "relative_to": "bar",
             "start_when": {"ended": "first"}, "end_when": {"body": "bar", "at_least": 3}}],
          "constraints": [{"body": "bar", "kind": "hold", "release_when": {"body": "bar", "at_least": 2},
              "region": {"half_space": {"point": [-0.4, 0, 0], "normal": [-1, 0, 0]}}},
            {"body": "other", "kind": "move", "keyframes": [{"time": 0}, {"time": 0.3, "position": [0, 0, 0.1]}],
             "region": {"half_space": {"point": [0.4, 0, 0], "normal": [1, 0, 0]}}, "start_when": {"body": "bar"}},
            {"body": "other", "kind": "hold", "relative_to": "bar", "from_time": 0.1,
             "region": {"half_space": {"point": [-0.4, 0, 0], "normal": [-1, 0, 0]}}}],
          "handles": [{"name": "grip", "body": "bar", "stiffness": 800, "force_limit": 20,
              "region": {"half_space": {"point": [0.3, 0, 0], "normal": [1, 0, 0]}}, "start_when": {"body": "bar"},
              "relative_to": {"body": "other"}, "keyframes": [{"time": 0}, {"time": 0.3, "position": [0.1, 0, 0.2]}]}],
          "tools": [)" +
            tool_of("first", stroke_at(0.113)) + "," +
            tool_of("second", stroke_at(0.313, 0.04, 0.2),
                    R"(, "start_when": {"body": "bar"}, "relative_to": {"body": "bar", "region": {"box":
                        {"min": [0.2, -1, -1], "max": [1, 1, 1]}}})") +
            "," +
            tool_of("third", stroke_at(-0.05, 0, 0.1),
                    R"(, "relative_to": "second", "start_when": {"ended": "second"})") +
            "]");
}

TEST(Course, AResumedRunIsTheSameToTheLastBit) {
    Played whole(eventful());
    std::vector<std::string> checkpoints, notes, hashes;
    for (int k = 0; k < 40; ++k) {
        StateWriter writer;
        whole.course->save(writer);
        notes.push_back(writer.take());
        checkpoints.push_back(body::encode_checkpoint(*whole.world, "x"));
        hashes.push_back(whole.hash());
        whole.step();
    }
    EXPECT_GE(whole.body().pieces().count(), 3u) << "what depends on the state takes part";
    for (const std::size_t from : {0u, 4u, 7u, 11u, 18u, 29u}) {
        Played resumed(eventful());
        body::restore_checkpoint(*resumed.world, checkpoints[from], "x", "x");
        StateReader reader(notes[from]);
        resumed.course->load(reader, *resumed.world);
        reader.finish();
        for (std::size_t k = from; k < hashes.size(); ++k, resumed.step())
            ASSERT_EQ(resumed.hash(), hashes[k]) << from << " " << k;
        EXPECT_EQ(resumed.hash(), whole.hash());
        const auto a = body::motion_tracks(*resumed.world, 40), b = body::motion_tracks(*whole.world, 40);
        ASSERT_EQ(a.size(), b.size());
        for (std::size_t t = 0; t < a.size(); ++t)
            for (std::size_t k = 0; k < a[t].motion.times().size(); ++k)
                EXPECT_EQ(a[t].motion.frames()[k].matrix(), b[t].motion.frames()[k].matrix()) << a[t].name;
    }
}

TEST(Course, ARecordingRepeatsTheRun) {
    Played whole(eventful(), 3);
    whole.step(40);
    Played replayed(eventful());
    body::follow_tracks(*replayed.world, body::motion_tracks(*whole.world, 40));
    replayed.course->leave_motions();
    replayed.step(40);
    EXPECT_EQ(replayed.hash(), whole.hash()) << "also for another number of threads";
}

TEST(Course, DamagedStatesAreRefused) {
    Played whole(eventful());
    whole.step(20);
    StateWriter writer;
    whole.course->save(writer);
    const std::string bytes = writer.take();
    for (std::size_t size = 0; size < bytes.size(); size += 397) {
        Played other(eventful());
        StateReader reader(std::string_view(bytes).substr(0, size));
        EXPECT_THROW(other.course->load(reader, *other.world), DamagedState) << size;
    }
}

TEST(Course, ASceneAsItRanMovesAsTheWorldDid) {
    Played played(eventful());
    std::vector<std::vector<Isometry>> tools, colliders;
    for (int k = 0; k <= 40; ++k) {
        tools.emplace_back();
        for (std::size_t t = 0; t < 3; ++t) tools.back().push_back(played.tool(t));
        colliders.push_back({played.world->colliders()[0].at(played.world->time())});
        if (k < 40) played.step();
    }
    const SceneDescription as_run = parse_scene_text(
        resolved_scene(played_scene(played.scene, played.course->course(), 0, 40)).dump(), "x.json", "/");
    EXPECT_FALSE(Course(as_run, {}).depends_on_state());
    ASSERT_EQ(as_run.tools.size(), 3u);
    ASSERT_EQ(as_run.handles.size(), 1u);
    EXPECT_GT(as_run.handles[0].from_time, 0.05);
    ASSERT_TRUE(as_run.constraints[0].until_time);
    for (int k = 0; k <= 40; ++k) {
        const double t = 0.02 * k;
        for (std::size_t i = 0; i < 3; ++i) {
            const cutting::Blade blade = make_blade(as_run.tools[i]);
            // Outside of the time in which it is drawn it may be anywhere.
            if (t >= blade.keyframes().front().time && t <= blade.keyframes().back().time)
                EXPECT_LT(frame_distance(blade.frame(t), tools[static_cast<std::size_t>(k)][i]), 1e-6)
                    << i << " " << k;
        }
        EXPECT_LT(
            frame_distance(collider_frame(as_run.colliders[0], t), colliders[static_cast<std::size_t>(k)][0]),
            1e-6)
            << k;
    }
}

TEST(Course, CopiesForgetWhatIsLaterWhenTimeGoesBack) {
    Played played(eventful());
    Course fresh = played.course->course();
    fresh.advance(0, 0.02, WorldSamples(*played.world).bodies);
    played.step(20);
    EXPECT_LT(played.course->course().tool_activity(1).first, Course::never);
    Course later = played.course->course();
    const Played again(eventful());
    later.advance(0, 0.02, WorldSamples(*again.world).bodies);
    EXPECT_EQ(later.tool_activity(1), fresh.tool_activity(1));
    EXPECT_LT(frame_distance(later.tool_frame(1, 0.02), fresh.tool_frame(1, 0.02)), 1e-12);
    EXPECT_LT(frame_distance(later.handle_motion(0, 0.02), fresh.handle_motion(0, 0.02)), 1e-12);
}

}  // namespace
}  // namespace splitcubes::scene
