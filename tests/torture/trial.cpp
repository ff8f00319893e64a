#include "trial.h"

#include "checker.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <thread>
#include <vector>

namespace splitcubes::torture {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds poll_interval{5};
constexpr std::chrono::seconds patience{30};  // for a process that is asked to end
constexpr double wall_clock_factor = 20;      // wall clock that a process may take, over its processor time

// Returns the time that the process has used so far, s.
double processor_seconds(pid_t process) {
    clockid_t clock{};
    timespec time{};
    if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::string last_line(const fs::path& file) {
    std::ifstream in(file);
    std::string out;
    for (std::string line; std::getline(in, line);)
        if (!line.empty()) out = line;
    return out;
}

// The child runs this: only calls that are safe after fork in a program with threads.
[[noreturn]] void become(char** arguments, const char* errors, rlim_t memory) {
    const int none = open("/dev/null", O_WRONLY | O_CLOEXEC);
    const int file = open(errors, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (none < 0 || file < 0 || dup2(none, 1) < 0 || dup2(file, 2) < 0) _exit(126);
    const rlimit limit{memory, memory};
    if (memory > 0 && setrlimit(RLIMIT_AS, &limit) != 0) _exit(126);
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    execv(arguments[0], arguments);
    _exit(127);
}

std::string finding_text(const Finding& finding, const LawText& text) {
    std::array<char, 96> out;
    std::snprintf(out.data(), out.size(), "%s %.3g/%.3g", text.name, finding.worst, text.bound);
    return out.data();
}

}  // namespace

Ended run_program(const fs::path& program, const fs::path& scene, const fs::path& run,
                  const ProcessLimits& limits) {
    fs::remove_all(run);
    const fs::path errors = scene.parent_path() / "errors.txt";
    std::vector<std::string> words = {program.string(), "run", scene.string(), "-o", run.string()};
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const auto memory = static_cast<rlim_t>(limits.memory_gib * 1024 * 1024 * 1024);
    const auto began = Clock::now();
    const pid_t child = fork();
    if (child < 0) throw std::runtime_error("no process can be started");
    if (child == 0) become(arguments.data(), errors.c_str(), memory);
    Ended out;
    int status = 0;
    rusage used{};
    Clock::time_point asked;
    while (wait4(child, &status, WNOHANG, &used) == 0) {
        const auto now = Clock::now();
        if (!out.timed_out &&
            (processor_seconds(child) > limits.seconds ||
             now - began > wall_clock_factor * std::chrono::duration<double>(limits.seconds))) {
            out.timed_out = true;
            asked = now;
            kill(child, SIGTERM);  // the program finishes its step and its tables
        }
        if (out.timed_out && now - asked > patience) kill(child, SIGKILL);
        std::this_thread::sleep_for(poll_interval);
    }
    const auto seconds = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    out.seconds = seconds(used.ru_utime) + seconds(used.ru_stime);
    if (WIFEXITED(status)) out.code = WEXITSTATUS(status);
    if (WIFSIGNALED(status)) out.signal = WTERMSIG(status);
    out.errors = last_line(errors);
    if (out.code == 127)
        throw std::runtime_error(program.string() + ": cannot be started; name the program by --program");
    return out;
}

Trial run_trial(const fs::path& program, const fs::path& scene_folder, const ProcessLimits& limits) {
    Trial out;
    const fs::path run = scene_folder / "run";
    out.ended = run_program(program, scene_folder / "scene.json", run, limits);
    const Ended& ended = out.ended;
    if (ended.code == 0 || ended.timed_out) out.verdict = check_run(scene_folder, run, ended.code == 0);
    const double share = ended.seconds / limits.seconds;
    out.verdict.measure(Law::time, ended.timed_out ? std::max(share, 1.001) : std::min(share, 1.0), -1);
    if (ended.timed_out) return out;
    const std::string note = ended.signal != 0 ? "signal " + std::to_string(ended.signal) : ended.errors;
    out.verdict.measure(Law::ended, ended.code == 0 ? 0 : 1, -1, ended.code == 0 ? "" : note);
    return out;
}

std::string text_of(const Verdict& verdict) {
    std::string broken, kept;
    for (const LawText& text : law_texts) {
        const Finding& finding = verdict.of(text.law);
        if (!finding.measured) continue;
        if (verdict.breaks(text.law)) {
            broken += (broken.empty() ? "" : ", ") + finding_text(finding, text);
            if (finding.frame >= 0) broken += " frame " + std::to_string(finding.frame);
            if (!finding.note.empty()) broken += " (" + finding.note + ")";
        } else {
            kept += (kept.empty() ? "" : ", ") + finding_text(finding, text);
        }
    }
    return broken.empty() ? kept : broken + " | " + kept;
}

nlohmann::ordered_json to_json(const Verdict& verdict) {
    nlohmann::ordered_json out;
    for (const LawText& text : law_texts) {
        const Finding& finding = verdict.of(text.law);
        if (!finding.measured) continue;
        auto& json = out[text.name];
        json["broken"] = verdict.breaks(text.law);
        if (std::isfinite(finding.worst))
            json["worst"] = finding.worst;
        else
            json["worst"] = "infinite";
        json["bound"] = text.bound;
        if (finding.frame >= 0) json["frame"] = finding.frame;
        if (!finding.note.empty()) json["note"] = finding.note;
    }
    return out;
}

}  // namespace splitcubes::torture
