#include "scene_options.h"

#include <splitcubes/core/error.h>

namespace splitcubes::app {

void SceneOptions::add_to(CLI::App& command, const std::string& frames_text) {
    command.add_option("-o,--output", out, "Folder for the frames")->required();
    command.add_option("--frames", frames, frames_text)->check(CLI::Range(1, 100000000));
    command.add_option("--threads", threads, "Threads; default: the scene's, or all")
        ->check(CLI::Range(1, 1024));
    command.add_option("--set", set, "Overrides a value: path.to[0].value=json")->allow_extra_args(false);
    command.add_flag("--links", links, "Writes the links between phyxels to DIR/links, for render --links");
    command.add_flag("--pictures", pictures, "Draws each written frame to DIR/pictures");
}

std::vector<std::string> SceneOptions::overrides() const {
    if (out.empty()) throw InputError("--output", "names no folder", "give -o FOLDER");
    std::vector<std::string> all = set;
    if (frames >= 0) all.push_back("frames=" + std::to_string(frames));
    if (threads > 0) all.push_back("threads=" + std::to_string(threads));
    if (pictures) all.push_back("output.pictures=true");
    if (links) all.push_back("output.links=true");
    return all;
}

}  // namespace splitcubes::app
