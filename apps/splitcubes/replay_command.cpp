#include "commands.h"
#include "simulate.h"

#include <splitcubes/core/error.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/recording.h>
#include <splitcubes/scene/resolve.h>

#include <memory>
#include <nlohmann/json.hpp>

namespace splitcubes::app {

namespace {

struct Options {
    std::string recording, out;
    int frames = -1;
    int threads = 0;
    std::vector<std::string> overrides;
    bool pictures = false, links = false;
};

int replay(const Options& options) {
    if (options.out.empty()) throw InputError("--output", "names no folder", "give -o FOLDER");
    const scene::Recording recording = scene::read_recording(options.recording);
    std::vector<std::string> overrides = options.overrides;
    const int frames = options.frames < 0 ? recording.scene.frames : options.frames;
    if (frames > recording.scene.frames)
        throw InputError("--frames",
                         std::to_string(frames) + " is more than the " +
                             std::to_string(recording.scene.frames) + " that were recorded",
                         "ask for fewer");
    overrides.push_back("frames=" + std::to_string(frames));
    if (options.threads > 0) overrides.push_back("threads=" + std::to_string(options.threads));
    if (options.pictures) overrides.push_back("output.pictures=true");
    if (options.links) overrides.push_back("output.links=true");
    const scene::SceneDescription description = scene::parse_scene_text(
        scene::resolved_scene(recording.scene).dump(), options.recording, ".", overrides);
    return simulate(description, {options.out, 0, {}, {}, !options.overrides.empty()}, &recording);
}

}  // namespace

void add_replay_command(CLI::App& app, Run& run) {
    const auto options = std::make_shared<Options>();
    CLI::App* command =
        app.add_subcommand("replay", "Repeats a recorded run and says whether it comes to the same state");
    command->add_option("recording", options->recording, "File that 'run --record' wrote")->required();
    command->add_option("-o,--output", options->out, "Folder for the frames")->required();
    command->add_option("--frames", options->frames, "Only the first so many")
        ->check(CLI::Range(1, 100000000));
    command->add_option("--threads", options->threads, "Threads; default: the scene's, or all")
        ->check(CLI::Range(1, 1024));
    command->add_option("--set", options->overrides, "Overrides a value: path.to[0].value=json")
        ->allow_extra_args(false);
    command->add_flag("--links", options->links,
                      "Writes the links between phyxels to DIR/links, for render --links");
    command->add_flag("--pictures", options->pictures, "Draws each written frame to DIR/pictures");
    command->callback([options, &run] { run = [options] { return replay(*options); }; });
}

}  // namespace splitcubes::app
