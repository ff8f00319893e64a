// Copies of the files that a scene refers to, so that the output of a run can be moved and sent.
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

/// Copies each file as CONTENT/NAME together with the files that it refers to (libraries, buffers, textures).
/// CONTENT is a hash over all of them, so that equal inputs share a copy and different ones never collide.
class InputCopies {
  public:
    /// scene: its inputs have been found. Reads the files that they refer to.
    InputCopies(const scene::SceneDescription& scene, const scene::BuildReport& built);

    /// Returns whether this is the name of a copy or a file that is copied.
    bool has_name(const std::string& name) const { return names_.contains(name); }
    bool has_source(const std::filesystem::path& file) const;

    /// Copies the files that are missing; `target` returns the file for a name. Throws JobError if a file has
    /// changed since or another file is at the target.
    void write(const std::function<std::filesystem::path(const std::string&)>& target) const;

    /// Returns the scene with its file names replaced by the copies in a folder.
    scene::SceneDescription scene_in(const std::filesystem::path& folder) const;

    /// Makes the models' textures refer to the copies; a missing texture keeps its name without the folder.
    /// models: of the scene's bodies.
    void move_textures(const std::filesystem::path& folder, std::vector<io::Model>& models) const;

  private:
    struct Copy {
        std::filesystem::path from;
        std::string name;  // includes CONTENT
        std::string sha256;
    };
    struct Group {
        std::string content;
        std::string name;                                     // of the file that the scene refers to
        std::map<std::filesystem::path, std::string> others;  // name by file
    };
    void add(const std::filesystem::path& file, const std::string& sha256,
             const std::vector<std::filesystem::path>& others);

    scene::SceneDescription scene_;
    std::map<std::filesystem::path, Group> groups_;  // by the file that the scene refers to
    std::vector<Copy> copies_;
    std::set<std::string> names_;
};

}  // namespace splitcubes::app
