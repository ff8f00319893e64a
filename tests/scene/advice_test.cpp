// Notes about a world before its first step: given for problems, and not otherwise.
#include <splitcubes/scene/advice.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/parse.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <memory>
#include <numbers>

namespace splitcubes::scene {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

std::vector<std::string> notes(const std::string& text) {
    BuildReport report;
    build_world(parse_scene_text(text, "x.json", "/"), std::make_shared<const Parallel>(2), report);
    std::vector<std::string> out;
    for (const auto& [name, note] : report.notes) out.push_back(name + ": " + note);
    return out;
}

std::string body(const std::string& name, const std::string& size, const std::string& rest) {
    return R"({"name": ")" + name + R"(", "shape": {"box": {"size": )" + size + "}}, " + rest + "}";
}

std::string scene(const std::string& bodies, const std::string& rest = "") {
    return "{\"bodies\": [" + bodies + "]" + rest + "}";
}

using meshless::TimeScheme;
using Complex = std::complex<double>;

// One step of TR-BDF2 for y' = z y / step, from its definition: the trapezoidal rule over a share of the
// step, then the parabola through both ends of that and the new value, whose slope there is z times the
// value.
Complex tr_bdf2_step(const Complex& y, const Complex& z) {
    const double share = 2 - std::sqrt(2.0), rest = 1 - share;
    const Complex middle = y * (1.0 + 0.5 * share * z) / (1.0 - 0.5 * share * z);
    // Derivatives at 1 of Lagrange's polynomials at 0, share and 1.
    const double at_start = rest / share, at_middle = -1 / (share * rest), at_end = (1 + rest) / rest;
    return (at_start * y + at_middle * middle) / (z - at_end);
}

// Integrates y' = i w y over many periods.
double measured_keep(double w, double h, TimeScheme scheme) {
    const Complex x(0, w * h);
    Complex before(1, 0), now = 1.0 / (1.0 - x);
    double angle = std::arg(now);
    const int steps = 400;
    // The other root of BDF2 has decayed after some steps.
    double start = 0, start_angle = 0;
    for (int k = 0; k < steps; ++k) {
        const Complex next = scheme == TimeScheme::bdf2      ? (2.0 * now - 0.5 * before) / (1.5 - x)
                             : scheme == TimeScheme::tr_bdf2 ? tr_bdf2_step(now, x)
                                                             : now / (1.0 - x);
        angle += std::arg(next / now);
        before = now;
        now = next;
        if (k == 100) {
            start = std::log(std::abs(now));
            start_angle = angle;
        }
    }
    return std::exp((std::log(std::abs(now)) - start) / (angle - start_angle) * 2 * std::numbers::pi);
}

TEST(Advice, amplitude_kept_per_period_matches_the_integrators) {
    for (const TimeScheme scheme : {TimeScheme::bdf2, TimeScheme::backward_euler, TimeScheme::tr_bdf2})
        for (const double x : {0.05, 0.2, 0.5, 0.8})
            EXPECT_NEAR(kept_per_period(x / 0.01, 0.01, scheme), measured_keep(x / 0.01, 0.01, scheme), 1e-6)
                << x << ' ' << static_cast<int>(scheme);
}

TEST(Advice, few_phyxels_across_a_plate_are_noted_with_a_sufficient_spacing) {
    const auto plate = [](const std::string& spacing) {
        return scene(
            body("plate", "[0.5, 0.5, 0.03]", R"("cell_size": 0.005, "phyxel_spacing": )" + spacing));
    };
    EXPECT_THAT(notes(plate("0.012")),
                ElementsAre(testing::AllOf(HasSubstr("plate: it is about 0.0"), HasSubstr("across"),
                                           HasSubstr("phyxel_spacing 0.00"), HasSubstr("puts six across"))));
    EXPECT_THAT(notes(plate("0.005")), IsEmpty());
    EXPECT_THAT(notes(scene(body("cube", "[1, 1, 1]", R"("cells": 20)"))), IsEmpty());
}

TEST(Advice, a_step_that_damps_visible_vibrations_is_noted) {
    const std::string hold = R"(, "constraints": [{"body": "bar", "kind": "hold",
        "region": {"half_space": {"point": [-0.22, 0, 0], "normal": [-1, 0, 0]}}}])";
    // Its frequency is about 3 Hz.
    const std::string bar =
        body("bar", "[0.5, 0.06, 0.06]",
             R"("cells": 50, "phyxel_spacing": 0.01, "material": {"youngs_modulus": 5e6})");
    EXPECT_THAT(notes(scene(bar, hold)), IsEmpty());
    EXPECT_THAT(
        notes(scene(bar, hold + R"(, "time_step": 0.1)")),
        ElementsAre(testing::AllOf(HasSubstr("bar: its slowest vibration, at about "),
                                   HasSubstr(" because of the time step of 0.1 s alone; time_step 0.0"))));
    EXPECT_THAT(notes(scene(bar, hold + R"(, "time_step": 0.1, "solver": {"kind": "explicit"})")), IsEmpty());
    EXPECT_THAT(notes(scene(bar, hold + R"(, "solver": {"integrator": "backward_euler"})")),
                ElementsAre(HasSubstr("solver.integrator tr_bdf2")));
    // No note if the material's own damping dominates, or if the vibration is too fast to be seen.
    const std::string damped = body("bar", "[0.5, 0.06, 0.06]",
                                    R"("cells": 50, "phyxel_spacing": 0.01,
                                       "material": {"youngs_modulus": 5e6, "mass_damping": 20})");
    EXPECT_THAT(notes(scene(damped, hold + R"(, "time_step": 0.1)")), IsEmpty());
    const std::string stiff =
        body("bar", "[0.5, 0.06, 0.06]",
             R"("cells": 50, "phyxel_spacing": 0.01, "material": {"youngs_modulus": 1e8})");
    EXPECT_THAT(notes(scene(stiff, hold + R"(, "time_step": 0.1)")), IsEmpty());
}

