// Runs the splitcubes program and captures its output.
#pragma once

#include <gtest/gtest.h>

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <regex>
#include <string>
#include <thread>
#include <vector>

namespace splitcubes::app_test {

namespace fs = std::filesystem;

inline std::string text_of(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_text(const fs::path& file, const std::string& text) {
    std::ofstream(file, std::ios::binary) << text;
}

inline std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> out;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        out.push_back(text.substr(at, end - at));
        at = end + 1;
    }
    return out;
}

/// Returns the lines without those of progress, which appear where work takes longer than a second.
inline std::vector<std::string> lines_without_progress(const std::string& text) {
    static const std::regex progress(
        R"((set-up of .*|[a-z]+( \S+)*: (.*, )?[0-9.]+ %.*|run .*|(?!splitcubes)[a-z]+: [a-z ]+))");
    std::vector<std::string> out = lines_of(text);
    std::erase_if(out, [](const std::string& line) { return std::regex_match(line, progress); });
    return out;
}

struct Ended {
    int code = -1;  // exit code; -1 if a signal ended it
    std::string out, err;
};

/// Runs each test in a temporary folder of its own.
class Program : public testing::Test {
  protected:
    Program() {
        std::string name = (fs::temp_directory_path() / "splitcubes-test-XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
        folder_ = name;
    }
    ~Program() override {
        std::error_code ignored;
        fs::permissions(folder_, fs::perms::owner_all, ignored);
        fs::remove_all(folder_, ignored);
    }

    /// Starts the program in the test's folder; `meanwhile` gets its process id and is called until the
    /// program has ended or `meanwhile` returns false.
    Ended run(const std::vector<std::string>& arguments,
              const std::function<bool(pid_t)>& meanwhile = {}) const {
        const fs::path out = folder_ / ".out", err = folder_ / ".err";
        std::vector<std::string> words = {SPLITCUBES_PROGRAM};
        words.insert(words.end(), arguments.begin(), arguments.end());
        std::vector<char*> argv;
        for (std::string& word : words) argv.push_back(word.data());
        argv.push_back(nullptr);
        const pid_t child = fork();
        if (child == 0) {
            const int o = open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
            const int e = open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
            if (o < 0 || e < 0 || dup2(o, 1) < 0 || dup2(e, 2) < 0 || chdir(folder_.c_str()) != 0) _exit(126);
            execv(argv[0], argv.data());
            _exit(127);
        }
        int status = 0;
        bool asking = static_cast<bool>(meanwhile);
        const auto began = std::chrono::steady_clock::now();
        while (waitpid(child, &status, WNOHANG) == 0) {
            if (asking) asking = meanwhile(child);
            if (std::chrono::steady_clock::now() - began > std::chrono::seconds(600)) {
                ADD_FAILURE() << "does not end";
                kill(child, SIGKILL);
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
        }
        Ended ended;
        ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
        ended.out = text_of(out);
        ended.err = text_of(err);
        return ended;
    }

    /// Expects exit code 2, nothing on standard output, and one line on standard error that names the
    /// culprit. On a slow machine the progress of the set-up may precede it.
    void expect_refused(const std::vector<std::string>& arguments, const std::string& culprit) const {
        const Ended ended = run(arguments);
        std::string command;
        for (const std::string& a : arguments) command += a + ' ';
        SCOPED_TRACE(command);
        EXPECT_EQ(ended.code, 2);
        EXPECT_EQ(ended.out, "");
        const std::vector<std::string> said = lines_without_progress(ended.err);
        ASSERT_EQ(said.size(), 1U) << ended.err;
        EXPECT_NE(said[0].find(culprit), std::string::npos) << ended.err;
        EXPECT_EQ(said[0].rfind("splitcubes: ", 0), 0U) << ended.err;
    }

    /// Counts unfinished temporary files below the folder.
    std::size_t unfinished_files() const {
        std::size_t count = 0;
        for (const auto& entry : fs::recursive_directory_iterator(folder_))
            count += entry.path().filename().string().find(".tmp") != std::string::npos;
        return count;
    }

    fs::path in(const std::string& name) const { return folder_ / name; }

    fs::path folder_;
};

}  // namespace splitcubes::app_test
