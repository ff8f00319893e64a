// Checkpoints of a run: when and as what they are kept.
#pragma once

#include "run_output.h"

#include <splitcubes/body/world.h>
#include <splitcubes/scene/description.h>

#include <filesystem>
#include <string>
#include <string_view>

namespace splitcubes::app {

class Checkpoints {
  public:
    /// world: as the scene makes it, before its first step. A checkpoint fits where the
    /// scene is the same but for frames, threads and output, and makes the same world.
    Checkpoints(std::filesystem::path file, const scene::SceneDescription& description,
                const body::World& world);

    const std::filesystem::path& file() const { return file_; }
    /// Replaces the file; there is a whole one at any moment.
    void write(body::World& world, std::string_view metrics) const;
    /// Throws InputError for a checkpoint that does not fit or lies beyond the last frame.
    RunOutput::Past restore(body::World& world, const std::filesystem::path& from, int last_frame) const;

  private:
    std::filesystem::path file_;
    std::string identity_;
};

}  // namespace splitcubes::app
