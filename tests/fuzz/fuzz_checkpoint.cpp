// The bytes describe how a valid checkpoint of a small world is damaged; length and checksum are fixed up. A
// refused checkpoint must give a one-line error, an accepted one must make two steps.
#include <splitcubes/core/error.h>
#include <splitcubes/world/checkpoint.h>

#include "world/busy_world.h"
#include "world/checkpoint_damage.h"

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

using namespace splitcubes;
using namespace splitcubes::body;

namespace {

constexpr std::string_view identity = "fuzz";
constexpr std::array kinds = {meshless::SolverKind::implicit_steps, meshless::SolverKind::explicit_steps};

void require(bool holds, const std::string& detail) {
    if (holds) return;
    std::fprintf(stderr, "broken promise: %s\n", detail.c_str());
    std::abort();
}

struct Sample {
    meshless::SolverKind kind;
    std::string checkpoint;
};

// Before the first cut, during the cuts, and with rigid fragments on the ground.
std::vector<Sample> make_samples() {
    std::vector<Sample> out;
    for (const meshless::SolverKind kind : kinds) {
        const auto world = busy::make(kind, busy::Size::small);
        for (int step = 1; step <= 20; ++step) {
            world->step();
            if (step == 2 || step == 9 || step == 20)
                out.push_back({kind, encode_checkpoint(*world, identity)});
        }
    }
    return out;
}

const std::vector<Sample>& samples() {
    static const std::vector<Sample> all = make_samples();
    return all;
}

constexpr std::size_t bytes_per_damage = 12;

// Three bytes of a damage are its position, the rest its kind and value.
void damage_by(std::span<const std::uint8_t> script, std::string& checkpoint) {
    const std::size_t begin = damage::payload_begin(checkpoint);
    for (; script.size() >= bytes_per_damage; script = script.subspan(bytes_per_damage)) {
        const std::size_t length = checkpoint.size() - begin;
        if (length < 16) return;
        const std::size_t index = script[0] | std::size_t{script[1]} << 8 | std::size_t{script[2]} << 16;
        const std::size_t unit = script[3] & 0x80 ? 1 : 4;
        const std::size_t at = begin + index * unit % (length - 8);
        std::uint64_t value = 0;
        std::memcpy(&value, script.data() + 4, sizeof value);
        switch (script[3] & 7) {
            case 0:
                std::memcpy(checkpoint.data() + at, &value, 1);
                break;
            case 1:
                std::memcpy(checkpoint.data() + at, &value, 4);
                break;
            case 2:
                std::memcpy(checkpoint.data() + at, &value, 8);
                break;
            case 3:
                checkpoint.erase(at, 1 + value % 64);
                break;
            case 4:
                checkpoint.insert(at, 1 + value % 64, static_cast<char>(value >> 8));
                break;
            case 5:
                std::memmove(checkpoint.data() + at, checkpoint.data() + begin + value % (length - 8), 8);
                break;
            case 6:
                checkpoint[at] = static_cast<char>(checkpoint[at] + (value & 1 ? 1 : -1));
                break;
            default:
                checkpoint[at] = static_cast<char>(checkpoint[at] ^ 1 << (value & 7));
        }
    }
}

// A script for each sample and kind of damage: libFuzzer would start with inputs too short for one.
void write_seeds(const std::filesystem::path& folder) {
    constexpr int samples = 6, kinds_of_damage = 8;
    std::mt19937 random(1);
    for (int k = 0; k < samples * kinds_of_damage; ++k) {
        std::string script(1 + bytes_per_damage, '\0');
        for (char& c : script) c = static_cast<char>(random());
        script[0] = static_cast<char>(k % samples);
        script[4] = static_cast<char>((script[4] & 0xf8) | k / samples);
        std::ofstream(folder / ("script_" + std::to_string(k)), std::ios::binary) << script;
    }
}

}  // namespace

// Seeds the corpus folder.
extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
    for (int k = 1; k < *count; ++k)
        if (const std::filesystem::path folder = (*arguments)[k]; std::filesystem::is_directory(folder)) {
            write_seeds(folder);
            return 0;
        }
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const Sample& sample = samples()[data[0] % samples().size()];
    std::string checkpoint = sample.checkpoint;
    damage_by(std::span(data + 1, size - 1), checkpoint);
    damage::reseal(checkpoint);
    const auto world = busy::make(sample.kind, busy::Size::small);
    try {
        restore_checkpoint(*world, checkpoint, identity, "fuzz");
    } catch (const InputError& error) {
        const std::string_view what = error.what();
        require(!what.empty() && what.find('\n') == std::string_view::npos, "an error is one line");
        require(checkpoint != sample.checkpoint, "a good checkpoint is taken: " + std::string(what));
        return 0;
    }
    try {
        for (int step = 0; step < 2; ++step) world->step();
    } catch (const JobError&) {
        // An explicit step that needs too many substeps.
    }
    return 0;
}
