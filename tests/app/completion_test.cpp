// The man page and shell completion, both generated from the options.
#include "app/program.h"

#include <algorithm>
#include <cstdlib>

namespace splitcubes::app_test {
namespace {

using Words = std::vector<std::string>;

class Shells : public Program {
  protected:
    // Runs a shell command; its output is in `.said`.
    int system(const std::string& line) const {
        return std::system(("cd '" + folder_.string() + "' && (" + line + ") > .said 2>&1").c_str());
    }
    bool has(const std::string& program) const { return system("command -v " + program) == 0; }
    std::string said() const { return text_of(in(".said")); }

    // Returns every option that the help of a command lists.
    Words options_of(const std::string& command) const {
        Words out;
        for (const std::string& line : lines_of(run({command, "--help"}).out)) {
            if (line.rfind("  -", 0) != 0) continue;
            const std::size_t at = line.find("--");
            if (at != std::string::npos && at < 10)
                out.push_back(line.substr(at, line.find_first_of(" ,", at) - at));
        }
        return out;
    }
    Words commands() const {
        Words out;
        const std::string help = run({"--help"}).out;
        for (const std::string& line : lines_of(help.substr(0, help.find("\nOptions"))))
            if (line.rfind("  ", 0) == 0 && line[2] != ' ')
                out.push_back(line.substr(2, line.find(' ', 2) - 2));
        return out;
    }
};

TEST_F(Shells, TheManPageRendersWithoutWarningsAndHoldsAllOptions) {
    if (!has("groff")) GTEST_SKIP() << "no groff";
    const Ended page = run({"man"});
    ASSERT_EQ(page.code, 0);
    write_text(in("splitcubes.1"), page.out);
    ASSERT_EQ(system("groff -man -Tutf8 -ww -z splitcubes.1"), 0) << said();
    EXPECT_EQ(said(), "");
    ASSERT_EQ(system("groff -man -Tascii -P-cbou -rLL=150n splitcubes.1"), 0);
    const std::string text = said();
    ASSERT_GE(commands().size(), 12U);
    for (const std::string& command : commands()) {
        EXPECT_NE(text.find("splitcubes " + command), std::string::npos) << command;
        for (const std::string& option : options_of(command))
            EXPECT_NE(text.find(option), std::string::npos) << command << ' ' << option;
    }
    EXPECT_NE(text.find("EXIT STATUS"), std::string::npos);
}

TEST_F(Shells, BashCompletes) {
    if (!has("bash")) GTEST_SKIP() << "no bash";
    write_text(in("script"), run({"completion", "bash"}).out);
    for (const char* name : {"ball.obj", "blue ball.ply", "note.txt", "scene.json", "film.mp4"})
        write_text(in(name), "");
    fs::create_directory(in("folder"));
    // Returns bash's completions of the last word.
    const auto offers = [&](const Words& words) {
        std::string line = "source ./script; COMP_WORDS=(";
        for (const std::string& word : words) line += "'" + word + "' ";
        line += "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _splitcubes; printf '%s\\n' \"${COMPREPLY[@]}\"";
        write_text(in("ask"), line);
        EXPECT_EQ(system("bash ./ask"), 0) << said();
        Words out = lines_of(said());
        std::sort(out.begin(), out.end());
        return out;
    };
    EXPECT_EQ(offers({"splitcubes", "sur"}), Words{"surface"});
    EXPECT_EQ(offers({"splitcubes", "re"}), (Words{"render", "replay"}));
    EXPECT_EQ(offers({"splitcubes", "surface", "--cell"}), (Words{"--cell-size", "--cells"}));
    EXPECT_EQ(offers({"splitcubes", "surface", "b"}), (Words{"ball.obj", "blue ball.ply"}));
    EXPECT_EQ(offers({"splitcubes", "run", "s"}), Words{"scene.json"});
    EXPECT_EQ(offers({"splitcubes", "cut", "ball.obj", "--mode", ""}), (Words{"remove", "separate"}));
    EXPECT_EQ(offers({"splitcubes", "cut", "--mode", "=", "r"}), Words{"remove"});
    EXPECT_EQ(offers({"splitcubes", "cut", "--mode", "="}), (Words{"remove", "separate"}));
    EXPECT_EQ(offers({"splitcubes", "cut", "ball.obj", "--pieces", "f"}), Words{"folder"});
    EXPECT_EQ(offers({"splitcubes", "render", "x", "-o", "f"}), (Words{"film.mp4", "folder"}));
    EXPECT_EQ(offers({"splitcubes", "completion", ""}), (Words{"bash", "fish", "zsh"}));
    EXPECT_EQ(offers({"splitcubes", "figure", "fac"}), Words{"faces"});
    EXPECT_EQ(offers({"splitcubes", "help", "val"}), Words{"validate"});
    for (const std::string& command : commands())
        for (const std::string& option : options_of(command))
            EXPECT_EQ(offers({"splitcubes", command, option}).front(), option) << command;
}

TEST_F(Shells, EveryScriptHoldsAllOptions) {
    for (const char* shell : {"bash", "zsh", "fish"}) {
        const Ended ended = run({"completion", shell});
        ASSERT_EQ(ended.code, 0);
        write_text(in("script"), ended.out);
        EXPECT_TRUE(!has(shell) || system(std::string(shell) + " -n script") == 0) << shell << said();
        for (const std::string& command : commands())
            for (const std::string& option : options_of(command)) {
                const std::string written = shell == std::string("fish") ? "-l " + option.substr(2) : option;
                EXPECT_NE(ended.out.find(written), std::string::npos) << shell << ' ' << command << option;
            }
    }
    expect_refused({"completion", "tcsh"}, "bash, zsh, fish");
}

}  // namespace
}  // namespace splitcubes::app_test
