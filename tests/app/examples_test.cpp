// The commands in help texts and in the README work as typed, in the repository's folder.
#include <gtest/gtest.h>

#include <app/program.h>
#include <glob.h>
#include <regex>
#include <sstream>

namespace splitcubes::app_test {
namespace {

using Words = std::vector<std::string>;

class Examples : public Program {
  protected:
    Examples() { fs::create_directory_symlink(SPLITCUBES_SCENES, in("scenes")); }

    // Splits a line into words like a shell, up to a pipe.
    Words words_of(const std::string& line) const {
        std::istringstream stream(line);
        Words out;
        for (std::string word; stream >> word && word != "|";) {
            glob_t found{};
            if (word.find('*') != word.npos && glob((folder_ / word).c_str(), 0, nullptr, &found) == 0) {
                for (std::size_t k = 0; k < found.gl_pathc; ++k)
                    out.push_back(fs::path(found.gl_pathv[k]).lexically_relative(folder_).string());
                globfree(&found);
            } else {
                out.push_back(word);
            }
        }
        return out;
    }

    // Runs a line with fewer frames than given and without benchmarks: the test is whether the line is valid.
    void expect_works(const std::string& line) const {
        SCOPED_TRACE(line);
        Words words = words_of(line);
        ASSERT_GT(words.size(), 1U);
        ASSERT_EQ(words.front(), "splitcubes");
        words.erase(words.begin());
        const std::string command = words.front();
        if (command == "bench" || command == "view") words.emplace_back("--help");
        if (command == "run") {
            const auto frames = std::find(words.begin(), words.end(), "--frames");
            if (frames == words.end())
                words.insert(words.end(), {"--frames", "2"});
            else
                *(frames + 1) = "2";
        }
        const Ended ended = run(words);
        // A machine without OpenGL is not a fault of the line.
        if (command == "render" && ended.code == 1) return;
        EXPECT_EQ(ended.code, 0) << ended.err;
        EXPECT_EQ(ended.err.find("nothing was cut"), std::string::npos) << ended.err;
        if (command == "cut")
            EXPECT_EQ(ended.out.find(": 1 piece, 0 removed"), std::string::npos) << ended.out;
    }

    void expect_all_work(const Words& lines, std::size_t min_count) const {
        EXPECT_GE(lines.size(), min_count);
        for (const std::string& line : lines) {
#ifndef SPLITCUBES_WITH_RENDER
            if (line.starts_with("splitcubes render")) continue;
#endif
            expect_works(line);
        }
    }
};

TEST_F(Examples, CommandsOfEveryHelpTextWork) {
    Words lines;
    for (const char* command : {"surface", "cut", "run", "replay", "render", "validate", "bench", "figure",
                                "info", "help", "man", "completion"}) {
        bool in_examples = false;
        for (const std::string& line : lines_of(run({command, "--help"}).out)) {
            if (in_examples && line.starts_with("  splitcubes ")) lines.push_back(line.substr(2));
            in_examples = in_examples || line == "Examples:";
        }
    }
    expect_all_work(lines, 12);
}

TEST_F(Examples, CommandsOfTheReadmeWork) {
    Words lines;
    const std::string readme = text_of(fs::path(SPLITCUBES_DOCS).parent_path() / "README.md");
    const std::regex command(
        "(^|`)(splitcubes [a-z]+ [^`]*-o [^`]+|splitcubes (info|validate [^`]+|bench [a-z]+))(`|$)");
    for (const std::string& line : lines_of(readme)) {
        std::smatch found;
        if (std::regex_search(line, found, command)) lines.push_back(found[2]);
    }
    expect_all_work(lines, 11);
}

// Longer ones are not run, but their input files exist.
TEST_F(Examples, CommandsOfTheDocumentsNameExistingFiles) {
    const std::regex input("scenes/[A-Za-z0-9_/]+\\.(jsonl?|obj)");
    std::size_t count = 0;
    for (const auto& entry : fs::recursive_directory_iterator(SPLITCUBES_DOCS)) {
        if (entry.path().extension() != ".md") continue;
        const std::string text = text_of(entry.path());
        for (std::sregex_iterator at(text.begin(), text.end(), input), end; at != end; ++at, ++count)
            EXPECT_TRUE(fs::exists(in(at->str()))) << entry.path() << ": " << at->str();
    }
    EXPECT_GT(count, 10U);
}

}  // namespace
}  // namespace splitcubes::app_test
