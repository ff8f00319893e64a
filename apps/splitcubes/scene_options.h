// Options common to `run` and `replay`.
#pragma once

#include <string>
#include <vector>

namespace splitcubes::app {

class Command;

struct SceneOptions {
    std::string out;  // folder
    int frames = -1;  // time steps; -1: not given
    int threads = 0;  // 0: not given
    std::vector<std::string> set;
    bool pictures = false, links = false;
    bool force = false;               // write into a folder that has other files
    std::vector<std::string> inputs;  // folders to search for the scene's files

    /// Adds all options to a command; frames_text: help of --frames.
    void add_to(Command& command, const std::string& frames_text);
    /// Throws InputError if the folder cannot be written. Called before anything is read.
    void check() const;
    /// Returns the options as overrides of a scene.
    std::vector<std::string> overrides() const;
};

}  // namespace splitcubes::app
