#include "checkpoints.h"
#include "report.h"

#include <splitcubes/body/checkpoint.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/memory.h>
#include <splitcubes/io/atomic_file.h>
#include <splitcubes/scene/inputs.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/resolve.h>

#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

namespace splitcubes::app {

namespace fs = std::filesystem;

namespace {

// What the state of a run depends on, for any place and name of its files.
Json essence(const scene::SceneDescription& description) {
    Json out = scene::resolved_scene(scene::without_file_names(description));
    for (const char* key : {"name", "frames", "threads", "output", "camera"}) out.erase(key);
    return out;
}

// Where the scene that lies beside a checkpoint is another than this one; empty where it tells nothing.
std::string difference(const fs::path& checkpoint, const scene::SceneDescription& description) {
    try {
        const fs::path beside = checkpoint.parent_path() / "scene.json";
        const Json then = essence(scene::parse_scene_file(beside)), now = essence(description);
        const Json changes = Json::diff(then, now);
        if (changes.empty()) return {};
        const Json::json_pointer at(changes[0]["path"].get<std::string>());
        const auto shown = [&](const Json& scene) {
            return scene.contains(at) ? printable(scene[at].dump(), 80) : std::string("nothing");
        };
        return beside.string() + " differs, first in " + at.to_string().substr(1) + " (" + shown(then) +
               " there, now " + shown(now) + ")";
    } catch (const std::exception&) {
        return {};
    }
}

}  // namespace

Checkpoints::Checkpoints(OutputFolder& folder, const scene::SceneDescription& description,
                         const body::World& world)
    : folder_(folder), description_(description) {
    identity_ = essence(description).dump() + world.state_hash().text();
}

void Checkpoints::write(body::World& world, std::string_view metrics) const {
    io::write_file(folder_.add("checkpoint.bin"), body::encode_checkpoint(world, identity_, metrics));
}

std::string read_checkpoint(const fs::path& from) {
    const char* const remedy = "give a checkpoint that 'run' wrote";
    std::error_code error;
    // A pipe or a device may never end.
    if (fs::exists(from, error) && !fs::is_regular_file(from, error))
        throw InputError(from.string(), "is not a file", remedy);
    std::ifstream file(from, std::ios::binary);
    const std::uintmax_t size = file ? fs::file_size(from, error) : 0;
    if (!file || error) throw InputError(from.string(), "cannot be read", remedy);
    require_memory(from.string(), 2 * static_cast<double>(size), remedy);
    std::string bytes(size, '\0');
    if (!file.read(bytes.data(), static_cast<std::streamsize>(size)))
        throw InputError(from.string(), "cannot be read", remedy);
    body::check_checkpoint(bytes, from.string());
    return bytes;
}

RunOutput::Past Checkpoints::restore(body::World& world, std::string_view bytes, const fs::path& from,
                                     int last_frame) const {
    RunOutput::Past past;
    try {
        past.metrics = body::restore_checkpoint(world, bytes, identity_, from.string());
    } catch (const InputError& error) {
        const std::string differs = difference(from, description_);
        if (differs.empty()) throw;
        throw InputError(error.what(), differs);
    }
    past.frame = static_cast<int>(world.step_count());
    if (past.frame > last_frame)
        throw InputError(from.string(),
                         "was made after frame " + std::to_string(past.frame) + ", the run ends at " +
                             std::to_string(last_frame),
                         "ask for more --frames");
    return past;
}

}  // namespace splitcubes::app
