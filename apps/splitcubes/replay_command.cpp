#include "command_line.h"
#include "commands.h"
#include "scene_options.h"
#include "simulate.h"

#include <splitcubes/core/error.h>
#include <splitcubes/scene/parse.h>
#include <splitcubes/scene/recording.h>
#include <splitcubes/scene/resolve.h>

#include <memory>
#include <nlohmann/json.hpp>

namespace splitcubes::app {

namespace {

struct ReplayOptions {
    std::string recording;
    SceneOptions common;
};

int replay(const ReplayOptions& options) {
    options.common.check();
    SceneOptions common = options.common;
    const scene::Recording recording = scene::read_recording(options.recording);
    if (common.frames < 0) common.frames = recording.scene.frames;
    if (common.frames > recording.scene.frames)
        throw InputError("--frames",
                         std::to_string(common.frames) + " is more than the " +
                             std::to_string(recording.scene.frames) + " that were recorded",
                         "ask for fewer");
    const scene::SceneDescription description =
        scene::parse_scene_text(scene::resolved_scene(recording.scene, recording.scene.folder).dump(),
                                options.recording, recording.scene.folder, common.overrides());
    return simulate(
        description,
        {options.recording, common.out, 0, {}, {}, !common.set.empty(), common.force, common.inputs},
        &recording);
}

}  // namespace

void add_replay_command(CommandLine& line) {
    const auto options = std::make_shared<ReplayOptions>();
    Command& command =
        line.add("replay", "Repeats a recorded run and says whether it reaches the same state");
    command.add_text("RECORDING", "", options->recording, "File that 'run --record' wrote")
        .required()
        .completes(files());
    options->common.add_to(command, "Only the first so many time steps");
    command.example("splitcubes replay motions.json -o again");
    command.run = [options] { return replay(*options); };
}

}  // namespace splitcubes::app
