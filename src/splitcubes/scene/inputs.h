// The files that a scene names, by what they hold.
#pragma once

#include <splitcubes/scene/description.h>

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace splitcubes::scene {

/// A mesh or a picture that a scene names.
struct Input {
    std::string what;             // as "the mesh of body 'liver'"
    std::filesystem::path* file;  // in the scene
    std::string* sha256;          // in the scene; empty: whatever the file holds
};

/// In the scene's order; they point into the scene.
std::vector<Input> inputs_of(SceneDescription& scene);

/// Looks at each file and fills in what it holds. A file that is not there, or holds something else than the
/// scene says, is looked for in `folders` and below them by what it should hold: among files of its name
/// first, then of its ending. Throws InputError where there is none.
void find_inputs(SceneDescription& scene, std::span<const std::filesystem::path> folders = {});

/// The scene with each file's content in place of its name: equal for scenes that differ only in where their
/// files are. Its inputs must have been found.
SceneDescription without_file_names(SceneDescription scene);

}  // namespace splitcubes::scene
