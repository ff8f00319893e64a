// Each slider of the material changes the picture of a replayed session as it says.
#include "view/draw/drawn_sessions.h"

#include <splitcubes/view/parameters.h>
#include <splitcubes/view/replay.h>

#include <set>
#include <string>

#include <nlohmann/json.hpp>

namespace splitcubes::view_tests {
namespace {

bool is_body(const Pixel& p) {
    return p.red > p.blue + 20;
}

/// The last picture of a replay.
struct Seen {
    render::Picture picture;
    OrbitCamera camera;
    std::vector<NumberLabel> labels;

    Pixel at(int x, int y) const {
        const std::uint8_t* p = picture.pixel(x, y);
        return {p[0], p[1], p[2]};
    }
    Pixel at(const Vec3& world) const {
        const Vec3 p = camera.project(world, {1.0 * picture.width, 1.0 * picture.height});
        return at(static_cast<int>(p.x()), static_cast<int>(p.y()));
    }
    /// The highest pixel of the body in the middle column.
    int top() const {
        int y = 0;
        while (y + 1 < picture.height && !is_body(at(picture.width / 2, y))) ++y;
        return y;
    }
    int width() const {
        int first = picture.width, last = 0;
        for (int y = 0; y < picture.height; ++y)
            for (int x = 0; x < picture.width; ++x)
                if (is_body(at(x, y))) {
                    first = std::min(first, x);
                    last = std::max(last, x);
                }
        return last - first;
    }
    std::size_t count(bool (*property)(const Pixel&)) const {
        std::size_t out = 0;
        for (int y = 0; y < picture.height; ++y)
            for (int x = 0; x < picture.width; ++x) out += property(at(x, y));
        return out;
    }
};

using Values = std::vector<std::pair<std::string, double>>;

struct SliderPixels : DrawnSession {
    void SetUp() override {
        DrawnSession::SetUp();
        scene = write_scene("");
    }
    std::filesystem::path write_scene(const std::string& more, double ground = 0) const {
        const std::filesystem::path file = write_block_scene(
            folder.path, more + R"(, "camera": {"eye": [0.3, -0.3, 0.3], "target": [0, 0, 0.04]})", 8, 50);
        nlohmann::json scene = nlohmann::json::parse(std::ifstream(file));
        scene["ground"]["height"] = ground;
        std::ofstream(file) << scene;
        return file;
    }
    // Values are set before the first step. knife: a stroke over the top; the picture is that of the largest
    // force.
    Seen seen(const Values& values, int frames = 25, bool knife = false) {
        checked.insert(values.back().first);
        ReplaySettings settings{.file = scene, .frames = frames, .size = {width, height}, .threads = 1};
        const auto add = [&](const ViewerInput& input) { settings.inputs.push_back(input); };
        for (const auto& [name, value] : values)
            add({.kind = InputKind::set, .frame = 0, .name = name, .value = value});
        add({.kind = InputKind::key, .frame = 0, .name = "r"});
        add({.kind = InputKind::key, .frame = 0, .name = "space"});
        if (knife) {
            add({.kind = InputKind::press, .frame = 1, .x = 200, .y = 130});
            for (int k = 1; k < frames; ++k)
                add({.kind = InputKind::move, .frame = 1 + k, .x = 200.0 + 10 * k, .y = 130.0 + 3 * k});
        }
        renderer.emplace(*context);  // states of another replay have the same numbers
        Seen out;
        double force = -1;
        replay_input(settings, [&](const ReplayFrame& frame) {
            const double now = knife ? frame.viewer.state()->statistics.tool_force : 0;
            if ((!knife && frame.number + 1 < frames) || now <= force) return;
            force = now;
            out = {renderer->picture(frame.viewer, width, height, Quality::quick), frame.viewer.camera(),
                   renderer->labels()};
        });
        return out;
    }
    // The pixel at which the body ended above shows what is behind it.
    void expect_lower(const Seen& lower, const Seen& higher) {
        EXPECT_GT(lower.top(), higher.top() + 2);
        const int row = higher.top() + 1;
        EXPECT_TRUE(is_body(higher.at(width / 2, row)));
        EXPECT_FALSE(is_body(lower.at(width / 2, row)));
    }

