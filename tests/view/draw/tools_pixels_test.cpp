// The picture shows each tool while it works, and its traces.
#include "view/draw/drawn_sessions.h"

namespace splitcubes::view_tests {
namespace {

const Vec3 from(0.01, -0.16, 0.1), to(0.01, 0.16, 0.1), top(0, 0, 0.1);

struct ToolPixels : DrawnSession {
    void SetUp() override {
        DrawnSession::SetUp();
        if (context == nullptr) return;
        session->key("space");
        session->run(2);
    }
};

TEST_F(ToolPixels, KnifeDrawsItsLineAndOpensACut) {
    session->key("1");
    stroke({from, top}, false);
    EXPECT_TRUE(is_near({0.01, -0.1, 0.1}, is_blue)) << "the trail";
    stroke({from, to});
    EXPECT_GE(session->pieces(), 2U);
    session->set("colouring", 1);
    const Pixel left = at(Vec3(-0.05, 0, 0.1)), right = at(Vec3(0.07, 0, 0.1));
    EXPECT_GT(std::abs(left.red - right.red) + std::abs(left.green - right.green) +
                  std::abs(left.blue - right.blue),
              90)
        << "two pieces";
}

TEST_F(ToolPixels, ScalpelDrawsItsLine) {
    session->key("2");
    stroke({{-0.06, 0, 0.1}, {0.06, 0, 0.1}}, false);
    EXPECT_TRUE(is_near({-0.03, 0, 0.1}, is_blue));
    EXPECT_GT(session->cut_triangles(), 10U);
}

TEST_F(ToolPixels, ScissorsShowWhereTheyAreGoingToCut) {
    session->key("3");
    session->press({0.01, -0.095, 0.1});
    session->move({0.01, 0.02, 0.1});
    session->frame();
    EXPECT_TRUE(is_near({0.01, -0.04, 0.1}, is_blue));
    session->release({0.01, 0.02, 0.1});
    session->run(20);
    EXPECT_GT(session->cut_triangles(), 20U);
}

TEST_F(ToolPixels, GrabAndTearShowTheirForceWithANumber) {
    for (const char* tool : {"4", "5"}) {
        session->key(tool);
        stroke({top, {0, 0, 0.15}}, false);
        EXPECT_GT(count(is_red), 60U) << "an arrow, tool " << tool;
        ASSERT_EQ(renderer->labels().size(), 1U);
        EXPECT_NE(renderer->labels()[0].text.find(" N"), std::string::npos);
        session->set("forces", 0);
        EXPECT_LT(count(is_red), 20U);
        EXPECT_TRUE(renderer->labels().empty());
        session->set("forces", 1);
        session->release({0, 0, 0.15});
        session->run(2);
    }
}

TEST_F(ToolPixels, FreeBladeIsALineWhereverThePointerIs) {
    session->key("6");
    session->set("blade_length", 0.1);
    session->move({0, 0, 0.2});
    session->frame();
    const auto blade = session->viewer.tools().overlay(session->viewer.context()).back().points;
    EXPECT_TRUE(is_near(0.5 * (blade[0] + blade[1]), is_blue));
}

TEST_F(ToolPixels, LengthsOfToolsAreSeen) {
    session->key("6");
    session->move({0, 0, 0.2});
    session->set("blade_length", 0.06);
    const auto end_of_blade = [&] {
        return session->viewer.tools().overlay(session->viewer.context()).back().points[1];
    };
    const Vec3 near = end_of_blade();
    session->set("blade_length", 0.2);
    const Vec3 far = end_of_blade();
    EXPECT_TRUE(is_near(far, is_blue));
    session->set("blade_length", 0.06);
    EXPECT_FALSE(is_near(far, is_blue));
    EXPECT_TRUE(is_near(near, is_blue));

    // A deeper scalpel reaches further down; its edge shows through the body.
    session->key("2");
    session->move(top);
    session->frame();
    session->move(top);
    session->set("scalpel_depth", 0.02);
    const render::Picture shallow = picture();
    session->set("scalpel_depth", 0.08);
    const render::Picture deep = picture();
    EXPECT_NE(deep.rgb, shallow.rgb);
    session->set("scalpel_tilt", 50);
    session->move(top);
    EXPECT_NE(picture().rgb, deep.rgb);
}

TEST_F(ToolPixels, ForcepsAreSolidAndRedWhenTheyHoldWithAllTheirForce) {
    session->set("forces", 0);
    const render::Picture without = picture();
    session->key("8");
    session->move(top);
    session->frame();
    const render::Picture open = picture();
    EXPECT_NE(open.rgb, without.rgb) << "they are open over the tissue";
    session->set("forceps_grip", 0.3);
    stroke({top}, false);
    session->run(15);
    EXPECT_NE(picture().rgb, open.rgb);
    EXPECT_LT(count(is_red), 20U);
    for (int k = 1; k <= 12 && count(is_red) < 60; ++k) {
        session->move(top + Vec3(0, 0, 0.004 * k));
        session->frame();
    }
    EXPECT_GT(count(is_red), 60U);
    session->set("forces", 1);
    picture();
    ASSERT_EQ(renderer->labels().size(), 1U);
    EXPECT_NE(renderer->labels()[0].text.find("all that it holds"), std::string::npos);
}

TEST_F(ToolPixels, PinsAreGreenCrosses) {
    session->key("7");
    stroke({top});
    session->set("forces", 0);
    EXPECT_TRUE(is_near(top, is_green, 8));
}

TEST_F(ToolPixels, UndoneCutsAreGone) {
    session->set("forces", 0);
    session->key("space");
    session->frame();
    const render::Picture before = picture();
    session->key("space");
    stroke({from, to});
    session->run(20);
    EXPECT_NE(picture().rgb, before.rgb);
    session->key("space");
    session->key("z", control_key);
    EXPECT_EQ(picture().rgb, before.rgb);
}

}  // namespace
}  // namespace splitcubes::view_tests
