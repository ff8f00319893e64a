// The command line: help, versions, values, lists, messages. No line crashes the program or prints the
// message of a library.
#include "app/program.h"
#include "sanitized.h"

#include <splitcubes/core/random.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/io/write_mesh.h>

#include <algorithm>
#include <regex>

namespace splitcubes::app_test {
namespace {

using Words = std::vector<std::string>;

const Words all_commands = {"surface", "cut",    "run",  "replay",     "render", "validate",
                            "bench",   "figure", "info", "completion", "man",    "help"};

class CommandLine : public Program {
  protected:
    CommandLine() {
        io::write_mesh(in("ball.obj"), geometry::SurfaceMesh{geometry::make_sphere(0.5, 2), {}, {}, {}});
        io::write_mesh(in("sheet.obj"),
                       geometry::SurfaceMesh{
                           geometry::make_plane_sheet({0.01, 0, 0}, Vec3(1, 0.2, 0.1), 2), {}, {}, {}});
    }

    // Expects one line that contains all of the texts.
    void expect_line(const Words& arguments, const Words& texts) const {
        const Ended ended = run(arguments);
        EXPECT_EQ(ended.code, 2);
        EXPECT_EQ(lines_of(ended.err).size(), 1U) << ended.err;
        for (const std::string& text : texts)
            EXPECT_NE(ended.err.find(text), std::string::npos) << text << " is not in: " << ended.err;
    }
};

// In every help text each option has its own explanation and each line fits the window.
TEST_F(CommandLine, HelpOfEveryCommandInThreeWays) {
    const std::string overview = run({"--help"}).out;
    EXPECT_EQ(run({"-h"}).out, overview);
    EXPECT_EQ(run({"help"}).out, overview);
    for (const std::string& command : all_commands) {
        EXPECT_NE(overview.find("\n  " + command + " "), std::string::npos) << command;
        const Ended ended = run({command, "--help"});
        EXPECT_EQ(ended.code, 0);
        EXPECT_EQ(ended.err, "");
        EXPECT_EQ(ended.out.rfind("Usage: splitcubes " + command, 0), 0U) << ended.out;
        EXPECT_EQ(run({command, "-h"}).out, ended.out);
        EXPECT_EQ(run({"help", command}).out, ended.out);
        for (const std::string& line : lines_of(ended.out)) {
            EXPECT_LE(line.size(), 110U) << line;
            // Below 10^15 numbers have no exponent.
            EXPECT_FALSE(std::regex_search(line, std::regex("[0-9]e([+]|[0-9]([^0-9]|$)|1[0-4]([^0-9]|$))")))
                << line;
        }
        EXPECT_TRUE(command == "info" || ended.out.find("Examples:\n") != std::string::npos) << command;
        // Also if something else is wrong with the line.
        EXPECT_EQ(run({command, "--nonsense", "x", "--help"}).out, ended.out);
        const Ended version = run({command, "--version"});
        EXPECT_EQ(version.code, 0);
        EXPECT_EQ(version.out, run({"--version"}).out);
    }
    expect_line({"help", "surfcae"}, {"surfcae: is not a command", "surface"});
}

TEST_F(CommandLine, MessagesNameTheNearestAndWhereHelpIs) {
    expect_line({"surfcae", "ball.obj"},
                {"surfcae: is not a command", "did you mean surface?", "splitcubes --help"});
    expect_line({"--thread", "2"}, {"--thread: is not an option of splitcubes itself"});
    expect_line({"surface", "ball.obj", "-o", "x.ply", "--cels", "8"},
                {"--cels: is not an option", "did you mean --cells?", "splitcubes surface --help"});
    expect_line({"surface", "ball.obj", "-o", "x.ply", "-q"},
                {"-q: is not an option", "splitcubes surface --help"});
    expect_line({"run", "x.json", "-o", "x", "--occlusion", "cup"},
                {"--occlusion: 'cup' is not known", "did you mean cpu?", "splitcubes run --help"});
    expect_line({"surface", "ball.obj", "more.obj", "-o", "x.ply"},
                {"more.obj: is one argument too many", "splitcubes surface MESH -o FILE"});
    expect_line({"surface", "-o", "x.ply"}, {"MESH: is missing", "splitcubes surface --help"});
    expect_line({"surface", "ball.obj"}, {"--output: is missing", "-o FILE"});
    expect_line({"surface", "ball.obj", "-o"}, {"-o: needs a value", "-o FILE"});
    expect_line({"surface", "ball.obj", "-o", "--cells", "8"},
                {"-o: needs a value", "'--cells' is an option"});
    expect_line({"surface", "ball.obj", "-o", "a.ply", "-o", "b.ply"}, {"--output: is given 2 times"});
    expect_line({"run", "x.json", "-o", "x", "--links=yes"}, {"--links: takes no value"});
    EXPECT_FALSE(fs::exists(in("x.ply")));
}

TEST_F(CommandLine, NumbersAreShownPlainly) {
    const Words surface{"surface", "ball.obj", "-o", "x.ply"};
    const auto with = [&](const std::string& option, const std::string& value) {
        Words out = surface;
        out.insert(out.end(), {option, value});
        return out;
    };
    expect_line(with("--cells", "many"),
                {"--cells: 'many' is not a whole number; give one from 2 to 1024; see"});
    expect_line(with("--cells", "8.5"), {"--cells: '8.5' is not a whole number"});
    expect_line(with("--cells", ""), {"--cells: '' is not a whole number"});
    expect_line(with("--cells", "99999999999999999999999"), {"99999999999999999999999 is out of range"});
    expect_line(
        with("--cells", "2000"),
        {"--cells: 2000 is out of range; give a whole number from 2 to 1024; see splitcubes surface"});
    expect_line(with("--cell-size", "nan"), {"--cell-size: 'nan' is not a number"});
    expect_line(with("--cell-size", "-inf"), {"--cell-size: '-inf' is not a number"});
    expect_line(with("--cell-size", "1e999"),
                {"--cell-size: 1e999 is out of range", "from 1e-12 to 1000000000000"});
    expect_line(with("--cell-size", "1,5"), {"--cell-size: '1,5' is not a number"});
    expect_line({"run", "x.json", "-o", "x", "--frames", "100000000000"}, {"from 1 to 1000000;"});
    for (const char* fps : {"0", "-1", "1001"})
        expect_line({"render", "x", "-o", "x.mp4", "--fps", fps},
                    {std::string("--fps: ") + fps +
                     " is out of range; give a number above 0 to 1000; see splitcubes render --help"});
    expect_line({"render", "x", "-o", "x.mp4", "--fps", "nan"}, {"--fps: 'nan' is not a number"});
    expect_line({"render", "x", "-o", "x.mp4", "--width", "0"}, {"--width: 0 is out of range"});
    expect_line({"render", "x", "-o", "x.mp4", "--height", "100000"}, {"--height: 100000 is out of range"});
    expect_line({"render", "x", "-o", "x.mp4", "--every", "0"}, {"--every: 0 is out of range"});
    expect_line({"bench", "paper", "--runs", "0"}, {"--runs: 0 is out of range"});
    EXPECT_FALSE(fs::exists(in("x.ply")));
}

TEST_F(CommandLine, EveryWayToWriteAnOptionIsTheSame) {
    ASSERT_EQ(run({"surface", "ball.obj", "-o", "a.ply", "--cells", "12"}).code, 0);
    for (const Words& words : {Words{"surface", "-o", "b.ply", "--cells=12", "ball.obj"},
                               {"surface", "-ob.ply", "--cells", "+12", "ball.obj"},
                               {"surface", "--output=b.ply", "--cells", "12", "--", "ball.obj"},
                               {"surface", "--cells", "12", "ball.obj", "--output", "b.ply"}}) {
        const Ended ended = run(words);
        ASSERT_EQ(ended.code, 0) << ended.err;
        EXPECT_EQ(text_of(in("b.ply")), text_of(in("a.ply")));
        fs::remove(in("b.ply"));
    }
    // Names that look like options.
    fs::copy(in("ball.obj"), in("-x.obj"));
    EXPECT_EQ(run({"validate", "--", "-x.obj"}).code, 0);
    EXPECT_EQ(run({"surface", "ball.obj", "--output=--cells.ply", "--cells", "8"}).code, 0);
    EXPECT_TRUE(fs::exists(in("--cells.ply")));
}

TEST_F(CommandLine, CuttersDoNotSwallowTheMesh) {
    fs::copy(in("sheet.obj"), in("other.obj"));
    ASSERT_EQ(run({"cut", "ball.obj", "--with", "sheet.obj", "-o", "a.ply", "--cells", "12"}).code, 0);
    for (const Words& words : {Words{"--with", "sheet.obj", "ball.obj"},
                               {"--with", "sheet.obj", "--", "ball.obj"},
                               {"ball.obj", "--with", "sheet.obj"},
                               {"--with", "sheet.obj", "--threads", "1", "ball.obj"},
                               {"--with=sheet.obj", "ball.obj"}}) {
        for (const bool output_first : {true, false}) {
            if (!output_first && std::find(words.begin(), words.end(), "--") != words.end()) continue;
            Words line{"cut", "--cells", "12"};
            if (output_first) line.insert(line.end(), {"-o", "b.ply"});
            line.insert(line.end(), words.begin(), words.end());
            if (!output_first) line.insert(line.end(), {"-o", "b.ply"});
            const Ended ended = run(line);
            ASSERT_EQ(ended.code, 0) << ended.err;
            EXPECT_EQ(text_of(in("b.ply")), text_of(in("a.ply")));
        }
    }
    // Two sheets and a mesh.
    EXPECT_EQ(
        run({"cut", "--with", "sheet.obj", "other.obj", "ball.obj", "-o", "b.ply", "--cells", "12"}).code, 0);
    EXPECT_EQ(text_of(in("b.ply")), text_of(in("a.ply"))) << "the second sheet is the first";
    expect_line({"cut", "--with", "sheet.obj", "-o", "b.ply"}, {"MESH: is missing"});
    expect_line({"cut", "--with", "sheet.obj", "--with", "other.obj", "-o", "b.ply"}, {"MESH: is missing"});
}

const std::string scene = R"({"time_step": 0.01, "duration": 1,
  "bodies": [{"name": "a", "shape": {"box": {"size": [1, 1, 1]}}, "cells": 6, "phyxel_count": 30}]})";

