#include "command_line.h"
#include "commands.h"
#include "output_targets.h"
#include "report.h"
#include "scene_options.h"
#include "simulate.h"

#include <splitcubes/scene/parse.h>

#include <memory>

namespace splitcubes::app {

namespace {

struct RunCommandOptions {
    std::string scene;
    SceneOptions common;
    std::string occlusion, criterion;
    int checkpoint_every = 0;  // frames; 0: never
    std::string resume;        // a checkpoint; empty: from the start
    std::string record;        // file for the motions; empty: none
};

bool is_in(const std::filesystem::path& file, const std::filesystem::path& folder) {
    const auto around = [](const std::filesystem::path& path) {
        return std::filesystem::absolute(path).lexically_normal().parent_path();
    };
    return !file.empty() && around(file) == around(folder / "");
}

int run_scene(const RunCommandOptions& options) {
    options.common.check();
    // The run's own folder need not exist yet.
    if (!is_in(options.record, options.common.out)) check_report_output(options.record);
    std::vector<std::string> overrides = options.common.overrides();
    if (!options.occlusion.empty()) overrides.push_back("occlusion.backend=\"" + options.occlusion + '"');
    if (!options.criterion.empty()) overrides.push_back("occlusion.criterion=\"" + options.criterion + '"');
    const scene::SceneDescription description = scene::parse_scene_file(options.scene, overrides);
    check_distinct({options.scene, options.record, options.resume});
    return simulate(description, {options.scene, options.common.out, options.checkpoint_every, options.resume,
                                  options.record, false, options.common.force, options.common.inputs});
}

}  // namespace

void add_run_command(CommandLine& line) {
    const auto options = std::make_shared<RunCommandOptions>();
    Command& command = line.add("run", "Simulates a scene and writes its frames");
    command.add_text("SCENE", "", options->scene, "Scene: a JSON file, see scenes/schema.json")
        .required()
        .completes(files({"json"}));
    options->common.add_to(command, "Time steps to run, in place of the scene's frames or duration");
    command.add_choice("--occlusion", "BACKEND", options->occlusion, {"cpu", "opengl"},
                       "Backend that computes occlusion disks: cpu or opengl; default: the scene's");
    const std::vector<std::string> criteria(occlusion::criterion_names.begin(),
                                            occlusion::criterion_names.end());
    command.add_choice("--criterion", "NAME", options->criterion, criteria,
                       "Visibility criterion that weakens links at cuts; default: the scene's");
    command.add_integer("--checkpoint-every", "N", options->checkpoint_every, {1, 100000000},
                        "Writes DIR/checkpoint.bin every so many frames; an interrupted run always does");
    command
        .add_text("--resume", "FILE", options->resume,
                  "Resumes from a checkpoint of the same scene, with bit-identical results")
        .completes(files({"bin"}));
    command
        .add_text("--record", "FILE", options->record,
                  "Writes the motions of tools, handles, colliders and held regions to a file, for replay")
        .completes(files());
    command.example("splitcubes run scenes/pear_halves.json -o pear --record motions.json");
    command.example(
        "splitcubes run scenes/pear_halves.json -o out --frames 20 --set bodies[0].cells=24 gravity=[0,0,0]",
        "Runs 20 steps of a coarser, weightless variant");
    command.run = [options] { return run_scene(*options); };
}

}  // namespace splitcubes::app
