// One run of the program as a process of its own, and its verdict.
#pragma once

#include "laws.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>

namespace splitcubes::torture {

struct ProcessLimits {
    double seconds = 60;    // of processor time
    double memory_gib = 4;  // address space; 0: no limit
};

struct Ended {
    int code = -1;   // exit code; -1: ended by a signal
    int signal = 0;  // 0: none
    bool timed_out = false;
    double seconds = 0;  // of processor time
    std::string errors;  // last line of standard error
};

/// Runs a scene; the run's folder is replaced.
Ended run_program(const std::filesystem::path& program, const std::filesystem::path& scene,
                  const std::filesystem::path& run, const ProcessLimits& limits);

struct Trial {
    Ended ended;
    Verdict verdict;
    bool refused() const { return ended.code == 2; }
};

/// Runs SCENE_FOLDER/scene.json into SCENE_FOLDER/run and checks what it wrote.
Trial run_trial(const std::filesystem::path& program, const std::filesystem::path& scene_folder,
                const ProcessLimits& limits);

/// One line: the worst value of each law beside its bound, broken laws first.
std::string text_of(const Verdict& verdict);

nlohmann::ordered_json to_json(const Verdict& verdict);

}  // namespace splitcubes::torture