TEST_F(CommandLine, FramesAndSetOverrideTheScene) {
    write_text(in("scene.json"), scene);
    const auto frames = [&](const Words& more) {
        Words words{"run", "-o", "out"};
        words.insert(words.end(), more.begin(), more.end());
        const Ended ended = run(words);
        EXPECT_EQ(ended.code, 0) << ended.err;
        const std::size_t at = ended.out.find("out: ");
        return at == std::string::npos ? "" : ended.out.substr(at + 5, ended.out.find(" frames") - at - 5);
    };
    EXPECT_EQ(frames({"scene.json", "--frames", "2"}), "2");
    EXPECT_EQ(frames({"scene.json", "--set", "duration=0.03"}), "3");
    EXPECT_EQ(frames({"scene.json", "--set", "frames=1", "bodies[0].cell_size=0.25"}), "1");
    EXPECT_EQ(frames({"--set", "frames=1", "gravity=[0,0,0]", "scene.json"}), "1") << "no '=', no override";
    EXPECT_EQ(frames({"--set", "frames=5", "--frames", "1", "scene.json"}), "1") << "the option holds";
    expect_line({"run", "--set", "a", "scene.json", "-o", "out"}, {"--set a: has no '='"});
}

TEST_F(CommandLine, BadTargetsAreFoundBeforeAnythingIsRead) {
    write_text(in("file"), "mine");
    fs::create_directory(in("folder.ply"));
    fs::create_directory(in("closed"));
    fs::permissions(in("closed"), fs::perms::owner_read | fs::perms::owner_exec);
    const std::string long_name = std::string(300, 'x');
    const auto expect_both = [&](const std::string& target, const Words& texts) {
        // The mesh does not exist; the target is reported first.
        expect_line({"surface", "missing.obj", "-o", target}, texts);
        expect_line({"cut", "missing.obj", "--plane", "x=0", "-o", target}, texts);
        expect_line({"surface", "missing.obj", "-o", "x.ply", "--lost", target}, texts);
    };
    expect_both("no/x.ply", {"no/x.ply", "there is no folder no"});
    expect_both("x.xyz", {"x.xyz", "'.xyz'", ".ply"});
    expect_both("x", {"x: has no ending"});
    expect_both("folder.ply", {"folder.ply: is a folder"});
    expect_both("file/x.ply", {"file/x.ply"});
    expect_both(long_name + ".ply", {"too long"});
    expect_both("/dev/null.ply/x.ply", {"there is no folder"});
    expect_both("/proc/x.ply", {"/proc/x.ply"});
    if (geteuid() != 0) {
        expect_both("closed/x.ply", {"closed"});
    }
    expect_line({"surface", "missing.obj", "-o", "x.ply", "--report", "no/r.json"}, {"no/r.json"});
    expect_line({"surface", "missing.obj", "-o", "x.ply", "--picture", "p.jpg"}, {"p.jpg", ".png"});
    expect_line({"surface", "missing.obj", "-o", ""}, {"--output: its value is empty"});
    expect_line({"cut", "missing.obj", "--plane", "x=0", "-o", "x.ply", "--pieces", "file"},
                {"file: is a file"});
    expect_line({"cut", "missing.obj", "--plane", "x=0", "-o", "x.ply", "--pieces", "file/sub"},
                {"file/sub"});
    expect_line({"cut", "missing.obj", "--plane", "x=0", "-o", "x.ply", "--pieces", long_name}, {"too long"});
    expect_line({"run", "missing.json", "-o", "file"}, {"file: "});
    expect_line({"run", "missing.json", "-o", "/proc/run"}, {"/proc"});
    expect_line({"run", "missing.json", "-o", "out", "--record", "no/m.json"}, {"no/m.json"});
    expect_line({"render", "missing", "-o", "no/x.mp4"}, {"no/x.mp4"});
    expect_line({"render", "missing", "-o", "x.avi"}, {"x.avi", ".mp4"});
    expect_line({"render", "missing", "-o", "a.mp4", "b.mp4"}, {"b.mp4", "a.mp4"});
    expect_line({"bench", "paper", "--json", "no/b.json"}, {"no/b.json"});
    expect_line({"bench", "validation", "--plot", "x.png"}, {"x.png", ".svg"});
    expect_line({"bench", "validation", "--document", "x.txt"}, {"x.txt", ".md"});
    expect_line({"bench", "paper", "--document", "x.md"}, {"--document", "validation"});
    expect_line({"bench", "validation", "--document", "missing.md"}, {"missing.md: cannot be read"});
    expect_line({"bench", "validation", "--tetrahedra", "missing.json"}, {"missing.json: cannot be read"});
    expect_line({"bench", "validation", "--tetrahedra", "file"}, {"file: does not hold results"});
    expect_line({"figure", "faces", "-o", "no/f.svg"}, {"no/f.svg"});
    EXPECT_EQ(text_of(in("file")), "mine");
    EXPECT_EQ(unfinished_files(), 0U);
    // A valid output name passes, and the mesh is reported.
    expect_line({"surface", "missing.obj", "-o", "x.ply", "--report", "r.json"}, {"missing.obj"});
    expect_line({"surface", "missing.obj", "-o", "x.PLY"}, {"missing.obj"});
}

