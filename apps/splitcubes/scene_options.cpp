#include "scene_options.h"

#include "command_line.h"
#include "output_folder.h"
#include "output_targets.h"

#include <splitcubes/core/error.h>

namespace splitcubes::app {

void SceneOptions::add_to(Command& command, const std::string& frames_text) {
    command.add_text("-o,--output", "FOLDER", out, "Folder for the frames").required().completes(folders());
    command.add_integer("--frames", "N", frames, {1, 1000000}, frames_text);
    command.add_threads(threads, "Threads; default: the scene's, or all");
    command
        .add_list("--set", "KEY=VALUE", set,
                  "Overrides values of the scene: path.to[0].key=json; a value that is not JSON is a text "
                  "(name=2nd), "
                  "unless it "
                  "begins with [, { or \"; null takes the key out. Words with '=' after it are overrides too")
        .list([](std::string_view word) { return word.find('=') != std::string_view::npos; });
    command
        .add({"--inputs", "FOLDER", "Searches this folder by content for meshes and pictures that were moved",
              [this](const std::string& folder) { inputs.push_back(folder); }})
        .repeatable()
        .completes(folders());
    add_force_option(command, force, run_folder);
    command.add_flag("--links", links, "Writes the links between phyxels to DIR/links, for render --links");
    command.add_flag("--pictures", pictures, "Draws each written frame to DIR/pictures");
}

void SceneOptions::check() const {
    if (out.empty()) throw InputError("--output", "names no folder", "give -o FOLDER");
    check_output_folder(out);
}

std::vector<std::string> SceneOptions::overrides() const {
    std::vector<std::string> all = set;
    if (frames >= 0) all.push_back("frames=" + std::to_string(frames));
    if (threads > 0) all.push_back("threads=" + std::to_string(threads));
    if (pictures) all.push_back("output.pictures=true");
    if (links) all.push_back("output.links=true");
    return all;
}

}  // namespace splitcubes::app
