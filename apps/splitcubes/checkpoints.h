// Checkpoints of a run: when and as what they are kept.
#pragma once

#include "output_folder.h"
#include "run_output.h"

#include <splitcubes/body/world.h>
#include <splitcubes/scene/description.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace splitcubes::app {

/// What a checkpoint holds.
struct SavedRun {
    std::string scene_hash;   // of what its state depends on
    std::uint64_t frame = 0;  // after which it was made
    std::string state;        // body::encode_checkpoint
};

/// Throws InputError for a file that is none, is damaged, or does not fit into memory.
SavedRun read_checkpoint(const std::filesystem::path& from);

class Checkpoints {
  public:
    /// folder: where checkpoint.bin is kept. A checkpoint fits where the scene, whose inputs have been found,
    /// is the same but for its name, frames, threads, output, camera and where its files are, and makes the
    /// same world.
    Checkpoints(OutputFolder& folder, const scene::SceneDescription& description);

    /// Before any world is made: throws InputError for one of another scene or from beyond the last frame.
    void check(const SavedRun& saved, const std::filesystem::path& from) const;
    /// world: as the scene makes it, before its first step. To be called before what follows.
    void begin(const body::World& world);

    std::filesystem::path file() const { return folder_.path() / "checkpoint.bin"; }
    /// Replaces the file; there is a whole one at any moment.
    void write(body::World& world, std::string_view metrics) const;
    /// saved: what check() has passed. Throws InputError where the world is another than it was.
    RunOutput::Past restore(body::World& world, const SavedRun& saved,
                            const std::filesystem::path& from) const;

  private:
    OutputFolder& folder_;
    scene::SceneDescription description_;
    std::string essence_, identity_;
};

}  // namespace splitcubes::app
