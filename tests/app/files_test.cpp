// Files that the program did not write: which ones a command may remove, and which not.
#include "app/program.h"
#include "sanitized.h"

#include <splitcubes/core/random.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <map>
#include <set>

namespace splitcubes::app_test {
namespace {

using Words = std::vector<std::string>;
using Contents = std::map<std::string, std::string>;

const char* const block_scene = R"({
  "frames": 3,
  "bodies": [{"name": "block", "shape": {"box": {"size": [0.2, 0.16, 0.14]}}, "cells": 6, "phyxel_count": 30,
              "material": {"youngs_modulus": 2e5}}],
  "camera": {"width": 64, "height": 48}
})";

const char* const block_obj =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n"
    "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
const char* const sheet_obj = "v -1 -1 0.45\nv 2 -1 0.46\nv -1 2 0.47\nv 2 2 0.48\nf 1 2 4\nf 1 4 3\n";

class Files : public Program {
  protected:
    Files() {
        write_text(in("block.json"), block_scene);
        write_text(in("block.obj"), block_obj);
        write_text(in("sheet.obj"), sheet_obj);
    }

    void put(const std::string& name, const std::string& text) const {
        fs::create_directories(in(name).parent_path());
        write_text(in(name), text);
    }

    // Returns the contents of all files below a folder, by name.
    Contents contents(const std::string& folder) const {
        Contents out;
        for (const auto& entry : fs::recursive_directory_iterator(in(folder)))
            out[entry.path().lexically_relative(in(folder)).generic_string()] =
                entry.is_symlink()     ? "link to " + fs::read_symlink(entry.path()).string()
                : entry.is_directory() ? "folder"
                                       : text_of(entry.path());
        return out;
    }

    std::set<std::string> listed(const std::string& folder) const {
        const std::vector<std::string> lines = lines_of(text_of(in(folder) / "splitcubes-files.txt"));
        return {lines.begin() + 1, lines.end()};
    }

    Ended run_block(const Words& more) const {
        Words words = {"run", "block.json", "-o", "out", "--threads", "1"};
        words.insert(words.end(), more.begin(), more.end());
        return run(words);
    }
    void expect_block_refused(Words more, const std::string& culprit) const {
        const Words words = {"run", "block.json", "-o", "out", "--threads", "1"};
        more.insert(more.begin(), words.begin(), words.end());
        expect_refused(more, culprit);
    }
};

// A refused run changes nothing, and a successful run keeps the files of others.
TEST_F(Files, FilesOfOthersAreKept) {
    const Words harmless = {"notes.txt",
                            "000001.ply",
                            "surface/notes.txt",
                            "surface/1.ply",
                            "links/00001.ply",
                            "deep/er/000001.ply",
                            ".hidden",
                            "inputs/mesh.obj",
                            "pictures/000001.jpg",
                            "surface/body-plan.ply",
                            "surface.ply",
                            "motions.json",
                            "surface/deep/000001.ply"};
    const Words named_alike = {"surface/000001.ply", "surface/000099.obj",  "scene.json",
                               "metrics.csv",        "pictures/000002.png", "links/000000.ply",
                               "checkpoint.bin",     "summary.json",        "inputs/0123456789abcdef/a.obj",
                               "surface/body0-a.png"};
    Random random(7);
    int taken = 0;
    for (int round = 0; round < 16; ++round) {
        SCOPED_TRACE(round);
        fs::remove_all(in("out"));
        bool alike = false;
        for (const std::string& name : harmless)
            if (random.below(2) == 0) put("out/" + name, "mine " + name);
        for (const std::string& name : named_alike)
            if (round % 2 == 0 && random.below(4) == 0) {
                put("out/" + name, "mine " + name);
                alike = true;
            }
        put("out/last", "mine");
        const Contents before = contents("out");
        expect_block_refused({"--frames", "1"}, "out");
        EXPECT_EQ(contents("out"), before);
        const Ended forced = run_block({"--frames", "1", "--force"});
        EXPECT_EQ(forced.code, 0) << forced.err;
        const Contents after = contents("out");
        EXPECT_NE(forced.err.find(alike ? "replaced " : "did not write stay"), std::string::npos)
            << forced.err;
        for (const std::string& name : named_alike)
            EXPECT_TRUE(after.count(name) == 0 || after.at(name) != "mine " + name) << name;
        taken += alike;
        // Again, now with a list and fewer files to write.
        EXPECT_EQ(run_block({"--frames", "1", "--set", "output.every_nth_frame=9"}).code, 0);
        EXPECT_FALSE(fs::exists(in("out/surface/000001.ply")));
        const Contents again = contents("out");
        for (const auto& [name, text] : before) {
            const bool is_alike =
                std::find(named_alike.begin(), named_alike.end(), name) != named_alike.end();
            if (is_alike || text == "folder") continue;
            EXPECT_EQ(after.count(name) ? after.at(name) : "", text) << name;
            EXPECT_EQ(again.count(name) ? again.at(name) : "", text) << name;
        }
    }
    EXPECT_GE(taken, 6);
}