    std::filesystem::path scene;
    std::set<std::string> checked;
};

TEST_F(SliderPixels, OfEachQuantity) {
    // A block sags under its weight: it is lower the softer, the heavier, and the more it is pulled.
    const Values soft = {{"forces", 0}, {"youngs_modulus", 8000}};
    const auto with = [&](const std::string& name, double value, Values more = {}) {
        more.insert(more.begin(), soft.begin(), soft.end());
        more.emplace_back(name, value);
        return more;
    };
    const Seen plain = seen(soft);
    expect_lower(seen(with("youngs_modulus", 2500)), plain);
    expect_lower(seen(with("density", 3000)), plain);
    expect_lower(seen(with("gravity", 22)), plain);
    // A body that keeps its volume bulges.
    const Values very_soft = {{"youngs_modulus", 3000}};
    EXPECT_GT(seen(with("poisson_ratio", 0.48, very_soft)).width(),
              seen(with("poisson_ratio", 0, very_soft)).width() + 4);
    // A damped body deforms more slowly.
    expect_lower(seen(with("stiffness_damping", 0, very_soft), 3),
                 seen(with("stiffness_damping", 0.05, very_soft), 3));
    // A weak block breaks under its own weight; its cut faces are red.
    EXPECT_GT(seen(with("strength", 50, very_soft)).count(is_red),
              seen(with("strength", 0, very_soft)).count(is_red) + 40);

    // Meshes and samples are finer after a restart.
    const auto is_dark = [](const Pixel& p) { return p.red + p.green + p.blue < 330; };
    EXPECT_GT(seen(with("cell_size", 0.012, {{"wireframe", 1}}), 2).count(is_dark),
              1.5 * static_cast<double>(seen(with("cell_size", 0.03, {{"wireframe", 1}}), 2).count(is_dark)));
    EXPECT_NE(seen(with("phyxel_spacing", 0.03, {{"phyxels", 1}}), 2).count(is_blue),
              seen(with("phyxel_spacing", 0.06, {{"phyxels", 1}}), 2).count(is_blue));

    // A blade in the material feels its resistance: the arrow and its number.
    const auto cut = [&](double resistance) {
        return seen({{"knife_through", 0}, {"knife_depth", 0.05}, {"cutting_resistance", resistance}}, 12,
                    true);
    };
    const Seen tough = cut(2000), easy = cut(200), none = cut(0);
    EXPECT_GT(tough.count(is_red), none.count(is_red) + 40);
    ASSERT_EQ(tough.labels.size(), 1U);
    ASSERT_EQ(easy.labels.size(), 1U);
    EXPECT_GT(std::stod(tough.labels[0].text), 3 * std::stod(easy.labels[0].text));

    // A falling block is lower after longer steps, and where nothing slows it.
    scene = write_scene("", -2);
    const Values still = {{"forces", 0}, {"mass_damping", 0}};
    const auto fall = [&](const std::string& name, double value) {
        Values values = still;
        values.emplace_back(name, value);
        return seen(values, 8);
    };
    expect_lower(fall("mass_damping", 0), fall("mass_damping", 20));
    expect_lower(fall("time_step", 1.0 / 60), fall("time_step", 1.0 / 120));

    // On a slope a block slides away where there is no friction.
    scene = write_scene(R"(, "gravity": [3, 0, -9.81])");
    const Vec3 end(-0.09, 0, 0.09);
    EXPECT_TRUE(is_body(seen({{"friction", 1}}, 22).at(end)));
    EXPECT_FALSE(is_body(seen({{"friction", 0.02}}, 22).at(end)));

    for (const Parameter& parameter : parameter_list())
        EXPECT_EQ(checked.count(std::string(parameter.name)), 1U) << parameter.name << " is looked at";
}

}  // namespace
}  // namespace splitcubes::view_tests
