// `view` without a window: recorded input ends in the same state and picture each time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <app/program.h>

#ifdef SPLITCUBES_WITH_RENDER
#include <splitcubes/gl/context.h>
#include <splitcubes/render/image.h>
#endif

namespace splitcubes::app_test {
namespace {

using testing::HasSubstr;

class ViewCommand : public Program {
  protected:
    ViewCommand() {
        write_text(folder_ / "block.json",
                   R"({"frames": 10, "ground": {"height": 0}, "contact": {"pieces": true},
  "bodies": [{"name": "block", "shape": {"box": {"size": [0.2, 0.2, 0.1]}},
              "placement": {"position": [0, 0, 0.05]}, "cells": 16, "phyxel_count": 150,
              "material": {"youngs_modulus": 30000, "mass_damping": 2, "stiffness_damping": 0.005}}],
  "camera": {"eye": [0.35, -0.35, 0.4], "target": [0, 0, 0.05]}})");
    }
    static std::string event(int frame, const std::string& rest) {
        return "{\"frame\":" + std::to_string(frame) + "," + rest + "}\n";
    }
    static std::string key(int frame, const std::string& name) {
        return event(frame, R"("kind":"key","name":")" + name + "\"");
    }
    static std::string set(int frame, const std::string& name, double value) {
        return event(frame, R"("kind":"set","name":")" + name + "\",\"value\":" + std::to_string(value));
    }
    // From one pixel to another in 20 frames; the button stays down unless it is released.
    static std::string drag(int frame, double x0, double y0, double x1, double y1, bool releases = true) {
        const auto at = [](const char* kind, double x, double y) {
            return std::string("\"kind\":\"") + kind + "\",\"x\":" + std::to_string(x) +
                   ",\"y\":" + std::to_string(y);
        };
        std::string out = event(frame, at("press", x0, y0));
        for (int k = 1; k <= 20; ++k)
            out += event(frame + k, at("move", x0 + (x1 - x0) * k / 20, y0 + (y1 - y0) * k / 20));
        if (releases) out += event(frame + 21, at("release", x1, y1));
        return out;
    }
    Ended replay(const std::string& input, std::vector<std::string> more = {}) const {
        write_text(folder_ / "input.jsonl", input);
        std::vector<std::string> words = {"view",    "block.json", "--replay-input", "input.jsonl",
                                          "--width", "640",        "--height",       "480"};
        words.insert(words.end(), more.begin(), more.end());
        return run(words);
    }
    // Number of pixels with the colour of cut faces, of the last frame; -1: there is no OpenGL here.
    int cut_pixels(const std::string& input, const std::string& state) const {
        const Ended ended = replay(input, {"--screenshot", "last.png", "--threads", "1"});
#ifdef SPLITCUBES_WITH_RENDER
        if (ended.code == 1 && ended.err.find("no OpenGL") != std::string::npos) return -1;
        EXPECT_EQ(ended.code, 0) << ended.err;
        EXPECT_EQ(ended.out, state) << "a picture changes nothing";
        const render::Picture picture = render::read_png(folder_ / "last.png");
        EXPECT_EQ(picture.width, 640);
        int out = 0;
        for (std::size_t k = 0; k < picture.rgb.size(); k += 3)
            out += picture.rgb[k] > 60 && picture.rgb[k] > 2 * picture.rgb[k + 1] &&
                   picture.rgb[k] > 2 * picture.rgb[k + 2];
        return out;
#else
        EXPECT_EQ(ended.code, 1);
        EXPECT_NE(state, "");
        return -1;
#endif
    }
    // Of the colours of two pixels of the last frame.
    int difference([[maybe_unused]] int x0, [[maybe_unused]] int y0, [[maybe_unused]] int x1,
                   [[maybe_unused]] int y1) const {
        int out = 0;
#ifdef SPLITCUBES_WITH_RENDER
        if (!fs::exists(folder_ / "last.png")) return 0;
        const render::Picture picture = render::read_png(folder_ / "last.png");
        for (int k = 0; k < 3; ++k) out += std::abs(picture.pixel(x0, y0)[k] - picture.pixel(x1, y1)[k]);
#endif
        return out;
    }
    // Replays twice, with different numbers of threads, then with a picture.
    struct Seen {
        std::string state;
        int cut = -1;
        int pieces() const { return std::stoi(state.substr(state.find(" s, ") + 4)); }
    };
    Seen seen(const std::string& input) const {
        const Ended one = replay(input, {"--threads", "1"}), two = replay(input, {"--threads", "2"});
        EXPECT_EQ(one.code, 0) << one.err;
        EXPECT_EQ(one.out, two.out);
        Seen out{one.out};
        out.cut = cut_pixels(input, one.out);
        return out;
    }
    const std::string begin = set(0, "panels", 0) + key(0, "space");
};

