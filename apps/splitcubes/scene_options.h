// What `run` and `replay` are both told.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace splitcubes::app {

struct SceneOptions {
    std::string out;  // folder
    int frames = -1;  // time steps; -1: not said
    int threads = 0;  // 0: not said
    std::vector<std::string> set;
    bool pictures = false, links = false;

    /// Adds all of them to a command; frames_text: what it says of --frames.
    void add_to(CLI::App& command, const std::string& frames_text);
    /// As overrides of a scene. Throws InputError where no folder is named.
    std::vector<std::string> overrides() const;
};

}  // namespace splitcubes::app
