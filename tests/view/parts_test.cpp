// Camera, picks, events as lines, fields at vertices, patches of surfaces.
#include "view/sessions.h"

#include <splitcubes/view/sample_field.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <splitcubes/core/error.h>

namespace splitcubes::view_tests {
namespace {

const ViewSize size{800, 600};

TEST(Camera, RaysAndProjectionsAreInverse) {
    OrbitCamera camera;
    camera.look({1, -2, 1.5}, {0.1, 0.2, 0.3});
    EXPECT_NEAR((camera.eye() - Vec3(1, -2, 1.5)).norm(), 0, 1e-12);
    for (const auto& [x, y] : {std::pair{400.0, 300.0}, {10.0, 20.0}, {790.0, 500.0}}) {
        const Vec3 back = camera.project(camera.ray(x, y, size).at(1.7), size);
        EXPECT_NEAR(back.x(), x, 1e-8);
        EXPECT_NEAR(back.y(), y, 1e-8);
    }
    EXPECT_LT(camera.project({5, -10, 7}, size).z(), 0) << "behind the eye";
}

TEST(Camera, PanKeepsThePointUnderThePointer) {
    OrbitCamera camera;
    camera.look({0, -2, 0}, {0, 0, 0});
    const Vec3 at =
        camera.ray(300, 200, size).at(2 / camera.ray(300, 200, size).direction.dot(camera.forward()));
    camera.pan(50, -30, size);
    const Vec3 now = camera.project(at, size);
    EXPECT_NEAR(now.x(), 350, 1e-6);
    EXPECT_NEAR(now.y(), 170, 1e-6);
}

TEST(Camera, FocusShowsTheWholeBox) {
    OrbitCamera camera;
    geometry::Box box;
    box.add(Vec3(1, 2, 3));
    box.add(Vec3(2, 5, 3.5));
    camera.focus(box);
    for (int k = 0; k < 8; ++k) {
        const Vec3 corner(k & 1 ? 2 : 1, k & 2 ? 5 : 2, k & 4 ? 3.5 : 3);
        const Vec3 p = camera.project(corner, size);
        EXPECT_GT(p.y(), 0);
        EXPECT_LT(p.y(), size.height);
    }
}

TEST(Camera, WhatHasLeftThePictureIsNoticedUnlessItIsNear) {
    OrbitCamera camera;
    geometry::Box box;
    box.add(Vec3(-0.1, -0.1, -0.1));
    box.add(Vec3(0.1, 0.1, 0.1));
    camera.focus(box);
    const ViewSize size{1280, 720};
    const ViewArea area{245, 0, 1014, 656};
    EXPECT_FALSE(has_left(box, camera, size, area));
    EXPECT_FALSE(has_left({}, camera, size, area));
    geometry::Box away;
    for (const double side : {-0.1, 0.1}) away.add(Vec3(Vec3::Constant(side) + 0.5 * camera.right()));
    EXPECT_TRUE(has_left(away, camera, size, area)) << "behind the panel at the right";
    camera.distance *= 0.25;
    EXPECT_FALSE(has_left(box, camera, size, area)) << "a near one fills the picture";
    camera.target += 3 * camera.forward();
    EXPECT_FALSE(has_left(box, camera, size, area)) << "behind the eye there is nothing to turn to";
}

TEST(Camera, ElevationStopsAtThePoles) {
    OrbitCamera camera;
    for (int k = 0; k < 100; ++k) camera.orbit(3, 40);
    EXPECT_LT(camera.elevation, 1.5708);
    EXPECT_NEAR(camera.right().norm(), 1, 1e-12);
}

TEST(Picks, FollowTheMaterial) {
    const TemporaryFolder folder("picks");
    HandSession session(write_block_scene(folder.path));
    const Vec3 at = session.pixels({0.03, 0.02, 0.1});
    const auto hit =
        pick(*session.viewer.state(), session.viewer.camera().ray(at.x(), at.y(), session.viewer.size()));
    ASSERT_TRUE(hit);
    EXPECT_NEAR((hit->point.world - Vec3(0.03, 0.02, 0.1)).norm(), 0, 1e-3);
    EXPECT_NEAR((hit->point.rest - hit->point.world).norm(), 0, 1e-5);
    EXPECT_GT(hit->normal.z(), 0.99);
    EXPECT_NEAR((hit->world_from_rest - Mat3::Identity()).norm(), 0, 1e-3);
    session.key("space");
    session.run(15);
    const auto now = present_position(hit->point, *session.viewer.state());
    ASSERT_TRUE(now);
    EXPECT_GT((*now - hit->point.world).norm(), 1e-5) << "the block has sagged";
    EXPECT_LT((*now - hit->point.world).norm(), 0.03);
    EXPECT_FALSE(pick(*session.viewer.state(), session.viewer.camera().ray(1, 1, session.viewer.size())));
}

TEST(Picks, EndWithTheSurfaceTheyAreOn) {
    const TemporaryFolder folder("replaced");
    HandSession session(write_block_scene(folder.path));
    session.key("space");
    const Vec3 at = session.pixels({0.012, 0.02, 0.1});
    const auto hit =
        pick(*session.viewer.state(), session.viewer.camera().ray(at.x(), at.y(), session.viewer.size()));
    ASSERT_TRUE(hit);
    session.drag({0.01, -0.16, 0.1}, {0.01, 0.16, 0.1}, 20);
    MaterialPoint other = hit->point;
    other.rest += Vec3(0.01, 0, 0);
    EXPECT_FALSE(present_position(other, *session.viewer.state()));
}

TEST(Events, AreTheSameAfterALine) {
    const ViewerInput press{.kind = InputKind::press,
                            .frame = 7,
                            .time = 0.25,
                            .x = 12.5,
                            .y = 99,
                            .button = Button::middle,
                            .modifiers = 5};
    const ViewerInput back = input_of_line(input_line(press), "test");
    EXPECT_EQ(back.kind, press.kind);
    EXPECT_EQ(back.frame, 7);
    EXPECT_EQ(back.x, 12.5);
    EXPECT_EQ(back.button, Button::middle);
    EXPECT_EQ(back.modifiers, 5U);
    const ViewerInput set{.kind = InputKind::set, .name = "gravity", .value = 0.1};
    EXPECT_EQ(input_line(input_of_line(input_line(set), "test")), input_line(set));
}

TEST(Events, WrongLinesAreRefusedWithTheirPlace) {
    const TemporaryFolder folder("events");
    const auto file = folder.path / "input.jsonl";
    const auto problem = [&](const std::string& text) {
        std::ofstream(file) << text;
        try {
            read_inputs(file);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_EQ(problem("// a comment\n\n{\"kind\":\"key\",\"name\":\"1\"}\n"), "");
    EXPECT_THAT(problem("{\"kind\":\"key\"}\nfoo\n"), testing::HasSubstr("input.jsonl:2: is no JSON object"));
    EXPECT_THAT(problem("{\"kind\":\"kick\"}\n"),
                testing::HasSubstr("unknown kind ('kick'); use one of: move"));
    EXPECT_THAT(problem("{\"frame\":2,\"kind\":\"key\"}\n{\"frame\":1,\"kind\":\"key\"}\n"),
                testing::HasSubstr(":2: comes before the line above"));
    EXPECT_THAT(problem("{\"kind\":\"move\",\"x\":\"a\"}\n"), testing::HasSubstr("'x' is no finite number"));
}

TEST(Fields, AreInterpolatedWithinPieces) {
    const TemporaryFolder folder("fields");
    HandSession session(write_block_scene(folder.path));
    session.key("space");
    session.set("colouring", 2);
    session.run(10);
    const BodyState& body = session.viewer.state()->bodies[0];
    ASSERT_EQ(body.field.size(), body.topology->pieces.size());
    double highest = 0;
    for (const float v : body.field) {
        EXPECT_GE(v, 0);
        highest = std::max<double>(highest, v);
    }
    // Weight of the block on its base: 1000 kg/m^3 * 9.81 m/s^2 * 0.1 m.
    EXPECT_GT(highest, 200);
    EXPECT_LT(highest, 20000);
    session.set("phyxels", 1);
    session.run(1);
    EXPECT_GT(session.viewer.state()->bodies[0].sample_positions.size(), 300U);
}

TEST(Patches, KeepACopyEqualToTheWhole) {
    const TemporaryFolder folder("patches");
    HandSession session(write_block_scene(folder.path));
    session.key("space");
    std::vector<std::uint32_t> copy = session.viewer.state()->bodies[0].topology->triangles;
    std::uint64_t revision = session.viewer.state()->bodies[0].topology->revision;
    session.press({0.01, -0.16, 0.1});
    session.frame();
    std::size_t patched = 0, changes = 0;
    for (int k = 1; k <= 40; ++k) {
        session.move({0.01, -0.16 + 0.008 * k, 0.1});
        session.frame();
        if (k % 3 != 0) continue;  // a window that draws every third state
        const SurfaceTopology& now = *session.viewer.state()->bodies[0].topology;
        copy.resize(now.triangles.size(), 0);
        for (const SurfaceChange& change : now.changes) {
            if (change.revision <= revision) continue;
            ++changes;
            for (const Range& range : change.triangles)
                for (std::size_t i = 3 * std::size_t{range.first};
                     i < 3 * (std::size_t{range.first} + range.count); ++i)
                    copy[i] = now.triangles[i], ++patched;
        }
        revision = now.revision;
        ASSERT_EQ(copy, now.triangles) << k;
    }
    EXPECT_GT(changes, 5U);
    EXPECT_GT(patched, 100U);
}

TEST(Settings, AreSetByName) {
    Viewer viewer;
    viewer.take({.kind = InputKind::set, .name = "scalpel_tilt", .value = 200});
    EXPECT_EQ(viewer.setting("scalpel_tilt"), 80);
    EXPECT_THROW(viewer.take({.kind = InputKind::set, .name = "nothing"}), InputError);
    EXPECT_THROW(viewer.take({.kind = InputKind::act, .name = "nothing"}), InputError);
    for (const std::string& name : Viewer::kept_settings()) EXPECT_NO_THROW(viewer.setting(name));
}

}  // namespace
}  // namespace splitcubes::view_tests
