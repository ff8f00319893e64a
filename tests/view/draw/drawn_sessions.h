// Sessions whose pictures are looked at.
#pragma once

#include "view/sessions.h"

#include <splitcubes/gl/context.h>
#include <splitcubes/view/draw/state_renderer.h>

#include <gtest/gtest.h>

#include <functional>
#include <optional>

namespace splitcubes::view_tests {

/// A colour as 0 to 255.
struct Pixel {
    int red, green, blue;
};
inline bool is_blue(const Pixel& p) {
    return p.blue > p.red + 50 && p.blue > p.green + 15;
}
inline bool is_red(const Pixel& p) {
    return p.red > p.green + 80 && p.red > p.blue + 80;
}
inline bool is_green(const Pixel& p) {
    return p.green > p.red + 30 && p.green > p.blue + 15;
}

/// One context for all tests of a program: to make one takes longer than a test.
inline const gl::HeadlessContext* shared_context(std::string* why_not) {
    static std::string reason;
    static const std::optional<gl::HeadlessContext> context = gl::HeadlessContext::create(&reason);
    *why_not = reason;
    return context ? &*context : nullptr;
}

struct DrawnSession : testing::Test {
    static constexpr int width = 480, height = 300;
    TemporaryFolder folder{"drawn"};
    std::optional<HandSession> session;
    std::optional<StateRenderer> renderer;
    const gl::HeadlessContext* context = nullptr;

    void SetUp() override {
        std::string why_not;
        context = shared_context(&why_not);
        if (context == nullptr) GTEST_SKIP() << "no OpenGL here: " << why_not;
        open(write_block_scene(folder.path));
    }
    void open(const std::filesystem::path& file) {
        session.emplace(file);
        session->viewer.take({.kind = InputKind::resize, .x = width, .y = height});
        renderer.emplace(*context);
    }
    render::Picture picture(Quality quality = Quality::quick) {
        return renderer->picture(session->viewer, width, height, quality);
    }
    static Pixel at(const render::Picture& picture, double x, double y) {
        const std::uint8_t* p = picture.pixel(static_cast<int>(x), static_cast<int>(y));
        return {p[0], p[1], p[2]};
    }
    /// The pixel of a point of the world.
    Pixel at(const Vec3& world) {
        const Vec3 p = session->pixels(world);
        return at(picture(), p.x(), p.y());
    }
    /// Whether some pixel within a few pixels of a point has a property.
    bool is_near(const Vec3& world, const std::function<bool(const Pixel&)>& property, int reach = 4) {
        const render::Picture all = picture();
        const Vec3 p = session->pixels(world);
        for (int dy = -reach; dy <= reach; ++dy)
            for (int dx = -reach; dx <= reach; ++dx)
                if (property(at(all, p.x() + dx, p.y() + dy))) return true;
        return false;
    }
    std::size_t count(const std::function<bool(const Pixel&)>& property) {
        const render::Picture all = picture();
        std::size_t out = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) out += property(at(all, x, y));
        return out;
    }
    /// Down, through `points`, and up; a frame each.
    void stroke(const std::vector<Vec3>& points, bool releases = true) {
        session->press(points.front());
        session->frame();
        for (std::size_t k = 1; k < points.size(); ++k)
            for (int part = 1; part <= 8; ++part) {
                session->move(points[k - 1] + (points[k] - points[k - 1]) * part / 8);
                session->frame();
            }
        if (!releases) return;
        session->release(points.back());
        session->run(3);
    }
};

}  // namespace splitcubes::view_tests
