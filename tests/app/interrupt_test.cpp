// SIGINT and SIGTERM: every command ends soon, with exit code 1 and complete files.
#include "program.h"

#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/io/write_mesh.h>

#include <chrono>
#include <csignal>

#include <sys/resource.h>

#include "sanitized.h"

namespace splitcubes::app_test {
namespace {

using Clock = std::chrono::steady_clock;
using Words = std::vector<std::string>;

class Interrupt : public Program {
  protected:
    void write(const char* name, const geometry::TriangleMesh& mesh) const {
        geometry::SurfaceMesh surface;
        surface.mesh = mesh;
        io::write_mesh(in(name), surface);
    }

    // Work for many seconds: a mesh with a hole, on a fine grid.
    void write_open_ball() const {
        geometry::TriangleMesh ball = geometry::make_sphere(0.5, 5);
        ball.triangles.pop_back();
        write("ball.ply", ball);
    }

    // Many parts, which take long to set up.
    void write_scene(int parts, int cells) const {
        std::string list;
        for (int k = 0; k < parts; ++k)
            list += std::string(k > 0 ? ", " : "") + R"({"ball": {"center": [)" + std::to_string(0.001 * k) +
                    R"(, 0, 0], "radii": [0.1, 0.1, 0.1], "colour": [1, 0, 0]}})";
        const std::string shape = R"({"implicit": {"cells": )" + std::to_string(cells) +
                                  R"(, "smoothness": 0.01, "parts": [)" + list + "]}}";
        write_text(in("scene.json"), R"({"name": "parts", "frames": 10, "bodies": [{"name": "b", "shape": )" +
                                         shape +
                                         R"(, "cells": 24, "phyxel_count": 200, "material": {"density": 1000,
                                            "youngs_modulus": 1e4, "poisson_ratio": 0.3}}]})");
    }

    // Whether the process waits for the signal or has a handler for it.
    static bool expects(pid_t process, int signal_number) {
        for (const std::string& line : lines_of(text_of("/proc/" + std::to_string(process) + "/status")))
            if (line.rfind("SigCgt:", 0) == 0 || line.rfind("SigBlk:", 0) == 0)
                if ((std::stoull(line.substr(7), nullptr, 16) >> (signal_number - 1) & 1U) != 0) return true;
        return false;
    }

    // Sends a signal after the delay, but not before the program expects it: a loaded machine may take long
    // to start it. Returns the time, s, until the program ends.
    double end_after(const Words& arguments, std::chrono::milliseconds delay, int signal_number,
                     Ended& ended) const {
        constexpr std::chrono::seconds longest_start{20};
        const Clock::time_point start = Clock::now();
        Clock::time_point sent{};
        ended = run(arguments, [&](pid_t child) {
            const Clock::duration passed = Clock::now() - start;
            if (passed < delay) return true;
            if (!expects(child, signal_number) && passed < longest_start) return true;
            kill(child, signal_number);
            sent = Clock::now();
            return false;
        });
        return sent == Clock::time_point{} ? 0 : std::chrono::duration<double>(Clock::now() - sent).count();
    }

    // Sends signals at several times during the command; the bound allows for a loaded machine.
    void expect_ends_soon(const Words& arguments) const {
        constexpr double bound = 6;  // s; about one on an idle machine
        int signal_number = SIGINT;
        for (const int delay : {5, 40, 150, 500, 1300}) {
            SCOPED_TRACE(arguments[0] + " after " + std::to_string(delay) + " ms");
            Ended ended;
            EXPECT_LT(end_after(arguments, std::chrono::milliseconds(delay), signal_number, ended), bound);
            EXPECT_GE(ended.code, 0) << "a signal ended the program";
            EXPECT_LE(ended.code, 1) << ended.err;
            if (ended.code == 1) {
                const Words said = lines_of(ended.err);
                ASSERT_FALSE(said.empty());
                EXPECT_NE(said.back().find("interrupted"), std::string::npos) << ended.err;
            }
            EXPECT_EQ(unfinished_files(), 0U);
            for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
                EXPECT_EQ(entry.path().string().find("partial"), std::string::npos);
                if (entry.path().extension() != ".ply") continue;
                EXPECT_NO_THROW(io::read_mesh(entry.path()));
            }
            signal_number = SIGINT + SIGTERM - signal_number;
        }
    }
};