TEST_F(Files, FilesOfAnEarlierRunAreRemoved) {
    ASSERT_EQ(run_block({"--frames", "4", "--links", "--checkpoint-every", "2"}).code, 0);
    const Contents first = contents("out");
    for (const auto& [name, text] : first) {
        if (name == "splitcubes-files.txt") continue;
        EXPECT_TRUE(listed("out").contains(text == "folder" ? name + "/" : name)) << name;
    }
    put("out/surface/mine.txt", "mine");
    ASSERT_EQ(run_block({"--frames", "2", "--set", "output.format=obj"}).code, 0);
    std::set<std::string> names;
    for (const auto& [name, text] : contents("out")) names.insert(name);
    EXPECT_EQ(names,
              (std::set<std::string>{"checkpoint.bin", "metrics.csv", "scene.json", "splitcubes-files.txt",
                                     "summary.json", "surface", "surface/000000.obj", "surface/000001.obj",
                                     "surface/000002.obj", "surface/mine.txt"}));
    // A file that someone else put there since has a name that a run may write.
    put("out/surface/000077.ply", "mine");
    const Contents before = contents("out");
    expect_block_refused({}, "surface/000077.ply");
    EXPECT_EQ(contents("out"), before);
    ASSERT_EQ(run_block({"--frames", "1", "--force"}).code, 0);
    EXPECT_FALSE(fs::exists(in("out/surface/000077.ply")));
    EXPECT_EQ(text_of(in("out/surface/mine.txt")), "mine");
}

// --force replaces neither links nor the files behind them nor the command's own inputs.
TEST_F(Files, ForceReplacesPlainFilesAlone) {
    ASSERT_EQ(run_block({"--frames", "1"}).code, 0);
    const auto expect_forced_refused = [&](const std::string& culprit) {
        const Contents before = contents("out");
        expect_block_refused({"--force"}, culprit);
        EXPECT_EQ(contents("out"), before);
    };
    put("mine.obj", "mine");
    fs::remove(in("out/surface/000001.ply"));
    fs::create_symlink(in("mine.obj"), in("out/surface/000001.ply"));
    expect_forced_refused("surface/000001.ply");
    EXPECT_EQ(text_of(in("mine.obj")), "mine");
    fs::remove(in("out/surface/000001.ply"));
    fs::create_directory(in("out/surface/000002.ply"));
    expect_forced_refused("surface/000002.ply");
    fs::remove_all(in("out"));
    fs::create_directory(in("out"));
    put("far/000001.ply", "mine");
    fs::create_symlink(in("far"), in("out/surface"));
    expect_forced_refused("surface/000001.ply");
    EXPECT_EQ(text_of(in("far/000001.ply")), "mine");
    // A scene with the name of a run's, in the output folder of the run.
    fs::remove(in("out/surface"));
    write_text(in("out/scene.json"), block_scene);
    expect_refused({"run", "out/scene.json", "-o", "out", "--force"}, "reads it");
    EXPECT_EQ(text_of(in("out/scene.json")), block_scene);
    fs::create_directories(in("parts"));
    fs::copy_file(in("block.obj"), in("parts/piece-0000.obj"));
    expect_refused({"cut", "parts/piece-0000.obj", "--plane", "z=0.5", "-o", "no.obj", "--pieces", "parts",
                    "--force", "--cells", "8"},
                   "parts/piece-0000.obj");
    EXPECT_EQ(text_of(in("parts/piece-0000.obj")), block_obj);
}

