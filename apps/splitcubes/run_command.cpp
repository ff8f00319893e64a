#include "commands.h"
#include "scene_options.h"
#include "simulate.h"

#include <splitcubes/scene/parse.h>

#include <memory>

namespace splitcubes::app {

namespace {

struct Options {
    std::string scene;
    SceneOptions common;
    std::string occlusion, criterion;
    int checkpoint_every = 0;  // frames; 0: never
    std::string resume;        // a checkpoint; empty: from the start
    std::string record;        // file for the motions; empty: none
};

int run_scene(const Options& options) {
    std::vector<std::string> overrides = options.common.overrides();
    if (!options.occlusion.empty()) overrides.push_back("occlusion.backend=\"" + options.occlusion + '"');
    if (!options.criterion.empty()) overrides.push_back("occlusion.criterion=\"" + options.criterion + '"');
    const scene::SceneDescription description = scene::parse_scene_file(options.scene, overrides);
    return simulate(description,
                    {options.common.out, options.checkpoint_every, options.resume, options.record, false});
}

}  // namespace

void add_run_command(CLI::App& app, Run& run) {
    const auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("run", "Simulates a scene and writes its frames");
    command->add_option("scene", options->scene, "Scene: a JSON file, see scenes/schema.json")->required();
    options->common.add_to(*command, "Time steps to run; default: the scene's");
    command
        ->add_option("--occlusion", options->occlusion, "What computes occlusion disks; default: the scene's")
        ->check(CLI::IsMember({"cpu", "opengl"}));
    command
        ->add_option("--criterion", options->criterion, "What weakens links past cuts; default: the scene's")
        ->check(CLI::IsMember(
            std::vector<std::string>(occlusion::criterion_names.begin(), occlusion::criterion_names.end())));
    command
        ->add_option("--checkpoint-every", options->checkpoint_every,
                     "Writes DIR/checkpoint.bin every so many frames; an interrupted run always does")
        ->check(CLI::Range(1, 100000000));
    command->add_option("--resume", options->resume,
                        "Goes on from a checkpoint of the same scene, to the same last bit");
    command->add_option(
        "--record", options->record,
        "Writes the motions of tools, handles, colliders and held regions to a file, for replay");
    command->callback([options, &run] { run = [options] { return run_scene(*options); }; });
}

}  // namespace splitcubes::app
