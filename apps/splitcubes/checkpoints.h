// Checkpoints of a run: when and as what they are kept.
#pragma once

#include "output_folder.h"
#include "run_output.h"

#include <splitcubes/body/world.h>
#include <splitcubes/scene/description.h>

#include <filesystem>
#include <string>
#include <string_view>

namespace splitcubes::app {

/// The bytes of a checkpoint. Throws InputError for a file that is none, is damaged, or does not fit into
/// memory; to be called before long work.
std::string read_checkpoint(const std::filesystem::path& from);

class Checkpoints {
  public:
    /// folder: where checkpoint.bin is kept. world: as the scene, whose inputs have been found, makes it,
    /// before its first step. A checkpoint fits where the scene is the same but for its name, frames,
    /// threads, output, camera and where its files are, and makes the same world.
    Checkpoints(OutputFolder& folder, const scene::SceneDescription& description, const body::World& world);

    std::filesystem::path file() const { return folder_.path() / "checkpoint.bin"; }
    /// Replaces the file; there is a whole one at any moment.
    void write(body::World& world, std::string_view metrics) const;
    /// bytes: as read_checkpoint gave them. Throws InputError for a checkpoint that does not fit or lies
    /// beyond the last frame.
    RunOutput::Past restore(body::World& world, std::string_view bytes, const std::filesystem::path& from,
                            int last_frame) const;

  private:
    OutputFolder& folder_;
    scene::SceneDescription description_;
    std::string identity_;
};

}  // namespace splitcubes::app