TEST_F(Files, FilesOfAKilledRunAreRecognised) {
    for (const char* frame : {"surface/000000.ply", "surface/000003.ply", "links/000006.ply"}) {
        SCOPED_TRACE(frame);
        const Ended killed = run(
            {"run", "block.json", "-o", "out", "--frames", "100000", "--links", "--checkpoint-every", "1"},
            [&](pid_t child) {
                if (!fs::exists(in("out") / frame)) return true;
                kill(child, SIGKILL);
                return false;
            });
        ASSERT_EQ(killed.code, -1);
        const Ended next = run_block({"--frames", "1"});
        ASSERT_EQ(next.code, 0) << next.err;
        EXPECT_TRUE(fs::exists(in("out/surface/000001.ply")));
        EXPECT_FALSE(fs::exists(in("out/surface/000002.ply")));
        EXPECT_FALSE(fs::exists(in("out/links")));
    }
    // A truncated line names nothing.
    put("out/surface/00000", "mine");
    write_text(in("out/splitcubes-files.txt"), text_of(in("out/splitcubes-files.txt")) + "surface/00000");
    ASSERT_EQ(run_block({"--frames", "1"}).code, 0);
    EXPECT_EQ(text_of(in("out/surface/00000")), "mine");
}

// Where files without a name are not supported, a kill leaves a partial temporary file.
TEST_F(Files, TemporaryFilesOfAKilledRunAreRemoved) {
    ASSERT_EQ(run_block({"--frames", "1", "--links"}).code, 0);
    const std::vector<const char*> leftovers = {"out/.splitcubes-0.tmp", "out/links/.splitcubes-12.tmp",
                                                "out/surface/.splitcubes-0.tmp"};
    for (const char* file : leftovers) put(file, "left");
    for (const char* file : {"out/surface/.splitcubes-a.tmp", "out/.splitcubes-.tmp"}) put(file, "mine");
    ASSERT_EQ(run_block({"--frames", "1"}).code, 0);
    for (const char* file : leftovers) EXPECT_FALSE(fs::exists(in(file))) << file;
    EXPECT_FALSE(fs::exists(in("out/links")));
    for (const char* file : {"out/surface/.splitcubes-a.tmp", "out/.splitcubes-.tmp"})
        EXPECT_EQ(text_of(in(file)), "mine") << file;
    // Those of another folder, behind a link, stay.
    put("far/.splitcubes-0.tmp", "mine");
    fs::remove_all(in("out/surface"));
    fs::create_symlink(in("far"), in("out/surface"));
    run_block({"--frames", "1"});
    EXPECT_EQ(text_of(in("far/.splitcubes-0.tmp")), "mine");
}

TEST_F(Files, TwoRunsDoNotShareAFolder) {
    for (const int signal_number : {SIGTERM, SIGKILL}) {
        SCOPED_TRACE(signal_number);
        Ended second, resumed;
        const Ended first =
            run({"run", "block.json", "-o", "out", "--frames", "100000", "--checkpoint-every", "1"},
                [&](pid_t child) {
                    if (!fs::exists(in("out/checkpoint.bin"))) return true;
                    second = run_block({"--force"});
                    resumed = run_block({"--resume", "out/checkpoint.bin"});
                    kill(child, signal_number);
                    return false;
                });
        EXPECT_EQ(first.code, signal_number == SIGTERM ? 1 : -1);
        for (const Ended& other : {second, resumed}) {
            EXPECT_EQ(other.code, 2);
            EXPECT_NE(other.err.find("out: another process is writing into it"), std::string::npos)
                << other.err;
        }
        // A process's lock ends with it, however it ends.
        const Ended next = run_block({"--frames", "1"});
        EXPECT_EQ(next.code, 0) << next.err;
        fs::remove_all(in("out"));
    }
}

// As on some network file systems: flock() is preloaded with one that fails.
TEST_F(Files, AFolderThatCannotBeLockedIsReported) {
    if (is_sanitized) GTEST_SKIP() << "the sanitizer's library has to be the first";
    for (const std::string& error :
         {std::to_string(ENOLCK), std::to_string(EOPNOTSUPP), std::to_string(EBADF)}) {
        setenv("LD_PRELOAD", SPLITCUBES_NO_LOCKS, 1);
        setenv("NO_LOCKS_ERROR", error.c_str(), 1);
        const Ended ended = run_block({"--frames", "1"});
        unsetenv("LD_PRELOAD");
        unsetenv("NO_LOCKS_ERROR");
        EXPECT_EQ(ended.code, 0);
        std::size_t note_count = 0;
        for (const std::string& line : lines_of(ended.err))
            note_count += line.rfind("out: cannot be locked here (", 0) == 0;
        EXPECT_EQ(note_count, 1U) << ended.err;
    }
    EXPECT_EQ(run_block({"--frames", "1"}).err.find("locked"), std::string::npos);
}

