// What `run` and `replay` are both told.
#pragma once

#include <string>
#include <vector>

namespace splitcubes::app {

class Command;

struct SceneOptions {
    std::string out;  // folder
    int frames = -1;  // time steps; -1: not said
    int threads = 0;  // 0: not said
    std::vector<std::string> set;
    bool pictures = false, links = false;
    bool force = false;               // write into a folder that has other files
    std::vector<std::string> inputs;  // folders to look for the scene's files in

    /// Adds all of them to a command; frames_text: what it says of --frames.
    void add_to(Command& command, const std::string& frames_text);
    /// Throws InputError where the folder cannot be written: asked before anything is read.
    void check() const;
    /// As overrides of a scene.
    std::vector<std::string> overrides() const;
};

}  // namespace splitcubes::app