TEST_F(ViewCommand, KnifeSeparatesAndShowsThePieces) {
    const std::string by_piece = begin + set(1, "colouring", 1);
    const Seen before = seen(by_piece + set(60, "help", 0));
    const int uncut = difference(270, 190, 390, 190);
    const Seen after = seen(by_piece + drag(5, 330, 60, 330, 420) + set(60, "help", 0));
    EXPECT_EQ(before.pieces(), 1);
    EXPECT_EQ(after.pieces(), 2);
    if (after.cut < 0) GTEST_SKIP() << "no OpenGL here";
    EXPECT_LT(uncut, 40);
    EXPECT_GT(difference(270, 190, 390, 190), 100);
}

TEST_F(ViewCommand, ScalpelOpensTheTop) {
    const Seen after = seen(begin + key(1, "2") + set(1, "scalpel_depth", 0.04) +
                            drag(5, 250, 180, 400, 200) + key(27, "4") + drag(30, 330, 170, 330, 90, false));
    EXPECT_EQ(after.pieces(), 1);
    if (after.cut < 0) GTEST_SKIP() << "no OpenGL here";
    EXPECT_GT(after.cut, 30);
}

TEST_F(ViewCommand, EveryToolEndsInAStateOfItsOwn) {
    std::vector<std::string> states = {seen(begin + set(60, "help", 0)).state};
    for (const char* tool : {"1", "2", "3", "4", "5", "6", "7", "8"}) {
        const Seen one = seen(begin + key(1, tool) + set(1, "knife_through", 0) +
                              drag(5, 300, 190, 380, 260) + set(60, "help", 0));
        EXPECT_EQ(std::count(states.begin(), states.end(), one.state), 0) << "tool " << tool;
        states.push_back(one.state);
    }
}

TEST_F(ViewCommand, ControlsEndInTheStateTheyShould) {
    const std::string cut = drag(5, 330, 60, 330, 420);
    const std::string undone = begin + cut + key(30, "space") +
                               event(31, R"("kind":"key","name":"z","modifiers":2)") + set(32, "help", 0);
    const std::string redone = begin + cut + key(30, "space") +
                               event(31, R"("kind":"key","name":"z","modifiers":2)") +
                               event(32, R"("kind":"key","name":"y","modifiers":2)");
    EXPECT_EQ(seen(undone).pieces(), 1);
    const std::string stopped = begin + cut + key(30, "space") + set(32, "help", 0);
    EXPECT_EQ(seen(redone).state, seen(stopped).state);
    EXPECT_THAT(seen(begin + key(10, "r") + key(10, "space")).state, HasSubstr("step 0, "));
    EXPECT_THAT(seen(set(0, "panels", 0) + key(1, ".") + key(2, ".") + set(9, "help", 0)).state,
                HasSubstr("step 2, "));
}

TEST_F(ViewCommand, DisplayChangesThePictureAndNotTheState) {
#ifdef SPLITCUBES_WITH_RENDER
    const auto picture = [&](const std::string& more) {
        const Ended ended = replay(begin + more + set(15, "help", 0), {"--screenshot", "shown.png"});
        return std::pair{ended.out, text_of(folder_ / "shown.png")};
    };
    const auto plain = picture("");
    if (plain.second.empty()) GTEST_SKIP() << "no OpenGL here";
    std::vector<std::string> pictures = {plain.second};
    for (const std::string& more :
         {set(1, "colouring", 1), set(1, "colouring", 2), set(1, "colouring", 3), set(1, "colouring", 4),
          set(1, "wireframe", 1), set(1, "phyxels", 1), set(1, "links", 1), set(1, "contacts", 1),
          set(1, "colouring", 5), set(1, "clip", 1), set(1, "shadows", 0), set(1, "panels", 1), key(1, "f1"),
          event(1, R"("kind":"wheel","value":3)"),
          event(1, R"("kind":"press","x":9,"y":9,"button":"right")") +
              event(2, R"("kind":"move","x":90,"y":40)")}) {
        const auto shown = picture(more);
        EXPECT_EQ(shown.first, plain.first) << more;
        // Panels are drawn where the window is built, too.
        const bool is_panel = more == set(1, "panels", 1) || more == key(1, "f1");
        if (!is_panel) EXPECT_EQ(std::count(pictures.begin(), pictures.end(), shown.second), 0) << more;
        pictures.push_back(shown.second);
    }
#endif
}

TEST_F(ViewCommand, PicturesCanBeTakenOnTheWay) {
    const Ended ended = replay(begin + event(5, R"("kind":"act","name":"save_picture","text":"five.png")") +
                               event(9, R"("kind":"act","name":"quit")") + set(20, "help", 0));
    if (ended.code == 1) GTEST_SKIP() << ended.err;
    EXPECT_TRUE(fs::exists(folder_ / "five.png"));
    EXPECT_THAT(ended.out, HasSubstr("step 10, "));
}