// A list may be forged.
TEST_F(Files, AListDoesNotLeadOutOfItsFolder) {
    put("precious/000001.ply", "mine");
    put("scene.json", "mine");
    put("out/notes/000001.ply", "mine");
    fs::create_directory(in("out/empty"));
    fs::create_symlink(in("precious"), in("out/surface"));
    write_text(in("out/splitcubes-files.txt"),
               "splitcubes files 1: run\n../scene.json\n" + in("scene.json").string() +
                   "\nsurface/../../precious/000001.ply\nsurface/../notes/000001.ply\nnotes/000001.ply\n"
                   "notes/\nempty/\n../precious/\n\n/\nsurface/\nsurface/000001.ply\n");
    const Contents precious = contents("precious");
    const Ended ended = run_block({"--set", "output.every_nth_frame=5"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    EXPECT_EQ(text_of(in("precious/000001.ply")), "mine");
    EXPECT_EQ(text_of(in("scene.json")), "mine");
    EXPECT_EQ(text_of(in("out/notes/000001.ply")), "mine");
    EXPECT_TRUE(fs::exists(in("out/empty")));
    EXPECT_TRUE(fs::is_symlink(in("out/surface")));
    write_text(in("out/splitcubes-files.txt"), "something else\n");
    expect_block_refused({"--force"}, "something else");
    fs::remove(in("out/splitcubes-files.txt"));
    fs::create_symlink("/dev/zero", in("out/splitcubes-files.txt"));
    expect_block_refused({"--force"}, "splitcubes-files.txt");
}

TEST_F(Files, FoldersOfAnotherKindAreNotMixed) {
    ASSERT_EQ(run_block({}).code, 0);
    const Words cut = {"cut", "block.obj", "--with", "sheet.obj", "-o", "no.ply", "--cells", "8"};
    const auto with = [&](Words more) {
        more.insert(more.begin(), cut.begin(), cut.end());
        return more;
    };
    const Contents before = contents("out");
    expect_refused(with({"--pieces", "out"}), "other files than pieces of a cut");
    expect_refused(with({"--pieces", "out", "--force"}), "out");
    EXPECT_EQ(contents("out"), before);
    ASSERT_EQ(run(with({"--pieces", "parts"})).code, 0);
    expect_refused({"run", "block.json", "-o", "parts"}, "parts");
    expect_refused({"run", "block.json", "-o", "parts", "--force"}, "parts");
    expect_refused(
        {"cut", "block.obj", "--with", "sheet.obj", "-o", "parts/piece-0000.ply", "--pieces", "parts"},
        "parts/piece-0000.ply");
    EXPECT_EQ(run(with({"--pieces", "parts"})).code, 0);
}

TEST_F(Files, UnwritableTargetsAreReportedBeforeTheWork) {
    put("file", "mine");
    fs::create_symlink("round", in("round"));
    for (const std::string& folder :
         {std::string("file"), std::string("file/out"), std::string(300, 'x'), std::string("/proc/out"),
          std::string("new/") + std::string(300, 'x'), std::string("round")})
        expect_refused({"run", "block.json", "-o", folder}, folder.substr(0, 40));
    EXPECT_FALSE(fs::exists(in("new")));
    EXPECT_EQ(text_of(in("file")), "mine");
    // An invalid scene leaves no folder behind.
    write_text(in("bad.obj"), "f 1 2 3\n");
    write_text(in("bad.json"), R"({"bodies": [{"name": "b", "shape": {"mesh": {"file": "bad.obj"}}}]})");
    expect_refused({"run", "bad.json", "-o", "a/b/c"}, "bad.obj");
    EXPECT_FALSE(fs::exists(in("a")));
    ASSERT_EQ(run({"run", "block.json", "-o", "a/b/c", "--frames", "1"}).code, 0);
    EXPECT_TRUE(fs::exists(in("a/b/c/summary.json")));
}

TEST_F(Files, ARecordingReplacesNoOtherFile) {
    expect_refused({"run", "block.json", "-o", "out", "--record", "block.json"}, "block.json");
    expect_refused({"run", "block.json", "-o", "out", "--record", "./out/../block.json"}, "block.json");
    ASSERT_EQ(run_block({"--record", "./out/first.json"}).code, 0) << "a folder that is yet to be made";
    EXPECT_TRUE(fs::exists(in("out/first.json")));
    for (const char* name : {"scene.json", "summary.json", "splitcubes-files.txt", "surface/000000.ply"})
        expect_refused({"run", "block.json", "-o", "out", "--record", std::string("out/") + name}, name);
    EXPECT_EQ(run_block({"--record", "out/motions.json"}).code, 0);
    EXPECT_EQ(run_block({}).code, 0);
    EXPECT_TRUE(fs::exists(in("out/motions.json")));
    EXPECT_EQ(text_of(in("block.json")), block_scene);
}

TEST_F(Files, LinksAreWrittenThrough) {
    fs::create_directory(in("far"));
    put("far/report.json", "old");
    fs::create_symlink("far/report.json", in("report.json"));
    fs::create_symlink("far/mesh.ply", in("mesh.ply"));
    fs::create_symlink("far/run", in("run"));
    ASSERT_EQ(run({"surface", "block.obj", "-o", "mesh.ply", "--cells", "8", "--report", "report.json"}).code,
              0);
    EXPECT_TRUE(fs::is_symlink(in("mesh.ply")) && fs::is_symlink(in("report.json")));
    EXPECT_EQ(text_of(in("far/report.json")).substr(0, 1), "{");
    EXPECT_EQ(text_of(in("far/mesh.ply")).substr(0, 3), "ply");
    const Ended ended = run({"run", "block.json", "-o", "run", "--frames", "1"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    EXPECT_TRUE(fs::is_symlink(in("run")));
    EXPECT_TRUE(fs::exists(in("far/run/surface/000001.ply")));
    EXPECT_EQ(run({"run", "block.json", "-o", "far/run", "--frames", "1"}).code, 0);
    fs::create_symlink("nowhere/mesh.ply", in("lost.ply"));
    expect_refused({"surface", "block.obj", "-o", "lost.ply"}, "lost.ply");
}

TEST_F(Files, TheLibraryOfAMeshIsNotReplacedByThatOfItsSurface) {
    write_text(in("skin.mtl"), "newmtl skin\nKd 1 0 0\n");
    std::string obj = block_obj;
    obj.insert(obj.find("f "), "usemtl skin\n");
    write_text(in("skinned.obj"), "mtllib skin.mtl\n" + obj);
    expect_refused({"surface", "skinned.obj", "-o", "skin.obj", "--cells", "8"}, "skin.mtl");
    expect_refused({"cut", "skinned.obj", "--with", "sheet.obj", "-o", "skin.obj", "--cells", "8"},
                   "skin.mtl");
    EXPECT_EQ(text_of(in("skin.mtl")), "newmtl skin\nKd 1 0 0\n");
    EXPECT_EQ(run({"surface", "skinned.obj", "-o", "out.obj", "--cells", "8"}).code, 0);
}

#ifdef SPLITCUBES_WITH_RENDER

TEST_F(Files, PicturesReplaceThoseOfAnEarlierRunAndNothingElse) {
    ASSERT_EQ(run_block({}).code, 0);
    const Ended ended = run({"render", "out", "-o", "stills"});
    if (ended.code == 1 && ended.err.find("OpenGL cannot start") != std::string::npos)
        GTEST_SKIP() << ended.err;
    ASSERT_EQ(ended.code, 0) << ended.err;
    put("stills/notes.txt", "mine");
    ASSERT_EQ(run({"render", "out", "-o", "stills", "--every", "3"}).code, 0);
    std::set<std::string> names;
    for (const auto& [name, text] : contents("stills")) names.insert(name);
    EXPECT_EQ(names,
              (std::set<std::string>{"000000.png", "000003.png", "notes.txt", "splitcubes-files.txt"}));
    put("album/000007.png", "mine");
    put("other/000007.jpg", "mine");
    expect_refused({"render", "out", "-o", "album"}, "album");
    expect_refused({"render", "out", "-o", "other"}, "other");
    expect_refused({"render", "out", "-o", "out"}, "out");
    EXPECT_EQ(run({"render", "out", "-o", "other", "--force"}).code, 0);
    EXPECT_EQ(text_of(in("other/000007.jpg")), "mine");
    EXPECT_EQ(contents("album").size(), 1U);
    EXPECT_EQ(run({"render", "out", "-o", "album", "--force", "--every", "3"}).code, 0);
    EXPECT_FALSE(fs::exists(in("album/000007.png")));
}

#endif

}  // namespace
}  // namespace splitcubes::app_test
