// Each setting of the display changes the picture as it says.
#include "view/draw/drawn_sessions.h"

#include <splitcubes/render/image.h>

namespace splitcubes::view_tests {
namespace {

bool is_orange(const Pixel& p) {
    return p.red > 200 && p.green > 70 && p.green < 150 && p.blue < 90;
}
bool is_grey(const Pixel& p) {
    return std::abs(p.red - p.blue) < 25 && std::abs(p.red - p.green) < 18;
}

struct DisplayPixels : DrawnSession {
    void SetUp() override {
        DrawnSession::SetUp();
        if (context == nullptr) return;
        session->key("space");
        session->run(2);
    }
    // Lays the left part aside, so that the cut face is seen.
    void open_cut() {
        session->set("forces", 0);
        stroke({{0.01, -0.16, 0.1}, {0.01, 0.16, 0.1}});
        session->key("4");
        stroke({{-0.06, -0.06, 0.1}, {-0.14, -0.06, 0.12}}, false);
        session->run(20);
    }
};

TEST_F(DisplayPixels, CutFacesAreRedByMaterialAndColouredByCutAndAge) {
    open_cut();
    const std::size_t red = count(is_red);
    EXPECT_GT(red, 80U);
    session->set("colouring", static_cast<double>(Colouring::cut));
    const Pixel skin = at(Vec3(0.07, 0, 0.1));
    EXPECT_TRUE(is_grey(skin)) << skin.red << ' ' << skin.green << ' ' << skin.blue;
    EXPECT_GT(count([](const Pixel& p) { return !is_grey(p) && std::abs(p.red - p.blue) > 60; }), 60U);
    session->set("colouring", static_cast<double>(Colouring::age));
    EXPECT_EQ(renderer->legend().title, "") << "of the picture before";
    session->set("colour_range", 100);
    const std::size_t fresh = count(is_red);
    EXPECT_GT(fresh, 60U) << "young cuts are red";
    EXPECT_EQ(renderer->legend().title, "Age of the cut, s");
    session->set("colour_range", 0.02);
    EXPECT_LT(count(is_red), fresh / 4);
    EXPECT_GT(count(is_blue), 30U) << "old ones are blue";
    session->set("colouring", 0);
    EXPECT_NEAR(static_cast<double>(count(is_red)), static_cast<double>(red), 0.2 * static_cast<double>(red));
}

TEST_F(DisplayPixels, FieldsHaveAScale) {
    for (const Colouring field :
         {Colouring::von_mises_stress, Colouring::principal_stress, Colouring::principal_strain}) {
        session->set("colouring", static_cast<double>(field));
        session->run(1);
        EXPECT_GT(count(is_blue), 500U);
        EXPECT_EQ(renderer->legend().title.find(colouring_names[static_cast<std::size_t>(field)]), 0U);
    }
}

TEST_F(DisplayPixels, PhyxelsAndLinksAreSeenThroughTheSurface) {
    const std::size_t none = count(is_blue);
    session->set("phyxels", 1);
    session->run(1);
    EXPECT_GT(count(is_blue), none + 300);
    session->set("phyxels", 0);
    stroke({{0.01, -0.07, 0.1}, {0.01, 0.07, 0.1}});
    session->key("space");
    const render::Picture opaque = picture();
    session->set("links", 1);
    session->run(1);
    EXPECT_FALSE(session->viewer.state()->bodies[0].links.empty());
    EXPECT_NE(picture().rgb, opaque.rgb);
    const Pixel through = at(Vec3(0.07, 0.07, 0.1)), before = [&] {
        const Vec3 p = session->pixels({0.07, 0.07, 0.1});
        return at(opaque, p.x(), p.y());
    }();
    EXPECT_LT(std::abs(through.red - through.blue), std::abs(before.red - before.blue));
    session->set("links", 0);
    session->run(1);
    EXPECT_EQ(picture().rgb, opaque.rgb);
}

TEST_F(DisplayPixels, ContactsAreOrangePoints) {
    session->run(20);
    const std::size_t none = count(is_orange);
    session->set("contacts", 1);
    session->run(1);
    EXPECT_FALSE(session->viewer.state()->forces.contacts.empty());
    EXPECT_GT(count(is_orange), none + 30);
}

TEST_F(DisplayPixels, EdgesAndClipPlane) {
    const auto dark = [](const Pixel& p) { return p.red + p.green + p.blue < 330; };
    const std::size_t smooth = count(dark);
    session->set("wireframe", 1);
    EXPECT_GT(count(dark), smooth + 500);
    session->set("wireframe", 0);
    session->set("clip", 1);
    session->set("clip_axis", 0);
    session->set("clip_offset", 0.5);
    const Pixel hidden = at(Vec3(0.08, 0, 0.1)), left = at(Vec3(-0.08, 0, 0.1));
    EXPECT_GT(left.red, left.blue + 20);
    EXPECT_LT(std::abs(hidden.red - hidden.blue), std::abs(left.red - left.blue));
}

TEST_F(DisplayPixels, SlidersOfTheMaterialAreSeen) {
    session->set("forces", 0);
    // The middle of the rear upper edge, where the background is after the body has come down.
    const auto height = [&](const char* name, double value) {
        session->set(name, value);
        session->run(25);
        return session->viewer.bounds().max.z();
    };
    const double before = session->viewer.bounds().max.z();
    const Vec3 edge(0, 0.1, before - 0.002);
    const Pixel body = at(edge);
    EXPECT_GT(body.red, body.blue + 20);
    EXPECT_LT(height("youngs_modulus", 2500), before - 0.006);
    const Pixel behind = at(edge);
    EXPECT_LT(std::abs(behind.red - behind.blue), body.red - body.blue);
    const double sagged = session->viewer.bounds().max.z();
    EXPECT_GT(height("gravity", 0.5), sagged + 0.003);
    EXPECT_GT(height("density", 300), sagged + 0.003);
}

TEST_F(DisplayPixels, ClipPlaneShowsTheInside) {
    session->key("space");
    session->frame();
    session->set("clip", 1);
    session->set("clip_axis", 1);
    session->set("clip_offset", 0.5);
    EXPECT_TRUE(is_red(at(Vec3(0, 0, 0.05)))) << "the colour of cut faces";
    session->set("clip_offset", 0.02);
    EXPECT_TRUE(is_red(at(Vec3(0.05, -0.096, 0.05))));
    EXPECT_FALSE(is_red(at(Vec3(0, 0, 0.1)))) << "its skin stays";
    session->set("clip", 0);
    EXPECT_LT(count(is_red), 30U);
}

TEST_F(DisplayPixels, ThePastIsShownAsItWas) {
    Timeline timeline(std::size_t{64} << 20);
    session->set("forces", 0);
    session->run(1);
    timeline.add(session->viewer.state());
    const render::Picture before = picture();
    open_cut();
    const render::Picture after = picture();
    EXPECT_NE(after.rgb, before.rgb);
    const State now = session->viewer.state();
    session->viewer.show(timeline.at(now->step));
    session->viewer.take({.kind = InputKind::key, .name = "escape"});
    EXPECT_EQ(picture().rgb, before.rgb);
    session->viewer.show(now);
    EXPECT_EQ(picture().rgb, after.rgb);
}

TEST_F(DisplayPixels, PicturesAreLaidOnMeshes) {
    // A box whose picture is red where u < 1/2, and blue elsewhere; u is x.
    render::Picture halves{.width = 2, .height = 1, .rgb = {220, 20, 20, 20, 20, 220}};
    render::write_png(folder.path / "halves.png", halves);
    std::ofstream(folder.path / "box.mtl") << "newmtl paint\nKd 1 1 1\nmap_Kd halves.png\n";
    std::ofstream obj(folder.path / "box.obj");
    obj << "mtllib box.mtl\nusemtl paint\n";
    for (int c = 0; c < 8; ++c)
        obj << "v " << (c & 1 ? 0.1 : -0.1) << ' ' << (c & 2 ? 0.1 : -0.1) << ' ' << (c & 4 ? 0.1 : 0)
            << '\n';
    obj << "vt 0.01 0.5\nvt 0.99 0.5\n";
    for (const auto& t : {std::array{0, 2, 1},
                          {1, 2, 3},
                          {4, 5, 6},
                          {5, 7, 6},
                          {0, 1, 4},
                          {1, 5, 4},
                          {2, 6, 3},
                          {3, 6, 7},
                          {0, 4, 2},
                          {2, 4, 6},
                          {1, 3, 5},
                          {3, 7, 5}}) {
        obj << 'f';
        for (const int c : t) obj << ' ' << c + 1 << '/' << (c & 1) + 1;
        obj << '\n';
    }
    obj.close();
    open(folder.path / "box.obj");
    ASSERT_TRUE(session->viewer.state()->bodies[0].pictures);
    EXPECT_TRUE(is_red(at(Vec3(-0.07, 0, 0.1))));
    EXPECT_TRUE(is_blue(at(Vec3(0.07, 0, 0.1))));
    session->key("space");
    stroke({{0.02, -0.16, 0.1}, {0.02, 0.16, 0.1}});
    EXPECT_EQ(session->pieces(), 2U);
    EXPECT_TRUE(is_red(at(Vec3(-0.07, 0, 0.1)))) << "after a cut, too";
    EXPECT_TRUE(is_blue(at(Vec3(0.085, 0, 0.1))));
}

}  // namespace
}  // namespace splitcubes::view_tests