TEST_F(Interrupt, EndsSurface) {
    write_open_ball();
    expect_ends_soon({"surface", "ball.ply", "-o", "out.ply", "--cells", "400"});
}

TEST_F(Interrupt, EndsCut) {
    write_open_ball();
    write("sheet.ply", geometry::make_box({2, 2, 0.1}));
    expect_ends_soon(
        {"cut", "ball.ply", "--with", "sheet.ply", "-o", "out.ply", "--pieces", "parts", "--cells", "400"});
}

TEST_F(Interrupt, EndsTheSetUpOfRun) {
    write_scene(1000, 300);
    expect_ends_soon({"run", "scene.json", "-o", "out"});
}

TEST_F(Interrupt, EndsValidate) {
    write("ball.ply", geometry::make_sphere(0.5, 5));
    Words arguments{"validate"};
    arguments.insert(arguments.end(), 300, "ball.ply");
    expect_ends_soon(arguments);
}

TEST_F(Interrupt, EndsBench) {
    expect_ends_soon({"bench", "validation"});
}

TEST_F(Interrupt, EndsShortWork) {
    expect_ends_soon({"info"});
    expect_ends_soon({"figure", "faces", "-o", "faces.svg"});
}

TEST_F(Interrupt, ProgressIsShownFromTheFirstSecond) {
    write_scene(1000, 300);
    Ended ended;
    end_after({"run", "scene.json", "-o", "out"}, std::chrono::milliseconds(2500), SIGINT, ended);
    EXPECT_EQ(ended.code, 1);
    const Words said = lines_of(ended.err);
    ASSERT_GE(said.size(), 2U) << ended.err;
    EXPECT_EQ(said.front().rfind("set-up of parts: body 'b': shape, ", 0), 0U) << ended.err;
}

// Limits the program's memory, in bytes.
class WithMemory {
  public:
    explicit WithMemory(rlim_t bytes) {
        getrlimit(RLIMIT_DATA, &before_);
        rlimit limit = before_;
        limit.rlim_cur = bytes;
        setrlimit(RLIMIT_DATA, &limit);
    }
    ~WithMemory() { setrlimit(RLIMIT_DATA, &before_); }
    WithMemory(const WithMemory&) = delete;
    WithMemory& operator=(const WithMemory&) = delete;

  private:
    rlimit before_{};
};

TEST_F(Interrupt, TooLargeProblemsAreRefusedBeforeTheWork) {
    if (is_sanitized) GTEST_SKIP() << "the sanitizer's tables pass any limit";
    write_open_ball();
    write_scene(2, 32);
    const WithMemory little(rlim_t{1} << 29);
    expect_refused({"surface", "ball.ply", "-o", "out.ply", "--cells", "1000"},
                   "ball.ply: needs about 11 GB of memory");
    expect_refused({"run", "scene.json", "-o", "out", "--set", "bodies[0].phyxel_count=400000"},
                   "body 'b': phyxels: needs about 5.6 GB of memory");
    EXPECT_EQ(run({"surface", "ball.ply", "-o", "out.ply", "--cells", "20"}).code, 0);
}

TEST_F(Interrupt, ShortWorkShowsNoProgress) {
    write("box.ply", geometry::make_box({1, 1, 1}));
    EXPECT_EQ(run({"surface", "box.ply", "-o", "out.ply", "--cells", "8"}).err, "");
}

}  // namespace
}  // namespace splitcubes::app_test
