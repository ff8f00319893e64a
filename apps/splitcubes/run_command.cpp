#include "commands.h"
#include "simulate.h"

#include <splitcubes/core/error.h>
#include <splitcubes/scene/parse.h>

#include <memory>

namespace splitcubes::app {

namespace {

struct Options {
    std::string scene, out;
    int frames = -1;
    int threads = 0;
    std::string occlusion, criterion;
    std::vector<std::string> overrides;
    bool pictures = false, links = false;
    int checkpoint_every = 0;  // frames; 0: never
    std::string resume;        // a checkpoint; empty: from the start
    std::string record;        // file for the motions; empty: none
};

int run_scene(const Options& options) {
    if (options.out.empty()) throw InputError("--output", "names no folder", "give -o FOLDER");
    std::vector<std::string> overrides = options.overrides;
    if (options.frames >= 0) overrides.push_back("frames=" + std::to_string(options.frames));
    if (options.threads > 0) overrides.push_back("threads=" + std::to_string(options.threads));
    if (!options.occlusion.empty()) overrides.push_back("occlusion.backend=\"" + options.occlusion + '"');
    if (!options.criterion.empty()) overrides.push_back("occlusion.criterion=\"" + options.criterion + '"');
    if (options.pictures) overrides.push_back("output.pictures=true");
    if (options.links) overrides.push_back("output.links=true");
    const scene::SceneDescription description = scene::parse_scene_file(options.scene, overrides);
    return simulate(description,
                    {options.out, options.checkpoint_every, options.resume, options.record, false});
}

}  // namespace

void add_run_command(CLI::App& app, Run& run) {
    const auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("run", "Simulates a scene and writes its frames");
    command->add_option("scene", options->scene, "Scene: a JSON file, see scenes/schema.json")->required();
    command->add_option("-o,--output", options->out, "Folder for the frames")->required();
    command->add_option("--frames", options->frames, "Time steps to run; default: the scene's")
        ->check(CLI::Range(1, 100000000));
    command->add_option("--threads", options->threads, "Threads; default: the scene's, or all")
        ->check(CLI::Range(1, 1024));
    command
        ->add_option("--occlusion", options->occlusion, "What computes occlusion disks; default: the scene's")
        ->check(CLI::IsMember({"cpu", "opengl"}));
    command
        ->add_option("--criterion", options->criterion, "What weakens links past cuts; default: the scene's")
        ->check(CLI::IsMember(
            std::vector<std::string>(occlusion::criterion_names.begin(), occlusion::criterion_names.end())));
    command->add_option("--set", options->overrides, "Overrides a value: path.to[0].value=json")
        ->allow_extra_args(false);
    command->add_flag("--links", options->links,
                      "Writes the links between phyxels to DIR/links, for render --links");
    command->add_flag("--pictures", options->pictures, "Draws each written frame to DIR/pictures");
    command
        ->add_option("--checkpoint-every", options->checkpoint_every,
                     "Writes DIR/checkpoint.bin every so many frames; an interrupted run always does")
        ->check(CLI::Range(1, 100000000));
    command->add_option("--resume", options->resume,
                        "Goes on from a checkpoint of the same scene, to the same last bit");
    command->add_option("--record", options->record,
                        "Writes the motions of tools and constraints to a file, for replay");
    command->callback([options, &run] { run = [options] { return run_scene(*options); }; });
}

}  // namespace splitcubes::app
