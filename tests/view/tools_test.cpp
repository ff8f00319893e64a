// Every tool, by the motions of a pointer.
#include "view/sessions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace splitcubes::view_tests {
namespace {

struct ViewerTools : testing::Test {
    TemporaryFolder folder{"tools"};
    HandSession session{write_block_scene(folder.path)};

    void SetUp() override {
        session.key("space");
        session.run(2);
    }
    // m, of the cut faces: lowest and highest position at rest.
    std::pair<double, double> cut_heights() const {
        double low = 1, high = -1;
        const BodyState& body = session.viewer.state()->bodies[0];
        for (std::size_t t = 0; t < body.topology->origins.size(); ++t) {
            if (body.topology->origins[t] != SurfaceOrigin::cut) continue;
            for (std::size_t k = 0; k < 3; ++k) {
                const double z = body.topology->rest[3 * body.topology->triangles[3 * t + k] + 2];
                if (body.topology->triangles[3 * t] == body.topology->triangles[3 * t + 1]) continue;
                low = std::min(low, z);
                high = std::max(high, z);
            }
        }
        return {low, high};
    }
};

TEST_F(ViewerTools, KnifeThroughMakesTwoPieces) {
    session.key("1");
    session.drag({0.01, -0.16, 0.1}, {0.01, 0.16, 0.1}, 20);
    EXPECT_EQ(session.pieces(), 2U);
    EXPECT_EQ(session.state().undo_count, 1U);
    EXPECT_TRUE(session.state().blades.empty());
}

TEST_F(ViewerTools, KnifeToADepthLeavesTheBottom) {
    session.key("1");
    session.set("knife_through", 0);
    session.set("knife_depth", 0.04);
    session.drag({0.01, -0.07, 0.1}, {0.01, 0.07, 0.1}, 20);
    EXPECT_EQ(session.pieces(), 1U);
    EXPECT_GT(session.cut_triangles(), 50U);
    EXPECT_GT(cut_heights().first, 0.05);
}

TEST_F(ViewerTools, CutIsInTheStateOfTheStepThatMadeIt) {
    session.key("1");
    session.press({0.01, -0.16, 0.1});
    session.frame();
    for (int k = 1; k <= 30; ++k) {
        session.move({0.01, -0.16 + 0.01 * k, 0.1});
        const std::size_t before = session.cut_triangles();
        session.frame();
        EXPECT_EQ(session.cut_triangles() > before, session.state().statistics.new_cut_edges > 0) << k;
    }
    EXPECT_GT(session.cut_triangles(), 50U);
}

TEST_F(ViewerTools, ScalpelFollowsTheSurfaceToItsDepth) {
    session.key("2");
    session.set("scalpel_depth", 0.03);
    session.drag({-0.06, 0, 0.1}, {0.06, 0, 0.1}, 20);
    EXPECT_EQ(session.pieces(), 1U);
    EXPECT_GT(session.cut_triangles(), 20U);
    const auto [low, high] = cut_heights();
    EXPECT_NEAR(low, 0.07, 0.014);
    EXPECT_GT(high, 0.085);
}

TEST_F(ViewerTools, ScissorsSnipWhenTheButtonIsReleased) {
    session.key("3");
    session.set("scissors_length", 0.08);
    session.press({0.01, -0.095, 0.1});
    session.run(2);
    session.move({0.01, -0.02, 0.1});
    session.run(2);
    EXPECT_EQ(session.cut_triangles(), 0U);
    session.release({0.01, -0.02, 0.1});
    session.run(20);
    EXPECT_GT(session.cut_triangles(), 20U);
    EXPECT_TRUE(session.state().blades.empty());
    EXPECT_EQ(session.state().undo_count, 1U);
}

TEST_F(ViewerTools, GrabPullsUntilItLetsGo) {
    session.key("4");
    const double before = session.viewer.bounds().max.z();
    session.press({0, 0, 0.1});
    session.frame();
    ASSERT_EQ(session.state().pulls.size(), 1U);
    for (int k = 1; k <= 20; ++k) {
        session.move({0, 0, 0.1 + 0.004 * k});
        session.frame();
    }
    EXPECT_GT(session.viewer.bounds().max.z(), before + 0.02);
    EXPECT_GT(session.state().pulls[0].force, 0.1);
    EXPECT_GT(session.state().statistics.tool_force, 0.1);
    session.release({0, 0, 0.18});
    session.run(60);
    EXPECT_TRUE(session.state().pulls.empty());
    EXPECT_NEAR(session.viewer.bounds().max.z(), before, 0.01);
}

TEST_F(ViewerTools, GrabbedMaterialCanBePinned) {
    session.key("4");
    session.press({0, 0, 0.1});
    session.frame();
    session.move({0, 0, 0.15});
    session.run(20);
    session.key("p");
    session.release({0, 0, 0.15});
    session.run(20);
    ASSERT_EQ(session.state().pulls.size(), 1U);
    EXPECT_TRUE(session.state().pulls[0].pinned);
    session.key("7");
    session.press(session.state().pulls[0].target);
    session.release(session.state().pulls[0].target);
    session.run(2);
    EXPECT_TRUE(session.state().pulls.empty());
}

TEST_F(ViewerTools, PinHoldsAFallingBody) {
    session.key("7");
    for (const Vec3& at : {Vec3(0.08, 0, 0.1), Vec3(-0.08, 0, 0.1), Vec3(0, -0.08, 0.1)}) {
        session.press(at);
        session.release(at);
        session.frame();
    }
    EXPECT_EQ(session.state().pulls.size(), 3U);
    for (const PullState& pull : session.state().pulls) EXPECT_TRUE(pull.pinned);
}

TEST_F(ViewerTools, TearBreaksWhatDidNotTear) {
    EXPECT_EQ(session.state().parameters[strength], 0);
    session.key("7");
    for (const Vec3& at : {Vec3(-0.09, -0.09, 0.1), Vec3(-0.09, 0.0, 0.1), Vec3(-0.09, 0.09, 0.1)}) {
        session.press(at);
        session.release(at);
        session.frame();
    }
    session.key("5");
    session.press({0.09, -0.05, 0.1});
    session.frame();
    EXPECT_GT(session.state().parameters[strength], 0);
    for (int k = 1; k <= 60; ++k) {
        session.move({0.09 + 0.006 * k, -0.05, 0.1 + 0.003 * k});
        session.frame();
    }
    EXPECT_GT(session.cut_triangles(), 10U);
}

TEST_F(ViewerTools, FreeBladeIsTurnedByKeysAndMovedByTheWheel) {
    session.key("6");
    session.move({0, 0, 0.2});
    session.frame();
    const auto lines = [&] { return session.viewer.tools().overlay(session.viewer.context()); };
    const auto direction = [&] {
        const std::vector<Vec3> points = lines().back().points;
        return Vec3(points[1] - points[0]).normalized();
    };
    const Vec3 before = direction();
    for (int k = 0; k < 5; ++k) session.key("q");
    EXPECT_LT(direction().dot(before), 0.95);
    for (int k = 0; k < 5; ++k) session.key("e");
    EXPECT_NEAR(direction().dot(before), 1, 1e-9);
    const Vec3 near = lines().back().points[0];
    session.viewer.take({.kind = InputKind::wheel, .value = 2});
    const Vec3 far = lines().back().points[0];
    EXPECT_GT((far - near).dot(session.viewer.camera().forward()), 0.01);
}

TEST_F(ViewerTools, FreeBladeCutsWhileTheButtonIsDown) {
    session.key("6");
    session.set("blade_length", 0.5);
    const Vec3 middle(0, 0, 0.05), up = session.viewer.camera().up();
    session.drag(middle + 0.2 * up, middle - 0.2 * up, 20);
    EXPECT_GE(session.pieces(), 2U);
}

// The jaws close, hold what lies between them, and let go.
TEST_F(ViewerTools, ForcepsCloseHoldAndLetGo) {
    session.key("8");
    session.move({0, 0, 0.1});
    const auto hand = [&] { return session.viewer.tools().instrument(session.viewer.context()); };
    ASSERT_TRUE(hand());
    EXPECT_EQ(hand()->kind, ToolKind::forceps);
    const double width = session.viewer.setting("forceps_width");
    const double before = session.viewer.bounds().max.z();
    session.press({0, 0, 0.1});
    session.frame();
    EXPECT_FALSE(hand()) << "those that hold are in the state";
    ASSERT_EQ(session.state().pulls.size(), 2U);
    const PullState first = session.state().pulls[0];
    EXPECT_EQ(first.partner, session.state().pulls[1].slot);
    EXPECT_EQ(session.state().pulls[1].partner, first.slot);
    EXPECT_NEAR(first.width, width, 0.02 * width);
    session.run(20);
    EXPECT_LT(session.state().pulls[0].opening, 0.8 * width) << "they have closed";
    for (int k = 1; k <= 20; ++k) {
        session.move({0, 0, 0.1 + 0.001 * k});
        session.frame();
    }
    ASSERT_EQ(session.state().pulls.size(), 2U);
    EXPECT_EQ(session.state().pulls[0].target, session.state().pulls[1].target);
    EXPECT_GT(session.viewer.bounds().max.z(), before + 0.005);
    ASSERT_EQ(session.state().forces.arrows.size(), 1U) << "both jaws are one thing";
    EXPECT_GT(session.state().forces.arrows[0].force.z(), 0);
    session.release({0, 0, 0.12});
    session.run(60);
    EXPECT_TRUE(session.state().pulls.empty());
    EXPECT_NEAR(session.viewer.bounds().max.z(), before, 0.005);
}

TEST_F(ViewerTools, ForcepsHoldUpToTheirForceAndSlipOff) {
    session.set("forceps_grip", 0.2);
    const double limit = session.viewer.tools().grip_limit(session.state());
    session.key("8");
    session.press({0, 0, 0.1});
    session.run(20);
    double largest = 0;
    bool was_at_limit = false;
    for (int k = 1; k <= 60 && !session.state().pulls.empty(); ++k) {
        session.move({0, 0, 0.1 + 0.004 * k});
        session.frame();
        for (const PullState& pull : session.state().pulls) {
            largest = std::max(largest, pull.force);
            was_at_limit = was_at_limit || pull.is_at_limit();
        }
    }
    EXPECT_TRUE(was_at_limit);
    EXPECT_LE(largest, 0.5 * limit * (1 + 1e-6));
    EXPECT_TRUE(session.state().pulls.empty());
    EXPECT_THAT(session.state().notice, testing::HasSubstr("slipped off"));
    session.release({0, 0, 0.3});
    session.run(3);
}

TEST_F(ViewerTools, ForcepsAreUndoneAndLeftOnTheTissue) {
    session.key("8");
    session.press({0.05, 0, 0.1});
    session.run(20);
    session.move({0.05, 0, 0.11});
    session.run(5);
    session.key("p");
    session.release({0.05, 0, 0.11});
    session.run(10);
    ASSERT_EQ(session.state().pulls.size(), 2U);
    EXPECT_TRUE(session.state().pulls[0].pinned && session.state().pulls[1].pinned);
    EXPECT_EQ(session.state().undo_count, 1U);
    session.key("z", control_key);
    EXPECT_TRUE(session.state().pulls.empty());
    EXPECT_EQ(session.state().undo_count, 0U);
    session.press({0.05, 0, 0.1});
    session.run(15);
    session.key("p");
    session.release({0.05, 0, 0.1});
    session.run(2);
    ASSERT_EQ(session.state().pulls.size(), 2U);
    session.press(session.state().pulls[0].target);
    session.release(session.state().pulls[0].target);
    session.run(2);
    EXPECT_TRUE(session.state().pulls.empty()) << "a click takes them off";
}

TEST_F(ViewerTools, ChangingTheToolEndsWhatIsUnderWay) {
    session.key("4");
    session.press({0, 0, 0.1});
    session.frame();
    EXPECT_EQ(session.state().pulls.size(), 1U);
    session.key("1");
    session.run(2);
    EXPECT_TRUE(session.state().pulls.empty());
    session.release({0, 0, 0.1});
    session.press({0.01, -0.16, 0.1});
    session.frame();
    EXPECT_EQ(session.state().blades.size(), 1U);
    session.move({0.01, -0.05, 0.1});
    session.move({0.01, 0.05, 0.1});
    session.frame();
    EXPECT_EQ(session.viewer.tools().overlay(session.viewer.context()).back().points.size(), 3U) << "a trail";
    session.key("escape");
    session.run(4);
    EXPECT_TRUE(session.state().blades.empty());
}

}  // namespace
}  // namespace splitcubes::view_tests
