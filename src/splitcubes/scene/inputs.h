// The files that a scene refers to, identified by content.
#pragma once

#include <splitcubes/scene/description.h>

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace splitcubes::scene {

/// A mesh or a picture that a scene refers to.
struct Input {
    std::string what;             // for messages: "the mesh of body 'liver'"
    std::filesystem::path* file;  // in the scene
    std::string* sha256;          // in the scene; empty: any content
};

/// Lists the inputs in the scene's order; the pointers refer into the scene.
std::vector<Input> inputs_of(SceneDescription& scene);

/// Reads each input and fills in its SHA-256. An input that is missing, or differs from the SHA-256 in the
/// scene, is searched by content in `folders` and below: first among files of the same name, then of the same
/// extension. Throws InputError if there is none.
void find_inputs(SceneDescription& scene, std::span<const std::filesystem::path> folders = {});

/// Returns the scene with each file name replaced by the content's SHA-256: equal for scenes that differ in
/// file locations only. find_inputs must have run.
SceneDescription without_file_names(SceneDescription scene);

}  // namespace splitcubes::scene