TEST_F(ViewCommand, StrokesAreAcceptedByCutAndRun) {
    const auto act = [](int frame, const std::string& name, const std::string& file) {
        return event(frame, R"("kind":"act","name":")" + name + R"(","text":")" + file + "\"");
    };
    ASSERT_EQ(run({"surface", "block.json", "-o", "block.ply"}).code, 2) << "of a scene there is none";
    write_text(
        folder_ / "box.obj",
        "v 0 0 0\nv 200 0 0\nv 200 200 0\nv 0 200 0\nv 0 0 100\nv 200 0 100\nv 200 200 100\nv 0 200 100\n"
        "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
    write_text(folder_ / "input.jsonl",
               begin + drag(5, 330, 20, 330, 460) + act(40, "save_path", "path.json") +
                   act(40, "save_scene", "cut.json") + act(40, "save_curve", "rate.csv") +
                   act(40, "save_recording", "all.jsonl"));
    const Ended ended =
        run({"view", "box.obj", "--replay-input", "input.jsonl", "--width", "640", "--height", "480"});
    EXPECT_THAT(ended.out, HasSubstr(" 2 pieces"));
    const Ended cut = run({"cut", "box.obj", "--path", "path.json", "-o", "cut.ply", "--cells", "24"});
    EXPECT_EQ(cut.code, 0) << cut.err;
    EXPECT_THAT(cut.out, HasSubstr("2 pieces"));
    const Ended ran = run({"run", "cut.json", "-o", "ran", "--set", "bodies[0].phyxel_count=100"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(lines_of(text_of(folder_ / "rate.csv")).size(), 41U);
    // The run is played back.
    write_text(folder_ / "input.jsonl", key(0, "space") + set(50, "help", 0));
    const Ended again = run({"view", "ran", "--replay-input", "input.jsonl"});
    EXPECT_THAT(again.out, HasSubstr(" 2 pieces"));
}

TEST_F(ViewCommand, FilmsTheSession) {
    if (std::system("ffmpeg -version >/dev/null 2>&1") != 0) GTEST_SKIP() << "there is no ffmpeg";
    write_text(folder_ / "input.jsonl",
               begin + event(1, R"("kind":"act","name":"record_film","text":"from-now.mp4")") +
                   event(6, R"("kind":"act","name":"record_film")") +
                   event(7, R"("kind":"act","name":"save_film","text":"so-far.mp4")"));
    const Ended ended = run({"view", "block.json", "--replay-input", "input.jsonl", "--film", "panels.mp4",
                             "--width", "161", "--height", "121"});
    if (ended.code == 1) GTEST_SKIP() << ended.err;
    EXPECT_THAT(ended.out, HasSubstr("from-now.mp4, 3 pictures"));
    EXPECT_THAT(ended.out, HasSubstr("so-far.mp4, 5 pictures"));
    for (const char* file : {"from-now.mp4", "so-far.mp4", "panels.mp4"})
        EXPECT_TRUE(fs::exists(folder_ / file)) << file;
}

TEST_F(ViewCommand, WithoutAFileThereIsTheGallery) {
    write_text(folder_ / "input.jsonl",
               key(0, "f1") + event(3, R"("kind":"act","name":"open","text":"block.json")"));
    const Ended ended =
        run({"view", "--replay-input", "input.jsonl", "--screenshot", "gallery.png", "--frames", "2"});
    if (ended.code == 1) GTEST_SKIP() << ended.err;
    EXPECT_THAT(ended.out, HasSubstr("0 pieces"));
    EXPECT_TRUE(fs::exists(folder_ / "gallery.png"));
    EXPECT_THAT(run({"view", "--replay-input", "input.jsonl"}).out, HasSubstr("1 pieces"));
}

TEST_F(ViewCommand, WrongInputIsOneLine) {
    const auto expect = [&](const Ended& ended, const char* text) {
        EXPECT_EQ(ended.code, 2) << ended.err;
        EXPECT_EQ(lines_of(ended.err).size(), 1U) << ended.err;
        EXPECT_THAT(ended.err, HasSubstr(text));
    };
    expect(replay("what\n"), "input.jsonl:1: is no JSON object");
    expect(replay(set(0, "stickiness", 1)), "there is no parameter 'stickiness'");
    expect(run({"view", "nothing.obj", "--replay-input", "input.jsonl"}), "nothing.obj");
    expect(run({"view", "--replay-input", "input.jsonl"}), "there is no parameter 'stickiness'");
    expect(run({"view", "block.json", "--replay-input", "none.jsonl"}), "none.jsonl: cannot be read");
    write_text(folder_ / "input.jsonl", key(0, "space"));
    expect(run({"view", "input.jsonl", "--replay-input", "input.jsonl"}), "is no recording of a session");
}

TEST_F(ViewCommand, WithoutADisplaySaysWhatIsMissing) {
    const char* display = std::getenv("DISPLAY");
    const std::string before = display != nullptr ? display : "";
    unsetenv("DISPLAY");
    const Ended ended = run({"view", "block.json"});
    if (display != nullptr) setenv("DISPLAY", before.c_str(), 1);
    EXPECT_EQ(ended.code, 1);
    EXPECT_EQ(lines_of(ended.err).size(), 1U) << ended.err;
    EXPECT_TRUE(ended.err.find("DISPLAY is not set") != std::string::npos ||
                ended.err.find("libglfw3-dev") != std::string::npos)
        << ended.err;
}

}  // namespace
}  // namespace splitcubes::app_test
