// Checkpoints of a run: writing and restoring.
#pragma once

#include "output_folder.h"
#include "run_output.h"

#include <splitcubes/scene/description.h>
#include <splitcubes/world/world.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace splitcubes::scene {
class WorldCourse;
}

namespace splitcubes::app {

/// Content of a checkpoint.
struct SavedRun {
    std::string scene_hash;   // of the part of the scene that determines the state
    std::uint64_t frame = 0;  // after which the checkpoint was made
    std::string state;        // body::encode_checkpoint
};

/// Throws InputError for a file that is not a checkpoint, is damaged, or does not fit into memory.
SavedRun read_checkpoint(const std::filesystem::path& from);

class Checkpoints {
  public:
    /// folder: contains checkpoint.bin. A checkpoint is accepted if the scene, whose inputs have been found,
    /// is the same except for name, frames, threads, output, camera and file locations, and builds the same
    /// world.
    Checkpoints(OutputFolder& folder, const scene::SceneDescription& description);

    /// Throws InputError for a checkpoint of another scene or past the last frame. Needs no world.
    void check(const SavedRun& saved, const std::filesystem::path& from) const;
    /// world: as built from the scene, before its first step. Must be called before the functions below.
    void begin(const body::World& world);

    std::filesystem::path file() const { return folder_.path() / "checkpoint.bin"; }
    /// Replaces the file atomically: a complete one exists at any time.
    void write(body::World& world, const scene::WorldCourse& course, std::string_view metrics) const;
    /// saved: has passed check(). Throws InputError if the world differs from the one saved.
    RunOutput::Past restore(body::World& world, scene::WorldCourse& course, const SavedRun& saved,
                            const std::filesystem::path& from) const;

  private:
    OutputFolder& folder_;
    scene::SceneDescription description_;
    std::string essence_, identity_;
};

}  // namespace splitcubes::app
