// The job of `run` and `replay`: a scene simulated to its end, its files written.
#pragma once

#include <splitcubes/scene/description.h>
#include <splitcubes/scene/recording.h>

#include <string>
#include <vector>

namespace splitcubes::app {

struct RunOptions {
    std::string source;               // the scene's or the recording's file
    std::string out;                  // folder
    int checkpoint_every = 0;         // frames; 0: never
    std::string resume;               // a checkpoint; empty: from the start
    std::string record;               // file for the motions; empty: none
    bool changed = false;             // of a replay: the scene was, so it may come to another state
    bool force = false;               // write into a folder that has other files
    std::vector<std::string> inputs;  // folders to look for the scene's files in
};

/// Returns the exit code. replayed: drives the tools and constraints by its tracks, and says
/// whether its last state is come to; null: the scene's own motions.
int simulate(const scene::SceneDescription& description, const RunOptions& options,
             const scene::Recording* replayed = nullptr);

}  // namespace splitcubes::app
