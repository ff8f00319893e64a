// Copies of the files that a scene names, so that what a run leaves can be moved and sent.
#pragma once

#include <splitcubes/io/read_mesh.h>
#include <splitcubes/scene/build.h>
#include <splitcubes/scene/description.h>

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace splitcubes::app {

/// Each file is copied as CONTENT/NAME with what belongs to it beside it (libraries, buffers, textures);
/// CONTENT tells what all of them hold, so that equal ones share a copy and others never meet.
class InputCopies {
  public:
    /// scene: its inputs have been found. Reads what belongs to them.
    InputCopies(const scene::SceneDescription& scene, const scene::BuildReport& built);

    /// Is it the name of a copy, or a file that is copied?
    bool has_name(const std::string& name) const { return names_.contains(name); }
    bool has_source(const std::filesystem::path& file) const;

    /// Copies what is not there yet; `target` gives the file for a name. Throws JobError where a file holds
    /// something else by now, or something else has its place.
    void write(const std::function<std::filesystem::path(const std::string&)>& target) const;

    /// The scene with the copies in a folder in place of the files.
    scene::SceneDescription scene_in(const std::filesystem::path& folder) const;

    /// models: of the scene's bodies, whose textures then are the copies; one that was not there keeps its
    /// name, but not its folder.
    void move_textures(const std::filesystem::path& folder, std::vector<io::Model>& models) const;

  private:
    struct Copy {
        std::filesystem::path from;
        std::string name;  // with CONTENT
        std::string sha256;
    };
    struct Group {
        std::string content;
        std::string name;                                     // of the file that the scene names
        std::map<std::filesystem::path, std::string> others;  // name by file
    };
    void add(const std::filesystem::path& file, const std::string& sha256,
             const std::vector<std::filesystem::path>& others);

    scene::SceneDescription scene_;
    std::map<std::filesystem::path, Group> groups_;  // by the file that the scene names
    std::vector<Copy> copies_;
    std::set<std::string> names_;
};

}  // namespace splitcubes::app
