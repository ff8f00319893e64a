// The job of `run` and `replay`: simulates a scene to its end and writes its files.
#pragma once

#include <splitcubes/scene/description.h>
#include <splitcubes/scene/recording.h>

#include <string>
#include <vector>

namespace splitcubes::app {

struct RunOptions {
    std::string source;               // file of the scene or the recording
    std::string out;                  // folder
    int checkpoint_every = 0;         // frames; 0: never
    std::string resume;               // a checkpoint; empty: from the start
    std::string record;               // file for the motions; empty: none
    bool changed = false;             // of a replay: the scene has changed, so it may reach another state
    bool force = false;               // write into a folder that has other files
    std::vector<std::string> inputs;  // folders to search for the scene's files
};

/// Returns the exit code. replayed: drives the tools and constraints by its tracks and compares the last
/// state; null: the scene's own motions.
int simulate(const scene::SceneDescription& description, const RunOptions& options,
             const scene::Recording* replayed = nullptr);

}  // namespace splitcubes::app