TEST(Advice, overlapping_bodies_are_noted_if_contact_is_enabled) {
    const auto two = [](const std::string& height, const std::string& contact) {
        return scene(body("low", "[1, 1, 1]", R"("cells": 20)") + "," +
                         body("high", "[1, 1, 1]",
                              R"("cells": 20, "placement": {"position": [0.3, 0, )" + height + "]}"),
                     contact);
    };
    const std::string on = R"(, "contact": {"pieces": true})";
    EXPECT_THAT(notes(two("0.8", on)),
                ElementsAre(testing::StartsWith("low: overlaps 'high' at the start, over 0.")));
    EXPECT_THAT(notes(two("1", on)), IsEmpty()) << "they touch";
    const std::string off = R"(, "contact": {"pieces": false})";
    EXPECT_THAT(notes(two("0.8", off)), IsEmpty()) << "they go through each other";
    // A ball in the hole of a ring overlaps its bounding box only.
    EXPECT_THAT(notes(scene(R"({"name": "ring", "shape": {"torus": {"ring_radius": 0.5, "tube_radius": 0.2}},
                                "cells": 30, "phyxel_count": 2000},
                               {"name": "ball", "shape": {"sphere": {"radius": 0.2}}, "cells": 20})",
                            on)),
                IsEmpty());
}

TEST(Advice, bodies_inside_the_ground_are_noted) {
    EXPECT_THAT(notes(scene(body("cube", "[1, 1, 1]", R"("cells": 20)"), R"(, "ground": {"height": -0.3})")),
                ElementsAre(HasSubstr("cube: begins 0.2 m inside 'ground'")));
    EXPECT_THAT(notes(scene(body("cube", "[1, 1, 1]", R"("cells": 20)"), R"(, "ground": {"height": -0.5})")),
                IsEmpty());
}

// The first steps confirm the predictions of the overlap notes.
TEST(Advice, overlap_notes_predict_the_first_steps) {
    const auto fastest = [](const std::string& text) {
        BuildReport report;
        const auto world =
            build_world(parse_scene_text(text, "x.json", "/"), std::make_shared<const Parallel>(2), report);
        double out = 0;
        for (int k = 0; k < 3; ++k) out = std::max(out, world->step().totals.top_speed);
        return out;
    };
    const std::string still = R"(, "gravity": [0, 0, 0])";
    for (const std::string shift : {"0.87", "0.6", "0.5"}) {
        const std::string two = scene(
            body("a", "[1, 1, 1]", R"("cells": 16, "phyxel_count": 100)") + "," +
                body("b", "[1, 1, 1]",
                     R"("cells": 16, "phyxel_count": 100, "placement": {"position": [)" + shift + ", 0, 0]}"),
            still + R"(, "contact": {"pieces": true})");
        const bool seen = shift == "0.87";
        EXPECT_THAT(notes(two), ElementsAre(testing::AllOf(testing::Not(HasSubstr("throws")),
                                                           HasSubstr(seen ? "contact keeps the overlap"
                                                                          : "pass through each other"))))
            << shift;
        EXPECT_LT(fastest(two), 1e-6) << shift;
    }
    const std::string ground = still + R"(, "ground": {"height": -0.3})";
    const std::string cube = R"("cells": 16, "phyxel_count": 100)";
    const std::string soft = scene(body("a", "[1, 1, 1]", cube), ground);
    EXPECT_THAT(notes(soft), ElementsAre(HasSubstr("inside 'ground', which pushes it out slowly")));
    EXPECT_LT(fastest(soft), 1e-6);
    const std::string springs =
        scene(body("a", "[1, 1, 1]", cube + R"(, "deformation": {"mass_spring": {}})"), ground);
    EXPECT_THAT(notes(springs), ElementsAre(HasSubstr("inside 'ground', which pushes it out at once")));
    EXPECT_GT(fastest(springs), 1);
}

}  // namespace
}  // namespace splitcubes::scene
