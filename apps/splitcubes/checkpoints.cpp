#include "checkpoints.h"

#include <splitcubes/body/checkpoint.h>
#include <splitcubes/core/error.h>
#include <splitcubes/io/atomic_file.h>
#include <splitcubes/scene/resolve.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

namespace splitcubes::app {

Checkpoints::Checkpoints(std::filesystem::path file, const scene::SceneDescription& description,
                         const body::World& world)
    : file_(std::move(file)) {
    auto scene = scene::resolved_scene(description);
    for (const char* key : {"frames", "threads", "output"}) scene.erase(key);
    // The state stands for what the text only names: the content of mesh files.
    identity_ = std::string(SPLITCUBES_VERSION) + scene.dump() + world.state_hash().text();
}

void Checkpoints::write(body::World& world, std::string_view metrics) const {
    io::write_file(file_, body::encode_checkpoint(world, identity_, metrics));
}

RunOutput::Past Checkpoints::restore(body::World& world, const std::filesystem::path& from,
                                     int last_frame) const {
    std::ifstream file(from, std::ios::binary);
    std::ostringstream bytes;
    if (file) bytes << file.rdbuf();
    if (!file || !bytes)
        throw InputError(from.string(), "cannot be read", "give a checkpoint that 'run' wrote");
    RunOutput::Past past;
    past.metrics = body::restore_checkpoint(world, bytes.str(), identity_, from.string());
    past.frame = static_cast<int>(world.step_count());
    if (past.frame > last_frame)
        throw InputError(from.string(),
                         "was made after frame " + std::to_string(past.frame) + ", the run ends at " +
                             std::to_string(last_frame),
                         "ask for more --frames");
    return past;
}

}  // namespace splitcubes::app
