#include "checkpoints.h"
#include "report.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/memory.h>
#include <splitcubes/core/sha256.h>
#include <splitcubes/core/state_stream.h>
#include <splitcubes/io/atomic_file.h>
#include <splitcubes/scene/inputs.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/plain_json.h>
#include <splitcubes/scene/resolve.h>
#include <splitcubes/scene/world_course.h>
#include <splitcubes/world/checkpoint.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

namespace splitcubes::app {

namespace fs = std::filesystem;

namespace {

// Returns the part of the description that determines a run's state, regardless of its files' locations.
Json essence(const scene::SceneDescription& description) {
    Json out = scene::resolved_scene(scene::without_file_names(description));
    for (const char* key : {"name", "frames", "threads", "output", "camera"}) out.erase(key);
    return out;
}

// Describes the difference between the scene beside a checkpoint and this one; empty if unknown.
std::string difference(const fs::path& checkpoint, const scene::SceneDescription& description) {
    try {
        const fs::path beside = checkpoint.parent_path() / "scene.json";
        const Json then = essence(scene::parse_scene_file(beside)), now = essence(description);
        const Json changes = Json::diff(then, now);
        if (changes.empty()) return {};
        const Json::json_pointer at(changes[0]["path"].get<std::string>());
        const auto shown = [&](const Json& scene) {
            return scene.contains(at) ? printable(scene::plain_json(scene[at]), 80) : std::string("nothing");
        };
        return beside.string() + " differs, first in " + at.to_string().substr(1) + " (" + shown(then) +
               " there, now " + shown(now) + ")";
    } catch (const std::exception&) {
        return {};
    }
}

// Header before the state, so that another scene's checkpoint is detected before a world is built.
constexpr std::string_view head_begin = "Splitcubes run 2, scene ", head_middle = ", frame ";
constexpr std::size_t hash_digits = 64, frame_digits = 10;
constexpr std::size_t head_size = head_begin.size() + hash_digits + head_middle.size() + frame_digits + 1;

std::string checkpoint_head(const std::string& scene_hash, std::uint64_t frame) {
    std::string digits = std::to_string(frame);
    digits.insert(0, frame_digits - std::min(frame_digits, digits.size()), '0');
    return std::string(head_begin) + scene_hash + std::string(head_middle) + digits + '\n';
}

std::string sha256_of(const std::string& text) {
    Sha256 hash;
    hash.add(text);
    return hash.text();
}

// Removes the header. Throws InputError if there is none.
SavedRun without_head(std::string bytes, const std::string& name) {
    const std::string_view text = bytes;
    SavedRun out;
    const std::string_view middle = text.substr(std::min(text.size(), head_begin.size() + hash_digits));
    if (!text.starts_with(head_begin) || !middle.starts_with(head_middle)) {
        body::check_checkpoint(bytes, name);
        throw InputError(name, "is a checkpoint of another version of the program",
                         "go on with the version that wrote it, or start again");
    }
    out.scene_hash = text.substr(head_begin.size(), hash_digits);
    const char* const digits = middle.data() + head_middle.size();
    const char* const end = std::min(digits + frame_digits, text.data() + text.size());
    const auto [stop, error] = std::from_chars(digits, end, out.frame);
    if (error != std::errc() || stop != digits + frame_digits || text.size() < head_size ||
        text[head_size - 1] != '\n')
        throw InputError(name, "is damaged or cut off", "go back to an earlier checkpoint, or start again");
    bytes.erase(0, head_size);
    out.state = std::move(bytes);
    return out;
}

}  // namespace

Checkpoints::Checkpoints(OutputFolder& folder, const scene::SceneDescription& description)
    : folder_(folder), description_(description), essence_(essence(description).dump()) {}

void Checkpoints::begin(const body::World& world) {
    identity_ = essence_ + world.state_hash().text();
}

void Checkpoints::write(body::World& world, const scene::WorldCourse& course,
                        std::string_view metrics) const {
    StateWriter notes;
    notes.add_text(metrics);
    course.save(notes);
    const auto frame = static_cast<std::uint64_t>(world.step_count());
    io::write_file(folder_.add("checkpoint.bin"),
                   checkpoint_head(sha256_of(essence_), frame) +
                       body::encode_checkpoint(world, identity_, notes.take()));
}

SavedRun read_checkpoint(const fs::path& from) {
    const char* const remedy = "give a checkpoint that 'run' wrote";
    std::error_code error;
    // Reading from a pipe or a device might never end.
    if (fs::exists(from, error) && !fs::is_regular_file(from, error))
        throw InputError(from.string(), "is not a file", remedy);
    std::ifstream file(from, std::ios::binary);
    const std::uintmax_t size = file ? fs::file_size(from, error) : 0;
    if (!file || error) throw InputError(from.string(), "cannot be read", remedy);
    require_memory(from.string(), 2 * static_cast<double>(size), remedy);
    std::string bytes(size, '\0');
    if (!file.read(bytes.data(), static_cast<std::streamsize>(size)))
        throw InputError(from.string(), "cannot be read", remedy);
    SavedRun out = without_head(std::move(bytes), from.string());
    body::check_checkpoint(out.state, from.string());
    return out;
}

void Checkpoints::check(const SavedRun& saved, const fs::path& from) const {
    if (saved.scene_hash != sha256_of(essence_)) {
        const std::string differs = difference(from, description_);
        throw InputError(from.string(), "is a checkpoint of another scene",
                         "give the scene it was made from; only frames, threads and output may differ" +
                             (differs.empty() ? "" : "; " + differs));
    }
    if (saved.frame > static_cast<std::uint64_t>(description_.frames))
        throw InputError(from.string(),
                         "was made after frame " + std::to_string(saved.frame) + ", the run ends at " +
                             std::to_string(description_.frames),
                         "ask for more --frames");
}

RunOutput::Past Checkpoints::restore(body::World& world, scene::WorldCourse& course, const SavedRun& saved,
                                     const fs::path& from) const {
    RunOutput::Past past;
    const std::string notes = body::restore_checkpoint(world, saved.state, identity_, from.string());
    try {
        StateReader reader(notes);
        past.metrics = reader.text();
        course.load(reader, world);
        reader.finish();
    } catch (const DamagedState& damaged) {
        throw InputError(from.string(), std::string("is damaged: it holds ") + damaged.what(),
                         "go back to an earlier checkpoint, or start again");
    }
    past.frame = static_cast<int>(world.step_count());
    // The header has no checksum.
    if (static_cast<std::uint64_t>(past.frame) != saved.frame)
        throw InputError(from.string(), "is damaged or cut off",
                         "go back to an earlier checkpoint, or start again");
    return past;
}

}  // namespace splitcubes::app