TEST_F(CommandLine, ValidateGivesReasonsForAllFiles) {
    write_text(in("bad.obj"), "v 0 0 x\n");
    geometry::TriangleMesh open = geometry::make_sphere(0.5, 1);
    open.triangles.pop_back();
    io::write_mesh(in("open.obj"), geometry::SurfaceMesh{open, {}, {}, {}});
    geometry::TriangleMesh turned = geometry::make_sphere(0.5, 1);
    std::swap(turned.triangles[0][0], turned.triangles[0][1]);
    io::write_mesh(in("turned.obj"), geometry::SurfaceMesh{turned, {}, {}, {}});
    geometry::TriangleMesh many;
    for (int k = 0; k < 23; ++k) {
        geometry::TriangleMesh ball = geometry::make_sphere(0.1, 0);
        for (Vec3& p : ball.positions) p[0] += k;
        many.append(ball);
    }
    io::write_mesh(in("many.obj"), geometry::SurfaceMesh{many, {}, {}, {}});

    const Ended all = run({"validate", "bad.obj", "open.obj", "missing.obj", "ball.obj"});
    EXPECT_EQ(all.code, 2);
    EXPECT_EQ(lines_of(all.err).size(), 2U) << all.err;
    EXPECT_NE(all.out.find("open.obj: NOT valid"), std::string::npos);
    EXPECT_NE(all.out.find("ball.obj: valid"), std::string::npos);
    EXPECT_NE(all.out.find("4 files: 1 valid, 1 not valid, 2 not read"), std::string::npos) << all.out;

    const Ended holes = run({"validate", "open.obj"});
    EXPECT_EQ(holes.code, 1);
    EXPECT_NE(holes.out.find("closed no: 3 edges have one triangle only\n"), std::string::npos) << holes.out;
    EXPECT_NE(holes.out.find("oriented yes\n"), std::string::npos) << holes.out;
    const Ended twisted = run({"validate", "turned.obj"});
    EXPECT_NE(twisted.out.find("oriented no: 3 edges have the same direction"), std::string::npos)
        << twisted.out;
    EXPECT_EQ(twisted.out.find("(0"), std::string::npos) << twisted.out;

    // The edge with four triangles makes it unoriented: no reason with a count of zero.
    geometry::TriangleMesh wedge = geometry::make_box({1, 1, 1}), second = wedge;
    for (Vec3& p : second.positions) p += Vec3(1, 1, 0);
    wedge.append(second);
    io::write_mesh(in("wedge.stl"), geometry::SurfaceMesh{wedge, {}, {}, {}});
    const Ended edge = run({"validate", "wedge.stl"});
    EXPECT_EQ(edge.code, 1);
    EXPECT_NE(edge.out.find("oriented no: 1 edge has more than two triangles\n"), std::string::npos)
        << edge.out;

    const Ended parts = run({"validate", "many.obj"});
    EXPECT_EQ(parts.code, 0);
    EXPECT_NE(parts.out.find("3 smaller parts"), std::string::npos) << parts.out;
    EXPECT_NE(run({"validate", "many.obj", "--all-parts"}).out.find("  part 22: 20 triangles"),
              std::string::npos);
}

TEST_F(CommandLine, EmptyValuesAreRefused) {
    for (const char* option : {"--resume", "--record"})
        expect_refused({"run", "scene.json", "-o", "out", option, ""},
                       std::string(option) + ": its value is empty");
    expect_refused({"run", "scene.json", "-o", ""}, "--output: its value is empty");
    expect_refused({"cut", "box.ply", "-o", "x.ply", "--pieces="}, "--pieces: its value is empty");
    expect_refused({"run", "", "-o", "out"}, "SCENE: is an empty name");
}

// Lines of meaningful words in any order, with some meaningless ones.
TEST_F(CommandLine, NoLineCrashesOrPrintsALibraryMessage) {
    write_text(in("scene.json"), scene);
    write_text(in("bad.json"), "{\"time_step\": 1e999, \"bodies\": [");
    write_text(in("cut.glb"), std::string("glTF\2\0\0\0\xff\xff\xff\x7f", 12));
    fs::create_directory(in("folder"));
    const Words vocabulary = {"surface",
                              "cut",
                              "validate",
                              "figure",
                              "help",
                              "man",
                              "completion",
                              "replay",
                              "info",
                              "ball.obj",
                              "sheet.obj",
                              "scene.json",
                              "bad.json",
                              "cut.glb",
                              "folder",
                              "missing",
                              "-o",
                              "--output",
                              "x.ply",
                              "x.stl",
                              "x.svg",
                              "x.png",
                              "x.xyz",
                              "--cells",
                              "8",
                              "12",
                              "-3",
                              "0",
                              "1e400",
                              "nan",
                              "--cell-size",
                              "0.2",
                              "--with",
                              "--path",
                              "--plane",
                              "z=0",
                              "0,0,1,0.1",
                              "0,0,0,0",
                              "1,2",
                              ",,,",
                              "=",
                              "--mode",
                              "remove",
                              "separate",
                              "--unit",
                              "mm",
                              "inch",
                              "--scale",
                              "--min-volume",
                              "--largest",
                              "--threads",
                              "1",
                              "--pieces",
                              "parts",
                              "--report",
                              "r.json",
                              "--lost",
                              "--",
                              "-",
                              "--=",
                              "--cells=",
                              "--cells=9",
                              "-o=",
                              "",
                              " ",
                              "\n",
                              "\xff\xfe",
                              "%s%n",
                              "--csv",
                              "--list",
                              "faces",
                              "bash",
                              "fish",
                              "--all-parts",
                              "-h5",
                              "--set",
                              "a=1",
                              std::string(5000, 'a'),
                              "x.ply/..",
                              ".",
                              "/dev/null",
                              "--record"};
    constexpr int lines = is_sanitized ? 60 : 250;
    Random random(20260);
    int done = 0;
    for (int k = 0; k < lines; ++k) {
        Words line;
        const auto pick = [&](std::size_t below) { return static_cast<std::size_t>(random.bits() % below); };
        line.push_back(vocabulary[pick(pick(3) == 0 ? vocabulary.size() : 9)]);
        const bool near_good = pick(2) == 0;
        for (std::size_t n = pick(near_good ? 4 : 9); n > 0; --n)
            line.push_back(vocabulary[pick(vocabulary.size())]);
        if (near_good) {
            line[0] = pick(2) == 0 ? "surface" : "cut";
            line.insert(line.begin() + 1, {"ball.obj", "-o", "x.ply", "--cells", "8"});
            if (line[0] == "cut") line.insert(line.end(), {"--plane", "z=0"});
        }
        const Ended ended = run(line);
        std::string shown;
        for (const std::string& word : line) shown += "[" + word.substr(0, 60) + "] ";
        EXPECT_TRUE(ended.code >= 0 && ended.code <= 2) << shown << ended.code << ended.err;
        done += ended.code == 0;
        EXPECT_TRUE(ended.code != 2 || ended.err.rfind("splitcubes: ", 0) == 0 ||
                    ended.err.find("\nsplitcubes: ") != std::string::npos)
            << shown << ended.err;
        for (const char* foreign :
             {"json.exception", "std::", "terminate", "basic_string", "vector::", "filesystem error",
              "bug in the program", "stoi", "regex", "bad_alloc", "what():"})
            EXPECT_EQ(ended.err.find(foreign), std::string::npos) << shown << ended.err;
        for (const char* name : {"x.ply", "x.stl", "parts", "r.json"}) fs::remove_all(in(name));
    }
    EXPECT_GT(done, lines / 20) << "most lines are refused early: the vocabulary does not fit";
    EXPECT_EQ(unfinished_files(), 0U);
}

}  // namespace
}  // namespace splitcubes::app_test
